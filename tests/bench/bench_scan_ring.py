"""Whether a scan takes a place for another that looks alike: `python -m tests.bench.bench_scan_ring [--seeds N] [--walls repeated|unlike] ...`.

A camera goes around a rendered corridor, twice by default. Its walls, floor and posts repeat every 3 m, or nowhere (`--walls unlike --doors unlike`).
Pairs are rendered, matched and scanned as `phone-host scan` does, with a rig that is rectified exactly.

wrong: pairs that have a row in the trajectory, in the model or not, and whose motion since the last such pair is more than 0.25 m or 6 degrees off: when they
were taken, or in the end. loops: closed between views half a lap apart and more, whose motion is as near to the truth; wrong loops: the others. ATE: of all
rows of the trajectory, in the end. out: pairs that are not in the model; of these, rowless ones have no row either. Pairs are kept in the folder of
`--cache`, so that a second run of the same ring does not render again. Exit 4 when a figure is missed.
"""

import argparse
import hashlib
import json
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.progress import track

from common.ledger import StageTimes
from phone_host.geometry.se3 import SE3
from phone_host.model import Processed, RectifiedPair
from phone_host.scan.loop_closing import LoopSettings
from phone_host.scan.pose_source import VisualPoses
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import PoseOrigin, ScannedPair
from phone_host.scan.stretches import ClosedLoop
from phone_host.stereo.match import MatchSettings, create_matcher
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.ring_corridor import GEOMETRY, Ring, RingScene, Walls
from tests.bench.trajectory_errors import trajectory_errors

_DISPARITIES: Final = 96
_WRONG_M, _WRONG_RAD = 0.25, 0.105
_MAX_OUT: Final = 0.05
"""Share of the pairs of a ring: a scan that believes nothing has no wrong places either."""

_MOST_ATE_MM: Final = {Walls.REPEATED: 100.0, Walls.UNLIKE: 56.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What came of one ring."""

    ring: Ring
    pairs: int
    out: int
    rowless: int
    states: dict[str, int]
    wrong: int
    loops: int
    wrong_loops: int
    ate_mm: float
    seconds: float


def processed(scene: RingScene, cache: Path | None) -> Iterator[Processed]:
    """Render and match all pairs, or take them from the cache."""
    matcher = create_matcher(MatchSettings(disparities=_DISPARITIES))
    columns, rows = np.meshgrid(*(np.arange(length, dtype=np.float32) for length in (400, 300)))
    slopes = (columns - GEOMETRY.cx_px) / GEOMETRY.focal_px, (rows - GEOMETRY.cy_px) / GEOMETRY.focal_px
    rays = np.stack([*slopes, np.ones_like(columns)], axis=-1).astype(np.float32)
    for number in range(len(scene.poses)):
        place = None if cache is None else cache / f"{number:05d}.npz"
        if place is not None and place.is_file():
            with np.load(place) as file:
                left, right, disparity = file["left"], file["right"], file["disparity"]
        else:
            left, right = scene.pair(number)
            disparity = matcher.match(RectifiedPair(left, right))
            if place is not None:
                place.parent.mkdir(parents=True, exist_ok=True)
                np.savez(place, left=left, right=right, disparity=disparity)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = GEOMETRY.focal_px * GEOMETRY.baseline_m / np.where(disparity > 0, disparity, np.nan)
        shown, beside = (np.repeat(image[..., np.newaxis], 3, axis=2) for image in (left, right))
        cloud = (rays * depth[..., np.newaxis]).astype(np.float32)
        yield Processed(RectifiedPair(shown, beside), disparity, cloud, StageTimes(), geometry=GEOMETRY)


def run(ring: Ring, options: argparse.Namespace) -> Row:
    """Scan a ring and judge it."""
    scene, began = RingScene(ring), time.monotonic()
    scan = scan_for(ScanWanted(threads=options.threads, loops=None if options.no_loops else LoopSettings()))
    cache = None if options.cache is None else options.cache / _key(ring)
    pairs, console = processed(scene, cache), Console(stderr=True)
    shown = track(pairs, "scanning", len(scene.poses), console=console, disable=not console.is_terminal)
    taken = []
    for number, each in enumerate(shown):
        pair = scan.take(str(number), float(number), each)
        taken.append(pair)
        if options.trace:
            off = (scene.poses[number].inverse() @ scene.poses[0] @ pair.world_camera).pose()
            figures = f"{pair.corners} {pair.overlap:.2f} {np.linalg.norm(off[3:]):.3f} {np.linalg.norm(off[:3]):.3f}"
            print(number, pair.state.value, pair.weakness.value, figures, file=sys.stderr, flush=True)
    scan.model()
    assert isinstance(scan.poses, VisualPoses)
    tracker = scan.poses.tracker
    assert tracker is not None
    rows = _rows(scan.pairs)
    found, truth = [scan.pairs[at].world_camera for at in rows], [scene.poses[at] for at in rows]
    # Half a lap has some turns more than pairs along the way.
    loops = [loop for loop in tracker.closed_loops if loop.there - loop.here > scene.round_m / ring.step_m / 2]
    closed = [_is_near(loop.here_there, _between(scene, loop)) for loop in loops]
    return Row(
        ring=ring,
        pairs=len(scan.pairs),
        out=len(scan.pairs) - scan.fused,
        rowless=len(scan.pairs) - len(rows),
        states=dict(Counter(f"{pair.state.value}, {pair.weakness.value}" for pair in scan.pairs)),
        wrong=len(_wrong(taken, scene.poses) | _wrong(scan.pairs, scene.poses)),
        loops=sum(closed),
        wrong_loops=len(closed) - sum(closed),
        ate_mm=trajectory_errors(found, truth).ate_mm,
        seconds=time.monotonic() - began,
    )


def _key(ring: Ring) -> str:
    """Return a name for a ring's pairs."""
    return hashlib.sha256(repr(ring).encode()).hexdigest()[:16]


def _rows(pairs: Sequence[ScannedPair]) -> list[int]:
    """Return the numbers of the pairs that have a row in the trajectory."""
    return [at for at, pair in enumerate(pairs) if pair.pose_origin is not PoseOrigin.NONE]


def _wrong(pairs: Sequence[ScannedPair], truth: Sequence[SE3]) -> set[int]:
    """Return the numbers of the pairs at wrong places, as seen from the row before."""
    return {
        there
        for here, there in pairwise(_rows(pairs))
        if not _is_near(
            pairs[here].world_camera.inverse() @ pairs[there].world_camera, truth[here].inverse() @ truth[there]
        )
    }


def _between(scene: RingScene, loop: ClosedLoop) -> SE3:
    """Return what a loop should say."""
    return scene.poses[loop.here - 1].inverse() @ scene.poses[loop.there - 1]


def _is_near(found: SE3, truth: SE3) -> bool:
    off = (truth.inverse() @ found).pose()
    return bool(np.linalg.norm(off[3:]) <= _WRONG_M and np.linalg.norm(off[:3]) <= _WRONG_RAD)


def verdicts(rows: Sequence[Row]) -> list[Verdict]:
    """Judge all rings."""
    worst = float(np.max([row.ate_mm for row in rows]))  # NaN, of a ring without a trajectory, is no pass
    out = float(np.max([row.out / row.pairs for row in rows]))
    limit = max(_MOST_ATE_MM[row.ring.walls] for row in rows)
    wrong, wrong_loops = sum(row.wrong for row in rows), sum(row.wrong_loops for row in rows)
    bare = sum(row.ring.laps > 1 and not row.loops for row in rows)
    return [
        Verdict("wrong places", wrong == 0, f"{wrong}", "0"),
        Verdict("wrong loops", wrong_loops == 0, f"{wrong_loops}", "0"),
        Verdict("rings of more than a lap without a loop", bare == 0, f"{bare}", "0"),
        Verdict("pairs out of a ring's model", out <= _MAX_OUT, f"{out:.1%}", f"at most {_MAX_OUT:.0%}"),
        Verdict("worst ATE", worst <= limit, f"{worst:.0f} mm", f"at most {limit:g} mm"),
    ]


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    options = _options()
    cv2.setNumThreads(options.threads)
    rows = []
    for seed in range(options.first, options.first + options.seeds):
        ring = Ring(
            seed=seed,
            walls=Walls(options.walls),
            period_m=options.period,
            size_m=tuple(options.size),
            width_m=options.width,
            camera_m=options.camera,
            equal_doors=options.doors == "equal",
            laps=options.laps,
            step_m=options.step,
        )
        rows.append(run(ring, options))
        if not options.json:
            _print(rows[-1:])
    judged = verdicts(rows)
    if options.json:
        told = {"rows": [asdict(row) for row in rows], "verdicts": [asdict(each) for each in judged]}
        print(
            json.dumps({"machine": str(machine()), "opencv": cv2.__version__, **told}, default=lambda each: each.value)
        )
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}, {options.threads} threads")
        print(*judged, sep="\n")
    return exit_code(judged)


def _options() -> argparse.Namespace:
    ring, parser = Ring(), argparse.ArgumentParser("python -m tests.bench.bench_scan_ring", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--seeds", type=int, default=20, help="rings (default 20)")
    parser.add_argument("--first", type=int, default=1, help="the first one's seed (default 1)")
    parser.add_argument("--walls", choices=[each.value for each in Walls], default=ring.walls.value)
    parser.add_argument("--doors", choices=["equal", "unlike"], default="equal", help="the posts (default equal)")
    parser.add_argument("--period", type=float, default=ring.period_m, help="m (default 3)")
    parser.add_argument("--size", type=float, nargs=2, default=ring.size_m, help="outer sides, m (default 8 6)")
    parser.add_argument("--width", type=float, default=ring.width_m, help="of the corridor, m (default 1.8)")
    parser.add_argument("--camera", type=float, default=ring.camera_m, help="its height, m (default 1.2)")
    parser.add_argument("--laps", type=float, default=ring.laps, help="(default 2)")
    parser.add_argument("--step", type=float, default=ring.step_m, help="from pair to pair, m (default 0.18)")
    parser.add_argument("--threads", type=int, default=2, help="of the native library and of OpenCV (default 2)")
    parser.add_argument("--no-loops", action="store_true", help="close none")
    parser.add_argument("--cache", type=Path, help="folder for rendered and matched pairs, 0.6 MB each")
    parser.add_argument(
        "--trace", action="store_true", help="print each pair: state, corners, overlap, error in m and rad"
    )
    return parser.parse_args()


def _print(rows: Sequence[Row]) -> None:
    for row in rows:
        ring = row.ring
        print(
            f"seed {ring.seed}, {ring.walls.value}, period {ring.period_m:g} m, {ring.size_m[0]:g} x {ring.size_m[1]:g} m: {row.pairs} pairs, {row.out} out, {row.rowless} without a row, wrong {row.wrong}, "
            f"loops {row.loops}, wrong loops {row.wrong_loops}, ATE {row.ate_mm:.0f} mm, {row.seconds:.0f} s; {row.states}",
            flush=True,
        )


if __name__ == "__main__":
    sys.exit(main())
