"""The card of a calibration's page that shows the rig in space: both cameras with what they see, and where the boards stood. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel
from phone_host.model.calibration_series import CalibrationSeries, SeriesRig
from phone_host.report.page_frame import HALF_PX, section, two_widths
from phone_host.svg.plot_parts import legend, svg

Floats = NDArray[np.float64]

_MARGIN_PX: Final = 30
_MOST_HIGH: Final = 0.75
"""Height over width at most."""

_LEFT, _RIGHT, _BOARD = 5, 4, 2
_REACH: Final = 0.3
"""How long the cameras' pyramids are drawn, as a share of the way to the boards."""

_MOST_SLOPE: Final = 1.5
_OBLIQUE: Final = (-35.0, 28.0)
_ABOVE: Final = (0.0, 90.0)


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


def rig_card(series: CalibrationSeries, found: SeriesRig) -> str:
    """Make the card."""
    shapes = _boards(series)
    rig = found.rig
    away_m = float(np.median([np.linalg.norm(shape.lines[0][:-1].mean(axis=0)) for shape in shapes])) if shapes else 1.0
    shapes += [
        _camera(_pyramid(rig.left, _REACH * away_m), _LEFT, "left"),
        _camera((_pyramid(rig.right, _REACH * away_m) - rig.t_right_left_m) @ rig.R_right_left, _RIGHT, "right"),
    ]
    drawn = "".join(
        f"<div><h3>{escape(title)}</h3>"
        f"{two_widths(partial(in_space, shapes, seen_from(*direction), f'cameras and boards, {title}'), HALF_PX)}</div>"
        for title, direction in (("from behind, left and above", _OBLIQUE), ("from above", _ABOVE))
    )
    names = legend([("left camera", _LEFT), ("right camera", _RIGHT), ("boards", _BOARD)])
    words = "Where the boards stood, as far as their outer corners. Pyramids show what a camera sees; the bars show the scale."
    return section("The rig in space", words, f'{names}<div class="pair">{drawn}</div>')


def _boards(series: CalibrationSeries) -> list[Shape]:
    return [
        Shape(
            lines=(np.vstack([view.outline_m, view.outline_m[:1]]),),
            colour=_BOARD,
            title=f"{view.name}: {np.linalg.norm(view.outline_m.mean(axis=0)):.2f} m away",
            opacity=0.1,
        )
        for view in series.views
        if len(view.outline_m)
    ]


def _pyramid(model: CameraModel, reach_m: float) -> Floats:
    """Return a camera's centre and the corners of what it sees, (5, 3) in its own axes, m; without the lens's bend."""
    corners = np.array([[0, 0], [model.width_px, 0], [model.width_px, model.height_px], [0, model.height_px]], float)
    focal, middle = np.diag(model.matrix)[:2], model.matrix[:2, 2]
    slopes = np.clip((corners - 0.5 - middle) / focal, -_MOST_SLOPE, _MOST_SLOPE)
    return np.vstack([np.zeros(3), np.column_stack([slopes, np.ones(4)]) * reach_m])


def _camera(pyramid: Floats, colour: int, name: str) -> Shape:
    edges = tuple(np.vstack([pyramid[0], point]) for point in pyramid[1:])
    return Shape(lines=(*edges, np.vstack([pyramid[1:], pyramid[1:2]])), colour=colour, title=f"{name} camera")


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
