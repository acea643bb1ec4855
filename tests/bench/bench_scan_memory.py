"""What memory a long scan takes: `python -m tests.bench.bench_scan_memory [--minutes N] [--rest N] [--json]`.

A camera goes along a rendered passage for ten minutes of five pairs a second, 640x480, with exact depth; walls, floor and posts are new all the
time, with papers that never repeat. Then it rests for two minutes. Pairs come as fast as they are taken. What counts is the
process's memory, without files' pages and without what it took before the first pair. Figures to reach: 400 MB in all, and no growth at rest.
Exit 4 when one is missed.
"""

import argparse
import json
import os
import sys
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from common.ledger import StageTimes
from phone_host.geometry.se3 import SE3
from phone_host.model import Processed, RectifiedPair, StereoGeometry
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_wanted import ScanWanted
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.support.plane_films import Plane, plane_at, texture

_HZ: Final = 5
_SIZE: Final = (640, 480)
_GEOMETRY: Final = StereoGeometry(focal_px=530.0, baseline_m=0.1, cx_px=319.5, cy_px=239.5)
_SPEED_M: Final = 0.03
"""From pair to pair."""

_TEXEL_M: Final = 0.004
_PAPERS: Final = 38
"""Of 3.2 m each, one behind the other: 120 m of wall, and no picture may be wider for OpenCV's remap."""

_FAR_M: Final = 4.0
_ASIDE_M, _DOWN_M, _POST_M = 0.9, 0.7, 1.6
_MOST_BYTES: Final = 400e6
_REST_BYTES: Final = 1e6


class Passage:
    """Two walls, a floor, and posts between them and the camera."""

    def __init__(self) -> None:
        self._walls = [
            (plane_at([-_ASIDE_M, 0.0, 0.0], [0.0, -np.pi / 2, 0.0]), _paper(1)),
            (plane_at([_ASIDE_M, 0.0, 0.0], [0.0, np.pi / 2, 0.0]), _paper(101)),
            (plane_at([0.0, _DOWN_M, 0.0], [-np.pi / 2, 0.0, 0.0]), _paper(201)),
        ]
        self._post = texture(999)
        columns, rows = np.meshgrid(*(np.arange(length, dtype=np.float32) for length in _SIZE))
        of = _GEOMETRY
        slopes = (columns - of.cx_px) / of.focal_px, (rows - of.cy_px) / of.focal_px
        self._rays = np.stack([*slopes, np.ones_like(columns)], axis=-1).astype(np.float32)

    def seen(self, world_camera: SE3) -> Processed:
        """Return what a camera sees."""
        depth, grey = np.full(self._rays.shape[:2], np.inf, np.float32), np.zeros(self._rays.shape[:2], np.uint8)
        for plane, paper in self._walls:
            self._show(world_camera, plane, paper, (depth, grey))
        ahead = world_camera.t_m[2]
        for number in range(int(ahead / _POST_M), int((ahead + _FAR_M) / _POST_M) + 1):
            side = 0.6 if number % 2 else -0.6
            face = plane_at([side, 0.0, number * _POST_M], [0.0, 0.3 * (-1) ** number, 0.0])
            shifted = np.roll(self._post, (37 * number, 91 * number), axis=(0, 1))
            self._show(world_camera, face, shifted, (depth, grey), half_m=0.12)
        depth[depth > _FAR_M] = np.nan
        cloud = self._rays * depth[..., np.newaxis]
        disparity = (_GEOMETRY.focal_px * _GEOMETRY.baseline_m / depth).astype(np.float32)
        colours = np.repeat(grey[..., np.newaxis], 3, axis=2)
        return Processed(RectifiedPair(colours, colours), disparity, cloud, StageTimes(), geometry=_GEOMETRY)

    def _show(
        self,
        world_camera: SE3,
        plane: Plane,
        paper: NDArray[np.uint8],
        shown_before: tuple[NDArray[np.float32], NDArray[np.uint8]],
        half_m: float = np.inf,
    ) -> None:
        """Put a plane, or a strip of it, before what is farther."""
        depth, grey = shown_before
        turn, normal = world_camera.R.astype(np.float32), plane.axes[0].astype(np.float32)
        with np.errstate(divide="ignore", invalid="ignore"):
            there = np.float32(plane.axes[0] @ (plane.through_m - world_camera.t_m)) / (self._rays @ (turn.T @ normal))
        points = (self._rays * there[..., np.newaxis]) @ turn.T
        points += (world_camera.t_m - plane.through_m).astype(np.float32)
        across, along = (points @ axis.astype(np.float32) for axis in plane.axes[1:])
        nearer = (there > 0) & (there < depth) & (np.abs(across) < half_m)
        # A wall's long direction is the way, z; the paper's long side is its width.
        far, high = (across, along) if abs(plane.axes[1][2]) > abs(plane.axes[2][2]) else (along, across)
        columns, rows = (np.nan_to_num(each / _TEXEL_M).astype(np.float32) for each in (np.abs(far), high + 2.0))
        shown = cv2.remap(paper, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        depth[nearer], grey[nearer] = there[nearer], np.asarray(shown)[nearer]


def _paper(seed: int) -> NDArray[np.uint8]:
    return np.concatenate([texture(seed + number) for number in range(_PAPERS)], axis=1)


def _pose(way_m: float) -> SE3:
    """Where the camera is: in the middle, looking ahead, a little down, and slowly from side to side."""
    ahead = SE3.of(np.array([0.0, 0.0, 0.0, 0.1 * np.sin(way_m / 2), 0.0, way_m]))
    return (
        ahead
        @ SE3.of(np.array([-0.25, 0.0, 0.0, 0.0, 0.0, 0.0]))
        @ SE3.of(np.array([0, 0.25 * np.sin(way_m / 3), 0, 0, 0, 0]))
    )


def _own_bytes() -> int:
    resident, shared = map(int, Path("/proc/self/statm").read_text().split()[1:3])
    return (resident - shared) * os.sysconf("SC_PAGE_SIZE")


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_scan_memory", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--minutes", type=float, default=10.0, help="of new surface (default 10)")
    parser.add_argument("--rest", type=float, default=2.0, help="minutes at rest afterwards (default 2)")
    parser.add_argument("--threads", type=int, default=2, help="of the native library and of OpenCV (default 2)")
    options = parser.parse_args()
    cv2.setNumThreads(options.threads)
    passage, scan = Passage(), scan_for(ScanWanted(threads=options.threads))
    scan.take("first", 0.0, passage.seen(_pose(0.0)))
    own, states, sizes, at_rest = _own_bytes(), Counter[str](), list[int](), list[int]()
    going, resting = (round(60 * _HZ * minutes) for minutes in (options.minutes, options.rest))
    console = Console(stderr=True)
    for number in track(range(1, going + resting), "scanning", console=console, disable=not console.is_terminal):
        seen = passage.seen(_pose(_SPEED_M * min(number, going)))
        told = scan.take(str(number), number / _HZ, seen)
        states[told.state.value] += 1
        (sizes if number < going else at_rest).append(_own_bytes())
    volume = scan.volume
    assert volume is not None
    half = len(at_rest) // 2
    growth = float(np.median(at_rest[half:])) - float(np.median(at_rest[:half])) if half else 0.0
    most, lost = max(sizes + at_rest) - own, states["lost"]
    verdicts = [
        Verdict(
            f"memory after {options.minutes:g} minutes of new surface, at most",
            most <= _MOST_BYTES,
            _mb(most),
            _mb(_MOST_BYTES),
        ),
        Verdict(f"growth in {options.rest:g} minutes at rest", growth <= _REST_BYTES, _mb(growth), _mb(_REST_BYTES)),
        Verdict("pairs lost", lost == 0, f"{lost} of {going + resting - 1}", "none"),
    ]
    facts = {
        "before_bytes": own,
        "model_bytes": volume.memory_bytes,
        "voxel_m": [scan.poses.begun_voxel_m, volume.settings.voxel_m],
        "blocks_left_out": volume.left_out,
        "states": dict(states),
    }
    if options.json:
        print(json.dumps({"machine": str(machine()), **facts, "verdicts": [asdict(each) for each in verdicts]}))
    else:
        print(machine(), *(f"{name}: {value}" for name, value in facts.items()), *verdicts, sep="\n")
    return exit_code(verdicts)


def _mb(size: float) -> str:
    return f"{size / 1e6:.1f} MB"


if __name__ == "__main__":
    sys.exit(main())
