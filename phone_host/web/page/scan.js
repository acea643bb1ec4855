// The scan: start and stop, how it goes, the surface as it grows, the box that is kept, and what to save of it.

import { begin, command } from './connection.js';
import { byId, data, keep, make, onPress, sentence, show, startOrStop, tell, text } from './dom.js';
import { GrowingSurface } from './surface.js';

/** @typedef {import('./crop_box.js').Box} Box */

const ASK_MS = 1000;
const NO_WEBGL = 'This browser cannot draw the surface (no WebGL 2). Everything else works; the model can be saved.';
const NO_BOX = { problem: 'this is not a box', remedy: 'give its size and its centre in mm, such as 300x300x200@0,0,600' };
const EMPTY = { words: '', level: 'unknown', pairs: 0, fused: 0, folder: '', files: [], options: {} };

export class ScanPanel {
  /** @param {() => any} state - the newest */
  constructor(state) {
    this.state = state;
    /** @type {?import('./model.js').Model} */
    this.model = null;
    /** @type {?import('./crop_box.js').CropBox} */
    this.crop = null;
    /** @type {(text: string) => ?Box} */
    this.boxOf = () => null;
    /** @type {(box: Box) => string} */
    this.boxText = () => '';
    this.hasAskedForModel = false;
    /** Whether the person looks at it in a way of his own. */
    this.isHeld = false;
    this.wasEnding = false;
    /** The options of a scan that were shown last, JSON. */
    this.followed = '{}';
    this.field = /** @type {HTMLInputElement} */ (byId('scan-box'));
    this.surface = new GrowingSurface((name, part, axes) => {
      this.model?.stands(axes);
      this.model?.put(name, part);
    }, () => this.model?.clear());
    onPress(byId('scan-go'), () => this.go(), byId('scan-answer'));
    onPress(byId('scan-draw'), () => this.drawBox(), byId('scan-answer'));
    this.field.addEventListener('change', () => this.typed());
    byId('scan-kind').addEventListener('change', () => this.kind());
    this.kind();
    setInterval(() => this.ask(), ASK_MS);
  }

  isScanning() {
    return this.state()?.activity === 'scanning';
  }

  go() {
    if (this.isScanning() || this.state()?.activity === 'ending') return command('stop');
    this.isHeld = false;
    return begin('scan', this.options());
  }

  /** What is chosen, as options of `phone-host scan`; an empty value is not given. @returns {Record<string, string>} */
  options() {
    const value = (/** @type {string} */ id) => field(id).value.trim();
    const kind = value('scan-kind');
    const mat = kind === 'mat' ? value('scan-mat') || 'usual' : '';
    return {
      voxel: value('scan-voxel'),
      box: value('scan-box'),
      mat,
      turntable: kind === 'turntable' ? 'yes' : '',
      object: kind === 'object' ? 'yes' : '',
      unseen: value('scan-unseen') === 'fill' ? '' : value('scan-unseen'),
    };
  }

  /** Show the options of the newest scan, whichever viewer chose them; they may be changed for the next one. @param {Record<string, string>} options */
  follow(options) {
    const isOn = this.isScanning();
    for (const id of ['scan-kind', 'scan-mat', 'scan-voxel', 'scan-unseen']) if (field(id).disabled !== isOn) field(id).disabled = isOn;
    this.kind();
    const told = JSON.stringify(options);
    if (told === this.followed) return;
    this.followed = told;
    const { voxel = '', box = '', mat = '', turntable = '', object = '', unseen = '' } = options;
    field('scan-kind').value = mat ? 'mat' : turntable ? 'turntable' : object ? 'object' : '';
    field('scan-mat').value = mat === 'usual' ? '' : mat;
    field('scan-voxel').value = voxel;
    field('scan-unseen').value = unseen || 'fill';
    this.kind();
    if (box === this.field.value.trim() || document.activeElement === this.field) return;
    this.field.value = box;
    this.outline(this.boxOf(box));
  }

  /** Only a mat has a sheet to be named; while a scan goes on, the default one is not worth its place. */
  kind() {
    show(byId('scan-sheet'), field('scan-kind').value === 'mat' && !(this.isScanning() && !field('scan-mat').value));
  }

  /** Begin with a box around most of the surface, or keep everything again. */
  async drawBox() {
    const box = this.crop?.box ? null : (this.boxOf(this.field.value) ?? this.model?.middle() ?? null);
    if (!box && !this.crop?.box) return { problem: 'there is no surface yet', remedy: 'begin the scan first' };
    return this.boxed(box);
  }

  /** Somebody has typed a box. */
  async typed() {
    const isEmpty = !this.field.value.trim();
    const box = this.boxOf(this.field.value);
    const answer = isEmpty || box ? await this.boxed(box, false) : NO_BOX;
    tell(byId('scan-answer'), answer);
  }

  /** Show a box, and have it kept. @param {?Box} box @param {boolean} writes - into the field, too @returns {Promise<{problem?: string, remedy?: string}>} */
  async boxed(box, writes = true) {
    this.outline(box);
    if (writes) this.field.value = box ? this.boxText(box) : '';
    return this.isScanning() ? begin('crop', { box: this.field.value.trim() }) : {};
  }

  /** @param {?Box} box */
  outline(box) {
    this.crop?.show(box);
    this.model?.within(box);
    byId('scan-draw').setAttribute('aria-pressed', String(!!box));
    text(byId('scan-draw'), box ? 'Remove box' : 'Draw box');
  }

  /** @param {any} state */
  show(state) {
    const scan = state.scan ?? EMPTY;
    const step = state.steps.find((/** @type {any} */ each) => each.name === 'scan');
    const isOn = this.isScanning();
    startOrStop(byId('scan-go'), isOn);
    this.follow(scan.options);
    const isEnding = state.activity === 'ending';
    if (this.wasEnding && !isEnding) tell(byId('scan-answer'), {}); // it said that it ends
    this.wasEnding = isEnding;
    data(byId('scan-state'), 'level', scan.level);
    text(byId('scan-words'), sentence(isOn || scan.folder ? scan.words : (step?.words ?? '')));
    text(byId('scan-pairs'), scan.pairs > scan.fused && !scan.folder ? `${scan.fused} of ${scan.pairs} ${scan.pairs === 1 ? 'pair' : 'pairs'} are in the model` : '');
    text(byId('scan-folder'), scan.folder ? `Saved in ${scan.folder}` : '');
    keep(byId('scan-files'), scan.files, (name) => name, (name) => make('li', '', link(name)), () => undefined);
    show(byId('scan-saved'), scan.files.length > 0);
    if (document.body.dataset.step === 'scan' && !this.hasAskedForModel) this.startModel();
  }

  /** The viewer is heavy: it comes when the scan is looked at. */
  async startModel() {
    this.hasAskedForModel = true;
    try {
      const [{ canShowClouds }, { Model }, { CropBox, boxOf, boxText }] = await Promise.all([
        import('./viewer.js'), import('./model.js'), import('./crop_box.js'),
      ]);
      if (!canShowClouds()) throw new Error(NO_WEBGL);
      this.model = new Model(/** @type {HTMLCanvasElement} */ (byId('scan-model')), /** @type {HTMLCanvasElement} */ (byId('scan-over')));
      this.boxOf = boxOf;
      this.boxText = boxText;
      this.crop = new CropBox(this.model, (box, done) => this.pulled(box, done));
    } catch {
      text(byId('scan-none'), NO_WEBGL);
      return;
    }
    for (const kind of ['pointerdown', 'wheel', 'keydown']) byId('scan-model').addEventListener(kind, () => (this.isHeld = true));
    for (const input of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll('input[name=scan-paint]')))
      input.addEventListener('change', () => this.model?.paint(/** @type {any} */ (input.value)));
    this.outline(this.boxOf(this.field.value));
    this.ask();
  }

  /** A face of the box is pulled. @param {Box} box @param {boolean} done */
  async pulled(box, done) {
    this.isHeld = true;
    this.model?.within(box);
    this.field.value = this.boxText(box);
    if (!done) return;
    const answer = await this.boxed(box, false);
    tell(byId('scan-answer'), answer);
  }

  /** Ask for what is new while it is looked at. */
  async ask() {
    if (!this.model || document.body.dataset.step !== 'scan' || document.visibilityState !== 'visible') return;
    if (!this.state()?.scan) return;
    const has = await this.surface.ask();
    show(byId('scan-none'), this.model.isEmpty());
    show(byId('scan-hatch'), this.model.hasUnseen());
    data(byId('scan-model'), 'parts', String(this.model.parts.size));
    if (has && !this.isHeld) this.model.view('turned');
  }
}

/** @param {string} id @returns {HTMLInputElement} */
const field = (id) => byId(id);

/** @param {string} name */
function link(name) {
  const made = make('a', '', name);
  made.href = `/api/scan/${name}`;
  made.download = name;
  return made;
}
