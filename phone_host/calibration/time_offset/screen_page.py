"""The pattern as a page for any browser: self-contained, fills the screen and counts the screen's refreshes. Pure: text out."""

import json

from phone_host.calibration.time_offset.screen import (
    BITS,
    CELL,
    CELL_PLACES,
    COUNT,
    HEIGHT,
    MARKER,
    MARKERS,
    WIDTH,
    marker_bits,
)


def pattern_page() -> str:
    """Make the page.

    The page counts a refresh that the browser skipped by its time, so that the number keeps step with the screen.
    """
    values = {
        "width": WIDTH,
        "height": HEIGHT,
        "marker": MARKER,
        "markers": MARKERS,
        "bits": [(marker_bits(index) // 255).tolist() for index in range(len(MARKERS))],
        "cell": CELL,
        "places": CELL_PLACES,
        "count": COUNT,
        "coded": BITS,
    }
    return _PAGE.replace("VALUES", json.dumps(values))


_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>tandemscan: time pattern</title>
<style>html,body{margin:0;height:100%;background:#fff;overflow:hidden;cursor:none}canvas{display:block;margin:auto}</style></head>
<body><canvas></canvas><script>
"use strict";
const p = VALUES, canvas = document.querySelector("canvas"), pen = canvas.getContext("2d", {alpha: false});
let number = 0, last = 0, refresh = 1000 / 60;
const steps = [];
function draw(now) {
  if (last) {
    const step = now - last;
    if (steps.length < 60 && step > 2) { steps.push(step); refresh = [...steps].sort((a, b) => a - b)[steps.length >> 1]; }
    number = (number + Math.max(1, Math.round(step / refresh))) % p.count;
  }
  last = now;
  const unit = Math.floor(Math.min(innerWidth / p.width, innerHeight / p.height) * devicePixelRatio);
  if (canvas.width !== p.width * unit) {
    canvas.width = p.width * unit; canvas.height = p.height * unit;
    canvas.style.width = canvas.width / devicePixelRatio + "px";
  }
  const box = (x, y, w, h) => pen.fillRect(Math.round(x * unit), Math.round(y * unit), Math.round(w * unit), Math.round(h * unit));
  pen.fillStyle = "#fff"; box(0, 0, p.width, p.height);
  pen.fillStyle = "#000";
  p.markers.forEach(([x, y], index) => p.bits[index].forEach((row, j) => row.forEach((white, i) => { if (!white) box(x + i, y + j, 1, 1); })));
  const code = number ^ (number >> 1);
  for (let bit = 0; bit < p.coded; bit++) if (code >> bit & 1) box(p.places[bit][0], p.places[bit][1], p.cell, p.cell);
  requestAnimationFrame(draw);
}
requestAnimationFrame(draw);
addEventListener("click", () => document.documentElement.requestFullscreen());
</script></body></html>
"""
