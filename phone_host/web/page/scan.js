// The scan: start and stop, how it goes, the surface as it grows, and what to save of it.

import { begin, command } from './connection.js';
import { byId, data, keep, make, onPress, sentence, show, text } from './dom.js';
import { GrowingSurface } from './surface.js';

const ASK_MS = 1000;
const NO_WEBGL = 'This browser cannot draw the surface (no WebGL 2). Everything else works; the model can be saved.';
const EMPTY = { words: '', level: 'unknown', pairs: 0, fused: 0, folder: '', files: [] };

export class ScanPanel {
  /** @param {() => any} state - the newest */
  constructor(state) {
    this.state = state;
    /** @type {?import('./model.js').Model} */
    this.model = null;
    this.hasAskedForModel = false;
    /** Whether the person looks at it in a way of his own. */
    this.isHeld = false;
    this.surface = new GrowingSurface((name, part) => this.model?.put(name, part), () => this.model?.clear());
    onPress(byId('scan-go'), () => this.go(), byId('scan-answer'));
    setInterval(() => this.ask(), ASK_MS);
  }

  isScanning() {
    return this.state()?.activity === 'scanning';
  }

  go() {
    if (this.isScanning() || this.state()?.activity === 'ending') return command('stop');
    const value = (/** @type {string} */ id) => /** @type {HTMLInputElement} */ (byId(id)).value.trim();
    this.isHeld = false;
    return begin('scan', { voxel: value('scan-voxel'), box: value('scan-box') });
  }

  /** @param {any} state */
  show(state) {
    const scan = state.scan ?? EMPTY;
    const step = state.steps.find((/** @type {any} */ each) => each.name === 'scan');
    const isOn = this.isScanning();
    text(byId('scan-go'), isOn ? 'Stop' : 'Start');
    data(byId('scan-state'), 'level', scan.level);
    text(byId('scan-words'), sentence(isOn || scan.folder ? scan.words : (step?.words ?? '')));
    text(byId('scan-pairs'), scan.pairs ? `${scan.fused} of ${scan.pairs} pairs are in the model` : '');
    text(byId('scan-folder'), scan.folder ? `Saved in ${scan.folder}` : '');
    keep(byId('scan-files'), scan.files, (name) => name, (name) => make('li', '', link(name)), () => undefined);
    show(byId('scan-saved'), scan.files.length > 0);
    if (document.body.dataset.step === 'scan' && !this.hasAskedForModel) this.startModel();
  }

  /** The viewer is heavy: it comes when the scan is looked at. */
  async startModel() {
    this.hasAskedForModel = true;
    try {
      const [{ canShowClouds }, { Model }] = await Promise.all([import('./viewer.js'), import('./model.js')]);
      if (!canShowClouds()) throw new Error(NO_WEBGL);
      this.model = new Model(/** @type {HTMLCanvasElement} */ (byId('scan-model')), /** @type {HTMLCanvasElement} */ (byId('scan-over')));
    } catch {
      text(byId('scan-none'), NO_WEBGL);
      return;
    }
    for (const kind of ['pointerdown', 'wheel', 'keydown']) byId('scan-model').addEventListener(kind, () => (this.isHeld = true));
    for (const input of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll('input[name=scan-paint]')))
      input.addEventListener('change', () => this.model?.paint(/** @type {any} */ (input.value)));
    this.ask();
  }

  /** Ask for what is new while it is looked at. */
  async ask() {
    if (!this.model || document.body.dataset.step !== 'scan' || document.visibilityState !== 'visible') return;
    if (!this.state()?.scan) return;
    const has = await this.surface.ask();
    show(byId('scan-none'), this.model.isEmpty());
    data(byId('scan-model'), 'parts', String(this.model.parts.size));
    if (has && !this.isHeld) this.model.view('turned');
  }
}

/** @param {string} name */
function link(name) {
  const made = make('a', '', name);
  made.href = `/api/scan/${name}`;
  made.download = name;
  return made;
}
