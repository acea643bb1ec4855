// What steers a run: start and stop, snapshot, recording, matcher, near and far, crop.

import { begin, command } from './connection.js';
import { byId, data, follow, onPress, options, say, sentence, show, startOrStop, tell, text } from './dom.js';

/** @typedef {import('./pointing.js').Spot} Spot */

/** The least crop, px: smaller is a slip of the finger. */
const LEAST_PX = 16;

const NAMES = ['near', 'far', 'crop'];

/** @param {Spot} from @param {Spot} to @returns {[number, number, number, number]} x, y, width, height, px */
export function boxOf(from, to) {
  const [left, top] = [Math.round(Math.min(from.x, to.x) + 0.5), Math.round(Math.min(from.y, to.y) + 0.5)];
  return [left, top, Math.round(Math.abs(from.x - to.x)), Math.round(Math.abs(from.y - to.y))];
}

/** @param {string} words - X,Y,W,H @returns {?[number, number, number, number]} null: it is none */
export function parsedCrop(words) {
  const numbers = words.split(',').map(Number);
  return numbers.length === 4 && numbers.every((v) => Number.isFinite(v)) ? /** @type {any} */ (numbers) : null;
}

export class Controls {
  /** @param {() => any} state @param {() => ?{width: number, height: number}} size - of the left image */
  constructor(state, size) {
    this.state = state;
    this.size = size;
    this.drawing = false;
    /** @type {Map<string, {words?: string, problem?: string, remedy?: string}>} why fields that are still red were refused */
    this.refusals = new Map();
    this.answer = byId('run-answer');
    this.settingsAnswer = byId('settings-answer');
    this.cropAnswer = byId('crop-answer');
    onPress(byId('go'), () => (this.isRunning() ? command('stop') : begin('run')), this.answer);
    onPress(byId('snapshot'), () => command('snapshot'), this.answer);
    onPress(byId('record'), () => this.record(), this.answer);
    byId('matcher').addEventListener('change', (event) => this.set('matcher', /** @type {HTMLSelectElement} */ (event.target).value));
    for (const name of NAMES) this.field(name);
    byId('crop-draw').addEventListener('click', () => this.draw(!this.drawing));
    document.addEventListener('keydown', (event) => event.key === 'Escape' && this.drawing && this.draw(false));
    byId('crop-stop').addEventListener('click', () => this.draw(false));
    byId('crop-clear').addEventListener('click', () => {
      this.draw(false);
      this.set('crop', '');
    });
  }

  isRunning() {
    return this.state()?.activity === 'running' || this.state()?.activity === 'ending';
  }

  isRecording() {
    const told = this.state()?.live?.recording;
    return this.isRunning() && !!told && !told.is_over;
  }

  /** Begin or end a recording. What goes on stands in its own line, with every state; only what was refused is answered. */
  async record() {
    const answer = await command(this.isRecording() ? 'end_recording' : 'record');
    return answer.problem ? answer : {};
  }

  /** @param {string} name */
  field(name) {
    const input = /** @type {HTMLInputElement} */ (byId(name));
    input.addEventListener('input', () => data(input, 'dirty', 'yes'));
    input.addEventListener('change', () => this.set(name, input.value.trim()));
    input.addEventListener('keydown', (event) => event.key === 'Enter' && input.blur());
  }

  /** @param {string} name @param {string} value @param {HTMLElement} [place] - takes the answer */
  async set(name, value, place = this.settingsAnswer) {
    const answer = await command('set', { [name]: value });
    // What was refused stays as it was typed, to be mended.
    data(byId(name), 'dirty', answer.problem ? 'yes' : 'no');
    byId(name).setAttribute('aria-invalid', String(!!answer.problem));
    if (answer.problem) this.refusals.set(name, answer);
    else this.refusals.delete(name);
    const [before] = this.refusals.values();
    tell(place, answer.problem ? answer : (before ?? answer));
    if (this.state()) this.show(this.state());
  }

  /** What to do stands at the pictures: on a phone they are far from the button. @param {boolean} on */
  draw(on) {
    if (on && !this.size()) {
      tell(this.settingsAnswer, { problem: 'there is no image to draw on yet', remedy: 'start a run' });
      return;
    }
    this.drawing = on;
    byId('crop-draw').setAttribute('aria-pressed', String(on));
    data(byId('views'), 'drawing', on ? 'yes' : 'no');
    tell(this.settingsAnswer, {});
    tell(this.cropAnswer, { words: on ? 'drag a rectangle around the area that needs depth, on the depth or the left image' : '' });
    if (!on) {
      if (this.state()) this.show(this.state());
      return;
    }
    if (byId('views').dataset.shown === 'cloud') /** @type {HTMLElement} */ (document.querySelector('input[name=shown][value=depth]')).click();
    byId('crop-line').scrollIntoView();
  }

  /** @param {Spot} from @param {Spot} to @param {boolean} done @returns {boolean} whether the pointer draws now */
  drag(from, to, done) {
    if (!this.drawing) return false;
    const box = boxOf(from, to);
    this.outline(box);
    if (done && box[2] >= LEAST_PX && box[3] >= LEAST_PX) {
      this.draw(false);
      /** @type {HTMLInputElement} */ (byId('crop')).value = box.join(',');
      this.set('crop', box.join(','), this.cropAnswer);
    }
    return true;
  }

  /** @param {?[number, number, number, number]} box - px */
  outline(box) {
    const size = this.size();
    for (const mark of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll('.cropped'))) {
      show(mark, !!box && !!size);
      if (!box || !size) continue;
      const percent = (/** @type {number} */ v, /** @type {number} */ whole) => `${(100 * v) / whole}%`;
      Object.assign(mark.style, {
        left: percent(box[0], size.width), top: percent(box[1], size.height), width: percent(box[2], size.width), height: percent(box[3], size.height),
      });
    }
  }

  /** @param {?{words: string, is_over: boolean, failure: ?object}} told - null: nothing was recorded */
  showRecording(told) {
    const on = this.isRecording();
    const line = byId('recording');
    text(byId('record'), on ? 'End recording' : 'Record');
    data(byId('record'), 'on', on ? 'yes' : 'no');
    byId('record').setAttribute('aria-disabled', String(!this.isRunning()));
    show(line, !!told);
    if (!told) return;
    text(line, sentence(told.words));
    if (told.is_over && line.dataset.on === 'yes') say(told.words);
    data(line, 'on', told.is_over ? 'no' : 'yes');
    line.classList.toggle('bad', !!told.failure);
  }

  /** @param {any} state */
  show(state) {
    const running = this.isRunning();
    startOrStop(byId('go'), running);
    show(byId('go'), running || state.steps.length > 0);
    byId('snapshot').setAttribute('aria-disabled', String(!running));
    this.showRecording(state.live?.recording ?? null);
    const names = state.matchers.map((/** @type {string} */ name) => ({ value: name, words: name }));
    options(byId('matcher'), [{ value: '', words: 'default' }, ...names], state.settings.matcher ?? '');
    for (const name of NAMES) follow(byId(name), state.settings[name] ?? '');
    show(byId('crop-clear'), !!state.settings.crop);
    if (!this.drawing) this.outline(parsedCrop(state.settings.crop ?? ''));
  }
}
