// Eye-dome lighting: points are darkened where their neighbours on the screen are nearer, which shows relief without normals.
// Based on: Boucheny, "Visualisation scientifique de grands volumes de donnees", 2009.
import {
  DepthTexture,
  Mesh,
  NearestFilter,
  OrthographicCamera,
  PlaneGeometry,
  Scene,
  ShaderMaterial,
  UnsignedIntType,
  WebGLRenderTarget,
} from 'three';

const STRENGTH = 40; // of a step by the factor 2 in distance

const VERTEX = /* glsl */ `
  void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;

const FRAGMENT = /* glsl */ `
  uniform sampler2D colors, depths;
  uniform float near, far;
  uniform int radius;

  // Logarithm of the distance; where nothing is drawn there is no depth that could shade.
  float depthAt(ivec2 at) {
    float depth = texelFetch(depths, at, 0).r;
    if (depth == 1.0) return 1e9;
    return log2(near * far / (far - depth * (far - near)));
  }

  void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(depths, 0) - 1;
    vec4 color = texelFetch(colors, at, 0);
    float here = depthAt(at);
    gl_FragColor = color;
    gl_FragDepth = texelFetch(depths, at, 0).r;
    if (here == 1e9) return;
    float nearer = 0.0;
    ivec2 steps[8] = ivec2[8](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1), ivec2(1, 1), ivec2(-1, 1), ivec2(1, -1), ivec2(-1, -1));
    for (int i = 0; i < 8; ++i)
      nearer += max(0.0, here - depthAt(clamp(at + radius * steps[i], ivec2(0), last)));
    gl_FragColor.rgb *= max(0.4, exp(-nearer / 8.0 * float(${STRENGTH})));
  }`;

export class Relief {
  #target = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter });
  #camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  #scene = new Scene();
  #material;

  constructor() {
    this.#target.depthTexture = new DepthTexture(1, 1, UnsignedIntType);
    this.#material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      depthTest: false,
      uniforms: {
        colors: { value: this.#target.texture },
        depths: { value: this.#target.depthTexture },
        near: { value: 1 },
        far: { value: 2 },
        radius: { value: 1 },
      },
    });
    const quad = new Mesh(new PlaneGeometry(2, 2), this.#material);
    quad.frustumCulled = false;
    this.#scene.add(quad);
  }

  resize(width, height, pixelRatio) {
    this.#target.setSize(width, height);
    this.#material.uniforms.radius.value = Math.max(1, Math.round(pixelRatio));
  }

  /** Draws the scene through this camera onto the canvas, shaded. */
  render(renderer, scene, camera) {
    this.#material.uniforms.near.value = camera.near;
    this.#material.uniforms.far.value = camera.far;
    renderer.setRenderTarget(this.#target);
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    renderer.render(this.#scene, this.#camera);
  }
}
