// What the camera of this browser does now, in words, and what to do about it.

/**
 * @typedef {object} Facts
 * @property {boolean} isSecure
 * @property {'off' | 'opening' | 'failed' | 'on'} phase
 * @property {string} failure - name of the error; empty: none
 * @property {boolean} isEnded - the camera was taken away
 * @property {boolean} isMuted
 * @property {boolean} isVisible - the tab
 * @property {boolean} isTurned - the phone stands otherwise than at the start
 * @property {import('./camera_link.js').Line} line
 * @property {{problem: string, remedy: string}} refusal
 * @property {string} trouble - why the last frame was not sent; empty: it was
 * @property {string} told - what the program has to say of the frames; empty: nothing
 * @property {boolean} isAsked - the program has asked for frames of late
 */

/** @typedef {{level: 'good' | 'warning' | 'bad' | 'unknown', words: string, remedy: string}} Said */

/** @param {Said['level']} level @param {string} words @param {string} remedy @returns {Said} */
const said = (level, words, remedy = '') => ({ level, words, remedy });

const FAILURES = /** @type {Record<string, Said>} */ ({
  NotAllowedError: said('bad', 'The browser does not allow the camera', 'Press the icon left of the address, allow the camera, then start again.'),
  NotFoundError: said('bad', 'This device has no camera that the browser sees', 'Plug one in; on a phone, allow the browser the camera in the system\u2019s settings.'),
  NotReadableError: said('bad', 'Another program is using the camera', 'Close other camera apps and calls. The page tries again by itself.'),
  OverconstrainedError: said('bad', 'The camera offers no usable image size', 'Choose another camera.'),
  NotSupportedError: said('bad', 'This browser cannot deliver single frames', 'Use a current version of Chrome, Edge or Firefox.'),
});
const OTHER_FAILURE = said('bad', 'The camera does not start', 'Close other camera apps, or choose another camera. The page tries again by itself.');

/** Failures that end by themselves: it is tried again. @param {string} name */
export const passes = (name) => !['NotAllowedError', 'SecurityError', 'OverconstrainedError', 'NotSupportedError'].includes(name);

/** @param {Facts} facts @returns {Said} */
export function stateOf(facts) {
  if (!facts.isSecure) return said('bad', 'The browser blocks its camera at this address', 'Open the page in one of these ways:');
  if (facts.phase === 'failed') return FAILURES[facts.failure] ?? FAILURES[{ AbortError: 'NotReadableError', SecurityError: 'NotAllowedError' }[facts.failure] ?? ''] ?? OTHER_FAILURE;
  if (facts.phase === 'off') return said('unknown', 'The camera is off', 'Start it; the browser asks for permission once.');
  if (facts.phase === 'opening') return said('warning', 'Waiting for the camera', 'Allow it if the browser asks.');
  if (facts.isEnded) return said('bad', 'The camera was disconnected', 'End the call or the app that uses it, or plug it in. The page tries again by itself.');
  if (!facts.isVisible) return said('warning', 'This tab is in the background', 'Bring it to the front: browsers stop the camera of hidden tabs.');
  if (facts.isMuted) return said('bad', 'The browser has paused the camera', 'End the call or the app that uses it; unlock the screen.');
  if (facts.line === 'refused') return said('bad', facts.refusal.problem, facts.refusal.remedy);
  if (facts.line === 'connecting') return said('unknown', 'Connecting to the program');
  if (facts.line !== 'open') return said('warning', 'The program does not answer', 'Check that phone-host is running. The page tries again by itself.');
  if (facts.trouble) return said('bad', 'The browser cannot encode a frame', `Choose another size; it says: ${facts.trouble}`);
  if (facts.isTurned) return said('warning', 'The phone was turned', 'Turn it back: a calibration holds for one position.');
  if (facts.told) return said('warning', facts.told);
  if (!facts.isAsked) return said('good', 'Ready: no step needs frames now', 'Go on with the next step.');
  return said('good', 'Streaming', 'Keep this tab in front; the screen stays on.');
}

/** @type {Record<string, string>} */
export const GROUP_WORDS = { focus: 'Focus', exposure: 'Exposure', white_balance: 'White balance', zoom: 'Zoom' };

/** Values of a group in a person's units. @param {string} group @param {Record<string, any>} now - settings of the camera @returns {string} */
export function valuesInWords(group, now) {
  const some = (/** @type {any} */ value, /** @type {(v: number) => string} */ words) => (typeof value === 'number' ? [words(value)] : []);
  const parts = {
    focus: some(now.focusDistance, (v) => (Number.isFinite(v) && v < 1000 ? `${v.toFixed(v < 1 ? 2 : v < 10 ? 1 : 0)} m` : 'far')),
    exposure: [...some(now.exposureTime, (v) => `${(v / 10).toFixed(1)} ms`), ...some(now.iso, (v) => `ISO ${v}`)],
    white_balance: some(now.colorTemperature, (v) => `${v} K`),
    zoom: some(now.zoom, (v) => `${v.toFixed(1)} times`),
  }[group];
  return parts?.join(', ') ?? '';
}
