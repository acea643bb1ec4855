"""The card of a calibration's page that shows the rig in space: both cameras with what they see, and where the boards stood. Pure."""

from functools import partial
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel
from phone_host.model.calibration_series import CalibrationSeries, SeriesRig
from phone_host.report.page_frame import HALF_PX, section, two_widths
from phone_host.svg.plot_parts import legend
from phone_host.svg.plot_rig import Shape, in_space, seen_from

Floats = NDArray[np.float64]

_LEFT, _RIGHT, _BOARD = 5, 4, 2
_REACH: Final = 0.3
"""How long the cameras' pyramids are drawn, as a share of the way to the boards."""

_MOST_SLOPE: Final = 1.5
_OBLIQUE: Final = (-35.0, 28.0)
_ABOVE: Final = (0.0, 90.0)


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
        f"{two_widths(partial(_drawn, shapes, seen_from(*direction), f'cameras and boards, {title}'), HALF_PX)}</div>"
        for title, direction in (("from behind, left and above", _OBLIQUE), ("from above", _ABOVE))
    )
    names = legend([("left camera", _LEFT), ("right camera", _RIGHT), ("boards", _BOARD)])
    words = "Where the boards stood, as far as their outer corners. Pyramids show what a camera sees; the bars show the scale."
    return section("The rig in space", words, f'{names}<div class="pair">{drawn}</div>')


def _drawn(shapes: list[Shape], view: Floats, label: str, width_px: int) -> str:
    return in_space(shapes, view, label, width_px)


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
