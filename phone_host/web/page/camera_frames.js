// Single frames of a camera, in either of the two ways that browsers have.

/** Whether this browser hands over single frames at all. */
export const canHandOver = () => 'OffscreenCanvas' in window && ('MediaStreamTrackProcessor' in window || 'requestVideoFrameCallback' in HTMLVideoElement.prototype);

/** Chromium's way: a stream that the worker reads, without this thread. @param {MediaStreamTrack} track @returns {?ReadableStream<VideoFrame>} null: this browser has no such thing */
export function processorOf(track) {
  const Processor = /** @type {any} */ (window).MediaStreamTrackProcessor;
  return Processor ? new Processor({ track, maxBufferSize: 1 }).readable : null;
}

/** What is told of a picture and what its own timestamp says is the same time, but for rounding. */
const SAME_US = 1000;
/** Times near zero agree whatever their unit. */
const TELLING_US = 100_000;

/**
 * Stamps of pictures that were taken from a video. Under load the picture is a newer one than the callback tells of: its own timestamp is right then.
 * But Firefox 153 counts that in seconds; there what the callback tells is all there is.
 * @returns {(picture: VideoFrame | ImageBitmap, seen: VideoFrameCallbackMetadata) => {timestampUs: number, captureUs: number}}
 */
export function stamping() {
  let isOwnTrue = false;
  return (picture, seen) => {
    const mediaUs = seen.mediaTime * 1e6;
    const ownUs = 'timestamp' in picture ? picture.timestamp : Number.NaN;
    const agree = mediaUs > TELLING_US && Math.abs(ownUs - mediaUs) < SAME_US;
    isOwnTrue ||= agree;
    const isTold = seen.captureTime !== undefined && (agree || !isOwnTrue);
    return { timestampUs: isOwnTrue ? ownUs : mediaUs, captureUs: isTold ? (performance.timeOrigin + Number(seen.captureTime)) * 1000 : Number.NaN };
  };
}

/** Frames by way of a video element, for browsers without MediaStreamTrackProcessor. @param {MediaStream} stream @param {(message: any, moved: Transferable[]) => void} give @returns {() => void} ends it */
export function watch(stream, give) {
  const video = document.createElement('video');
  Object.assign(video, { muted: true, playsInline: true, srcObject: stream });
  const stamps = stamping();
  let isOn = true;
  let last = Number.NaN;
  const next = async (/** @type {number} */ _now, /** @type {VideoFrameCallbackMetadata} */ seen) => {
    if (!isOn) return;
    const callbackUs = (performance.timeOrigin + performance.now()) * 1000;
    video.requestVideoFrameCallback(next);
    try {
      const picture = 'VideoFrame' in window ? new VideoFrame(video) : await createImageBitmap(video);
      const stamp = stamps(picture, seen);
      if (stamp.timestampUs === last) return picture.close(); // a newer callback for the picture that is gone already
      last = stamp.timestampUs;
      give({ do: 'frame', picture, callbackUs, ...stamp }, [picture]);
    } catch {
      // it has no picture just now
    }
  };
  video.requestVideoFrameCallback(next);
  video.play().catch(() => {});
  return () => {
    isOn = false;
    video.srcObject = null;
  };
}
