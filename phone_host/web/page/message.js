// Takes apart what the server sends: JSON text, and pairs as binary messages. Decodes pictures and disparities.

/** @typedef {import('./depth.js').Grid} Grid */
/** @typedef {import('./depth.js').Geometry} Geometry */
/** @typedef {{name: string, type: string, bytes: number, width: number, height: number, step: number, low: number, scale: number}} Part */

/**
 * @typedef {object} PairHead
 * @property {number} number
 * @property {number} begun - number of its run
 * @property {number} width - of the full images, px
 * @property {number} height
 * @property {Part[]} parts
 * @property {?Geometry} geometry
 * @property {?number} near - m
 * @property {?number} far - m
 * @property {?[number, number]} range - darkest and brightest disparity, px; null: a pair without depth
 * @property {[number, number]} way - where a point lies in the right picture, in disparities
 * @property {Record<string, number>} ledger - delays, ms
 */

/**
 * @typedef {object} Pair
 * @property {PairHead} head
 * @property {?ImageBitmap} left
 * @property {?ImageBitmap} right
 * @property {?Grid} grid
 */

/**
 * Split a binary message.
 * @param {ArrayBuffer} buffer - header length (uint32, little endian), header (JSON), parts in the header's order
 * @returns {{head: PairHead, bodies: Uint8Array[]}}
 * @throws {RangeError} if it is shorter than its header says
 */
export function split(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const bodies = head.parts.map((/** @type {Part} */ part) => {
    const body = new Uint8Array(buffer, at, part.bytes);
    at += part.bytes;
    return body;
  });
  return { head, bodies };
}

/** @param {Uint8Array} bytes @returns {Promise<Uint8Array>} */
export async function inflate(bytes) {
  const stream = new Blob([/** @type {BlobPart} */ (bytes)]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** @param {Uint8Array} bytes - little endian @returns {Uint16Array} */
export function cellsOf(bytes) {
  return new Uint16Array(bytes.byteOffset % 2 ? bytes.slice().buffer : bytes.buffer, bytes.byteOffset % 2 ? 0 : bytes.byteOffset, bytes.length >> 1);
}

/** @param {PairHead} head @param {Part} part @param {Uint8Array} body @returns {Promise<Grid>} */
async function gridOf(head, part, body) {
  const cells = cellsOf(part.type === 'u16+deflate' ? await inflate(body) : body);
  return {
    cells, columns: part.width, rows: part.height, step: part.step, low: part.low, scale: part.scale, first: 1,
    width: head.width, height: head.height,
  };
}

/**
 * Decode a pair: pictures and disparities at the same time.
 * @param {ArrayBuffer} buffer @returns {Promise<Pair>}
 */
export async function decode(buffer) {
  const { head, bodies } = split(buffer);
  /** @param {string} name */
  const picture = (name) => {
    const at = head.parts.findIndex((part) => part.name === name);
    return at < 0 ? null : createImageBitmap(new Blob([/** @type {BlobPart} */ (bodies[at])], { type: head.parts[at].type }), { colorSpaceConversion: 'none' });
  };
  const at = head.parts.findIndex((part) => part.name === 'disparity');
  const grid = at < 0 ? null : gridOf(head, head.parts[at], bodies[at]);
  const [left, right, found] = await Promise.all([picture('left'), picture('right'), grid]);
  return { head, left, right, grid: found };
}
