// Opens this browser's camera: which one, in which of its sizes, at which rate. Never scaled or cropped: that would change the lens.

/** @typedef {{device?: string, width?: ?number, height?: ?number, fps?: ?number}} Choice - what is absent is chosen here */
/** @typedef {{stream: MediaStream, track: MediaStreamTrack, base: MediaTrackConstraints, words: string}} Opened - words: what is other than asked; may be empty */

/** Sizes that cameras have, px. The first is what a scan is made with. */
const SIZES = [[640, 480], [800, 600], [1280, 720], [1280, 960], [1920, 1080]];
const RATES = [10, 15, 24, 30, 60];
const USUAL = { width: 640, height: 480, fps: 30 };

/** What the tries are called, from what is wanted to what can be had. */
const NO_SUCH_SIZE = 'the camera does not have this size';
const OTHER_CAMERA = 'the chosen camera is not there';

/** Browsers leave out what they cannot tell. @param {MediaStreamTrack} track @returns {any} */
export const capabilitiesOf = (track) => track.getCapabilities?.() ?? {};

/** @param {Choice} choice @param {'exact' | 'ideal'} how @returns {MediaTrackConstraints} */
function constraints({ device, width, height, fps }, how) {
  const none = /** @type {any} */ (navigator.mediaDevices.getSupportedConstraints()).resizeMode ? { resizeMode: how === 'exact' ? { exact: 'none' } : 'none' } : {};
  return {
    ...(device ? { deviceId: { exact: device } } : { facingMode: { ideal: 'environment' } }),
    width: { [how]: width ?? USUAL.width },
    height: { [how]: height ?? USUAL.height },
    frameRate: { ideal: fps ?? USUAL.fps },
    ...none,
  };
}

/**
 * Open the camera as chosen, or as near to that as it can.
 * @param {Choice} choice @returns {Promise<Opened>}
 * @throws {DOMException} of getUserMedia: NotAllowedError, NotFoundError, NotReadableError, ...
 */
export async function openCamera(choice) {
  /** @type {[Choice, 'exact' | 'ideal', string][]} */
  const tries = [[choice, 'exact', ''], [choice, 'ideal', NO_SUCH_SIZE]];
  if (choice.device) tries.push([{ ...choice, device: '' }, 'exact', OTHER_CAMERA], [{ ...choice, device: '' }, 'ideal', `${OTHER_CAMERA}, and ${NO_SUCH_SIZE}`]);
  for (const [each, how, words] of tries) {
    const base = constraints(each, how);
    try {
      const stream = await navigator.mediaDevices.getUserMedia({ video: base, audio: false });
      return { stream, track: stream.getVideoTracks()[0], base, words };
    } catch (error) {
      const isLast = each === tries[tries.length - 1][0] && how === 'ideal';
      if (isLast || /** @type {DOMException} */ (error).name !== 'OverconstrainedError') throw error;
    }
  }
  throw new DOMException('no camera', 'NotFoundError');
}

/** Cameras by their names, as far as the browser tells them. @returns {Promise<{id: string, name: string}[]>} */
export async function cameras() {
  const devices = (await navigator.mediaDevices.enumerateDevices()).filter((one) => one.kind === 'videoinput' && one.deviceId);
  return devices.map((one, k) => ({ id: one.deviceId, name: one.label || `camera ${k + 1}` }));
}

/** @param {any} capabilities @param {any} settings - what is, always among them @returns {[number, number][]} sizes to offer, px */
export function sizesOf(capabilities, settings) {
  const [widest, highest] = [capabilities.width?.max ?? Infinity, capabilities.height?.max ?? Infinity];
  const sizes = SIZES.filter(([w, h]) => Math.max(w, h) <= Math.max(widest, highest) && Math.min(w, h) <= Math.min(widest, highest));
  const [w, h] = [Math.max(settings.width ?? 0, settings.height ?? 0), Math.min(settings.width ?? 0, settings.height ?? 0)];
  if (w && !sizes.some((each) => each[0] === w && each[1] === h)) sizes.push([w, h]);
  return /** @type {[number, number][]} */ (sizes.sort((a, b) => a[0] * a[1] - b[0] * b[1]));
}

/** @param {any} capabilities @param {number} now - always among them, 1/s @returns {number[]} rates to offer, 1/s */
export function ratesOf(capabilities, now) {
  const rates = RATES.filter((rate) => rate <= (capabilities.frameRate?.max ?? 30) + 0.5);
  return rates.includes(now) ? rates : [...rates, now].sort((a, b) => a - b);
}

/** Longest exposure that a stamp should account for, µs; 0: unknown. @param {any} settings */
export const exposureOf = (settings) => (settings.exposureTime > 0 ? Math.round(100 * settings.exposureTime) : 0);

/** By how much the browser has turned the pictures, so that they stand upright. @returns {0 | 90 | 180 | 270} */
export const rotation = () => /** @type {any} */ (screen.orientation?.angle ?? 0);
