// Makes the libraries that the page ships from npm's tarballs: `make vendor`. Users never run this.
//
//   node .ci/vendor.mjs pin       note the hash of npm's tarballs of the versions in versions.json (after changing a version)
//   node .ci/vendor.mjs build     make the prebuilt modules from the pinned tarballs
//   node .ci/vendor.mjs check     make them elsewhere and compare with those of the checkout
//
// phone_host/web/vendor/versions.json pins versions and the sha256 of npm's tarballs, and lists the sha256 of each file made and of
// each of our own files in it. One esbuild version, pinned here, so that the same sources give the same bytes.
import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, dirname, join, relative, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync, constants, gzipSync } from 'node:zlib';

const ESBUILD = 'esbuild@0.28.2';
const HERE = resolve(dirname(fileURLToPath(import.meta.url)), '..');
const PINS = join(HERE, 'phone_host/web/vendor/versions.json');

/**
 * Libraries made, which name themselves in `globalThis`: the live page imports them, static pages hold the same bytes in a script of their own.
 * Then what static pages run of our modules. The live page loads those as they are written.
 */
const MADE = [
  { entry: 'phone_host/web/vendor/three.entry.js', of: 'three', names: 'three', to: 'phone_host/web/page/vendor/three.js' },
  { entry: 'npm:uplot/dist/uPlot.esm.js', of: 'uplot', names: 'uPlot', to: 'phone_host/web/page/vendor/uplot.js' },
  { entry: 'static_depth.js', to: 'phone_host/report/page_depth.js' },
  { entry: 'static_charts.js', to: 'phone_host/report/page_charts.js' },
  { entry: 'static_copy.js', to: 'phone_host/report/page_copy.js' },
];

/** Files that go to the page unchanged. */
const COPIED = [
  ['npm:uplot/dist/uPlot.min.css', 'phone_host/web/page/vendor/uplot.css'],
  ['npm:three/LICENSE', 'phone_host/web/page/vendor/LICENSE.three'],
  ['npm:uplot/LICENSE', 'phone_host/web/page/vendor/LICENSE.uplot'],
];

const sha256 = (bytes) => createHash('sha256').update(bytes).digest('hex');
const pins = () => JSON.parse(readFileSync(PINS, 'utf8'));
const keep = (value) => writeFileSync(PINS, JSON.stringify(value, null, 2) + '\n');

/** Run npm or npx quietly; its notes go nowhere. */
function npm(program, ...words) {
  return execFileSync(program, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], cwd: tmpdir() });
}

/** Fetch a library's tarball and unpack it below `sources`. Return its hash. */
function fetched(name, version, sources) {
  const folder = join(sources, name);
  mkdirSync(folder);
  const tarball = join(folder, npm('npm', 'pack', '--silent', '--pack-destination', folder, `${name}@${version}`).trim());
  execFileSync('tar', ['xzf', tarball, '-C', folder, '--strip-components=1']);
  return sha256(readFileSync(tarball));
}

/** Note the hashes of the tarballs that npm gives for the pinned versions. */
function pin(sources) {
  const noted = pins();
  for (const [name, { version }] of Object.entries(noted.packages)) {
    noted.packages[name] = { version, tarball_sha256: fetched(name, version, sources) };
  }
  keep(noted);
}

/** Fetch every library; what does not have the pinned hash is not built. */
function fetch(sources) {
  for (const [name, { version, tarball_sha256: wanted }] of Object.entries(pins().packages)) {
    const found = fetched(name, version, sources);
    if (found !== wanted) throw new Error(`${name}@${version} has the sha256 ${found}, not ${wanted}: see what changed, then make vendor PIN=1`);
  }
}

/** Copy our modules, with nothing in place of the libraries. Return where they are. */
function withoutLibraries(sources) {
  const folder = join(sources, 'page');
  cpSync(join(HERE, 'phone_host/web/page'), folder, { recursive: true });
  for (const { to } of MADE.filter(({ of }) => of)) writeFileSync(join(sources, 'page/vendor', basename(to)), '');
  return folder;
}

/** Bundle one entry. A library's licence's notice stays in it. Return our own files in it. */
function bundle({ entry, of, names, to }, sources, root, page) {
  const holder = of && readFileSync(join(sources, of, 'LICENSE'), 'utf8').match(/Copyright.*/)[0].replace(/ ?[^ -~]+/g, '');
  const notice = of && `/* ${of} ${pins().packages[of].version}, MIT License, ${holder} */`;
  const meta = join(sources, 'meta.json');
  const words = [
    '--yes', ESBUILD, of ? place(entry, sources) : join(page, entry), '--bundle', '--minify', '--format=iife', '--target=es2022', '--charset=ascii',
    '--legal-comments=none', ...(of ? [`--banner:js=${notice}`, `--global-name=${names}`, `--footer:js=globalThis.${names}=${names}.default??${names};`] : []), `--outfile=${join(root, to)}`, `--metafile=${meta}`,
    '--log-level=warning', '--loader:.css=text',
    `--alias:three=${join(sources, 'three/build/three.module.js')}`,
    `--alias:three/addons/controls/OrbitControls.js=${join(sources, 'three/examples/jsm/controls/OrbitControls.js')}`,
  ];
  npm('npx', ...words);
  const inputs = Object.keys(JSON.parse(readFileSync(meta, 'utf8')).inputs)
    .map((one) => relative(HERE, resolve(tmpdir(), one).replace(page, join(HERE, 'phone_host/web/page'))));
  return inputs.filter((one) => !one.startsWith('..'));
}

/** Return where a file lies: one of npm's, or one of ours. */
const place = (path, sources) => (path.startsWith('npm:') ? join(sources, path.slice(4)) : join(HERE, path));

/** Make everything that is shipped below `root`. Return what is noted of it. */
function build(sources, root) {
  const [made, own] = [{}, {}];
  const note = (path) => (made[path] = sha256(readFileSync(join(root, path))));
  for (const [from, to] of COPIED) {
    mkdirSync(dirname(join(root, to)), { recursive: true });
    cpSync(place(from, sources), join(root, to));
    note(to);
  }
  const page = withoutLibraries(sources);
  for (const each of MADE) {
    for (const path of bundle(each, sources, root, page)) own[path] = sha256(readFileSync(join(HERE, path)));
    note(each.to);
  }
  for (const path of Object.keys(made).filter((one) => one.startsWith('phone_host/web/page/') && !one.includes('LICENSE'))) {
    const bytes = readFileSync(join(root, path));
    const size = { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length };
    writeFileSync(join(root, path + '.br'), brotliCompressSync(bytes, { params: size }));
    writeFileSync(join(root, path + '.gz'), gzipSync(bytes, { level: 9 }));
    note(path + '.br');
    note(path + '.gz');
  }
  const sorted = Object.fromEntries(Object.entries(own).filter(([path]) => !(path in made)).sort());
  return { packages: pins().packages, builder: ESBUILD, made, own: sorted };
}

/** Build elsewhere and name each file that differs. Compressed bytes depend on the compressor's version and are not compared. */
function check(sources) {
  const [there, noted] = [build(sources, join(sources, 'built')), pins()];
  const differs = ['made', 'own'].flatMap((part) => {
    const paths = new Set([...Object.keys(there[part]), ...Object.keys(noted[part])]);
    return [...paths].filter((path) => !/\.(br|gz)$/.test(path) && there[part][path] !== noted[part][path]);
  });
  if (differs.length) throw new Error(`not what the sources give: ${differs.join(', ')}: make vendor builds them again`);
}

const sources = mkdtempSync(join(tmpdir(), 'vendor-'));
try {
  const what = process.argv[2];
  if (!['pin', 'build', 'check'].includes(what)) throw new Error('usage: node .ci/vendor.mjs pin | build | check');
  if (what === 'pin') pin(sources);
  else {
    fetch(sources);
    if (what === 'build') keep(build(sources, HERE));
    else check(sources);
  }
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
} finally {
  rmSync(sources, { recursive: true });
}
