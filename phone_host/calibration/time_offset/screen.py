"""Measures the time offset with a screen that counts its own refreshes in a pattern that both cameras film.

The pattern has four ArUco markers in the corners, by which it is found, and twelve cells between them: the Gray code of
the refresh number. A frame whose exposure sees two refreshes therefore shows one number or the other. The screen's
clock need not be known, because both cameras' stamps are compared with the same count. A number stands for a whole
refresh (16.7 ms at 60 Hz). The extremes show where within it a frame falls: a camera that drifts against the screen
sees each number from its first to its last moment. A camera that keeps step does not; the uncertainty then covers what
remains open.
"""

import json
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.time_offset.shots import Measured, Method, Times, period_s, require_shots, rolling_s
from phone_host.model import Image, TimeOffset

BITS: Final = 12
COUNT: Final = 1 << BITS
WIDTH, HEIGHT = 26, 18
"""Size of the pattern in units; all places below are in units from its upper left corner."""

MARKER: Final = 6
MARKERS: Final = ((1, 1), (19, 1), (1, 11), (19, 11))
"""Upper left corners of the markers 0 to 3 of the dictionary 4X4_50, six units wide with their black border."""

CELL: Final = 3.0
CELL_PLACES: Final = tuple((8.25 + 3.25 * (bit % 3), 1.5 + 3.75 * (bit // 3)) for bit in range(BITS))

_DICTIONARY: Final = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
_LEAST_CONTRAST: Final = 20.0
_LEAST_SEEN: Final = 30
_SLOWEST_HZ: Final = 5.0
_RATE_OFF: Final = 0.002
"""How far the first fit of the screen's rate may be off: one refresh in eight seconds at 60 Hz is 0.2 %."""

_FITS: Final = 4
_FAR_OFF: Final = 3.0
"""A time is left out of the fit of the rate if it is off by this many medians, or refreshes: the two cameras' times may lie on either side of the line."""

_SLACKS_S: Final = (0.0003, 0.001, 0.002, 0.004, 0.008)
"""How far stamps may be off by themselves. The smallest value with which all frames agree is used."""

_Read = tuple[Times, Times]
"""Stamps, s, and numbers of one camera's frames."""

_REMEDY: Final = "show the page of --pattern full screen, near enough that its markers are 30 px wide in both images"


@dataclass(frozen=True, slots=True)
class Reading:
    """A pattern found in an image.

    Attributes:
        number: the count, 0 to COUNT - 1.
        row: position of the middle of the cells, 0 top to 1 bottom of the image.
    """

    number: int
    row: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Counted:
    """What one camera read.

    Attributes:
        shots: number of frames examined.
        times_s: (N,) stamps of the frames in which the pattern was found.
        numbers: (N,) the numbers read in them.
        row: mean row of the pattern.
        period: time between frames, s.
    """

    shots: int
    times_s: Times
    numbers: NDArray[np.int64]
    row: float
    period: float


def marker_bits(number: int) -> NDArray[np.uint8]:
    """Return a marker as (6, 6) uint8, 0 black, 255 white."""
    return np.asarray(cv2.aruco.generateImageMarker(_DICTIONARY, number, MARKER), dtype=np.uint8)


def draw(number: int, unit_px: int) -> Image:
    """Draw the pattern of a number as a grey image, `unit_px` pixels per unit, as the page shows it."""
    image = np.full((HEIGHT * unit_px, WIDTH * unit_px), 255, dtype=np.uint8)
    for index, (x, y) in enumerate(MARKERS):
        bits = np.kron(marker_bits(index), np.ones((unit_px, unit_px), dtype=np.uint8))
        image[y * unit_px : (y + MARKER) * unit_px, x * unit_px : (x + MARKER) * unit_px] = bits
    code = number ^ (number >> 1)
    for bit, (left, top) in enumerate(CELL_PLACES):
        if code >> bit & 1:
            x0, x1, y0, y1 = (round(edge * unit_px) for edge in (left, left + CELL, top, top + CELL))
            image[y0:y1, x0:x1] = 0
    return image


class PatternReader:
    """Finds the pattern in images."""

    def __init__(self) -> None:
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        self._detector = cv2.aruco.ArucoDetector(_DICTIONARY, parameters)

    def read(self, image: Image) -> Reading | None:
        """Read the pattern.

        Returns:
            The reading; None if the pattern is not seen well enough.
        """
        grey = image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        corners, found, _ = self._detector.detectMarkers(grey)
        seen = np.asarray([] if found is None else found, dtype=np.int64).ravel().tolist()  # type: ignore[redundant-expr] # the stubs know no None
        known = [(i, np.reshape(c, (4, 2))) for i, c in zip(seen, corners, strict=True) if i < len(MARKERS)]
        if len({index for index, _ in known}) < 2:
            return None
        here = np.concatenate([places for _, places in known])
        units = np.concatenate([_marker_corners(index) for index, _ in known])
        homography = np.asarray(cv2.findHomography(units, here)[0], dtype=np.float64)
        if homography.shape != (3, 3):
            return None  # all corners on a line
        black, white = (_levels(grey, homography, places) for places in (_BLACK, _WHITE))
        if not np.median(white) - np.median(black) > _LEAST_CONTRAST:
            return None
        middle = (np.median(white) + np.median(black)) / 2
        cells = _levels(grey, homography, _SAMPLES).reshape(BITS, -1).mean(axis=1)
        code = sum(1 << bit for bit in range(BITS) if cells[bit] < middle)
        number = code
        while code := code >> 1:
            number ^= code
        row = float(_project(homography, np.array([[13.0, 9.0]]))[0, 1] / grey.shape[0])
        return Reading(number, row)


def measure_screen(board: Counted, host: Counted) -> Measured:
    """Measure the time offset.

    Raises:
        DataError: the recording is too short, the pattern was not seen, or it did not count.
    """
    require_shots(board.shots, host.shots)
    for whose, seen in (("board", board), ("host", host)):
        if len(seen.times_s) < _LEAST_SEEN:
            raise DataError(
                f"the {whose}'s camera saw the pattern in {len(seen.times_s)} of {seen.shots} frames", _REMEDY
            )
    refresh_s, board_numbers, host_numbers = _unwrap(board, host)
    left, right = (board.times_s, board_numbers), (host.times_s, host_numbers)
    low_s, high_s, refresh_s = _interval(left, right, refresh_s)
    uncertainty_s = (high_s - low_s) / 2 + rolling_s(board.row, board.period) + rolling_s(host.row, host.period)
    offset_s = (low_s + high_s) / 2
    starts, host_starts = (times - refresh_s * numbers for times, numbers in (left, right))
    offsets = offset_s + np.linspace(-2 * refresh_s, 2 * refresh_s, 161)
    misfits = np.array([_spread_ms(starts, host_starts, float(offset)) for offset in offsets])
    offset = TimeOffset(round(offset_s * 1e9), max(1, round(uncertainty_s * 1e9)))
    return Measured(
        offset,
        Method.SCREEN,
        len(starts) + len(host_starts),
        offsets,
        misfits,
        "spread of a refresh over both cameras, ms",
    )


def _interval(left: _Read, right: _Read, refresh_s: float) -> tuple[float, float, float]:
    """Return the lowest and the highest offset that contradict no frame, s, and the middle of the refresh times that contradict none either.

    A frame at t that shows number n says that number 0 came between t - (n + 1) T and t - n T. Each T is used for which
    both cameras leave an interval.
    """
    ticks_s = refresh_s * np.linspace(1 - _RATE_OFF, 1 + _RATE_OFF, 1201)
    for slack_s in _SLACKS_S:
        (low, high), (host_low, host_high) = (_begins(side, ticks_s, slack_s) for side in (left, right))
        possible = (low <= high) & (host_low <= host_high)
        if possible.any():
            least, most = (host_low - high)[possible].min(), (host_high - low)[possible].max()
            return float(least), float(most), float(np.median(ticks_s[possible]))
    raise DataError(
        "the stamps do not fit the screen's count",
        "use a screen with a constant refresh rate, or use --by scene",
    )


def _begins(side: _Read, ticks_s: Times, slack_s: float) -> tuple[Times, Times]:
    """Return, for each refresh time, the earliest and latest moment of number 0; one contradiction in a hundred frames counts as a misreading."""
    times, numbers = side
    spared = len(times) // 100
    latest = times[:, None] - numbers[:, None] * ticks_s
    high = np.partition(latest, spared, axis=0)[spared]
    low = -np.partition(-(latest - ticks_s), spared, axis=0)[spared]
    return low - slack_s, high + slack_s


def counted(times_s: Times, readings: list[Reading | None]) -> Counted:
    """Gather what was read."""
    found = [(t, reading) for t, reading in zip(times_s, readings, strict=True) if reading is not None]
    return Counted(
        shots=len(times_s),
        times_s=np.array([t for t, _ in found]),
        numbers=np.array([reading.number for _, reading in found], dtype=np.int64),
        row=float(np.mean([reading.row for _, reading in found])) if found else 0.5,
        period=period_s(times_s) if len(times_s) > 1 else 0.0,
    )


def _unwrap(board: Counted, host: Counted) -> tuple[float, Times, Times]:
    """Return the approximate time of a refresh, and both cameras' numbers with the count's wrap-around undone."""
    rates = []
    for seen in (board, host):
        steps = np.diff(seen.numbers) % COUNT
        gaps_s = np.diff(seen.times_s)
        use = (steps > 0) & (steps < COUNT // 2) & (gaps_s < 1.0)
        rates += list(steps[use] / gaps_s[use])
    rate_hz = float(np.median(rates)) if rates else 0.0
    if not rate_hz > _SLOWEST_HZ:
        raise DataError(
            "the pattern on the screen did not change",
            "open the page of --pattern in a browser, not a picture of it",
        )
    times = np.concatenate([board.times_s, host.times_s])
    numbers = np.concatenate([board.numbers, host.numbers]).astype(np.float64)
    last_s, last = float(times.min()), float(numbers[times.argmin()])
    unwrapped = np.empty_like(numbers)
    for index in np.argsort(times, kind="stable"):
        expected = last + (times[index] - last_s) * rate_hz
        unwrapped[index] = numbers[index] + COUNT * round((expected - numbers[index]) / COUNT)
        if abs(unwrapped[index] - expected) < COUNT / 8:
            last_s, last = float(times[index]), float(unwrapped[index])
    split = len(board.times_s)
    return _refresh_s(times, unwrapped), unwrapped[:split], unwrapped[split:]


def _refresh_s(times: Times, numbers: Times) -> float:
    """Fit the slope of the times over the numbers, without those far off their line: a misread cell may change a number by thousands."""
    line, use = np.zeros(2), np.ones(len(times), dtype=np.bool_)
    for _ in range(_FITS):
        line = np.polyfit(numbers[use], times[use], 1)
        off_s = np.abs(times - np.polyval(line, numbers))
        use = off_s <= _FAR_OFF * max(float(np.median(off_s)), abs(float(line[0])))
    return float(line[0])


def _spread_ms(left: Times, right: Times, offset_s: float) -> float:
    """Return the time within which both cameras' refreshes would begin at this offset: one refresh at best."""
    low, high = np.percentile(np.concatenate([left, right - offset_s]), (1, 99))
    return float(high - low) * 1e3


def _marker_corners(index: int) -> NDArray[np.float64]:
    x, y = MARKERS[index]
    return np.array([[x, y], [x + MARKER, y], [x + MARKER, y + MARKER], [x, y + MARKER]], dtype=np.float64)


def _cell_samples() -> NDArray[np.float64]:
    grid = np.stack(np.meshgrid(*[np.linspace(0.25, 0.75, 4) * CELL] * 2), axis=-1).reshape(-1, 2)
    return np.concatenate([np.array(place) + grid for place in CELL_PLACES])


_SAMPLES: Final = _cell_samples()
_BLACK: Final = np.array([[x + 0.5, y + step] for x, y in MARKERS for step in (1.5, 3.0, 4.5)])
_WHITE: Final = np.array([[x + step, y - 0.4] for x, y in MARKERS for step in (1.5, 3.0, 4.5)])


def _project(homography: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(cv2.perspectiveTransform(places.reshape(-1, 1, 2), homography), dtype=np.float64).reshape(-1, 2)


def _levels(grey: Image, homography: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    at = _project(homography, places).astype(np.float32)
    return np.asarray(
        cv2.remap(grey, at[:, 0], at[:, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.float64
    ).ravel()


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
