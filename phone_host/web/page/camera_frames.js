// Single frames of a camera, in either of the two ways that browsers have.

/** Whether this browser hands over single frames at all. */
export const canHandOver = () => 'OffscreenCanvas' in window && ('MediaStreamTrackProcessor' in window || 'requestVideoFrameCallback' in HTMLVideoElement.prototype);

/** Chromium's way: a stream that the worker reads, without this thread. @param {MediaStreamTrack} track @returns {?ReadableStream<VideoFrame>} null: this browser has no such thing */
export function processorOf(track) {
  const Processor = /** @type {any} */ (window).MediaStreamTrackProcessor;
  return Processor ? new Processor({ track, maxBufferSize: 1 }).readable : null;
}

/** Frames by way of a video element, for browsers without MediaStreamTrackProcessor. @param {MediaStream} stream @param {(message: any, moved: Transferable[]) => void} give @returns {() => void} ends it */
export function watch(stream, give) {
  const video = document.createElement('video');
  Object.assign(video, { muted: true, playsInline: true, srcObject: stream });
  let isOn = true;
  const next = async (/** @type {number} */ _now, /** @type {VideoFrameCallbackMetadata} */ seen) => {
    if (!isOn) return;
    const callbackUs = (performance.timeOrigin + performance.now()) * 1000;
    video.requestVideoFrameCallback(next);
    const captureUs = seen.captureTime === undefined ? Number.NaN : (performance.timeOrigin + seen.captureTime) * 1000;
    try {
      const picture = 'VideoFrame' in window ? new VideoFrame(video) : await createImageBitmap(video);
      // Not the picture's own timestamp: Firefox 153 counts it in seconds, Chromium's is this very time.
      give({ do: 'frame', picture, timestampUs: seen.mediaTime * 1e6, captureUs, callbackUs }, [picture]);
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
