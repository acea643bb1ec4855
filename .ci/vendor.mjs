// Makes the libraries that the page ships from npm's tarballs: `make vendor`. Users never run this.
//
//   node .ci/vendor.mjs fetch           take the files of the pinned tarballs into phone_host/web/vendor, unchanged
//   node .ci/vendor.mjs build [ROOT]    make the prebuilt modules from them (below ROOT instead of the checkout: the test compares)
//
// phone_host/web/vendor/versions.json pins versions and the sha256 of npm's tarballs and of each file taken, and lists the
// sha256 of each file made. One esbuild version, pinned here, so that the same sources give the same bytes.
import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync, constants, gzipSync } from 'node:zlib';

const ESBUILD = 'esbuild@0.28.2';
const HERE = resolve(dirname(fileURLToPath(import.meta.url)), '..');
const SOURCES = join(HERE, 'phone_host/web/vendor');
const PINS = join(SOURCES, 'versions.json');

/** Files taken from each tarball: where they lie there. Here they lie side by side. */
const TAKEN = {
  three: ['LICENSE', 'package.json', 'build/three.core.js', 'build/three.module.js', 'examples/jsm/controls/OrbitControls.js'],
  uplot: ['LICENSE', 'package.json', 'dist/uPlot.esm.js', 'dist/uPlot.min.css'],
};

/** Modules made: from which entry, in which form, where to. The page's own modules are shipped as they are written. */
const MADE = [
  { entry: 'phone_host/web/vendor/three.entry.js', of: 'three', format: 'esm', to: 'phone_host/web/page/vendor/three.js' },
  { entry: 'phone_host/web/vendor/uplot/uPlot.esm.js', of: 'uplot', format: 'esm', to: 'phone_host/web/page/vendor/uplot.js' },
  { entry: 'phone_host/web/page/static_depth.js', of: 'three', format: 'iife', to: 'phone_host/report/page_depth.js' },
  { entry: 'phone_host/web/page/static_charts.js', of: 'uplot', format: 'iife', to: 'phone_host/report/page_charts.js' },
  { entry: 'phone_host/web/page/static_copy.js', of: '', format: 'iife', to: 'phone_host/report/page_copy.js' },
];

/** Files that go to the page unchanged. */
const COPIED = [
  ['phone_host/web/vendor/uplot/uPlot.min.css', 'phone_host/web/page/vendor/uplot.css'],
  ['phone_host/web/vendor/three/LICENSE', 'phone_host/web/page/vendor/LICENSE.three'],
  ['phone_host/web/vendor/uplot/LICENSE', 'phone_host/web/page/vendor/LICENSE.uplot'],
];

const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');
const pins = () => JSON.parse(readFileSync(PINS, 'utf8'));
const keep = (value) => writeFileSync(PINS, JSON.stringify(value, null, 2) + '\n');

/** Run npm or npx quietly; its notes go nowhere. */
function npm(program, ...words) {
  return execFileSync(program, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], cwd: tmpdir() });
}

/** Take the pinned tarballs' files, and note their hashes. */
function fetch() {
  const noted = pins();
  for (const [name, files] of Object.entries(TAKEN)) {
    const folder = mkdtempSync(join(tmpdir(), 'vendor-'));
    const tarball = join(folder, npm('npm', 'pack', '--silent', '--pack-destination', folder, `${name}@${noted.packages[name].version}`).trim());
    execFileSync('tar', ['xzf', tarball, '-C', folder]);
    noted.packages[name] = { version: noted.packages[name].version, tarball_sha256: sha256(readFileSync(tarball)), files: {} };
    rmSync(join(SOURCES, name), { recursive: true, force: true });
    for (const file of files) {
      cpSync(join(folder, 'package', file), join(SOURCES, name, basename(file)));
      noted.packages[name].files[file] = sha256(readFileSync(join(SOURCES, name, basename(file))));
    }
    rmSync(folder, { recursive: true });
  }
  keep(noted);
}

/** Bundle one entry. The licence's notice stays in it. */
function bundle({ entry, of, format, to }, root) {
  const out = join(root, to);
  const holder = of && readFileSync(join(SOURCES, of, 'LICENSE'), 'utf8').match(/Copyright.*/)[0].replace(/ ?[^ -~]+/g, '');
  const notice = of && `/* ${of} ${pins().packages[of].version}, MIT License, ${holder} */`;
  const words = [
    '--yes', ESBUILD, join(HERE, entry), '--bundle', '--minify', `--format=${format}`, '--target=es2022', '--charset=ascii',
    '--legal-comments=none', ...(notice ? [`--banner:js=${notice}`] : []), `--outfile=${out}`, '--log-level=warning', '--loader:.css=text',
    `--alias:three=${join(SOURCES, 'three/three.module.js')}`,
    `--alias:three/addons/controls/OrbitControls.js=${join(SOURCES, 'three/OrbitControls.js')}`,
  ];
  npm('npx', ...words);
}

/** Make everything that is shipped, and list its hashes in versions.json below `root`. */
function build(root) {
  const made = {};
  const note = (path) => (made[path] = sha256(readFileSync(join(root, path))));
  for (const each of MADE) {
    bundle(each, root);
    note(each.to);
  }
  for (const [from, to] of COPIED) {
    mkdirSync(dirname(join(root, to)), { recursive: true });
    cpSync(join(HERE, from), join(root, to));
    note(to);
  }
  for (const path of Object.keys(made).filter((one) => one.startsWith('phone_host/web/page/') && !one.includes('LICENSE'))) {
    const bytes = readFileSync(join(root, path));
    const size = { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length };
    writeFileSync(join(root, path + '.br'), brotliCompressSync(bytes, { params: size }));
    writeFileSync(join(root, path + '.gz'), gzipSync(bytes, { level: 9 }));
    note(path + '.br');
    note(path + '.gz');
  }
  const noted = { ...pins(), builder: ESBUILD, made };
  if (root === HERE) keep(noted);
  else writeFileSync(join(root, 'versions.json'), JSON.stringify(noted, null, 2) + '\n');
}

const [what, root] = process.argv.slice(2);
if (what === 'fetch') fetch();
else if (what === 'build') build(resolve(root ?? HERE));
else {
  console.error('usage: node .ci/vendor.mjs fetch | build [ROOT]');
  process.exit(2);
}
