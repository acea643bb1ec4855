"""How much wrong depth a matcher puts on bare walls, at full and at reduced size: `python -m tests.bench.bench_walls [--help]`.

Rendered rooms with exact truth (`wall_rooms`): bare walls and hardly textured ones, without noise and with, lossless and JPEG,
by like and unlike cameras. wrong: pixels of the wall whose disparity is off by more than 2 px and more than 1 px of the
matched images, % of the wall; right: the others with a value. The same for everything else.

Figures to reach on the worst bare wall: wrong 2 % of it at full size, 4 % at reduced ones. Exit 4 when one is missed.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from common import now
from phone_host.run.stereo_remarks import judge_pair
from phone_host.stereo.core import StereoCore
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import matcher_named
from tests.bench.depth_scenes import Values
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.wall_rooms import WallRoom, Walls, wall_room

SCALES: Final = (1.0, 0.5, 0.3)
_MOST_FULL: Final = 2.0
_MOST_REDUCED: Final = 4.0
_KINDS: Final = (
    Walls(seed=0, noise=0.0),
    Walls(seed=1, noise=0.5),
    Walls(seed=2, noise=1.0, quality=80, slant=0.3, unlike=True),
    Walls(seed=3, noise=0.5, quality=90, slant=-0.4),
    Walls(seed=4, noise=1.5, slant=0.2, unlike=True),
    Walls(seed=5, width_px=1280, noise=0.5, quality=80, slant=-0.2, unlike=True),
    Walls(seed=6, width_px=1280, noise=1.0),
    Walls(seed=7, wall_levels=2.0, noise=0.5, slant=0.2),
    Walls(seed=8, wall_levels=4.0, noise=1.0, quality=80, slant=-0.3, unlike=True),
    Walls(seed=9, width_px=1280, wall_levels=3.0, noise=1.0, quality=90, slant=0.4),
)


@dataclass(frozen=True, slots=True)
class Row:
    """One room at one size; % of the wall, or of the rest, that both cameras see."""

    walls: Walls
    scale: float
    wall_wrong: float
    wall_right: float
    rest_wrong: float
    rest_right: float
    headline: str


def measure(matcher: str, walls: Walls, room: WallRoom, scale: float) -> Row:
    """Match a room at one size."""
    settings = MatchSettings(matcher_named(matcher), room.disparities)
    core = StereoCore(settings, geometry=room.geometry, wanted=DepthWanted(scale=scale))
    processed = core.compute(room.left, room.right, now.monotonic_ns)
    assert processed.disparity is not None
    shares = (
        *wrong_and_right(processed.disparity, room, room.wall, scale),
        *wrong_and_right(processed.disparity, room, ~room.wall, scale),
    )
    return Row(walls, scale, *shares, judge_pair(core, processed).answer.sentence)


def wrong_and_right(found: Values, room: WallRoom, part: NDArray[np.bool_], scale: float) -> tuple[float, float]:
    """Return how much of a part has a wrong value, and a right one, %."""
    counted = part & np.isfinite(room.truth)
    error = np.abs(found - room.truth)[counted]
    limit_px = max(2.0, 1.0 / scale)
    return 100.0 * float((error > limit_px).mean()), 100.0 * float((error <= limit_px).mean())


def main() -> int:
    """Measure and print. Exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser(
        "python -m tests.bench.bench_walls", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--matcher", default=default_matcher().value, help="a matcher's name (default: %(default)s)")
    parser.add_argument("--seeds", type=int, default=0, metavar="N", help="added to the seeds of the rooms")
    options = parser.parse_args()
    rows = []
    for number, kind in enumerate(_KINDS):
        walls = Walls(
            seed=options.seeds + number,
            width_px=kind.width_px,
            wall_levels=kind.wall_levels,
            noise=kind.noise,
            quality=kind.quality,
            slant=kind.slant,
            unlike=kind.unlike,
        )
        room = wall_room(walls)
        rows += [measure(options.matcher, walls, room, scale) for scale in SCALES]
    print(f"{machine()}, {options.matcher}")
    _print(rows)
    verdicts = [_verdict(rows, scale) for scale in SCALES]
    print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _verdict(rows: Sequence[Row], scale: float) -> Verdict:
    worst = max(row.wall_wrong for row in rows if row.scale == scale and not row.walls.wall_levels)
    most = _MOST_FULL if scale == 1 else _MOST_REDUCED
    return Verdict(f"wrong on the worst bare wall, scale {scale:g}", worst <= most, f"{worst:.2f} %", f"{most:g} %")


def _print(rows: Sequence[Row]) -> None:
    table = Table()
    for title in ("px", "texture", "noise", "JPEG", "scale", "wall wrong", "right", "rest wrong", "right", "headline"):
        table.add_column(title, justify="left" if title == "headline" else "right")
    for row in rows:
        walls = row.walls
        known = (walls.width_px, f"{walls.wall_levels:g}", f"{walls.noise:g}", walls.quality or "-", f"{row.scale:g}")
        shares = (row.wall_wrong, row.wall_right, row.rest_wrong, row.rest_right)
        table.add_row(*map(str, known), *(f"{share:.2f}" for share in shares), row.headline[:60])
    Console(width=160).print(table)


if __name__ == "__main__":
    sys.exit(main())
