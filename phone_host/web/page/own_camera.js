// Whether this browser is to be the camera. What that takes is loaded only then.

import { byId, show } from './dom.js';

/** @typedef {{show: (state: any) => void}} Shown */

/** @type {?Promise<Shown>} */
let loading = null;

/** @param {any} state @returns {boolean} whether the camera that was chosen is a browser's */
export const isBrowsers = (state) => /^browser:/.test(state.settings.camera ?? '');

/** @param {any} state */
export function showOwnCamera(state) {
  const isHere = isBrowsers(state);
  show(byId('own'), isHere);
  // Beside a run there is no step for it: it stands above the run.
  const place = byId(state.steps.length ? 'panel-camera' : 'panel-run');
  if (isHere && !place.contains(byId('own'))) {
    place.prepend(byId('own'));
    // It stands before the depth: open only as long as there is none.
    /** @type {HTMLDetailsElement} */ (byId('own-fold')).open = !state.live?.pairs;
  }
  if (isHere && !loading && (document.body.dataset.step === 'camera' || !state.steps.length || wasOn()))
    loading = import('./camera.js').then(({ CameraBox }) => new CameraBox(wasOn()));
  loading?.then((box) => box.show(state));
}

/** Whether this tab was the camera before it was loaded again. @returns {boolean} */
function wasOn() {
  try {
    return sessionStorage.getItem('camera') === 'on';
  } catch {
    return false;
  }
}
