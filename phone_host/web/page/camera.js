// The box of this browser's camera: its picture, what it does now, what is chosen and held.

import { canHoldOrientation, holdOrientation } from './camera_awake.js';
import { CameraFeed } from './camera_feed.js';
import { cameras, capabilitiesOf, ratesOf, sizesOf } from './camera_track.js';
import { GROUP_WORDS, stateOf, valuesInWords } from './camera_words.js';
import { byId, data, keep, make, onPress, options, say, sentence, show, startOrStop, text } from './dom.js';
import { isBrowsers } from './own_camera.js';

/** @typedef {import('./camera_locks.js').Group} Group */

const KEPT = 'camera';
/** In the header, where there is no room for words: all as wide as the widest. */
const CHIPS = { good: 'on', warning: '?', bad: '!', unknown: '\u2026' };
const NO = '\u2013';

/** What was chosen in this browser before. @returns {import('./camera_feed.js').Chosen} */
function kept() {
  try {
    return JSON.parse(localStorage.getItem(KEPT) ?? '{}');
  } catch {
    return {};
  }
}

/** @param {Storage} storage @param {string} value */
function keepIn(storage, value) {
  try {
    storage.setItem(KEPT, value);
  } catch {
    // storage is switched off: for this visit
  }
}

/** @param {CameraFeed} feed @returns {{name: string, value: string, unit: string}[]} */
export function figuresOf({ seen: { figures, rate } }) {
  const isSending = figures.sent > 0;
  const kb = figures.bytes / 1000;
  return [
    { name: 'frames', value: isSending ? rate.toFixed(0) : NO, unit: '/s' },
    { name: 'dropped', value: isSending ? String(figures.dropped) : NO, unit: '' },
    { name: isSending ? `as ${figures.encoding === 'luma' ? 'luma' : 'JPEG'}` : 'as', value: isSending ? kb.toFixed(0) : NO, unit: 'KB' },
    { name: 'round trip', value: Number.isFinite(figures.leastUs) ? (figures.leastUs / 1000).toFixed(1) : NO, unit: 'ms' },
  ];
}

export class CameraBox {
  /** @param {boolean} goesOn - the camera was on before the page was loaded again */
  constructor(goesOn) {
    this.feed = new CameraFeed(kept(), () => this.draw());
    /** @type {{id: string, name: string}[]} */
    this.devices = [];
    /** @type {?MediaStream} */
    this.stream = null;
    /** What was other than asked when the camera was opened. */
    this.said = '';
    this.connect();
    this.list();
    if (goesOn) this.feed.start();
    this.draw();
  }

  connect() {
    const answer = byId('own-answer');
    onPress(byId('own-go'), async () => this.press(), answer);
    onPress(byId('own-turn'), holdOrientation, answer);
    show(byId('own-turn'), canHoldOrientation());
    text(byId('own-adb'), byId('own-adb').textContent?.replaceAll('8765', location.port || '8765') ?? '');
    const value = (/** @type {string} */ id) => /** @type {HTMLSelectElement} */ (byId(id)).value;
    this.onChoice('own-device', () => ({ device: value('own-device') }));
    this.onChoice('own-size', () => {
      const [width, height] = value('own-size').split('x').map(Number);
      return { width, height };
    });
    this.onChoice('own-rate', () => ({ fps: Number(value('own-rate')) }));
    navigator.mediaDevices?.addEventListener('devicechange', () => this.list());
    byId('own-video').addEventListener('resize', () => this.draw());
  }

  /** @param {string} id @param {() => import('./camera_track.js').Choice} read */
  onChoice(id, read) {
    byId(id).addEventListener('change', () => {
      this.feed.choose(read());
      this.keep();
    });
  }

  press() {
    if (this.feed.isOn) this.feed.stop();
    else this.feed.start();
    keepIn(sessionStorage, this.feed.isOn ? 'on' : 'off');
  }

  keep() {
    keepIn(localStorage, JSON.stringify(this.feed.chosen));
  }

  /** Names of cameras are told once the person has allowed one. */
  async list() {
    this.devices = navigator.mediaDevices ? await cameras() : [];
    this.draw();
  }

  /** @param {any} state - of the program */
  show(state) {
    // Another camera was chosen, here or elsewhere: this one is not left on.
    if (!isBrowsers(state) && this.feed.isOn) this.press();
    /** @type {HTMLAnchorElement} */ (byId('own-chip')).href = state.steps.length ? '#camera' : '#own';
    this.draw();
  }

  draw() {
    const { feed } = this;
    const facts = feed.facts();
    const now = stateOf(facts);
    data(byId('own-state'), 'level', now.level);
    text(byId('own-words'), sentence(now.words));
    text(byId('own-remedy'), sentence(now.remedy));
    if (feed.isOn || facts.phase === 'failed') say(`${now.words}. ${now.remedy}`);
    show(byId('own-ways'), !facts.isSecure);
    for (const id of ['own-parts', 'own-buttons']) show(byId(id), facts.isSecure);
    startOrStop(byId('own-go'), feed.isOn);
    show(byId('own-chip'), feed.isOn);
    text(byId('own-chip'), `camera ${CHIPS[now.level]}`);
    byId('own-chip').setAttribute('aria-label', `camera: ${now.words}`);
    this.picture();
    this.choices();
    this.held();
    keep(byId('own-figures'), figuresOf(feed), (one) => one.name.split(' ')[0], () => make('div', '', make('dt'), make('dd', '', make('span', 'value'), make('small'))), (item, one) => {
      text(item.children[0], one.name);
      text(item.children[1].children[0], one.value);
      text(item.children[1].children[1], one.unit);
    });
  }

  picture() {
    const stream = this.feed.opened?.stream ?? null;
    if (stream !== this.stream) {
      this.stream = stream;
      /** @type {HTMLVideoElement} */ (byId('own-video')).srcObject = stream;
      if (stream) this.list();
    }
    show(byId('own-dark'), !stream);
  }

  choices() {
    const { feed } = this;
    const track = feed.opened?.track;
    const settings = track?.getSettings() ?? {};
    const capabilities = track ? capabilitiesOf(track) : {};
    const devices = this.devices.length ? this.devices : [{ id: '', name: 'default' }];
    const chosen = settings.deviceId ?? feed.chosen.device ?? '';
    const device = devices.some(({ id }) => id === chosen) ? chosen : devices[0].id;
    options(byId('own-device'), devices.map(({ id, name }) => ({ value: id, words: name })), device);
    const wanted = { width: feed.chosen.width ?? 640, height: feed.chosen.height ?? 480 };
    const size = settings.width ? { width: Math.max(settings.width, settings.height ?? 0), height: Math.min(settings.width, settings.height ?? 0) } : wanted;
    options(byId('own-size'), sizesOf(capabilities, size).map(([w, h]) => ({ value: `${w}x${h}`, words: `${w} x ${h}` })), `${size.width}x${size.height}`);
    const rate = Math.round(settings.frameRate ?? feed.chosen.fps ?? 30);
    options(byId('own-rate'), ratesOf(capabilities, rate).map((each) => ({ value: String(each), words: `${each} /s` })), String(rate));
    const words = feed.opened?.words ?? '';
    if (words && words !== this.said) text(byId('own-answer'), sentence(`${words}: it gives ${settings.width} x ${settings.height}`));
    if (!words && this.said) text(byId('own-answer'), '');
    this.said = words;
  }

  held() {
    const { locks } = this.feed;
    const settings = /** @type {any} */ (this.feed.opened?.track.getSettings() ?? {});
    const groups = locks?.groups() ?? [];
    keep(byId('own-groups'), groups, (group) => group, (group) => this.toggle(/** @type {Group} */ (group)), (label, name) => {
      const group = /** @type {Group} */ (name);
      const [input, , output] = /** @type {[HTMLInputElement, Element, HTMLElement]} */ ([...label.children]);
      const isHeld = group === 'torch' ? !!settings.torch : locks?.settling.has(group) || !!locks?.held[group];
      if (input.checked !== isHeld) input.checked = !!isHeld;
      const refusal = locks?.refused[group] ?? '';
      text(output, refusal ? sentence(refusal) : locks?.settling.has(group) ? 'measuring \u2026' : isHeld || group === 'torch' ? valuesInWords(group, settings) : 'automatic');
      data(output, 'level', refusal ? 'bad' : '');
    });
    const isNone = !groups.length;
    show(byId('own-free'), isNone);
    text(byId('own-free'), locks ? 'This browser leaves all settings automatic. Keep the light even and the distance the same.' : 'Shown once the camera is on.');
  }

  /** @param {Group} group */
  toggle(group) {
    const input = make('input');
    input.type = 'checkbox';
    input.addEventListener('change', () => {
      if (group === 'torch') return this.feed.light(input.checked);
      this.feed.hold(group, input.checked);
      this.keep();
    });
    return make('label', 'held', input, make('span', '', GROUP_WORDS[group] ?? 'Light on'), make('output'));
  }
}
