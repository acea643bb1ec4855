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


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SeenErrors:
    """Errors at places of an image.

    Attributes:
        size_px: width and height of the image.
        places: (N, 2) px of the image; NaN is left out.
        errors_px: (N, 2) px; (0, 2): not known.
        picture: address of the image, such as a data URI; empty: there is none.
    """

    size_px: tuple[int, int]
    places: Points
    errors_px: Points
    picture: str = ""


@dataclass(frozen=True, slots=True)
class Enlarged:
    """How much longer arrows are drawn than the errors are.

    Attributes:
        by: length of an arrow, as a share of the picture's width, for an error of 1 px.
        bar_px: the error that the bar shows, px.
    """

    by: float
    bar_px: float

    def words(self, width_px: int) -> str:
        """Say by how much arrows on an image of that width are enlarged."""
        factor = self.by * width_px
        return f"enlarged {factor:.0f} times" if factor >= 1.5 else f"drawn at {factor:.2g} of their length"


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


def photo_arrows(seen: SeenErrors, scale: Enlarged, label: str, width_px: int) -> str:
    """Draw a photograph with corners and an arrow at each.

    Args:
        seen: the corners; without errors no arrows are drawn.
        scale: how much they are enlarged.
        label: what it shows, for screen readers.
        width_px: width of the picture.
    """
    factor = width_px / seen.size_px[0]
    height_px = seen.size_px[1] * factor
    parts = ['<rect width="100%" height="100%" style="fill:var(--line)"/>']
    if seen.picture:
        parts.append(f'<image href="{escape(seen.picture)}" width="{width_px}" height="{height_px:.1f}"/>')
    known = np.isfinite(seen.places).all(axis=1)
    at = (seen.places[known] + 0.5) * factor
    parts.append(f'<path class="dots" d="{"".join(f"M{x:.1f} {y:.1f}h0" for x, y in at)}"/>')
    if len(seen.errors_px):
        long = seen.errors_px[known] * scale.by * width_px
        some = slice(None, None, max(1, -(-len(at) // _MOST_ARROWS)))
        arrows = zip(at[some], long[some], strict=True)
        lines = "".join(f"M{x:.1f} {y:.1f}l{right:.1f} {down:.1f}" for (x, y), (right, down) in arrows)
        parts.append(f'<path class="err" d="{lines}"/>')
        parts.append(_bar(scale, width_px, height_px, on_photo=True))
    return svg(width_px, height_px, label, parts)


def arrow_field(seen: SeenErrors, scale: Enlarged, label: str, width_px: int) -> str:
    """Draw arrows over an empty image.

    Args:
        seen: the places, none of them NaN.
        scale: how much they are enlarged.
        label: what it shows, for screen readers.
        width_px: width of the picture.
    """
    factor = width_px / seen.size_px[0]
    height_px = seen.size_px[1] * factor
    parts = [f'<rect class="grid" x=".5" y=".5" width="{width_px - 1}" height="{height_px - 1:.1f}"/>']
    arrows = zip((seen.places + 0.5) * factor, seen.errors_px * scale.by * width_px, strict=True)
    lines = "".join(_arrow(at, long) for at, long in arrows)
    parts.append(f'<path d="{lines}" style="stroke:var(--c5);stroke-width:1.6;fill:none;stroke-linecap:round"/>')
    parts.append(_bar(scale, width_px, height_px, on_photo=False))
    return svg(width_px, height_px, label, parts)


def _arrow(at: Points, long: Points) -> str:
    """Return the path of an arrow with its head, and a dot where it begins."""
    (x, y), (right, down) = at, long
    path = f"M{x:.1f} {y:.1f}h0l{right:.1f} {down:.1f}"
    for way in (-1, 1):
        back_x, back_y = (-_HEAD * (right - way * down / 2), -_HEAD * (down + way * right / 2))
        path += f"l{back_x:.1f} {back_y:.1f}m{-back_x:.1f} {-back_y:.1f}"
    return path


def _bar(scale: Enlarged, width_px: int, height_px: float, *, on_photo: bool) -> str:
    """Draw the bar that shows the scale, in the lower left corner."""
    long = scale.by * scale.bar_px * width_px
    letter = _LETTER_PX * max(1.0, width_px / 400)
    words = f"{number_text(scale.bar_px)} px"
    wide = long + 14 + 0.62 * letter * len(words)
    top = height_px - letter - 10
    ground = (
        f'<rect class="ground" x="0" y="{top:.1f}" width="{wide:.1f}" height="{letter + 10:.1f}"/>' if on_photo else ""
    )
    y = top + letter / 2 + 5
    return (
        f'{ground}<path class="{"err" if on_photo else "mark"}" d="M6 {y:.1f}h{long:.1f}m0 -4v8m{-long:.1f} -8v8"/>'
        f'<text class="{"bright" if on_photo else "strong"}" x="{long + 12:.1f}" y="{y + letter / 3:.1f}" style="font-size:{letter:.0f}px">{escape(words)}</text>'
    )
