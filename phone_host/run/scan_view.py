"""Shows a live scan on a terminal: what helps now, and the surface as it grows."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.console import Console
from rich.style import Style
from rich.text import Text

from common import now
from phone_host.geometry.se3 import rotations_of
from phone_host.run.live_scan import LiveScan
from phone_host.run.terminal_view import Part, Redrawn
from phone_host.scan.mesh import Mesh
from phone_host.scan.patches import Patch

_TURN: Final = (-0.35, 0.3, 0.0)
"""Rotation vector, rad: seen from a little above and aside, so that depth shows."""

_MARGIN: Final = 0.02
_SEEN: Final = (0.01, 0.99)
"""Shares of the points between which the picture reaches: crumbs far away would make the rest small."""


@dataclass(frozen=True, slots=True, eq=False)
class SmallView:
    """A picture.

    Attributes:
        colours: (H, W, 3) uint8, red green blue.
        is_seen: (H, W) whether there is a surface.
    """

    colours: NDArray[np.uint8]
    is_seen: NDArray[np.bool_]


def small_view(meshes: Iterable[Mesh], width_px: int, height_px: int) -> SmallView:
    """Draw the points of a surface, the nearest of each pixel.

    Args:
        meshes: its parts; x right, y down, z forward.
        width_px: of the picture, >= 1.
        height_px: likewise; pixels are square.
    """
    colours = np.zeros((height_px, width_px, 3), np.uint8)
    is_seen = np.zeros((height_px, width_px), np.bool_)
    parts = [mesh for mesh in meshes if len(mesh.points_m)]
    if not parts:
        return SmallView(colours, is_seen)
    points = np.concatenate([mesh.points_m for mesh in parts]).astype(np.float64)
    turned = (points - np.median(points, axis=0)) @ rotations_of(np.array(_TURN)).T
    low, high = np.quantile(turned[:, :2], _SEEN, axis=0)
    step = max((high - low) / (np.array([width_px, height_px]) * (1 - 2 * _MARGIN)))
    if not step > 0:
        return SmallView(colours, is_seen)
    middle = np.array([width_px, height_px]) / 2
    at = np.floor((turned[:, :2] - (low + high) / 2) / step + middle).astype(np.int64)
    inside = np.flatnonzero(((at >= 0) & (at < (width_px, height_px))).all(axis=1))
    farthest_first = inside[np.argsort(-turned[inside, 2], kind="stable")]
    x, y = at[farthest_first].T
    colours[y, x] = np.concatenate([mesh.colours for mesh in parts])[farthest_first]  # the last one, the nearest, stays
    is_seen[y, x] = True
    return SmallView(colours, is_seen)


_EVERY_NS: Final = 250_000_000
_SURFACE_NS: Final = 1_000_000_000
_MOST_POINTS: Final = 2_000_000
_WORDS_LINES: Final = 3
_MOST_COLUMNS: Final = 100
_UPPER_HALF: Final = "\u2580"


class ScanPicture(Redrawn):
    """Redraws words and surface in their place; a context manager.

    Args:
        live: the scan.
        console: where to draw; stderr by default.
    """

    def __init__(self, live: LiveScan, console: Console | None = None) -> None:
        super().__init__(console)
        self._scan = live
        self._patches: dict[tuple[int, int, int], Patch] = {}
        self._newest, self._words = 0, ""
        self._drawn_ns = self._asked_ns = -_SURFACE_NS
        self._picture = Text()

    def refresh(self) -> None:
        """Show the present state, at most four times a second."""
        now_ns = now.monotonic_ns()
        if now_ns - self._drawn_ns >= _EVERY_NS:
            self._show(now_ns)

    def end(self) -> None:
        """Show once more how it stands: the run has ended."""
        self._scan.end()
        self._show(now.monotonic_ns())

    def _show(self, now_ns: int) -> None:
        self._drawn_ns, words, picture = now_ns, self._scan.words, self._picture
        if now_ns - self._asked_ns >= _SURFACE_NS:
            self._asked_ns = now_ns
            self._renew()
        if words != self._words or picture is not self._picture:
            self._words = words
            self.draw([Part(0, Text(words, style="bold")), Part(1, self._picture)])

    def _renew(self) -> None:
        """Take what is new of the surface, and draw it as large as the terminal allows."""
        newer = self._scan.surface_since(self._newest, _MOST_POINTS)
        if not newer:
            return
        self._patches |= {patch.place: patch for patch in newer}
        self._newest = max(patch.number for patch in newer)
        columns = max(1, min(self.console.width - 1, _MOST_COLUMNS))
        lines = max(1, self.console.height - _WORDS_LINES)
        self._picture = _as_text(small_view((each.mesh for each in self._patches.values()), columns, 2 * lines))


def _as_text(view: SmallView) -> Text:
    """Write a picture with two pixels a character, its empty lines left out."""
    text = Text(no_wrap=True, end="")
    rows = np.flatnonzero(view.is_seen.reshape(-1, 2, view.is_seen.shape[1]).any(axis=(1, 2)))
    for row in range(rows[0], rows[-1] + 1) if len(rows) else ():
        for column in range(view.is_seen.shape[1]):
            upper, lower = (
                Color.from_rgb(*view.colours[line, column].tolist()) if view.is_seen[line, column] else None
                for line in (2 * row, 2 * row + 1)
            )
            if upper is None and lower is None:
                text.append(" ")
            elif upper is None:
                text.append("\u2584", Style(color=lower))
            else:
                text.append(_UPPER_HALF, Style(color=upper, bgcolor=lower))
        text.append("\n")
    return text
