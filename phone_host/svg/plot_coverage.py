"""Where corners were seen in an image, and where none was. Pure: values in, SVG out.

It stays SVG: cells and pictures have places in an image; uPlot draws series over an axis.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.svg.plot_parts import svg

_COLUMNS: Final = 12
_MOST_DOTS: Final = 2500
_STRONGEST: Final = 0.75
_FAINTEST: Final = 0.12


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
            strength = _FAINTEST + (_STRONGEST - _FAINTEST) * count / most
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
