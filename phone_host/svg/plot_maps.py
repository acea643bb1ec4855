"""Maps: a grid of numbers, corners over an image, a disc of directions. Pure: values in, SVG out."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.svg.plot_parts import point, svg

_GAP_PX: Final = 1.0
_ABOVE, _BELOW, _ONE_SIDED = "var(--c4)", "var(--c5)", "var(--c0)"
_STRONGEST: Final = 0.85  # opacity; the number on it stays legible in light and dark mode

_COLUMNS: Final = 12
_MOST_DOTS: Final = 2500
_DARKEST: Final = 0.75
_FAINTEST: Final = 0.12

_RINGS_DEG: Final = (20, 45)
_LEAST_EDGE_DEG: Final = 50.0
_BELOW_PX: Final = 18


def tile_map(
    values: NDArray[np.float64],
    limit: float,
    label: str,
    words: Callable[[float], str],
    *,
    width_px: int = 330,
    two_sided: bool = False,
) -> str:
    """Draw a grid.

    Args:
        values: (rows, columns); NaN: empty, with a dash.
        limit: the value, or size of a value, with the strongest colour; above 0.
        label: what it shows, for screen readers.
        words: writes a value in a few characters.
        width_px: width of the picture.
        two_sided: whether values below 0 have a colour of their own.
    """
    rows, columns = values.shape
    size = width_px / columns
    # The tiles of an image are about as high as they are wide; an only tile need not fill the page.
    high = min(size, 40.0)
    letter = min(12.0, size * 0.32)  # five characters fit
    parts = []
    for (row, column), value in np.ndenumerate(values):
        x, y = column * size, row * high
        known = bool(np.isfinite(value))
        text = words(float(value)) if known else "\u2013"
        colour = (_ABOVE if value > 0 else _BELOW) if two_sided else _ONE_SIDED
        strength = _STRONGEST * min(1.0, abs(float(value)) / limit) if known else 0.0
        parts.append(
            f'<rect class="grid" x="{x:.1f}" y="{y:.1f}" width="{size - _GAP_PX:.1f}" height="{high - _GAP_PX:.1f}"'
            f' style="fill:{colour};fill-opacity:{strength:.2f}"><title>{escape(text)}</title></rect>'
            f'<text class="strong" x="{x + size / 2:.1f}" y="{y + high / 2 + letter / 3:.1f}" text-anchor="middle"'
            f' style="font-size:{letter:.1f}px;pointer-events:none">{escape(text)}</text>'
        )
    return svg(width_px, rows * high, label, parts)


def tile_views(views: list[NDArray[np.float64]], size_px: tuple[int, int]) -> NDArray[np.int64]:
    """Count for each tile of an image the views that have a corner in it.

    Args:
        views: (N, 2) corners of each view, px; NaN where one was not seen.
        size_px: width and height of the image.

    Returns:
        (rows, columns); tiles are about square.
    """
    width, height = size_px
    shape = max(3, round(_COLUMNS * height / width)), _COLUMNS
    counts = np.zeros(shape, np.int64)
    for corners in views:
        seen = corners[np.isfinite(corners).all(axis=1)] + 0.5
        tiles = (seen / size_px * shape[::-1]).astype(np.int64)
        inside = np.all((tiles >= 0) & (tiles < shape[::-1]), axis=1)
        touched = np.zeros(shape, np.bool_)
        touched[tiles[inside, 1], tiles[inside, 0]] = True
        counts += touched
    return counts


def coverage_map(
    views: list[NDArray[np.float64]], size_px: tuple[int, int], counts: NDArray[np.int64], label: str, width_px: int
) -> str:
    """Draw the corners of all views over tiles that are the darker, the more views reach them; empty tiles are crossed out.

    Args:
        views: as in `tile_views`.
        size_px: width and height of the image.
        counts: of `tile_views`.
        label: what it shows, for screen readers.
        width_px: width of the picture.
    """
    rows, columns = counts.shape
    scale = width_px / size_px[0]
    height_px = size_px[1] * scale
    across, down = width_px / columns, height_px / rows
    most = max(1, int(counts.max()))
    parts = []
    for (row, column), count in np.ndenumerate(counts):
        x, y = column * across, row * down
        box = f'x="{x:.1f}" y="{y:.1f}" width="{across - 1:.1f}" height="{down - 1:.1f}"'
        if count:
            strength = _FAINTEST + (_DARKEST - _FAINTEST) * count / most
            look = f'style="fill:var(--c0);fill-opacity:{strength:.2f}"'
        else:
            look = 'style="fill:none;stroke:var(--c4);stroke-opacity:.45"'
            parts.append(f'<path {look} d="M{x + 4:.1f} {y + down - 5:.1f}L{x + across - 5:.1f} {y + 4:.1f}"/>')
        parts.append(f"<rect {box} {look}><title>{'no view' if not count else f'views: {count}'}</title></rect>")
    every = np.concatenate(views) if views else np.empty((0, 2))
    seen = every[np.isfinite(every).all(axis=1)]
    seen = (seen[:: max(1, -(-len(seen) // _MOST_DOTS))] + 0.5) * scale
    dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in seen)
    parts.append(f'<path d="{dots}" style="stroke:var(--ink);stroke-width:2;stroke-linecap:round;stroke-opacity:.55"/>')
    parts.append(f'<rect class="axis" x=".5" y=".5" width="{width_px - 1}" height="{height_px - 1:.1f}"/>')
    return svg(width_px, height_px, label, parts)


@dataclass(frozen=True, slots=True)
class TiltedBoard:
    """How one board was tilted.

    Attributes:
        angle_deg: between its normal and the optical axis, degrees.
        right: how far its normal points to the right, -1 to 1.
        down: how far it points down, likewise.
        title: shown when the pointer rests on it.
    """

    angle_deg: float
    right: float
    down: float
    title: str


def tilt_disc(tilts: Sequence[TiltedBoard], label: str, width_px: int) -> str:
    """Draw the tilts, and rings at 20 and 45 degrees, between which views teach most."""
    height_px = min(width_px, 260)
    x, y = width_px / 2, height_px / 2
    radius = height_px / 2 - _BELOW_PX
    edge = max([_LEAST_EDGE_DEG, *(one.angle_deg for one in tilts)])
    parts = [
        f'<path class="grid" d="M{x - radius:.1f} {y:.1f}h{2 * radius:.1f}M{x:.1f} {y - radius:.1f}v{2 * radius:.1f}"/>'
    ]
    for ring in _RINGS_DEG:
        reach = radius * ring / edge
        parts.append(f'<circle class="axis" cx="{x:.1f}" cy="{y:.1f}" r="{reach:.1f}"/>')
        parts.append(f'<text x="{x + 0.71 * reach + 3:.1f}" y="{y - 0.71 * reach - 2:.1f}">{ring}°</text>')
    for words, at_x, at_y, anchor in (
        ("up", x, y - radius - 5, "middle"),
        ("down", x, y + radius + 14, "middle"),
        ("left", x - radius - 5, y + 4, "end"),
        ("right", x + radius + 5, y + 4, "start"),
    ):
        parts.append(f'<text x="{at_x:.1f}" y="{at_y:.1f}" text-anchor="{anchor}">{words}</text>')
    for one in tilts:
        length = math.hypot(one.right, one.down)
        reach = radius * one.angle_deg / edge / length if length else 0.0
        parts.append(point(5, (x + reach * one.right, y + reach * one.down), 4.5, one.title, "0.75"))
    return svg(width_px, height_px, label, parts)
