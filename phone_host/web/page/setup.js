// The steps before a run: board, camera, check, calibration. Choices become options of the command line (`set`), shown in the card below (command_card.js).

import { begin, command } from './connection.js';
import { byId, data, follow, keep, make, onPress, sentence, show, startOrStop, tell, text } from './dom.js';

/** @typedef {{uri: string, name: string, note: string}} Choice */

const NONE = {
  link: 'None found. Plug the board in, or connect it to the same network.',
  camera: "None found on this machine. For a phone’s camera app that serves MJPEG, type its address.",
};
const BROWSER = 'browser:';
const NOT_LOOKED = { link: 'Press Find to search for boards.', camera: 'Press Find to search for cameras.' };

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

/** @param {'link' | 'camera'} option @param {?Choice[]} found @param {string} chosen @param {boolean} hasLooked */
function showChoices(option, found, chosen, hasLooked) {
  const choices = found ?? [];
  const list = byId(`${option}-choices`);
  keep(list, choices, (one) => one.uri, (one) => radio(one, option, byId(`${option}-answer`)), (label, one) => {
    const [input, name, uri, note] = /** @type {[HTMLInputElement, Element, Element, HTMLElement]} */ ([...label.children]);
    if (input.checked !== (one.uri === chosen)) input.checked = one.uri === chosen;
    text(name, one.name);
    text(uri, one.uri);
    text(note, one.note);
    show(note, !!one.note);
  });
  // A browser's camera is always there.
  show(byId(`${option}-none`), choices.every((one) => one.uri === BROWSER));
  text(byId(`${option}-none`), hasLooked ? NONE[option] : NOT_LOOKED[option]);
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

/** The board that was strange when the field was last opened or closed for it. */
let stranger = '';

/** The board that takes a code: one that is reached over a network. @param {any} state @returns {string} */
const boardOf = (state) => state.stranger || (state.settings.link ?? '').split(' ').find((/** @type {string} */ link) => link.startsWith('tcp://')) || '';

/** Whether the camera's film is being checked: then the only thing that is shown is what to do. @param {any} state */
function isFilming(state) {
  return state.activity === 'checking' && state.checks?.[0]?.what === 'film';
}

/** @param {any} state */
export function showSetup(state) {
  const hasLooked = state.boards !== null;
  showChoices('link', state.boards, state.settings.link ?? '', hasLooked);
  showChoices('camera', state.cameras, state.settings.camera ?? '', hasLooked);
  show(byId('enrol'), !!boardOf(state));
  // A board that forgot this machine asks again: the field stays at hand.
  if (state.stranger !== stranger) /** @type {HTMLDetailsElement} */ (byId('enrol')).open = !!(stranger = state.stranger);
  const isLooking = state.activity === 'checking' && !isFilming(state);
  text(byId('check-words'), isLooking ? 'Looking at the machine, the board and both cameras \u2026' : '');
  const [film] = isFilming(state) ? state.checks : [];
  text(byId('film-words'), film ? sentence(film.words) : '');
  text(byId('film-done'), film ? sentence(film.remedy) : '');
  startOrStop(byId('capture-go'), isFilming(state), 'Check for image stabilisation');
  showChecks(film ? [] : state.checks ?? []);
  startOrStop(byId('calibrate-go'), state.activity === 'calibrating', 'Start live calibration');
  follow(byId('calibration-typed'), state.settings.calibration ?? '');
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
  for (const option of ['link', 'camera']) onPress(byId(`${option}-find`), () => command('find'), byId(`${option}-answer`));
  byId('enrol-form').addEventListener('submit', (event) => {
    event.preventDefault();
    const code = /** @type {HTMLInputElement} */ (byId('enrol-code'));
    ask(byId('link-answer'), 'enrol', { link: boardOf(current()), code: code.value.trim() });
    code.value = '';
  });
  onPress(byId('check-go'), () => begin('check'), byId('check-answer'));
  onPress(byId('capture-go'), () => (isFilming(current()) ? command('stop') : begin('capture')), byId('check-answer'));
  onPress(byId('calibrate-go'), () => calibrate(current()), byId('calibration-answer'));
}

/** @param {any} state */
function calibrate(state) {
  if (state.activity === 'calibrating') return command('stop');
  const value = (/** @type {string} */ id) => /** @type {HTMLInputElement} */ (byId(id)).value.trim();
  return begin('calibrate', { board: value('board-kind') || 'auto', square: value('board-square') });
}
