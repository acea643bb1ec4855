// Turns cells of a disparity grid into metres, and metres into words. Pure; the live page and the static pages share it.

/**
 * @typedef {object} Geometry  z = focal * baseline / (disparity + doffs)
 * @property {number} focal - px
 * @property {number} baseline - m
 * @property {number} doffs - px
 * @property {number} cx - px
 * @property {number} cy - px
 * @property {number} error - standard uncertainty of a disparity, px; 0: not known
 */

/**
 * @typedef {object} Grid  disparities of every `step`-th pixel of the left image
 * @property {Uint16Array} cells - row by row: below `first` there is no depth, from there on low + (cell - first) / scale px
 * @property {number} columns
 * @property {number} rows
 * @property {number} step - px of the full image
 * @property {number} low - px
 * @property {number} scale - steps per px
 * @property {number} first
 * @property {number} width - of the full image, px
 * @property {number} height - px
 */

/** @typedef {[number, number, number]} Place  X right, Y down, Z forward of the left camera, m */

/**
 * @typedef {object} Limits
 * @property {?number} near - m; null: none
 * @property {?number} far - m; null: none
 */

/** @param {Grid} grid @param {number} cell @returns {number} px; NaN: none */
export const disparityOf = (grid, cell) => (cell < grid.first ? NaN : grid.low + (cell - grid.first) / grid.scale);

/** @param {Geometry} geometry @param {number} d - px @returns {number} m; NaN: none */
export function depthOf(geometry, d) {
  const whole = d + geometry.doffs;
  return whole > 0 ? (geometry.focal * geometry.baseline) / whole : NaN;
}

/** @param {Geometry} geometry @param {number} z - m @returns {number} px */
export const disparityAt = (geometry, z) => (geometry.focal * geometry.baseline) / z - geometry.doffs;

/** @param {Geometry} geometry @param {number} z - m @returns {number} its standard uncertainty, m; 0: not known */
export const sigmaOf = (geometry, z) => ((z * z) / (geometry.focal * geometry.baseline)) * geometry.error;

/** @param {Geometry} geometry @param {number} x - px @param {number} y - px @param {number} z - m @returns {Place} */
export const placeOf = (geometry, x, y, z) => [((x - geometry.cx) * z) / geometry.focal, ((y - geometry.cy) * z) / geometry.focal, z];

/**
 * The cell of a pixel.
 * @param {Grid} grid @param {number} x - px of the full image @param {number} y - px
 * @returns {{column: number, row: number, cell: number, d: number}}
 */
export function cellAt(grid, x, y) {
  const within = (/** @type {number} */ v, /** @type {number} */ most) => Math.max(0, Math.min(most, Math.round(v / grid.step)));
  const column = within(x, grid.columns - 1);
  const row = within(y, grid.rows - 1);
  const cell = grid.cells[row * grid.columns + column];
  return { column, row, cell, d: disparityOf(grid, cell) };
}

/** @param {number} a @param {Limits} limits @returns {boolean} whether this depth is kept */
export const isKept = (a, limits) => a >= (limits.near ?? 0) && a <= (limits.far ?? Infinity);

/** Length of a vector, m. @param {number[]} v @returns {number} */
export const lengthOf = (v) => Math.hypot(...v);

/** Digits after the point that an uncertainty deserves. @param {number} sigma @returns {number} */
const digits = (sigma) => (sigma > 0 ? Math.max(0, Math.min(4, Math.ceil(-Math.log10(sigma / 2)))) : 3);

/** Metres with uncertainty. @param {number} value - m @param {number} sigma - m; 0: not known @returns {string} */
export function metres(value, sigma) {
  const n = digits(sigma);
  return sigma > 0 ? `${value.toFixed(n)} m \u00b1 ${sigma.toFixed(n)} m` : `${value.toFixed(n)} m`;
}

/** Millimetres with uncertainty. @param {number} value - m @param {?number} sigma - m; null or 0: not known @returns {string} */
export function millimetres(value, sigma) {
  const n = sigma ? Math.min(2, digits(sigma * 1000)) : 0;
  const text = (value * 1000).toFixed(n);
  return sigma ? `${text} mm \u00b1 ${(sigma * 1000).toFixed(n)} mm` : `${text} mm`;
}

/** A round length for labels. @param {number} z - m @returns {string} */
export const roundMetres = (z) => `${Number(z.toPrecision(3))} m`;

/**
 * Round depths between two, for a scale's marks.
 * @param {number} near - m, above 0 @param {number} far - m @param {number} [most]
 * @returns {number[]}
 */
export function roundDepths(near, far, most = 6) {
  if (far < 4 * near) return evenTicks(near, far, most);
  /** @type {number[]} */
  let found = [];
  for (const factors of [[1, 1.5, 2, 3, 5, 7], [1, 2, 5], [1, 3], [1]]) {
    found = [];
    for (let power = Math.floor(Math.log10(near)); power <= Math.ceil(Math.log10(far)); power++)
      for (const factor of factors) found.push(Number((factor * 10 ** power).toPrecision(3)));
    found = found.filter((z) => z >= near && z <= far);
    if (found.length <= most) break;
  }
  return found;
}

/** Round numbers at even distances. @param {number} low @param {number} high @param {number} most @returns {number[]} */
export function evenTicks(low, high, most) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * ([1, 2, 2.5, 5, 10].find((each) => each * power >= rough) ?? 10);
  /** @type {number[]} */
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-12; k++) found.push(Number((k * step).toPrecision(6)));
  return found;
}

/**
 * The colours' ends: they stay until the picture really changed, so that nothing flickers.
 * @param {?[number, number]} shown @param {[number, number]} wanted
 * @returns {[number, number]}
 */
export function steadyRange(shown, wanted) {
  if (!shown) return wanted;
  const span = Math.max(1e-9, wanted[1] - wanted[0]);
  const off = Math.max(Math.abs(shown[0] - wanted[0]), Math.abs(shown[1] - wanted[1]));
  return off > 0.12 * span ? wanted : shown;
}

/** The share of the middle's points that is nearer than where a cloud is turned around: things stand before walls. */
const NEARER = 0.3;

/**
 * Where a cloud is turned around: on the ray through the picture's middle, at the depth of what stands there.
 * @param {Grid} grid @param {Geometry} geometry @param {Limits} limits
 * @returns {?Place} null: nothing has depth
 */
export function middleOf(grid, geometry, limits) {
  for (const part of [0.6, 1]) {
    const found = places(grid, geometry, limits, part).map(([, , z]) => z).sort((a, b) => a - b);
    if (found.length > 20 || (part === 1 && found.length))
      return placeOf(geometry, (grid.width - 1) / 2, (grid.height - 1) / 2, found[Math.floor(NEARER * found.length)]);
  }
  return null;
}

/**
 * Points of about 60 x 60 cells of the picture's middle.
 * @param {Grid} grid @param {Geometry} geometry @param {Limits} limits @param {number} [part] - of width and height
 * @returns {Place[]}
 */
export function places(grid, geometry, limits, part = 1) {
  /** @type {Place[]} */
  const found = [];
  const [columns, rows] = [grid.columns * part, grid.rows * part];
  const [left, top] = [Math.floor((grid.columns - columns) / 2), Math.floor((grid.rows - rows) / 2)];
  const by = Math.max(1, Math.floor(Math.min(columns, rows) / 60));
  for (let row = top; row < top + rows && row < grid.rows; row += by)
    for (let column = left; column < left + columns && column < grid.columns; column += by) {
      const z = depthOf(geometry, disparityOf(grid, grid.cells[row * grid.columns + column]));
      if (isKept(z, limits)) found.push(placeOf(geometry, column * grid.step, row * grid.step, z));
    }
  return found;
}

/** The share of the points that may lie beyond each edge of a view that shows all: they are mistakes of the matcher. */
const STRAY = 0.005;

/**
 * Where a camera has to stand to see all points, along one axis of its picture.
 * @param {{across: number, away: number}[]} points - beside the view's axis, and along it @param {number} reach - tangent of half its angle
 * @param {number} stray - the share of them that may lie beyond each edge
 * @returns {{aside: number, back: number}} how far it stands aside and back
 */
export function fitted(points, reach, stray = STRAY) {
  const edge = (/** @type {number} */ sign, /** @type {number} */ share) => {
    const all = points.map(({ across, away }) => across + sign * reach * away).sort((a, b) => a - b);
    return all[Math.round(share * (all.length - 1))];
  };
  const [low, high] = [edge(1, stray), edge(-1, 1 - stray)];
  return { aside: (low + high) / 2, back: (high - low) / (2 * reach) };
}
