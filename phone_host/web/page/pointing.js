// Pointer and keys on a picture, as pixels of the full left image. Taps, hovering, dragged rectangles.

/** @typedef {{x: number, y: number}} Spot */

/** A tap moves less than this, px of the screen. */
const STILL_PX = 8;

/**
 * @param {HTMLElement} frame - around the picture; takes the focus
 * @param {() => {width: number, height: number}} size - of the full image, px
 * @param {object} told
 * @param {(at: Spot) => void} told.hover
 * @param {(at: Spot) => void} told.tap
 * @param {(from: Spot, to: Spot, done: boolean) => boolean} told.drag - whether dragging means something now
 * @param {() => void} told.clear
 */
export function pointing(frame, size, told) {
  /** @type {?{at: Spot, x: number, y: number}} */
  let down = null;
  const cursor = { x: NaN, y: NaN };
  const spot = (/** @type {PointerEvent} */ event) => {
    const box = frame.getBoundingClientRect();
    const { width, height } = size();
    const share = (/** @type {number} */ v) => Math.max(0, Math.min(1, v));
    return { x: share((event.clientX - box.left) / box.width) * width - 0.5, y: share((event.clientY - box.top) / box.height) * height - 0.5 };
  };
  frame.addEventListener('pointerdown', (event) => {
    down = { at: spot(event), x: event.clientX, y: event.clientY };
    if (told.drag(down.at, down.at, false)) frame.setPointerCapture(event.pointerId);
  });
  frame.addEventListener('pointermove', (event) => {
    if (down && told.drag(down.at, spot(event), false)) return;
    if (event.pointerType === 'mouse') told.hover(spot(event));
  });
  frame.addEventListener('pointerup', (event) => {
    if (!down) return;
    const still = Math.hypot(event.clientX - down.x, event.clientY - down.y) < STILL_PX;
    const { at } = down;
    down = null;
    if (!told.drag(at, spot(event), true) && still) told.tap(at);
  });
  frame.addEventListener('pointercancel', () => (down = null));
  frame.addEventListener('keydown', (event) => {
    const { width, height } = size();
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (event.key === 'Enter' || event.key === ' ') told.tap(cursor);
    else if (event.key === 'Escape') told.clear();
    else if (way) {
      const by = Math.max(1, width / 160) * (event.shiftKey ? 8 : 1);
      if (Number.isNaN(cursor.x)) Object.assign(cursor, { x: width / 2, y: height / 2 });
      cursor.x = Math.max(0, Math.min(width - 1, cursor.x + way[0] * by));
      cursor.y = Math.max(0, Math.min(height - 1, cursor.y + way[1] * by));
      told.hover(cursor);
    } else return;
    event.preventDefault();
  });
  frame.addEventListener('focus', () => {
    if (Number.isNaN(cursor.x)) Object.assign(cursor, { x: size().width / 2 - 0.5, y: size().height / 2 - 0.5 });
  });
}

/**
 * Put something at a pixel of the full image.
 * @param {HTMLElement} mark @param {Spot} at @param {{width: number, height: number}} size
 */
export function put(mark, at, size) {
  mark.style.left = `${((at.x + 0.5) / size.width) * 100}%`;
  mark.style.top = `${((at.y + 0.5) / size.height) * 100}%`;
}
