// How points are drawn: one program for all tiles, whose uniforms are shared but for what differs from tile to tile.
import { ShaderMaterial, Vector2, Vector3 } from 'three';
import { classTexture, paletteColor, rampTexture } from './colors.js';

export const MODES = ['color', 'intensity', 'classification', 'height', 'level'];

const VERTEX = /* glsl */ `
  #ifdef HAS_COLOR
  attribute vec3 color;
  #endif
  #ifdef HAS_INTENSITY
  attribute float _intensity;
  #endif
  #ifdef HAS_CLASSIFICATION
  attribute float _classification;
  #endif
  uniform int mode;
  uniform float size, pixelsAtOne, pixelRatio, spacing;
  uniform bool adaptive, byPower;
  uniform vec2 intensityRange, heightRange;
  uniform vec3 levelColor;
  uniform sampler2D ramp, classes;
  varying vec3 shown;
  varying float diameter;

  // Colors of glTF are linear; screens take sRGB. Those made for CesiumJS are told by its power.
  vec3 srgb(vec3 linear) {
    if (byPower) return pow(linear, vec3(1.0 / 2.2));
    return mix(12.92 * linear, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, linear));
  }
  vec3 onRamp(float value, vec2 range) {
    float share = clamp((value - range.x) / (range.y - range.x), 0.0, 1.0);
    return texture2D(ramp, vec2((share * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  }

  void main() {
    vec4 place = modelMatrix * vec4(position, 1.0);
    vec4 seen = viewMatrix * place;
    gl_Position = projectionMatrix * seen;
    float wanted = adaptive ? size * spacing * pixelsAtOne / max(-seen.z, 1e-6) : size * pixelRatio;
    diameter = clamp(wanted, 1.0, 48.0 * pixelRatio);
    gl_PointSize = diameter;

    shown = vec3(0.8);
    if (mode == 4) shown = levelColor;
    else if (mode == 3) shown = onRamp(place.y, heightRange);
    #ifdef HAS_CLASSIFICATION
    else if (mode == 2) shown = texture2D(classes, vec2((_classification + 0.5) / 256.0, 0.5)).rgb;
    #endif
    #ifdef HAS_INTENSITY
    else if (mode == 1) shown = onRamp(_intensity, intensityRange);
    #endif
    #ifdef HAS_COLOR
    else if (mode == 0) shown = srgb(color);
    #endif
  }`;

const FRAGMENT = /* glsl */ `
  varying vec3 shown;
  varying float diameter;
  void main() {
    vec2 from = 2.0 * gl_PointCoord - 1.0;
    if (diameter > 2.5 && dot(from, from) > 1.0) discard;
    gl_FragColor = vec4(shown, 1.0);
  }`;

/** The uniforms that all tiles share. */
export function sharedUniforms() {
  return {
    mode: { value: 0 },
    size: { value: 1 },
    adaptive: { value: true },
    byPower: { value: false },
    pixelsAtOne: { value: 1 }, // pixels of a metre that is a metre away
    pixelRatio: { value: 1 },
    intensityRange: { value: new Vector2(0, 1) },
    heightRange: { value: new Vector2(0, 1) },
    ramp: { value: rampTexture() },
    classes: { value: classTexture() },
  };
}

/** The material of one tile: `facts` are its metadata, `geometry` tells which attributes it has. */
export function pointMaterial(shared, facts, geometry) {
  const defines = {};
  if (geometry.hasAttribute('color')) defines.HAS_COLOR = '';
  if (geometry.hasAttribute('_intensity')) defines.HAS_INTENSITY = '';
  if (geometry.hasAttribute('_classification')) defines.HAS_CLASSIFICATION = '';
  const levelColor = new Vector3(...paletteColor(facts.level)).divideScalar(255);
  return new ShaderMaterial({
    defines,
    uniforms: { ...shared, spacing: { value: facts.spacing }, levelColor: { value: levelColor } },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
  });
}
