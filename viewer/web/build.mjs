// Bundles the page into a few files that any static server gives out, with the licences of what is in the bundle.
//
//   node build.mjs MODULES OUTPUT     MODULES holds node_modules/, OUTPUT is a folder that exists
import { copyFileSync, readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const [modules, output] = process.argv.slice(2).map((path) => resolve(path));
const source = dirname(fileURLToPath(import.meta.url));
const esbuild = createRequire(join(modules, 'package.json'))('esbuild');

const { metafile } = await esbuild.build({
  entryPoints: [join(source, 'main.js')],
  outfile: join(output, 'page.js'),
  nodePaths: [join(modules, 'node_modules')],
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  legalComments: 'none', // all of them stand in licenses.txt, in full
  banner: { js: '// Cairn, GPL-3.0-or-later; licenses of the libraries in this file: licenses.txt' },
  metafile: true,
});

const packages = new Set();
for (const [path, { bytesInOutput }] of Object.values(metafile.outputs).flatMap(({ inputs }) =>
  Object.entries(inputs),
)) {
  const found = path.match(/node_modules\/((?:@[^/]+\/)?[^/]+)\//);
  if (found && bytesInOutput > 0) packages.add(found[1]);
}
let text = 'page.js is part of Cairn (GPL-3.0-or-later) and contains parts of these libraries.\n';
for (const name of [...packages].sort()) {
  const folder = join(modules, 'node_modules', name);
  const { version, license } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  const file = readdirSync(folder).find((entry) => /^licen[sc]e/i.test(entry));
  if (!file) throw new Error(`${name} comes without the text of its license`);
  text += `\n${'='.repeat(80)}\n${name} ${version}: ${license}\n\n${readFileSync(join(folder, file), 'utf8').trim()}\n`;
}
writeFileSync(join(output, 'licenses.txt'), text);
copyFileSync(join(source, 'style.css'), join(output, 'page.css'));
copyFileSync(join(source, 'index.html'), join(output, 'index.html'));
