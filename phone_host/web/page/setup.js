// The steps before a run: board, camera, check, calibration. Choices become options of the command line (`set`), shown below to copy.

import { command } from './connection.js';
import { byId, data, follow, keep, make, onPress, sentence, show, tell, text } from './dom.js';

/** @typedef {{uri: string, name: string, note: string, needs_code: boolean}} Choice */

/** Give a command and show what became of it. @param {HTMLElement} place @param {string} name @param {Record<string, string>} [values] */
async function ask(place, name, values) {
  tell(place, await command(name, values));
}

/** @param {Choice} choice @param {string} option @param {HTMLElement} answer */
function radio(choice, option, answer) {
  const input = make('input');
  input.type = 'radio';
  input.name = option;
  input.value = choice.uri;
  input.addEventListener('change', () => ask(answer, 'set', { [option]: choice.uri }));
  return make('label', 'choice', input, make('span', 'name'), make('code'), make('span', 'note'));
}

/** @param {string} option @param {Choice[]} choices @param {string} chosen */
function showChoices(option, choices, chosen) {
  const list = byId(`${option}-choices`);
  keep(list, choices, (one) => one.uri, (one) => radio(one, option, byId(`${option}-answer`)), (label, one) => {
    const [input, name, uri, note] = /** @type {[HTMLInputElement, Element, Element, HTMLElement]} */ ([...label.children]);
    if (input.checked !== (one.uri === chosen)) input.checked = one.uri === chosen;
    text(name, one.name);
    text(uri, one.uri);
    text(note, one.note);
    show(note, !!one.note);
  });
  show(byId(`${option}-none`), choices.length === 0);
  follow(byId(`${option}-typed`), choices.some((one) => one.uri === chosen) ? '' : chosen);
}

/** @typedef {{what: string, grade: 'ok' | 'warn' | 'fail', words: string, remedy: string}} Checked */

const SIGNS = { ok: '\u2713', warn: '!', fail: '\u2715' };
const LEVELS = { ok: 'good', warn: 'warning', fail: 'bad' };

/** @param {Checked[]} checks - what was looked at so far */
function showChecks(checks) {
  keep(
    byId('checks'), checks, (one) => one.what,
    () => make('li', '', make('i'), make('b'), ' ', make('span'), make('span', 'remedy')),
    (item, one) => {
      const [sign, what, words, remedy] = /** @type {HTMLElement[]} */ ([...item.children]);
      data(item, 'level', LEVELS[one.grade]);
      text(sign, SIGNS[one.grade]);
      sign.setAttribute('aria-label', one.grade);
      sign.setAttribute('role', 'img');
      text(what, one.what);
      text(words, one.words);
      text(remedy, one.grade === 'ok' ? '' : sentence(one.remedy));
    },
  );
}

/** @param {any} state */
export function showSetup(state) {
  showChoices('link', state.boards, state.settings.link ?? '');
  showChoices('camera', state.cameras, state.settings.camera ?? '');
  const board = state.boards.find((/** @type {Choice} */ one) => one.uri === state.settings.link);
  show(byId('enrol'), !!board?.needs_code);
  text(byId('check-words'), state.activity === 'checking' ? 'Looking at the machine, the board and both cameras \u2026' : '');
  showChecks(state.checks ?? []);
  text(byId('calibrate-go'), state.activity === 'calibrating' ? 'Stop' : 'Start live calibration');
  follow(byId('calibration-typed'), state.settings.calibration ?? '');
  text(byId('command'), state.command || 'not enough is chosen yet');
  byId('command-copy').setAttribute('aria-disabled', String(!state.command));
}

/** Connect the forms, once. @param {() => any} current - the newest state */
export function connectSetup(current) {
  for (const option of ['link', 'camera', 'calibration']) {
    const [form, field, answer] = [byId(`${option}-form`), /** @type {HTMLInputElement} */ (byId(`${option}-typed`)), byId(`${option}-answer`)];
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      ask(answer, 'set', { [option]: field.value.trim() });
      field.blur();
    });
  }
  onPress(byId('find'), () => command('find'), byId('link-answer'));
  byId('enrol').addEventListener('submit', (event) => {
    event.preventDefault();
    const code = /** @type {HTMLInputElement} */ (byId('enrol-code'));
    ask(byId('link-answer'), 'enrol', { link: current().settings.link ?? '', code: code.value.trim() });
    code.value = '';
  });
  onPress(byId('check-go'), () => command('check'), byId('check-answer'));
  onPress(byId('calibrate-go'), () => calibrate(current()), byId('calibration-answer'));
  onPress(byId('command-copy'), () => copy(byId('command').textContent ?? ''), byId('command-answer'));
}

/** @param {any} state */
function calibrate(state) {
  if (state.activity === 'calibrating') return command('stop');
  const value = (/** @type {string} */ id) => /** @type {HTMLInputElement} */ (byId(id)).value.trim();
  return command('calibrate', { board: value('board-kind') || 'auto', square: value('board-square') });
}

/** @param {string} words */
async function copy(words) {
  try {
    await navigator.clipboard.writeText(words);
    return { words: 'copied' };
  } catch {
    getSelection()?.selectAllChildren(byId('command'));
    return { words: 'selected: copy it with the keys' };
  }
}
