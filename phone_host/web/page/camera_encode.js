// A frame's bytes: as JPEG, or its luma as it is. Which of the two costs less is measured in the first frames.

/** Room for the header in front of the payload, so that a frame is one message without a copy. */
export const HEADER_BYTES = 64;

/** What bytes cost through a WebSocket into a program on the same machine: 22 µs a KB, measured at 307 and 922 KB a frame. */
const MS_PER_BYTE = 22e-6;
/** Luma has to gain a tenth: a change for nothing would cost the program its settled decoder. */
const GAIN = 0.9;
/** Frames of each kind that are measured. The first makes buffers and is slow. */
const TRIES = 5;
/** Memory comes in steps, so that a frame that is a little larger than the last one fits as well. */
const STEP_BYTES = 65_536;
const PLANAR = /^(I4\d\dA?|NV12)$/;

/** @typedef {'jpeg' | 'luma'} Encoding */
/** @typedef {{encoding: Encoding, width: number, height: number, message: Uint8Array}} Encoded - the message's first `HEADER_BYTES` are free */
/** @typedef {VideoFrame | ImageBitmap} Picture */

/** BT.601, as the cameras' own luma. @param {Uint8ClampedArray} rgba @param {Uint8Array} luma */
export function lumaOf(rgba, luma) {
  for (let k = 0, at = 0; k < luma.length; k += 1, at += 4) luma[k] = (77 * rgba[at] + 150 * rgba[at + 1] + 29 * rgba[at + 2] + 128) >> 8;
}

/** Whether the first plane of a frame is its luma, 8 bits each, upright. @param {Picture} picture */
function isPlanar(picture) {
  const frame = /** @type {any} */ (picture);
  return PLANAR.test(frame.format ?? '') && !frame.rotation && !frame.flip;
}

/** @param {Picture} picture @returns {[number, number]} px, as it is drawn */
const sizeOf = (picture) => ('displayWidth' in picture ? [picture.displayWidth, picture.displayHeight] : [picture.width, picture.height]);

export class Encoder {
  /** @param {boolean} isNear - the program runs on this machine: elsewhere only bytes count, so JPEG */
  constructor(isNear) {
    this.isNear = isNear;
    this.quality = 0.9;
    /** @type {?Encoding} what the program wants */
    this.wanted = null;
    /** @type {?Encoding} what costs less; null: not known yet */
    this.chosen = null;
    /** @type {Record<Encoding, number[]>} costs of the first frames, ms */
    this.costs = { jpeg: [], luma: [] };
    /** @type {OffscreenCanvas[]} */
    this.canvases = [];
    /** @type {ArrayBuffer[]} */
    this.buffers = [];
  }

  /** @param {{encoding?: ?string, quality?: ?number}} want */
  want({ encoding, quality }) {
    this.wanted = encoding === 'jpeg' || encoding === 'luma' ? encoding : null;
    if (quality && quality > 0 && quality <= 1) this.quality = quality;
  }

  /** @param {Picture} picture @returns {Encoding} how this one is encoded */
  next(picture) {
    if (this.wanted) return this.wanted;
    if (!this.isNear || !isPlanar(picture)) return 'jpeg';
    return this.chosen ?? (this.costs.jpeg.length <= this.costs.luma.length ? 'jpeg' : 'luma');
  }

  /**
   * Encode a picture and close it at once: a camera has few buffers.
   * @param {Picture} picture @returns {Promise<Encoded>} its message is valid until it is given to `done`
   */
  async encode(picture) {
    const encoding = this.next(picture);
    const begun = performance.now();
    const encoded = encoding === 'luma' ? await this.luma(picture) : await this.jpeg(picture);
    if (!this.wanted && !this.chosen && this.isNear) this.learn(encoding, performance.now() - begun + MS_PER_BYTE * encoded.message.length);
    return encoded;
  }

  /** The message was sent: its memory serves the next one. @param {Encoded} encoded */
  done({ message }) {
    if (this.buffers.length < 2) this.buffers.push(/** @type {ArrayBuffer} */ (message.buffer));
  }

  /** @param {Encoding} encoding @param {number} ms */
  learn(encoding, ms) {
    this.costs[encoding].push(ms);
    const { jpeg, luma } = this.costs;
    // The least of each: whatever else the machine does only adds.
    if (jpeg.length > TRIES && luma.length > TRIES) this.chosen = Math.min(...luma) < GAIN * Math.min(...jpeg) ? 'luma' : 'jpeg';
  }

  /** @param {Picture} picture @returns {Promise<Encoded>} */
  async jpeg(picture) {
    const [width, height] = sizeOf(picture);
    const canvas = this.drawn(picture, width, height);
    try {
      const blob = await canvas.convertToBlob({ type: 'image/jpeg', quality: this.quality });
      const message = this.room(blob.size);
      message.set(new Uint8Array(await blob.arrayBuffer()), HEADER_BYTES);
      return { encoding: 'jpeg', width, height, message };
    } finally {
      this.canvases.push(canvas);
    }
  }

  /** @param {Picture} picture @returns {Promise<Encoded>} */
  async luma(picture) {
    if (isPlanar(picture)) return this.plane(/** @type {VideoFrame} */ (picture));
    const [width, height] = sizeOf(picture);
    const canvas = this.drawn(picture, width, height);
    const { data } = pen(canvas).getImageData(0, 0, width, height);
    this.canvases.push(canvas);
    const message = this.room(width * height);
    lumaOf(data, message.subarray(HEADER_BYTES));
    return { encoding: 'luma', width, height, message };
  }

  /** The first plane; the others are copied behind it and not sent. @param {VideoFrame} frame @returns {Promise<Encoded>} */
  async plane(frame) {
    const { width, height } = /** @type {DOMRectReadOnly} */ (frame.visibleRect);
    try {
      const whole = this.room(frame.allocationSize());
      const [{ offset, stride }] = await frame.copyTo(whole.subarray(HEADER_BYTES));
      const message = whole.subarray(0, HEADER_BYTES + width * height);
      for (let y = 0; (offset || stride !== width) && y < height; y += 1) {
        const from = HEADER_BYTES + offset + y * stride;
        whole.copyWithin(HEADER_BYTES + y * width, from, from + width);
      }
      return { encoding: 'luma', width, height, message };
    } finally {
      frame.close();
    }
  }

  /** @param {Picture} picture @param {number} width @param {number} height @returns {OffscreenCanvas} ours until it is pushed back */
  drawn(picture, width, height) {
    const canvas = this.canvases.pop() ?? new OffscreenCanvas(width, height);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    try {
      pen(canvas).drawImage(picture, 0, 0, width, height);
    } finally {
      picture.close();
    }
    return canvas;
  }

  /** @param {number} bytes - of the payload @returns {Uint8Array} */
  room(bytes) {
    const needed = HEADER_BYTES + bytes;
    const kept = this.buffers.pop();
    const buffer = kept && kept.byteLength >= needed ? kept : new ArrayBuffer(Math.ceil(needed / STEP_BYTES) * STEP_BYTES);
    return new Uint8Array(buffer, 0, needed);
  }
}

/** Pixels are read back from every picture: not by way of a graphics processor. @param {OffscreenCanvas} canvas */
const pen = (canvas) => /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d', { alpha: false, willReadFrequently: true }));
