// A page that shows the 3D Tiles beside it: tileset.json and what that names.
import { Color, LinearSRGBColorSpace, Matrix4, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from 'three';
import { MapControls } from 'three/addons/controls/MapControls.js';
import { GLTFExtensionsPlugin } from '3d-tiles-renderer/three/plugins';
import { MeshoptDecoder } from 'meshoptimizer/decoder';
import { frameOf } from './frame.js';
import { Panel } from './panel.js';
import { BudgetedTiles, errorWithinBudget, factsOf, TileView } from './point_budget.js';
import { MODES, pointMaterial, sharedUniforms } from './point_material.js';
import { Relief } from './relief.js';
import { middleRange } from './statistics.js';

class Page {
  #canvas = document.getElementById('view');
  #renderer = new WebGLRenderer({ canvas: this.#canvas, antialias: false, powerPreference: 'high-performance' });
  #scene = new Scene();
  #camera = new PerspectiveCamera(50, 1, 0.1, 1000);
  #controls = new MapControls(this.#camera, this.#canvas);
  #relief = new Relief();
  #uniforms = sharedUniforms();
  #panel = new Panel(
    (settings) => this.#apply(settings),
    () => this.home(),
  );
  #tiles = new BudgetedTiles(new URL('tileset.json', location.href).href);
  #frame = null; // of the root tileset, once it is there
  #settings = this.#panel.settings();
  #met = { ranges: { intensity: [0, 1], height: [0, 1] }, classes: [], levels: [] };
  #changed = true;
  drawn = null; // what the panel tells

  constructor() {
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    // All that is drawn is in the colors of the screen already.
    this.#renderer.outputColorSpace = LinearSRGBColorSpace;
    this.#scene.background = new Color(0x14181d).convertLinearToSRGB();
    this.#controls.enableDamping = true;
    this.#controls.dampingFactor = 0.12;
    this.#controls.zoomToCursor = true;
    this.#controls.maxPolarAngle = 0.98 * Math.PI;
    this.#controls.listenToKeyEvents(this.#canvas);
    this.#controls.addEventListener('change', () => (this.#changed = true));
    this.#canvas.addEventListener('keydown', (event) => this.#zoomByKey(event));
    new ResizeObserver(() => this.#resize()).observe(this.#canvas);
    this.#openTiles();
    this.#resize();
    this.#renderer.setAnimationLoop(() => this.#draw());
  }

  #openTiles() {
    const tiles = this.#tiles;
    tiles.registerPlugin(new GLTFExtensionsPlugin({ meshoptDecoder: MeshoptDecoder, metadata: false }));
    // Of a page at the root of a server the renderer makes addresses with two slashes, which not every server takes.
    tiles.registerPlugin({ preprocessURL: (url) => url.replace(/([^:])\/\/+/g, '$1/') });
    tiles.setCamera(this.#camera);
    tiles.lruCache.maxBytesSize = 1.5 * 2 ** 30;
    tiles.lruCache.minBytesSize = 1.2 * 2 ** 30;
    this.#scene.add(tiles.group);
    tiles.addEventListener('load-root-tileset', ({ tileset }) => this.#open(tileset));
    tiles.addEventListener('load-model', ({ scene, tile }) => this.#dress(scene, tile));
    tiles.addEventListener('dispose-model', ({ scene }) => scene.traverse((part) => part.material?.dispose()));
    tiles.addEventListener('load-error', ({ url, error }) =>
      this.#panel.complain(`Cannot load ${url}: ${error.message}`),
    );
    for (const event of ['needs-update', 'load-content', 'tile-visibility-change', 'tiles-load-end'])
      tiles.addEventListener(event, () => (this.#changed = true));
  }

  #open(tileset) {
    this.#frame = frameOf(tileset.root);
    this.#frame.toScene
      .clone()
      .multiply(this.#frame.fromEarth)
      .decompose(this.#tiles.group.position, this.#tiles.group.quaternion, this.#tiles.group.scale);
    this.#tiles.group.updateMatrixWorld(true);
    const told = tileset.asset.extras?.cairn;
    this.#uniforms.byPower.value = told?.colorsFor === 'cesiumjs';
    this.#panel.tellOrigin(told?.points ?? factsOf(tileset.root).points, told?.crs);
    this.home();
  }

  /** Gives a tile's points their material; of the first tile, learns what there is to see. */
  #dress(scene, tile) {
    scene.traverse((part) => {
      if (!part.isPoints) return;
      part.material.dispose();
      part.material = pointMaterial(this.#uniforms, factsOf(tile), part.geometry);
      if (factsOf(tile).level === 0) this.#learn(part);
    });
    this.#changed = true;
  }

  #learn(points) {
    const { geometry } = points;
    const available = new Set(['height', 'level']);
    if (geometry.hasAttribute('color')) available.add('color');
    if (geometry.hasAttribute('_intensity')) {
      available.add('intensity');
      const values = geometry.getAttribute('_intensity');
      this.#met.ranges.intensity = middleRange(values.count, (i) => values.getX(i));
    }
    if (geometry.hasAttribute('_classification')) {
      available.add('classification');
      const values = geometry.getAttribute('_classification');
      const classes = new Set();
      for (let i = 0; i < values.count; ++i) classes.add(values.getX(i));
      this.#met.classes = [...classes].sort((a, b) => a - b);
    }
    this.#met.ranges.height = this.#heights(points);
    this.#uniforms.intensityRange.value.fromArray(this.#met.ranges.intensity);
    this.#uniforms.heightRange.value.fromArray(this.#met.ranges.height);
    this.#panel.offer(available);
    this.#apply(this.#panel.settings());
  }

  /** From where to where nearly all of the points lie along y of the scene. */
  #heights(points) {
    points.updateWorldMatrix(true, false);
    const toScene = this.#tiles.group.matrixWorld.clone().multiply(points.matrixWorld);
    const codes = points.geometry.getAttribute('position');
    const place = new Vector3();
    return middleRange(codes.count, (i) => place.fromBufferAttribute(codes, i).applyMatrix4(toScene).y, 0.001);
  }

  #apply(settings) {
    this.#settings = settings;
    this.#uniforms.mode.value = MODES.indexOf(settings.mode);
    this.#uniforms.size.value = settings.size;
    this.#uniforms.adaptive.value = settings.adaptive;
    this.#changed = true;
  }

  /** Looks at all of it, from the south and above. */
  home() {
    if (!this.#frame) return;
    const { center, radius } = this.#frame;
    const across = Math.min(1, this.#camera.aspect);
    const distance = (0.8 * radius) / Math.tan((this.#camera.fov * Math.PI) / 360) / across;
    this.look(new Vector3(0, 0.6, 0.8).multiplyScalar(distance).add(center).toArray(), center.toArray());
  }

  /** Looks from one place of the scene at another; metres, y is up. */
  look(from, at) {
    this.#camera.position.fromArray(from);
    this.#controls.target.fromArray(at);
    this.#controls.update();
    this.#changed = true;
  }

  #zoomByKey({ key }) {
    const factor = { '+': 0.8, '=': 0.8, '-': 1.25 }[key];
    if (!factor) return;
    const from = this.#camera.position
      .clone()
      .sub(this.#controls.target)
      .multiplyScalar(factor)
      .add(this.#controls.target);
    this.look(from.toArray(), this.#controls.target.toArray());
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    if (width === 0 || height === 0) return;
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    // On wide screens the panel covers the left.
    const covered = width > 960 ? 304 : 0;
    if (covered) this.#camera.setViewOffset(width, height, -covered / 2, 0, width, height);
    else this.#camera.clearViewOffset();
    this.#camera.updateProjectionMatrix();
    this.#tiles.setResolutionFromRenderer(this.#camera, this.#renderer);
    const ratio = this.#renderer.getPixelRatio();
    this.#relief.resize(width * ratio, height * ratio, ratio);
    this.#uniforms.pixelRatio.value = ratio;
    this.#changed = true;
  }

  #draw() {
    this.#controls.update();
    if (!this.#changed && !this.#tiles.isLoading) return;
    this.#changed = false;
    this.#camera.updateMatrixWorld();
    if (this.#frame) this.#fitDepth();
    const view = this.#frame && new TileView(this.#camera, this.#frame.toScene, this.#pixelsAtOne());
    this.#tiles.view = view;
    if (view && this.#tiles.root)
      this.#tiles.errorTarget = errorWithinBudget(
        this.#tiles.root,
        view,
        this.#settings.budget,
        this.#settings.errorTarget,
      );
    this.#tiles.update();
    this.#uniforms.pixelsAtOne.value = this.#pixelsAtOne() * this.#renderer.getPixelRatio();
    if (this.#settings.relief) this.#relief.render(this.#renderer, this.#scene, this.#camera);
    else this.#renderer.render(this.#scene, this.#camera);
    if (view) this.#tell(view);
  }

  /** Pixels of the page that a metre takes that is a metre away. */
  #pixelsAtOne() {
    return this.#canvas.clientHeight / (2 * Math.tan((this.#camera.fov * Math.PI) / 360));
  }

  #fitDepth() {
    const { center, radius } = this.#frame;
    const away = this.#camera.position.distanceTo(center);
    this.#camera.far = away + 1.05 * radius;
    this.#camera.near = Math.max(away - 1.05 * radius, this.#camera.far / 20000);
    this.#camera.updateProjectionMatrix();
  }

  #tell(view) {
    const tiles = [...this.#tiles.visibleTiles].filter((tile) => tile.engineData.scene);
    const facts = tiles.map(factsOf);
    const most = (values) => values.reduce((a, b) => Math.max(a, b), 0);
    const coarse = tiles.filter((tile) => tile.children?.length > 0);
    const { downloading, parsing, queued, loaded } = this.#tiles.stats;
    this.#met.levels = [...new Set(facts.map(({ level }) => level))].sort((a, b) => a - b);
    this.drawn = {
      points: facts.reduce((sum, { points }) => sum + points, 0),
      budget: this.#settings.budget,
      tiles: tiles.length,
      loaded,
      waiting: downloading + parsing + queued,
      levels: this.#met.levels,
      target: this.#tiles.errorTarget,
      limited: this.#tiles.errorTarget > this.#settings.errorTarget,
      finest: tiles.length > 0 && coarse.length === 0,
      screenError: most(coarse.map((tile) => view.pixels(tile, tile.geometricError))),
      bound: most(facts.map(({ bound }) => bound)),
      rms: most(facts.map(({ rms }) => rms)),
    };
    this.#panel.tell(this.drawn);
    this.#panel.tellLegend(this.#settings.mode, this.#met);
  }

  /** Whether all that this view asks for is drawn. */
  get settled() {
    return Boolean(this.#frame) && !this.#changed && !this.#tiles.isLoading && this.#tiles.visibleTiles.size > 0;
  }
  /** Where a place of the scene is seen, in pixels of the page. */
  pixel(place) {
    const { x, y } = new Vector3().fromArray(place).project(this.#camera);
    return [((x + 1) / 2) * this.#canvas.clientWidth, ((1 - y) / 2) * this.#canvas.clientHeight];
  }
  /** The middle and radius of the whole, in the scene. */
  get extent() {
    return this.#frame && { center: this.#frame.center.toArray(), radius: this.#frame.radius };
  }
}

// For those who script the page: cairn.look(from, at), pixel(place), drawn, settled, extent.
if (location.protocol === 'file:')
  document.getElementById('summary').textContent =
    'Browsers load nothing from file:// addresses: serve this folder, for instance with python3 -m http.server.';
else
  try {
    window.cairn = new Page();
  } catch (error) {
    document.getElementById('summary').textContent = `Nothing can be drawn: ${error.message}`;
  }
