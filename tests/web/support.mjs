// What the tests of web clients share: the program, scans of known colours, a static server, a browser.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { createReadStream, existsSync, mkdirSync, mkdtempSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const { CAIRN_PROGRAM, CAIRN_SOURCE, CAIRN_SHARED_DATA, CAIRN_WEB_MODULES, CAIRN_PICTURES } = process.env;
export const modules = createRequire(join(CAIRN_WEB_MODULES, 'package.json'));

const TYPES = {
  '.html': 'text/html',
  '.js': 'text/javascript',
  '.css': 'text/css',
  '.json': 'application/json',
  '.glb': 'model/gltf-binary',
  '.wasm': 'application/wasm',
  '.png': 'image/png',
  '.txt': 'text/plain',
};

export const cairn = (...args) => execFileSync(CAIRN_PROGRAM, args, { encoding: 'utf8' });

/** A folder that vanishes with the tests of a file. */
export function temporaryFolder(context) {
  const folder = mkdtempSync(join(tmpdir(), 'cairn-web-'));
  context.after(() => rmSync(folder, { recursive: true }));
  return folder;
}

/** The scans of a campaign of other programs, or null where they are absent and may be. */
export function sharedCampaign(name) {
  const folder = join(CAIRN_SHARED_DATA, name);
  if (existsSync(folder)) return folder;
  assert(!process.env.CAIRN_SHARED_DATA_REQUIRED, `no scans at ${folder}`);
  return null;
}
export const campaignFile = (name) => join(CAIRN_SOURCE, 'configs', 'campaigns', name);

/** Patches of one colour each, in a row along x; 10 m squares with a point each 0.1 m. */
export const PATCHES = [
  { color: [255, 255, 255], classification: 2, intensity: 1000 },
  { color: [128, 64, 32], classification: 5, intensity: 8000 },
  { color: [10, 12, 14], classification: 6, intensity: 15000 },
  { color: [255, 0, 0], classification: 9, intensity: 22000 },
  { color: [0, 200, 60], classification: 2, intensity: 29000 },
  { color: [40, 60, 220], classification: 5, intensity: 36000 },
  { color: [90, 90, 90], classification: 6, intensity: 43000 },
  { color: [240, 200, 20], classification: 9, intensity: 50000 },
];
export const PATCH_LENGTH = 10;
/** The middle of a patch in a frame whose origin is the middle of all. */
export const patchMiddle = (index) => [(index + 0.5 - PATCHES.length / 2) * PATCH_LENGTH, 0, 0];

/** From east, north, up at a place (degrees, metres) to the Earth-centred frame of WGS84: EPSG guidance note 7-2, methods 9602 and 9837. */
export function earthCentred([longitude, latitude, height]) {
  const [lon, lat] = [longitude, latitude].map((degrees) => (degrees * Math.PI) / 180);
  const [sinLon, cosLon, sinLat, cosLat] = [Math.sin(lon), Math.cos(lon), Math.sin(lat), Math.cos(lat)];
  const flattening = 1 / 298.257223563;
  const squared = flattening * (2 - flattening);
  const normal = 6378137 / Math.sqrt(1 - squared * sinLat ** 2);
  return ([east, north, up]) => [
    (normal + height) * cosLat * cosLon - sinLon * east - sinLat * cosLon * north + cosLat * cosLon * up,
    (normal + height) * cosLat * sinLon + cosLon * east - sinLat * sinLon * north + cosLat * sinLon * up,
    (normal * (1 - squared) + height) * sinLat + cosLat * north + sinLat * up,
  ];
}

/** `world` takes places in the frame of patchMiddle to coordinates of the scan. */
export function writePatches(path, world = ([x, y, z]) => [x + 500000, y + 4800000, z + 100]) {
  const side = 100;
  const count = PATCHES.length * side * side;
  const header = `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n${[
    'double x',
    'double y',
    'double z',
    'uchar red',
    'uchar green',
    'uchar blue',
    'ushort intensity',
    'uchar classification',
  ]
    .map((property) => `property ${property}\n`)
    .join('')}end_header\n`;
  const bytes = Buffer.alloc(30 * count);
  let at = 0;
  PATCHES.forEach(({ color, classification, intensity }, patch) => {
    for (let i = 0; i < side * side; ++i) {
      const step = PATCH_LENGTH / side;
      const [x, y, z] = patchMiddle(patch);
      const place = [x + ((i % side) - (side - 1) / 2) * step, y + (Math.floor(i / side) - (side - 1) / 2) * step, z];
      for (const coordinate of world(place)) at = bytes.writeDoubleLE(coordinate, at);
      for (const component of color) at = bytes.writeUInt8(component, at);
      at = bytes.writeUInt16LE(intensity, at);
      at = bytes.writeUInt8(classification, at);
    }
  });
  writeFileSync(path, Buffer.concat([Buffer.from(header), bytes]));
}

/** Serves folders by the first part of the path. Returns the address; `missed` gathers paths that are not there. */
export async function serve(context, folders, missed) {
  const server = createServer((request, response) => {
    const [, name, ...rest] = decodeURIComponent(new URL(request.url, 'http://x').pathname).split('/');
    const path = name in folders ? join(folders[name], normalize('/' + rest.join('/'))) : null;
    const file = path && existsSync(path) && statSync(path).isDirectory() ? join(path, 'index.html') : path;
    if (!file || !existsSync(file)) {
      missed.push(request.url);
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { 'Content-Type': TYPES[extname(file)] ?? 'application/octet-stream' });
    createReadStream(file).pipe(response);
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  context.after(
    () =>
      new Promise((done) => {
        server.close(done);
        server.closeAllConnections?.();
      }),
  );
  return `http://127.0.0.1:${server.address().port}`;
}

/** Real Chromium, which draws without a screen and a graphics card. */
export async function openBrowser(context) {
  const browser = await modules('playwright-core').chromium.launch({
    executablePath: process.env.CAIRN_CHROMIUM,
    timeout: 120_000,
    args: [
      '--headless=new',
      '--no-sandbox',
      '--use-gl=angle',
      '--use-angle=swiftshader',
      '--enable-unsafe-swiftshader',
      '--disable-quic',
      '--no-first-run',
      '--disable-background-networking',
      '--disable-component-update',
      '--disable-sync',
      '--disable-dev-shm-usage',
    ],
  });
  context.after(() => browser.close());
  return browser;
}

/** A page that tells in `faults` of every error on its console, uncaught exception and request that fails or goes elsewhere. */
export async function openPage(browser, origin, path, size = { width: 800, height: 600 }) {
  const page = await browser.newPage({ viewport: size, deviceScaleFactor: 1 });
  page.setDefaultTimeout(120_000);
  const faults = [];
  page.on('console', (message) => message.type() === 'error' && faults.push(`console: ${message.text()}`));
  page.on('pageerror', (error) => faults.push(`exception: ${error.message}`));
  page.on('requestfailed', (request) => faults.push(`failed: ${request.url()}`));
  page.on('request', (request) => {
    const url = new URL(request.url());
    if (['http:', 'https:'].includes(url.protocol) && url.origin !== origin) faults.push(`elsewhere: ${request.url()}`);
  });
  await page.goto(origin + path);
  return { page, faults };
}

/** Takes a picture of the page, keeps it beside the build, and gives a function from pixels to colours. */
export async function picture(page, name) {
  mkdirSync(CAIRN_PICTURES, { recursive: true });
  const png = await page.screenshot({ path: join(CAIRN_PICTURES, `${name}.png`) });
  const { width, data } = await page.evaluate(async (base64) => {
    const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext('2d');
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    let text = '';
    for (let i = 0; i < data.length; i += 32768) text += String.fromCharCode(...data.subarray(i, i + 32768));
    return { width: bitmap.width, data: btoa(text) };
  }, png.toString('base64'));
  const bytes = Buffer.from(data, 'base64');
  const at = (x, y) => [...bytes.subarray(4 * (Math.round(y) * width + Math.round(x))).subarray(0, 3)];
  at.bytes = bytes;
  return at;
}

/** The median of the pixels around one must be as near to a colour in each channel as `allowed` says, of 255. */
export function assertColor(at, [x, y], wanted, what, allowed = () => 3) {
  const found = [];
  for (let dy = -1; dy <= 1; ++dy) for (let dx = -1; dx <= 1; ++dx) found.push(at(x + dx, y + dy));
  const median = wanted.map((_, i) => found.map((color) => color[i]).sort((a, b) => a - b)[4]);
  assert(
    median.every((value, i) => Math.abs(value - wanted[i]) <= allowed(wanted[i])),
    `${what}: ${median} is not ${wanted}`,
  );
}

/** Builds and exports the patches; the folder that holds `patches.cairn` and `patches/`. */
export function exportPatches(context, { world, crs, flags = [] } = {}) {
  const folder = temporaryFolder(context);
  writePatches(join(folder, 'patches.ply'), world);
  cairn(
    'build',
    join(folder, 'patches.ply'),
    '-o',
    join(folder, 'patches.cairn'),
    '--progress',
    'none',
    '--node-points',
    '4000',
    '--fanout',
    '4',
    ...(crs ? ['--crs', crs] : []),
  );
  cairn(
    'export',
    join(folder, 'patches.cairn'),
    '--format',
    '3dtiles',
    '-o',
    join(folder, 'patches'),
    '--progress',
    'none',
    ...flags,
  );
  return folder;
}

/** The patches at a place: put there by a flag, or by coordinates that are Earth-centred themselves. */
export const PLACE = [8.55, 47.37, 410];
export const WAYS = {
  placed: { flags: [`--place=${PLACE}`] },
  geocentric: { world: earthCentred(PLACE), crs: 'GEOCCS["WGS 84",DATUM["WGS_1984"],UNIT["metre",1]]' },
};

/** Builds and exports a campaign of other programs. */
export function exportCampaign(context, name, folder, ...flags) {
  const output = temporaryFolder(context);
  cairn(
    'build',
    campaignFile(`${name}.toml`),
    '--folder',
    folder,
    '-o',
    join(output, `${name}.cairn`),
    '--progress',
    'none',
  );
  cairn(
    'export',
    join(output, `${name}.cairn`),
    '--format',
    '3dtiles',
    '-o',
    join(output, name),
    '--progress',
    'none',
    ...flags,
  );
  return output;
}

export const here = fileURLToPath(new URL('.', import.meta.url));
