// Exports in the page beside them, which draws with 3d-tiles-renderer.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import test from 'node:test';
import {
  assertColor,
  exportCampaign,
  exportPatches,
  openBrowser,
  openPage,
  PATCHES,
  patchMiddle,
  picture,
  serve,
  sharedCampaign,
  WAYS,
} from './support.mjs';

async function openTiles(context, tiles, size) {
  const missed = [];
  const origin = await serve(context, { tiles }, missed);
  const browser = await openBrowser(context);
  const { page, faults } = await openPage(browser, origin, '/tiles/', size);
  const settled = () => page.waitForFunction(() => window.cairn?.settled, null, { timeout: 120000 });
  const set = async (id, value) => {
    await page.locator(`#${id}`).evaluate((input, to) => {
      if (input.type === 'checkbox') input.checked = to;
      else input.value = to;
      input.dispatchEvent(new Event('input', { bubbles: true }));
    }, value);
    await settled();
  };
  await settled();
  return {
    page,
    settled,
    set,
    drawn: () => page.evaluate(() => window.cairn.drawn),
    text: (id) => page.locator(`#${id}`).textContent(),
    look: async (from, at) => {
      await page.evaluate(([a, b]) => window.cairn.look(a, b), [from, at]);
      await settled();
    },
    finish: () => assert.deepEqual([...faults, ...missed], []),
  };
}

const FLAGS = { geocentric: ['--colors-for', 'cesiumjs'] };

for (const [way, how] of Object.entries(WAYS))
  test(`patches, ${way}: colours, classes and intensities`, { timeout: 300000 }, (context) =>
    testPatches(context, way, { ...how, flags: [...(how.flags ?? []), ...(FLAGS[way] ?? [])] }),
  );

async function testPatches(context, way, how) {
  const folder = exportPatches(context, how);
  const { page, set, look, finish } = await openTiles(context, join(folder, 'patches'), { width: 1200, height: 400 });
  await set('relief', false);
  await set('error', 0); // 0.5 px
  await look([0, 60, 0.01], [0, 0, 0]);
  // The frame has z up, the scene y up.
  const pixelsOf = (index) => page.evaluate(([x, y, z]) => window.cairn.pixel([x, z, -y]), patchMiddle(index));
  const colors = await picture(page, `page_${way}`);
  for (const [index, { color }] of PATCHES.entries())
    assertColor(colors, await pixelsOf(index), color, `colour of patch ${index}`);

  await set('mode', 'classification');
  // The colours that `cairn view` has for ground, high vegetation, building and water.
  const classes = { 2: [153, 102, 51], 5: [28, 107, 42], 6: [226, 92, 60], 9: [52, 120, 220] };
  const classified = await picture(page, `page_${way}_classes`);
  for (const [index, { classification }] of PATCHES.entries())
    assertColor(classified, await pixelsOf(index), classes[classification], `class of patch ${index}`);

  await set('mode', 'intensity');
  const ends = await picture(page, `page_${way}_intensity`);
  assertColor(ends, await pixelsOf(0), [68, 1, 84], 'least intensity');
  assertColor(ends, await pixelsOf(PATCHES.length - 1), [253, 231, 37], 'greatest intensity');

  // The patches are level, also where the z of their coordinates is the Earth's axis.
  await set('mode', 'height');
  const heights = await page.locator('#legend .ends span').allTextContents();
  assert.deepEqual(heights, ['< 1 mm', '1.00 m']);
  finish();
}

test('a campaign is drawn on a budget, and its settings take effect', { timeout: 300000 }, async (context) => {
  const scans = sharedCampaign('campaign_autzen');
  if (!scans) return context.skip('no scans');
  const folder = exportCampaign(context, 'autzen', scans);
  const { page, settled, set, drawn, text, look, finish } = await openTiles(context, join(folder, 'autzen'), {
    width: 1280,
    height: 720,
  });

  assert.equal(await text('title'), 'tiles');
  assert.match(await text('summary'), /^3,652,979 points/);
  await set('error', 1); // 1 px
  await set('budget', 2); // 500,000 points
  const small = await drawn();
  assert(small.points > 100_000 && small.points <= 500_000, `${small.points} points on 500,000`);
  assert(small.limited && small.screenError <= small.target, JSON.stringify(small));
  assert.match(await text('error-target'), /px \(budget\)$/);
  assert.match(await text('points-drawn'), /of 500K$/);
  await set('budget', 4); // 2,000,000
  const large = await drawn();
  assert(large.points > small.points && large.points <= 2_000_000, `${large.points} points on 2,000,000`);
  assert(large.target < small.target);
  await picture(page, 'page_autzen');

  await set('error', 9); // 32 px
  const coarse = await drawn();
  assert(coarse.points < large.points && !coarse.limited && coarse.screenError <= 32, JSON.stringify(coarse));
  await set('error', 1);

  const before = await picture(page, 'page_autzen_color');
  const differs = async (name) => !(await picture(page, name)).bytes.equals(before.bytes);
  await set('size', 3);
  assert(await differs('page_autzen_size'), 'the size of points changes nothing');
  await set('size', 1.2);
  for (const mode of ['intensity', 'classification', 'height', 'level']) {
    await set('mode', mode);
    assert(await differs(`page_autzen_${mode}`), `${mode} looks like colour`);
    assert.notEqual((await text('legend')) + (await page.locator('#legend').innerHTML()), '');
  }
  await set('mode', 'color');

  // Closer: finer levels, a smaller bound.
  const { center, radius } = await page.evaluate(() => window.cairn.extent);
  await look([center[0], center[1] + 0.15 * radius, center[2] + 0.2 * radius], center);
  const close = await drawn();
  assert(Math.max(...close.levels) > Math.max(...coarse.levels), JSON.stringify([coarse.levels, close.levels]));
  await picture(page, 'page_autzen_close');
  await page.locator('#home').click();
  await settled();
  assert((await drawn()).bound >= close.bound);

  // Inside the boxes of tiles.
  await set('budget', 0); // 100,000
  await look([center[0], center[1] - 0.01 * radius, center[2]], [center[0] + radius, center[1], center[2]]);
  const inside = await drawn();
  assert(inside.points <= 100_000, `${inside.points} points on 100,000`);

  // The panel folds on a narrow screen, and unfolds again.
  await page.setViewportSize({ width: 390, height: 780 });
  await page.locator('#body').waitFor({ state: 'hidden' });
  await settled();
  await picture(page, 'page_autzen_narrow');
  await page.locator('#fold').click();
  await page.locator('#body').waitFor({ state: 'visible' });
  finish();
});
