"""A grid of tiles with a number in each, coloured by it. Pure: values in, SVG out.

It stays SVG: a table in colours is read cell by cell; uPlot draws series over an axis.
"""

from collections.abc import Callable
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.svg.plot_parts import svg

_GAP_PX: Final = 1.0
_ABOVE, _BELOW, _ONE_SIDED = "var(--c4)", "var(--c5)", "var(--c0)"
_STRONGEST: Final = 0.85  # opacity; the number on it stays legible in light and dark mode


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
