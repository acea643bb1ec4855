"""Small errors over an image as arrows, enlarged, with their scale. Pure: values in, SVG out."""

import math
from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.svg.plot_parts import svg
from phone_host.svg.plot_scale import number_text

Points = NDArray[np.float64]
"""(N, 2) px of the image."""

_BAR_SHARE: Final = 0.16
"""Of the width: about so long is the bar that shows the scale."""

_MOST_ARROWS: Final = 160
_LETTER_PX: Final = 13
_HEAD: Final = 0.3
"""Length of an arrow's head, as a share of the arrow."""


@dataclass(frozen=True, slots=True)
class Enlarged:
    """How much longer arrows are drawn than the errors are.

    Attributes:
        by: length of an arrow, as a share of the picture's width, for an error of 1 px.
        bar_px: the error that the bar shows, px.
    """

    by: float
    bar_px: float

    def times(self, width_px: int) -> int:
        """By how much arrows on an image of that width are enlarged."""
        return round(self.by * width_px)


def enlarged(errors_px: Points, share: float) -> Enlarged:
    """Choose how much arrows are enlarged, so that all but one in twenty are shorter than a share of the picture's width.

    Args:
        errors_px: of all pictures that have the same scale; may hold NaN.
        share: of the width.
    """
    lengths = np.linalg.norm(errors_px, axis=1)
    lengths = lengths[np.isfinite(lengths)]
    usual = max(float(np.percentile(lengths, 95)) if lengths.size else 0.0, 1e-3)
    by = share / usual
    rough = _BAR_SHARE / by
    power = 10.0 ** math.floor(math.log10(rough))
    return Enlarged(by, next(step * power for step in (5.0, 2.0, 1.0) if step * power <= rough * 1.001))


def photo_arrows(
    picture: str, size_px: tuple[int, int], corners: Points, errors_px: Points, scale: Enlarged, label: str, width_px: int
) -> str:
    """Draw a photograph with corners and an arrow at each.

    Args:
        picture: address of the photograph, such as a data URI; empty: there is none.
        size_px: width and height of the whole image.
        corners: (N, 2) px of the whole image; NaN is left out.
        errors_px: (N, 2) px; (0, 2): no arrows.
        scale: how much they are enlarged.
        label: what it shows, for screen readers.
        width_px: width of the picture.
    """
    factor = width_px / size_px[0]
    height_px = size_px[1] * factor
    parts = ['<rect width="100%" height="100%" style="fill:var(--line)"/>']
    if picture:
        parts.append(f'<image href="{escape(picture)}" width="{width_px}" height="{height_px:.1f}"/>')
    seen = np.isfinite(corners).all(axis=1)
    at = (corners[seen] + 0.5) * factor
    dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in at)
    parts.append(f'<path class="dots" d="{dots}"/>')
    if len(errors_px):
        long = errors_px[seen] * scale.by * width_px
        every = max(1, -(-len(at) // _MOST_ARROWS))
        lines = "".join(f"M{x:.1f} {y:.1f}l{dx:.1f} {dy:.1f}" for (x, y), (dx, dy) in zip(at[::every], long[::every], strict=True))
        parts.append(f'<path class="err" d="{lines}"/>')
        parts.append(_bar(scale, width_px, height_px, on_photo=True))
    return svg(width_px, height_px, label, parts)


def arrow_field(places: Points, errors_px: Points, size_px: tuple[int, int], scale: Enlarged, label: str, width_px: int) -> str:
    """Draw arrows over an empty image.

    Args:
        places: (N, 2) px of the image.
        errors_px: (N, 2) px.
        size_px: width and height of the image.
        scale: how much they are enlarged.
        label: what it shows, for screen readers.
        width_px: width of the picture.
    """
    factor = width_px / size_px[0]
    height_px = size_px[1] * factor
    parts = [f'<rect class="grid" x=".5" y=".5" width="{width_px - 1}" height="{height_px - 1:.1f}"/>']
    lines = []
    for (x, y), (dx, dy) in zip((places + 0.5) * factor, errors_px * scale.by * width_px, strict=True):
        left, right = ((-_HEAD * (dx * c - way * dy * s), -_HEAD * (dy * c + way * dx * s)) for c, s, way in ((0.9, 0.45, 1), (0.9, 0.45, -1)))
        lines.append(
            f"M{x:.1f} {y:.1f}l{dx:.1f} {dy:.1f}l{left[0]:.1f} {left[1]:.1f}m{-left[0]:.1f} {-left[1]:.1f}l{right[0]:.1f} {right[1]:.1f}"
        )
        lines.append(f"M{x:.1f} {y:.1f}h0")
    parts.append(f'<path d="{"".join(lines)}" style="stroke:var(--c5);stroke-width:1.6;fill:none;stroke-linecap:round"/>')
    parts.append(_bar(scale, width_px, height_px, on_photo=False))
    return svg(width_px, height_px, label, parts)


def _bar(scale: Enlarged, width_px: int, height_px: float, *, on_photo: bool) -> str:
    """Draw the bar that shows the scale, in the lower left corner."""
    long = scale.by * scale.bar_px * width_px
    letter = _LETTER_PX * max(1.0, width_px / 400)
    words = f"{number_text(scale.bar_px)} px"
    wide = long + 14 + 0.62 * letter * len(words)
    top = height_px - letter - 10
    ground = f'<rect class="ground" x="0" y="{top:.1f}" width="{wide:.1f}" height="{letter + 10:.1f}"/>' if on_photo else ""
    y = top + letter / 2 + 5
    return (
        f'{ground}<path class="{"err" if on_photo else "mark"}" d="M6 {y:.1f}h{long:.1f}m0 -4v8m{-long:.1f} -8v8"/>'
        f'<text class="{"bright" if on_photo else "strong"}" x="{long + 12:.1f}" y="{y + letter / 3:.1f}" style="font-size:{letter:.0f}px">{escape(words)}</text>'
    )
