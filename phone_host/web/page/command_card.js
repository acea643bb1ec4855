// The command line that does the same as the page: that of a run, and on the scan's step that of a scan. To copy.

import { byId, onPress, text } from './dom.js';

const NOT_CHOSEN = 'Command: appears once board and camera are chosen';
const NOT_CALIBRATED = 'Command: appears once the cameras are calibrated';
const ONLY_HERE = 'Command: none, because only the page can scan with a browser\u2019s camera';

/** Quote a word for a shell. @param {string} word */
const quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** Write options as words of a command line. @param {Record<string, string>} options - of `scan`; an empty value leaves its option out @returns {string} */
export function optionWords(options) {
  const switches = ['turntable', 'object'];
  return Object.entries(options).filter(([, value]) => value).map(([name, value]) => {
    const isBare = switches.includes(name) || (name === 'mat' && value === 'usual');
    return isBare ? ` --${name}` : ` --${name} ${quoted(value)}`;
  }).join('');
}

/** @param {any} state @param {string} step - that is shown @param {Record<string, string>} options - of `scan`, as they are chosen */
export function showCommand(state, step, options) {
  const isScan = step === 'scan';
  const isMetric = !isScan || ['calibration', 'rectified'].some((name) => state.settings[name]);
  const line = !isScan ? state.command : isMetric && state.scan_command ? state.scan_command + optionWords(options) : '';
  text(byId('command'), line || (!state.command ? NOT_CHOSEN : isMetric ? ONLY_HERE : NOT_CALIBRATED));
  byId('command-copy').setAttribute('aria-disabled', String(!line));
}

/** Connect the button, once. */
export function connectCommand() {
  onPress(byId('command-copy'), () => copy(byId('command').textContent ?? ''), byId('command-answer'));
}

/** @param {string} words */
async function copy(words) {
  try {
    await navigator.clipboard.writeText(words);
    return { words: 'copied' };
  } catch {
    getSelection()?.selectAllChildren(byId('command'));
    return { words: 'selected: copy it with the keyboard' };
  }
}
