"""A scale beside a picture: the colours from bottom to top, with ticks at round numbers. Pure.

It is added as a strip on the right, so each pixel of the picture keeps its place, and none is hidden.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import cv2
import numpy as np

from phone_host.model import Image

_FONT: Final = cv2.FONT_HERSHEY_SIMPLEX
_FONT_PX: Final = 22  # height of the font's digits at scale 1 (cv2.getTextSize)
_LETTERS_ACROSS: Final = 38
"""Heights of a letter that fit across the picture. At a phone's 390 px a digit is then 9 to 10 px high, about the least that is read easily."""

_LEAST_LETTER_PX: Final = 9
_MOST_SHARE: Final = 1 / 12  # of the picture's height, so that a flat picture has room for more than one tick
_PITCH: Final = 2.0  # least distance of two ticks, in heights of a letter
_ENOUGH_TICKS: Final = 4
_WIDEST_GAP: Final = 0.35  # of the scale: none of its thirds stays without a tick
_MOST_TICKS: Final = 9
_MOST_RATIO: Final = 1e6  # of the greatest label to the least: a micrometre to a metre, a millimetre to a kilometre
_PAPER: Final = 255
_INK: Final = 0

_STEPS: Final[tuple[tuple[int, ...], ...]] = (
    (1,),
    (2, 5),
    (15, 3, 4, 6, 8),
    tuple(range(10, 100, 5)),
    tuple(range(10, 100, 2)),
    tuple(range(10, 100)),
    tuple(range(100, 1000)),
)
"""Leading digits of round numbers, the roundest first."""


@dataclass(frozen=True, slots=True)
class Tick:
    """A mark on the scale.

    Attributes:
        place: where, from 0 (bottom) to 1 (top).
        text: its label.
    """

    place: float
    text: str


def ticks(low: float, high: float, place: Callable[[float], float], pitch: float) -> tuple[Tick, ...]:
    """Choose round numbers that label a scale, the roundest first.

    Args:
        low: least number on it; numbers up to 0 get no tick, except 0 itself where it is `low`.
        high: greatest number on it; may be infinite.
        place: takes a number to its place on the scale, from 0 (bottom) to 1 (top).
        pitch: least distance of two ticks, as a share of the scale.
    """
    found: list[Tick] = []
    for numbers in _round_numbers(low, high):
        if len(found) >= _ENOUGH_TICKS and _widest_gap(found) <= _WIDEST_GAP:
            break
        for number in numbers:
            at = place(number)
            clear = all(abs(at - tick.place) >= pitch for tick in found)
            if 0 <= at <= 1 and clear and len(found) < _MOST_TICKS:
                found.append(Tick(at, f"{number:.6g}"))
    return tuple(found)


def _widest_gap(found: list[Tick]) -> float:
    places = [0.0, *sorted(tick.place for tick in found), 1.0]
    return max(after - before for before, after in pairwise(places))


def _round_numbers(low: float, high: float) -> Iterator[Iterable[float]]:
    """Yield the numbers of each roundness between two limits, those of greater steps first."""
    least = low if low > 0 else high / _MOST_RATIO
    first = math.floor(math.log10(least)) - 1
    last = math.floor(math.log10(min(high, least * _MOST_RATIO)))
    for digits in _STEPS:
        decades = range(first, last + 1)
        numbers = [float(f"{digit}e{decade}") for decade in decades for digit in digits]
        yield [number for number in numbers if low <= number <= high]


def with_scale(image: Image, colours: Image, marks: Callable[[float], Sequence[Tick]], unit: str) -> Image:
    """Add a scale on the right of a picture.

    Args:
        image: (H, W, 3) BGR.
        colours: (N, 3) BGR, uint8, from the scale's bottom to its top.
        marks: returns the ticks for a least distance of two (a share of the scale).
        unit: stands above the scale.

    Returns:
        (H, W + strip, 3) BGR; the picture itself is unchanged.
    """
    height, width = image.shape[:2]
    letter = max(_LEAST_LETTER_PX, min(round(width / _LETTERS_ACROSS), round(height * _MOST_SHARE)))
    top, bottom = min(3 * letter, height - 1), max(height - 1 - letter, 0)
    length = max(bottom - top, 1)
    chosen = marks(_PITCH * letter / length)
    scale, thickness = letter / _FONT_PX, max(1, round(letter / 9))
    texts = [*(tick.text for tick in chosen), unit]
    widest = max(cv2.getTextSize(text, _FONT, scale, thickness)[0][0] for text in texts)
    left, bar = letter // 2, letter
    strip = np.full((height, left + bar + letter + widest + letter // 2, 3), _PAPER, dtype=np.uint8)
    rows = np.linspace(len(colours) - 1, 0, length).round().astype(int)
    strip[top : top + length, left : left + bar] = colours[rows][:, np.newaxis]
    for tick in chosen:
        y = round(bottom - tick.place * length)
        x = left + bar
        cv2.line(strip, (x, y), (x + letter // 2, y), (_INK,) * 3, thickness)
        _write(strip, tick.text, (x + letter, y + letter // 2), scale, thickness)
    _write(strip, unit, (left, 2 * letter), scale, thickness)
    return np.hstack((image, strip))


def _write(strip: Image, text: str, at_px: tuple[int, int], scale: float, thickness: int) -> None:
    cv2.putText(strip, text, at_px, _FONT, scale, (_INK,) * 3, thickness, cv2.LINE_AA)
