// The Khronos validator reads every tile of an export.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { cairn, exportPatches, modules } from './support.mjs';

const glbs = (folder) =>
  readdirSync(folder, { withFileTypes: true }).flatMap((entry) =>
    entry.isDirectory()
      ? glbs(join(folder, entry.name))
      : entry.name.endsWith('.glb')
        ? [join(folder, entry.name)]
        : [],
  );

async function validate(folder, least) {
  const { validateBytes } = modules('gltf-validator');
  const paths = glbs(folder);
  assert(paths.length >= least, `only ${paths.length} tiles`);
  for (const path of paths) {
    const { issues, info } = await validateBytes(new Uint8Array(readFileSync(path)), { maxIssues: 20 });
    const bad = issues.messages.filter(({ severity }) => severity <= 1);
    assert.deepEqual(bad, [], path);
    assert.equal(info.drawCallCount, 1);
  }
}

test('the validator finds no errors in tiles', async (context) => {
  const folder = exportPatches(context);
  await validate(join(folder, 'patches'), 21);
  cairn(
    'export',
    join(folder, 'patches.cairn'),
    '--format',
    '3dtiles',
    '-o',
    join(folder, 'plain'),
    '--compression',
    'none',
    '--no-page',
    '--progress',
    'none',
  );
  await validate(join(folder, 'plain'), 21);
});
