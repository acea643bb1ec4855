// Puts the page together: one newest state and one newest pair; every part shows them in place.

import { Charts } from './charts.js';
import { connectCommand, showCommand } from './command_card.js';
import { Connection } from './connection.js';
import { Controls } from './controls.js';
import { byId, data, show, text } from './dom.js';
import { showFigures } from './figures.js';
import { seePictures, showGuide } from './guide.js';
import { Live } from './live.js';
import { showOwnCamera } from './own_camera.js';
import { ScanPanel } from './scan.js';
import { Workshop } from './workshop.js';
import { connectSetup, showSetup } from './setup.js';
import { STEPS, showSteps, stepOf } from './steps.js';
import { takeToken } from './token.js';
import { showTrust } from './trust.js';

takeToken();

const HZ = 10;
/** Widths that pictures are asked in: few, so that the server makes each only once for several viewers. */
const WIDTHS_PX = [320, 480, 640, 960, 1280];
const WIDE = matchMedia('(min-width: 900px)');
const LINES = /** @type {Record<import('./connection.js').Line, string>} */ ({
  connecting: 'connecting', open: 'connected', lost: 'connection lost, trying again', ended: 'the program has ended', refused: 'not allowed',
});

/** What is shown is old then; it stays, greyed. */
const OLD = /** @type {Record<string, string>} */ ({
  lost: 'Connection lost: this page shows old data. Trying again', ended: 'The program has ended: this page shows its last state',
});

/** @type {any} */
let state = null;
/** The step that was asked for; other fragments, such as that of the skip link, change nothing. */
let asked = '';

/** @type {Controls} */
const controls = new Controls(() => state, () => live.pair?.head ?? null);
/** @type {Live} */
const live = new Live((from, to, done) => controls.drag(from, to, done));
const scan = new ScanPanel(() => state);
const workshop = new Workshop(() => state);
const charts = new Charts({ delays: byId('chart-delays'), rate: byId('chart-rate'), skew: byId('chart-skew') });

const connection = new Connection({
  line: (line) => {
    data(document.body, 'line', line);
    text(byId('online'), LINES[line]);
    show(byId('refused'), line === 'refused');
    if (OLD[line]) showTrust({ live: { trust: { level: 'unknown', headline: OLD[line], concerns: [] } } });
    else draw();
  },
  state: (told) => {
    // The step that is right at the start stays until the person goes on: nothing is torn away.
    if (!state && !asked) asked = stepOf(told, '');
    if (told.begun !== (state?.begun ?? 0)) {
      charts.clear();
      live.begin(told.begun);
    }
    state = told;
    charts.add(told.live?.samples ?? []);
    draw();
  },
  pair: (pair) => {
    if (state?.activity === 'calibrating' && pair.head.begun === state.begun) {
      seePictures(pair, state);
      return;
    }
    live.show(pair);
    data(document.body, 'ready', 'yes');
  },
});

/** Show the newest state. */
function draw() {
  if (!state) return;
  showSteps(state, stepOf(state, asked));
  showTrust(state);
  showSetup(state);
  showGuide(state);
  showOwnCamera(state);
  showFigures(state.live, charts.delay());
  controls.show(state);
  scan.show(state);
  showCommand(state, document.body.dataset.step ?? '', scan.options());
  workshop.show(state);
  text(byId('activity'), state.activity);
  data(document.body, 'activity', state.activity);
  want();
}

/** What is looked at: parts of the pair, and the frame that tells their width. @returns {[string[], string]} */
function looked() {
  const { step } = document.body.dataset;
  const view = byId('views').dataset.shown;
  if (document.visibilityState !== 'visible') return [[], 'map-frame'];
  if (step === 'calibration' && state?.activity === 'calibrating') return [['left', 'right'], 'guide-left'];
  if (step !== 'run') return [[], 'map-frame'];
  if (WIDE.matches) return [['left', 'right', 'disparity'], 'left-frame'];
  if (view === 'pictures') return [['left', 'right'], 'left-frame'];
  return [view === 'cloud' ? ['left', 'disparity'] : ['disparity'], 'map-frame'];
}

/** Ask for what is looked at, no more. */
function want() {
  const [views, frame] = looked();
  const width = Math.max(320, byId(frame).clientWidth * Math.min(2, window.devicePixelRatio));
  connection.want(views, WIDTHS_PX.find((each) => each >= width) ?? 1280, HZ);
}

/** @returns {boolean} whether the address asks for another step */
function readAddress() {
  const name = location.hash.slice(1);
  if (name === asked || !STEPS.some((step) => step === name)) return false;
  asked = name;
  return true;
}

readAddress();
window.addEventListener('hashchange', () => {
  if (!readAddress()) return;
  draw();
  byId('main').focus({ preventScroll: true });
  window.scrollTo(0, 0);
});
document.addEventListener('visibilitychange', want);
WIDE.addEventListener('change', want);
for (const input of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll('input[name=shown]')))
  input.addEventListener('change', () => {
    data(byId('views'), 'shown', input.value);
    want();
  });
for (const input of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll('input[name=kind]')))
  input.addEventListener('change', () => live.as(/** @type {any} */ (input.value)));
byId('lines').addEventListener('change', (event) => data(byId('views'), 'withLines', /** @type {HTMLInputElement} */ (event.target).checked ? 'yes' : 'no'));
byId('stacked').addEventListener('change', (event) => charts.stack(/** @type {HTMLInputElement} */ (event.target).checked));
connectSetup(() => state);
connectCommand();
byId('panel-scan').addEventListener('input', draw);
