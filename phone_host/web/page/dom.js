// Changes the page in place, and only where something changed: what stays the same is never touched, so nothing flickers.

/**
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id @returns {T}
 */
export const byId = (id) => /** @type {T} */ (document.getElementById(id));

/** @param {Element} element @param {string} words */
export function text(element, words) {
  if (element.textContent !== words) element.textContent = words;
}

/** @param {HTMLElement} element @param {boolean} shown */
export function show(element, shown) {
  if (element.hidden === shown) element.hidden = !shown;
}

/** @param {HTMLElement} element @param {string} name @param {string} value */
export function data(element, name, value) {
  if (element.dataset[name] !== value) element.dataset[name] = value;
}

/**
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag @param {string} [kind] - its class @param {(string | Node)[]} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function make(tag, kind = '', ...children) {
  const element = document.createElement(tag);
  if (kind) element.className = kind;
  element.append(...children);
  return element;
}

/**
 * Keep one child for each item: made once, then updated; gone ones are removed.
 * @template T
 * @param {Element} parent @param {T[]} items @param {(item: T) => string} key
 * @param {(item: T) => HTMLElement} create @param {(element: HTMLElement, item: T) => void} update
 */
export function keep(parent, items, key, create, update) {
  /** @type {Map<string, HTMLElement>} */
  const old = new Map([...parent.children].map((child) => [/** @type {HTMLElement} */ (child).dataset.key ?? '', /** @type {HTMLElement} */ (child)]));
  items.forEach((item, index) => {
    const name = key(item);
    let element = old.get(name);
    if (!element) {
      element = create(item);
      element.dataset.key = name;
    }
    old.delete(name);
    update(element, item);
    if (parent.children[index] !== element) parent.insertBefore(element, parent.children[index] ?? null);
  });
  for (const element of old.values()) element.remove();
}

/** @param {HTMLSelectElement} select @param {{value: string, words: string}[]} options @param {string} chosen */
export function options(select, options, chosen) {
  const wanted = JSON.stringify(options);
  if (select.dataset.options !== wanted) {
    select.dataset.options = wanted;
    select.replaceChildren(...options.map(({ value, words }) => new Option(words, value)));
  }
  if (document.activeElement !== select && select.value !== chosen) select.value = chosen;
}

/** A field that the person is not writing in follows the program. @param {HTMLInputElement} input @param {string} value */
export function follow(input, value) {
  if (document.activeElement !== input && input.dataset.dirty !== 'yes' && input.value !== value) input.value = value;
}

let last = '';

/** Have a screen reader say something, once. @param {string} words */
export function say(words) {
  if (words === last) return;
  last = words;
  byId('said').textContent = words;
}

/**
 * Show on a button what a press does now: start or stop. Stop looks the same everywhere.
 * @param {HTMLElement} button @param {boolean} isOn @param {string} start - its words while nothing goes on
 */
export function startOrStop(button, isOn, start = 'Start') {
  text(button, isOn ? 'Stop' : start);
  data(button, 'running', isOn ? 'yes' : 'no');
}

/**
 * Run what a button does, once at a time; its answer is shown beside it.
 * @param {HTMLButtonElement} button
 * @param {() => Promise<{words?: string, problem?: string, remedy?: string} | void>} action
 * @param {HTMLElement} answer
 */
export function onPress(button, action, answer) {
  button.addEventListener('click', async () => {
    if (button.getAttribute('aria-disabled') === 'true') return;
    button.setAttribute('aria-disabled', 'true');
    try {
      tell(answer, (await action()) ?? {});
    } finally {
      button.removeAttribute('aria-disabled');
    }
  });
}

/** @param {HTMLElement} place @param {{words?: string, problem?: string, remedy?: string}} answer */
export function tell(place, answer) {
  const words = answer.problem ? `${sentence(answer.problem)} ${sentence(answer.remedy ?? '')}` : sentence(answer.words ?? '');
  place.classList.toggle('bad', !!answer.problem);
  text(place, words.trim());
  if (words.trim()) say(words);
}

/** What stands on the page for an option of the command line. */
const FIELDS = /** @type {Record<string, string>} */ ({
  near: 'Near', far: 'Far', crop: 'Crop', matcher: 'Matcher', square: 'Square', board: 'Inner corners', calibration: 'Calibration',
  link: 'the board\u2019s address', camera: 'the camera\u2019s address',
});

/** Words of the command line in words of the page; commands stay as they are typed. @param {string} words @returns {string} */
const ofThePage = (words) =>
  words.replace(/`([^`]*)`/g, '\u201c$1\u201d').replace(/ or --rectified\b|; see --help\b| without --disparities, or --disparities \d+|(?<=\bas in )--[a-z]+ /g, '').replace(/(?<!\u201c[^\u201d]*)--([a-z]+)(?![\w-])/g, (option, name) => FIELDS[name] ?? option);

/** With a capital letter and a full stop, but for addresses, commands and file names: those stay as they are typed. @param {string} words @returns {string} */
export function sentence(words) {
  const plain = ofThePage(words);
  const whole = /^(sudo|phone-host|board-agent)\b/.test(plain) ? plain : plain.replace(/^[a-z](?=[a-z'-]*([\s,;]|:\s|$))/, (first) => first.toUpperCase());
  return !words || /[.!?:]$|\S[/:.\\]\S*$/.test(whole) ? whole : `${whole}.`;
}
