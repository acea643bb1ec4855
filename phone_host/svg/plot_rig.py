"""Cameras and boards in space, seen from a direction. Pure: values in, SVG out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.svg.plot_parts import svg

Floats = NDArray[np.float64]

_MARGIN_PX: Final = 30
_MOST_HIGH: Final = 0.75
"""Height over width at most."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Shape:
    """Something in space.

    Attributes:
        lines: each (N, 3), m; a line that ends where it began is filled.
        colour: index into the palette.
        title: shown when the pointer rests on it.
        opacity: of the filling.
    """

    lines: tuple[Floats, ...]
    colour: int
    title: str = ""
    opacity: float = 0.2


def seen_from(yaw_deg: float, pitch_deg: float) -> Floats:
    """Return (3, 3), from the left camera's axes (x right, y down, z forward) to the picture's: right, down, away.

    Args:
        yaw_deg: how far the spectator has gone round to the right; 0 looks as the camera does.
        pitch_deg: how far he has climbed; 90 looks down from above.
    """
    yaw, pitch = math.radians(yaw_deg), math.radians(pitch_deg)
    turn = np.array([[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0], [-math.sin(yaw), 0, math.cos(yaw)]])
    climb = np.array([[1, 0, 0], [0, math.cos(pitch), -math.sin(pitch)], [0, math.sin(pitch), math.cos(pitch)]])
    return np.asarray(climb @ turn, np.float64)


def in_space(shapes: Sequence[Shape], view: Floats, label: str, width_px: int) -> str:
    """Draw shapes, the farther ones first, and a bar that shows the scale."""
    flat = [[line @ view.T for line in shape.lines] for shape in shapes]
    every = np.concatenate([line for lines in flat for line in lines])
    low, high = every.min(axis=0), every.max(axis=0)
    room = np.array([width_px - 2 * _MARGIN_PX, _MOST_HIGH * width_px - 2 * _MARGIN_PX])
    scale = float((room / np.maximum(high - low, 1e-6)[:2]).min())
    height_px = float((high - low)[1]) * scale + 2.5 * _MARGIN_PX
    start = np.array([(width_px - (high - low)[0] * scale) / 2, _MARGIN_PX])
    parts = []
    farthest_first = sorted(
        range(len(shapes)), key=lambda index: -float(np.mean([line[:, 2].mean() for line in flat[index]]))
    )
    for index in farthest_first:
        shape = shapes[index]
        drawn = "".join(_path((line[:, :2] - low[:2]) * scale + start) for line in flat[index])
        look = f"fill:var(--c{shape.colour});fill-opacity:{shape.opacity};stroke:var(--c{shape.colour});stroke-width:1.4;stroke-linejoin:round"
        parts.append(f'<path d="{drawn}" style="{look}"><title>{escape(shape.title)}</title></path>')
    parts.append(_bar(scale, width_px, height_px))
    return svg(width_px, height_px, label, parts)


def _path(points: Floats) -> str:
    closed = len(points) > 2 and bool(np.array_equal(points[0], points[-1]))
    drawn = "L".join(f"{x:.1f} {y:.1f}" for x, y in (points[:-1] if closed else points))
    return f"M{drawn}{'z' if closed else ''}"


def _bar(scale: float, width_px: int, height_px: float) -> str:
    rough_m = 0.25 * width_px / scale
    power = 10.0 ** math.floor(math.log10(rough_m))
    bar_m = next(step * power for step in (5.0, 2.0, 1.0) if step * power <= rough_m * 1.001)
    words = f"{bar_m:g} m" if bar_m >= 1 else f"{bar_m * 1e3:g} mm"
    y = height_px - 10
    return (
        f'<path class="mark" d="M6 {y:.1f}h{bar_m * scale:.1f}m0 -4v8m{-bar_m * scale:.1f} -8v8"/>'
        f'<text class="strong" x="{bar_m * scale + 12:.1f}" y="{y + 4:.1f}">{words}</text>'
    )
