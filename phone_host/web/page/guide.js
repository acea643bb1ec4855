// The live calibration: what the cameras see, what the views cover so far, what to show next, and how good it is by now. From guide.json.

import { byId, data, keep, make, say, sentence, show, text } from './dom.js';

/** Corners of a cell for the strongest colour: about three views (as in guide.svg). */
const FULL = 36;

/** The newest pictures of the calibration that goes on. @type {?import('./message.js').Pair} */
let seen = null;

/** Take the newest pictures. @param {import('./message.js').Pair} pair - its bitmaps are ours from now on @param {any} state */
export function seePictures(pair, state) {
  seen?.left?.close();
  seen?.right?.close();
  seen = pair;
  showGuide(state);
}

/**
 * The picture with what is known of it: covered cells, and the board.
 * @param {HTMLCanvasElement} canvas @param {any} camera - of guide.json; null: the board is not known yet @param {?ImageBitmap} picture
 */
function paint(canvas, camera, picture) {
  const width = 480;
  const of = camera ?? picture;
  const height = Math.round((width * of.height) / of.width);
  if (canvas.width !== 2 * width || canvas.height !== 2 * height) [canvas.width, canvas.height] = [2 * width, 2 * height];
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  const style = getComputedStyle(canvas);
  const [good, line, mark] = ['--c2', '--line', '--c4'].map((name) => style.getPropertyValue(name));
  pen.setTransform(2, 0, 0, 2, 0, 0);
  pen.clearRect(0, 0, width, height);
  if (picture) pen.drawImage(picture, 0, 0, width, height);
  if (!camera) return;
  const [rows, columns] = [camera.cells.length, camera.cells[0].length];
  const [w, h] = [width / columns, height / rows];
  camera.cells.forEach((/** @type {number[]} */ row, /** @type {number} */ y) =>
    row.forEach((count, x) => {
      pen.globalAlpha = (picture ? 0.45 : 0.85) * Math.min(1, count / FULL);
      pen.fillStyle = good;
      pen.fillRect(x * w, y * h, w, h);
      pen.globalAlpha = picture ? 0.2 : 1;
      pen.strokeStyle = line;
      pen.strokeRect(x * w + 0.5, y * h + 0.5, w - 1, h - 1);
    }),
  );
  pen.globalAlpha = 1;
  if (!camera.board_now.length) return;
  pen.beginPath();
  for (const [x, y] of camera.board_now) pen.lineTo(x * width, y * height);
  pen.closePath();
  pen.lineWidth = 3;
  pen.strokeStyle = mark;
  pen.stroke();
}

/** Shares of covered cells. @param {any} camera @returns {number} 0 .. 1 */
export function coveredShare(camera) {
  const cells = camera.cells.flat();
  return cells.filter((/** @type {number} */ count) => count > 0).length / cells.length;
}

/** @param {any} guide @returns {[string, string][]} names and values of the figures */
export function figuresOf(guide) {
  const error = guide.depth_error_at_1_m_mm;
  const after = guide.depth_error_after_next_view_mm;
  return [
    ['views', `${guide.views} of at most ${guide.most_views}`],
    ['depth error at 1 m', error === null ? 'not known yet' : `${error.toFixed(2)} mm`],
    ['after the next view', after === null ? 'not known yet' : `${after.toFixed(2)} mm`],
    ['chessboard', guide.board ?? 'not recognised yet'],
  ];
}

/** A verdict is that of a rig only if one was computed. @param {any} guide @returns {string} */
function headOf(guide) {
  if (guide.state === 'stopped') return 'No calibration was made.';
  return guide.verdict ? `Done: ${guide.verdict}.` : 'Ended.';
}

const VERDICTS = /** @type {Record<string, string>} */ ({ good: 'good', usable: 'warning', reject: 'bad' });

/** @param {any} state */
export function showGuide(state) {
  const { guide } = state;
  const pictures = state.activity === 'calibrating' && seen?.head.begun === state.begun ? seen : null;
  show(byId('guide'), !!guide);
  if (!guide) return;
  const isOver = !!guide.result;
  text(byId('guide-words'), isOver ? headOf(guide) : sentence(guide.words || 'show the board to both cameras'));
  text(byId('guide-note'), sentence(guide.result || guide.note || ''));
  show(byId('guide-wish'), !isOver);
  if (state.activity === 'calibrating' && guide.words) say(guide.words);
  const verdict = byId('guide-verdict');
  data(verdict, 'level', VERDICTS[guide.verdict ?? ''] ?? 'unknown');
  text(verdict, guide.verdict ? `so far: ${guide.verdict}` : 'no verdict yet');
  text(byId('guide-remedy'), guide.remedy ? sentence(`to improve: ${guide.remedy}`) : '');
  for (const side of ['left', 'right']) {
    const camera = guide.cameras[side] ?? null;
    const picture = pictures?.[/** @type {'left' | 'right'} */ (side)] ?? null;
    const canvas = /** @type {HTMLCanvasElement} */ (byId(`guide-${side}`));
    show(/** @type {HTMLElement} */ (canvas.parentElement), !!camera || !!picture);
    if (!camera && !picture) continue;
    paint(canvas, isOver && camera ? { ...camera, board_now: [] } : camera, picture);
    canvas.setAttribute('aria-label', `${side} picture: ${camera ? Math.round(100 * coveredShare(camera)) : 0} percent of it covered`);
  }
  keep(byId('guide-figures'), figuresOf(guide), ([name]) => name, () => make('div', '', make('dt'), make('dd')), (item, [name, value]) => {
    text(item.children[0], name);
    text(item.children[1], value);
  });
  keep(byId('guide-wanted'), guide.wanted, (/** @type {string} */ want) => want, () => make('li'), (item, /** @type {string} */ want) => {
    text(item, want);
    item.classList.toggle('now', want === guide.asked);
  });
}
