// Exports in CesiumJS.
import assert from 'node:assert/strict';
import { dirname, join } from 'node:path';
import test from 'node:test';
import {
  assertColor,
  exportCampaign,
  exportPatches,
  here,
  modules,
  openBrowser,
  openPage,
  PATCHES,
  patchMiddle,
  picture,
  PLACE,
  serve,
  sharedCampaign,
  WAYS,
} from './support.mjs';

// CesiumJS takes a power for sRGB: dark colours are off where they are not made for it (formats/tiles/linear_color.h).
const ALLOWED = { placed: (value) => (value < 31 ? 6 : 3), geocentric: () => 3 };
const FLAGS = { geocentric: ['--colors-for', 'cesiumjs'] };

async function openCesium(context, tiles, size) {
  const missed = [];
  const cesium = join(dirname(modules.resolve('cesium/package.json')), 'Build', 'Cesium');
  const origin = await serve(context, { cesium, tests: here, tiles }, missed);
  const browser = await openBrowser(context);
  const { page, faults } = await openPage(browser, origin, '/tests/cesium.html', size);
  await page.waitForFunction(() => window.test, null, { timeout: 60000 });
  const settled = () => page.evaluate(() => window.test.settled());
  const finish = async () => {
    assert.deepEqual(await page.evaluate(() => window.test.failed), []);
    assert.deepEqual([...faults, ...missed], []);
  };
  return { page, settled, finish };
}

// What is shown of attributes: the arguments of open. (CesiumJS also evaluates a style where there is no point, so all
// conditions must do without a value, and the last be white.)
const ATTRIBUTES = {
  placed: [
    {
      pointSize: '12',
      color: {
        conditions: [
          ['${classification} === 2', "color('#ff0000')"],
          ['Number(${intensity}) > 30000', "color('#00ff00')"],
          ['true', "color('white')"],
        ],
      },
    },
  ],
  geocentric: [
    null,
    `if (classification == 2.0) material.diffuse = vec3(1.0, 0.0, 0.0);
     else if (intensity > 30000.0) material.diffuse = vec3(0.0, 1.0, 0.0);`,
  ],
};

for (const [way, how] of Object.entries(WAYS))
  test(`patches, ${way}: place, colours, styles by attributes`, { timeout: 300000 }, (context) =>
    testPatches(context, way, how),
  );

async function testPatches(context, way, how) {
  const allowed = ALLOWED[way];
  const folder = exportPatches(context, { ...how, flags: [...(how.flags ?? []), ...(FLAGS[way] ?? [])] });
  const { page, settled, finish } = await openCesium(context, join(folder, 'patches'), { width: 480, height: 240 });
  const pixelsOf = (index) =>
    page.evaluate(([middle, place]) => window.test.pixel(middle, ...place), [patchMiddle(index), PLACE]);

  await page.evaluate((place) => window.test.look(...place, 80), PLACE);
  await page.evaluate(() => window.test.open({ pointSize: '12' }));
  await settled();
  const colors = await picture(page, `cesium_${way}`);
  for (const [index, { color }] of PATCHES.entries())
    assertColor(colors, await pixelsOf(index), color, `colour of patch ${index}`, allowed);

  // Attributes, in the language of styles and in shaders.
  await page.evaluate((shown) => window.test.open(...shown), ATTRIBUTES[way]);
  await settled();
  const styled = await picture(page, `cesium_${way}_attributes`);
  for (const [index, { color, classification, intensity }] of PATCHES.entries()) {
    const others = way === 'placed' ? [255, 255, 255] : color;
    const wanted = classification === 2 ? [255, 0, 0] : intensity > 30000 ? [0, 255, 0] : others;
    assertColor(styled, await pixelsOf(index), wanted, `attributes of patch ${index}`, allowed);
  }
  await finish();
}

test('a campaign refines as the camera comes closer', { timeout: 300000 }, async (context) => {
  const scans = sharedCampaign('campaign_autzen');
  if (!scans) return context.skip('no scans');
  const folder = exportCampaign(context, 'autzen', scans, '--place=-123.07,44.055,90');
  const { page, settled, finish } = await openCesium(context, join(folder, 'autzen'), { width: 480, height: 360 });
  await page.evaluate(() => window.test.open());
  const view = async (above, name) => {
    await page.evaluate((metres) => window.test.look(-123.07, 44.055, 90, metres), above);
    await settled();
    await picture(page, name);
    return page.evaluate(() => window.test.drawn());
  };
  const finest = (levels) => Math.max(...Object.keys(levels).map(Number));
  const far = await view(10000, 'cesium_autzen_far');
  const near = await view(600, 'cesium_autzen');
  const close = await view(150, 'cesium_autzen_close');
  assert.deepEqual(far, { 0: 1 });
  assert(finest(near) > 0, JSON.stringify(near));
  assert(finest(close) > finest(near), `${JSON.stringify(near)}, then ${JSON.stringify(close)}`);
  await finish();
});
