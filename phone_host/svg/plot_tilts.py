"""How far and which way boards were tilted: a disc whose middle is a board that faces the camera. Pure: values in, SVG out.

It stays SVG: a disc of directions; uPlot draws series over an axis.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from phone_host.svg.plot_parts import point, svg

_RINGS_DEG: Final = (20, 45)
_LEAST_EDGE_DEG: Final = 50.0
_BELOW_PX: Final = 18


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
