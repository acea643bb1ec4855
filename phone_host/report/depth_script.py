"""The script of pages that show depth: a pointer reads metres, a cloud can be turned, a command can be copied. Pure.

It is the only script that our pages run. It is the same text on every page, so that a page's policy can name its hash,
and takes all values from attributes (`depth_view` writes them). It loads nothing. The cloud is drawn by the script
itself, with a depth buffer in memory: that needs no graphics processor, and 60 000 points are few.
"""

import base64
import hashlib
from typing import Final

SCRIPT: Final = r"""
'use strict';
const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
const metres = (z, error) => {
  const digits = n => Math.max(0, Math.min(4, n));
  if (!(error > 0)) return z.toFixed(3) + ' m';
  const n = digits(Math.ceil(-Math.log10(error / 2)));
  return z.toFixed(n) + ' m \u00b1 ' + error.toFixed(n) + ' m';
};

function readDepth(root) {
  const m = JSON.parse(root.dataset.view), cells = new Uint16Array(bytes(root.dataset.grid).buffer);
  const readout = root.querySelector('.readout'), sides = [...root.querySelectorAll('[data-side]')];
  const at = [m.width >> 1, m.height >> 1];
  const clamp = (v, most) => Math.max(0, Math.min(most, v));
  function words(x, y, cell) {
    const where = ', x ' + x + ', y ' + y + ' px';
    if (cell === 0) return ['no depth here' + where, NaN];
    if (cell === 1) return ['cut: outside the depth limits' + where, NaN];
    const v = m.low + (cell - 2) / 65533 * (m.high - m.low);
    if (!m.metric) return [v.toFixed(2) + ' px disparity' + where, v];
    const z = 1 / v, d = m.focal * m.baseline / z - m.doffs;
    const error = z * z / (m.focal * m.baseline) * m.error;
    const across = 'X ' + ((x - m.cx) * z / m.focal).toFixed(3) + ' m, Y ' + ((y - m.cy) * z / m.focal).toFixed(3) + ' m';
    return [metres(z, error) + where + ' (' + across + ')', d];
  }
  function show(x, y) {
    const column = clamp(Math.round(x / m.step), m.columns - 1), row = clamp(Math.round(y / m.step), m.rows - 1);
    x = column * m.step; y = row * m.step; at[0] = x; at[1] = y;
    const [text, d] = words(x, y, cells[row * m.columns + column]);
    readout.textContent = text;
    for (const side of sides) {
      const dot = side.querySelector('i'), right = side.dataset.side === 'right';
      const [toX, toY] = right ? m.way : [0, 0], px = toX ? x + toX * d : x, py = toY ? y + toY * d : y;
      dot.hidden = !(px >= 0 && py >= 0 && px < m.width && py < m.height);
      dot.style.left = (px + .5) / m.width * 100 + '%'; dot.style.top = (py + .5) / m.height * 100 + '%';
    }
  }
  for (const side of sides.filter(one => one.dataset.side === 'left')) {
    const point = event => {
      const box = side.getBoundingClientRect();
      show((event.clientX - box.left) / box.width * m.width - .5, (event.clientY - box.top) / box.height * m.height - .5);
    };
    side.addEventListener('pointermove', point);
    side.addEventListener('pointerdown', point);
    side.addEventListener('keydown', event => {
      const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
      if (!way) return;
      event.preventDefault();
      const by = m.step * (event.shiftKey ? 10 : 1);
      show(at[0] + way[0] * by, at[1] + way[1] * by);
    });
  }
}

function turnCloud(root) {
  const m = JSON.parse(root.dataset.view), canvas = root.querySelector('canvas'), pen = canvas.getContext('2d');
  const places = new Uint16Array(bytes(root.dataset.places).buffer), rgb = bytes(root.dataset.colours);
  const n = places.length / 3, xyz = new Float32Array(3 * n), shade = new Uint32Array(n);
  for (let i = 0; i < n; i++) {
    for (let k = 0; k < 3; k++) xyz[3 * i + k] = m.low[k] + places[3 * i + k] / 65535 * (m.high[k] - m.low[k]);
    shade[i] = (255 << 24 | rgb[3 * i + 2] << 16 | rgb[3 * i + 1] << 8 | rgb[3 * i]) >>> 0;
  }
  const views = {front: [0, 0], turned: [.45, .22], side: [1.2, .1], above: [0, 1.2]};
  let yaw, pitch, away, pivot, asked = 0, frame = null, depth = null, pixels = null;
  function reset(name) { [yaw, pitch] = views[name]; away = m.pivot[2] * (name === 'front' ? 1 : 1.25); pivot = [...m.pivot]; draw(); }
  function draw() { if (!asked) asked = requestAnimationFrame(paint); }
  const axes = () => {
    const cy = Math.cos(yaw), sy = Math.sin(yaw), cp = Math.cos(pitch), sp = Math.sin(pitch);
    return [[cy, 0, sy], [sp * sy, cp, -sp * cy], [-cp * sy, sp, cp * cy]];
  };
  const zoom = (w, h) => Math.min(w / m.width, h / m.height) * m.focal;
  function paint() {
    asked = 0;
    const scale = Math.min(window.devicePixelRatio || 1, 1.5);
    const w = Math.max(1, Math.round(canvas.clientWidth * scale)), h = Math.max(1, Math.round(canvas.clientHeight * scale));
    if (!frame || frame.width !== w || frame.height !== h) {
      canvas.width = w; canvas.height = h;
      frame = pen.createImageData(w, h); pixels = new Uint32Array(frame.data.buffer); depth = new Float32Array(w * h);
    }
    pixels.fill(0); depth.fill(Infinity);
    const [a, b, c] = axes(), f = zoom(w, h), spread = m.step * f / m.focal;
    for (let i = 0, j = 0; i < n; i++, j += 3) {
      const x = xyz[j] - pivot[0], y = xyz[j + 1] - pivot[1], z = xyz[j + 2] - pivot[2];
      const q = c[0] * x + c[1] * y + c[2] * z + away;
      if (q < away * .02) continue;
      const u = w / 2 + f * (a[0] * x + a[1] * y + a[2] * z) / q, v = h / 2 + f * (b[0] * x + b[1] * y + b[2] * z) / q;
      const size = Math.max(1, Math.min(10, Math.ceil(1.15 * spread * xyz[j + 2] / q)));
      const left = Math.round(u - size / 2), top = Math.round(v - size / 2);
      if (left < 0 || top < 0 || left + size > w || top + size > h) continue;
      for (let row = top; row < top + size; row++) for (let o = row * w + left, end = o + size; o < end; o++)
        if (q < depth[o]) { depth[o] = q; pixels[o] = shade[i]; }
    }
    pen.putImageData(frame, 0, 0);
    legend(w, h, f, [a, b, c], scale);
    root.dataset.drawn = yaw.toFixed(3) + ' ' + pitch.toFixed(3) + ' ' + away.toFixed(3);
  }
  function legend(w, h, f, turn, scale) {
    const style = getComputedStyle(canvas), ink = style.color;
    // Lines and letters have an edge in the colour of the ground, so that they can be read over points, too.
    const edge = () => { pen.strokeStyle = style.backgroundColor; pen.lineWidth = 5 * scale; };
    const line = hue => { edge(); pen.stroke(); pen.strokeStyle = hue; pen.lineWidth = 2 * scale; pen.stroke(); };
    const write = (text, x, y) => { edge(); pen.strokeText(text, x, y); pen.fillText(text, x, y); };
    pen.font = 12 * scale + 'px system-ui, sans-serif'; pen.lineJoin = pen.lineCap = 'round'; pen.textBaseline = 'middle';
    let length = Math.pow(10, Math.floor(Math.log10(140 * scale * away / f)));
    for (const more of [5, 2]) if (f * length * more / away <= 140 * scale) { length *= more; break; }
    const x = 14 * scale, y = h - 14 * scale, long = f * length / away;
    pen.beginPath(); pen.moveTo(x, y - 4 * scale); pen.lineTo(x, y); pen.lineTo(x + long, y); pen.lineTo(x + long, y - 4 * scale);
    line(ink); pen.fillStyle = ink; pen.textAlign = 'left';
    write(length >= 1 ? length + ' m' : length >= .01 ? Math.round(length * 100) + ' cm' : Math.round(length * 1e4) / 10 + ' mm', x + long + 6 * scale, y - 1);
    const at = [w - 48 * scale, h - 44 * scale], names = ['X', 'Y', 'Z'], hues = ['#e0452f', '#2f9e44', '#3b82f6'];
    pen.textAlign = 'center';
    for (let k = 0; k < 3; k++) {
      const dx = turn[0][k] * 26 * scale, dy = turn[1][k] * 26 * scale;
      pen.beginPath(); pen.moveTo(at[0], at[1]); pen.lineTo(at[0] + dx, at[1] + dy);
      line(hues[k]); pen.fillStyle = hues[k];
      write(names[k], at[0] + dx * 1.4, at[1] + dy * 1.4);
    }
  }
  function pan(dx, dy) {
    const [a, b] = axes(), by = away / zoom(canvas.clientWidth, canvas.clientHeight);
    for (let k = 0; k < 3; k++) pivot[k] -= (a[k] * dx + b[k] * dy) * by;
  }
  function nearer(factor) { away = Math.max(m.pivot[2] * .05, Math.min(m.pivot[2] * 20, away * factor)); }
  function turn(dx, dy) { yaw += dx; pitch = Math.max(-1.57, Math.min(1.57, pitch + dy)); }
  const down = new Map();
  canvas.addEventListener('pointerdown', event => {
    down.set(event.pointerId, [event.clientX, event.clientY]);
    try { canvas.setPointerCapture(event.pointerId); } catch { /* a pointer that is gone already */ }
    canvas.focus({preventScroll: true});
  });
  for (const end of ['pointerup', 'pointercancel', 'lostpointercapture'])
    canvas.addEventListener(end, event => down.delete(event.pointerId));
  canvas.addEventListener('pointermove', event => {
    const before = down.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY], dx = now[0] - before[0], dy = now[1] - before[1];
    if (down.size === 2) {
      const other = [...down].find(([id]) => id !== event.pointerId)[1];
      const reach = p => Math.max(8, Math.hypot(p[0] - other[0], p[1] - other[1]));
      nearer(reach(before) / reach(now)); pan(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons === 2) pan(dx, dy);
    else turn(-dx * .008, dy * .008);
    down.set(event.pointerId, now);
    draw();
  });
  canvas.addEventListener('contextmenu', event => event.preventDefault());
  canvas.addEventListener('wheel', event => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault(); nearer(Math.exp(event.deltaY * .0015)); draw();
  }, {passive: false});
  canvas.addEventListener('dblclick', () => reset('turned'));
  canvas.addEventListener('keydown', event => {
    const way = {ArrowLeft: [-.1, 0], ArrowRight: [.1, 0], ArrowUp: [0, .1], ArrowDown: [0, -.1]}[event.key];
    if (way) turn(...way);
    else if (event.key === '+') nearer(.9);
    else if (event.key === '-') nearer(1.1);
    else return;
    event.preventDefault(); draw();
  });
  for (const button of root.querySelectorAll('button')) button.addEventListener('click', () => reset(button.dataset.to));
  new ResizeObserver(draw).observe(canvas);
  reset('turned');
}

function copyText(button) {
  const source = button.previousElementSibling;
  const said = done => { button.textContent = done ? 'copied' : 'selected: copy it'; };
  const select = () => {
    const range = document.createRange(); range.selectNodeContents(source);
    const chosen = getSelection(); chosen.removeAllRanges(); chosen.addRange(range);
    let done = false;
    try { done = document.execCommand('copy'); } catch { done = false; }
    said(done);
  };
  button.hidden = false;
  button.addEventListener('click', () => {
    if (navigator.clipboard) navigator.clipboard.writeText(source.textContent).then(() => said(true), select);
    else select();
  });
}

document.querySelectorAll('.depthview').forEach(readDepth);
document.querySelectorAll('.cloudview').forEach(turnCloud);
document.querySelectorAll('button.copy').forEach(copyText);
document.documentElement.dataset.ready = 'yes';
"""

HASH: Final = "sha256-" + base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode("ascii")
"""What a page's policy allows: this text and no other."""
