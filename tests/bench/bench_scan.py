"""How well the scan tracks and how fast: `python -m tests.bench.bench_scan [--json] [--runs N] [--seeds N] [--threads N]`.

Uses the sequences of $SCAN_DATA. street: odometry alone on 24 rectified pairs of KITTI, matched by `tandem`, and the same from the right
camera in a mirror; "left against right" needs no truth. room: a clip of 7-Scenes through the tracker's depth input, the given depths in place of
a matcher's; whole, every 2nd to 6th view, and with a tenth dropped at random (20 seeds). rest: 12 pairs of EuRoC's rig, matched by `tandem`, 50 times back and forth. kidnapped: 30 of the room's views cut out, or 15 of them (1 s) black; the camera has returned when half of
what it shows was fused before. self: every second view is fused, the others are
only compared, at the pose that tracking gives them. with loops: the room through the tracker that closes loops; surface: distance of the model of its
poses, fused as for self, from that of the given poses, after registration of the two.

ATE: root mean square after rigid alignment. step: median error of a motion from view to view. end: error of the last pose. The room's
poses come from another depth tracker and are no better than some 15 mm. ms and CPU ms: median a view, odometry, registration and fusion, the median of
the runs. Exit 4 when a figure is missed, 3 when there is no SCAN_DATA.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from phone_host.geometry.se3 import SE3
from phone_host.scan.loop_closing import LoopSettings
from phone_host.scan.odometry import Odometry
from phone_host.scan.stretches import Placed
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking
from phone_host.scan.view import Camera, View, halved
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.scan_clips import Clip, Street, at_rest, room, street, unmirrored
from tests.bench.surface_errors import surface_errors
from tests.bench.trajectory_errors import TrajectoryErrors, trajectory_errors

ROOM: Final = VolumeSettings(voxel_m=0.01, far_m=3.2, truncation_voxels=6.0)
"""A Kinect's depths have 15 mm of noise at the room's walls."""

FINE: Final = VolumeSettings(voxel_m=0.008, far_m=3.0)
"""Of the self-consistency."""

TURNS: Final = 50
STRIDES: Final = (2, 3, 4, 6)
KIDNAPPED_AT: Final = 40
"""The view at which the camera is covered, or goes elsewhere unseen."""

_KNOWN_M: Final = 0.05
_KNOWN_SHARE: Final = 0.5
_DROPPED: Final = 0.1
_OFF_M: Final = 0.03


@dataclass(frozen=True, slots=True)
class Options:
    """How often and with how many threads."""

    runs: int
    seeds: int
    threads: int


@dataclass(frozen=True, slots=True)
class Row:
    """One sequence, tracked in one way."""

    name: str
    views: int
    errors: TrajectoryErrors
    lost: int
    ms: float
    cpu_ms: float


def follow(name: str, clip: Clip) -> tuple[Row, tuple[SE3, ...]]:
    """Odometry alone."""
    odometry, took, lost = Odometry(), [], 0
    for view in clip.views:
        began = time.perf_counter(), time.process_time()
        lost += not odometry.step(view).is_known
        took.append((time.perf_counter() - began[0], time.process_time() - began[1]))
    return _row(name, clip, odometry.poses(), lost, took), odometry.poses()


def track(name: str, clip: Clip, threads: int, loops: LoopSettings | None = None) -> tuple[Row, tuple[SE3, ...]]:
    """Odometry, registration and fusion; with loops the poses are those that the views have in the end."""
    tracker, took, told, poses = Tracker(ROOM, threads, loops=loops), [], [], list[SE3]()
    for view in clip.views:
        began = time.perf_counter(), time.process_time()
        told.append(tracker.track(view))
        took.append((time.perf_counter() - began[0], time.process_time() - began[1]))
        poses.append(told[-1].world_camera)
        _put(poses, told[-1].moved_views)
    _put(poses, tracker.settled())
    return _row(name, clip, poses, sum(each.state is Tracking.LOST for each in told), took), tuple(poses)


def _put(poses: list[SE3], placed: Sequence[Placed]) -> None:
    for each in placed:
        poses[each.number - 1] = each.world_camera


def loop_verdicts(clip: Clip, rows: list[Row], threads: int) -> list[Verdict]:
    """The whole room with loops."""
    (row, poses), (_, again) = (track("room, with loops", clip, threads, LoopSettings()) for _ in range(2))
    rows.append(row)
    off_mm, _ = self_consistency(clip, poses, threads)
    mean_mm, far_mm = surface_errors(clip, poses, FINE, threads)
    same = all(np.array_equal(one.pose(), other.pose()) for one, other in zip(poses, again, strict=True))
    return [
        _below("room, with loops: ATE", row.errors.ate_mm, 18.5, "mm"),
        _below("room, with loops: end", row.errors.end_mm, 28, "mm"),
        _below("room, with loops: self, median", off_mm, 10, "mm"),
        _below("room, with loops: surface, mean", mean_mm, 6.5, "mm"),
        _below("room, with loops: surface, 95 %", far_mm, 16, "mm"),
        Verdict("room, with loops: the same poses in 2 runs", same, "yes" if same else "no", "yes"),
    ]


def _row(name: str, clip: Clip, poses: Sequence[SE3], lost: int, took: Sequence[tuple[float, float]]) -> Row:
    wall, cpu = (1e3 * float(np.median(each)) for each in zip(*took, strict=True))
    return Row(name, len(clip.views), trajectory_errors(poses, clip.truth), lost, wall, cpu)


def self_consistency(clip: Clip, poses: Sequence[SE3], threads: int) -> tuple[float, float]:
    """Fuse every second view; return the median distance of the others' depths to the model, mm, and the share off by more than 3 cm."""
    volume, off = Volume(FINE, threads), []
    for view, pose in zip(clip.views[::2], poses[::2], strict=True):
        volume.fuse(view, pose)
    for view, pose in zip(clip.views[1::2], poses[1::2], strict=True):
        depth, geometry = halved(view.depth_m, view.geometry)
        depth = np.where(depth < FINE.far_m, depth, np.float32(np.nan))
        surface = volume.cast(Camera(geometry, depth.shape, pose))  # without seeds: they would hide what is far off
        off.append(np.abs(surface.points_m[..., 2] - depth).ravel())
    every = np.concatenate(off)
    every = every[np.isfinite(every)]
    return 1e3 * float(np.median(every)), float((every > _OFF_M).mean())


def street_verdicts(scene: Street, rows: list[Row]) -> list[Verdict]:
    """Odometry from either camera."""
    left, seen_left = follow("street, left", scene.left)
    right, seen_right = follow("street, right in a mirror", scene.mirrored)
    rows += [left]
    between = trajectory_errors([unmirrored(pose, scene.baseline_m) for pose in seen_right], seen_left)
    rows.append(Row("street, left against right", right.views, between, right.lost, right.ms, right.cpu_ms))
    return [
        _below("street: ATE", left.errors.ate_mm, 25, "mm"),
        _below("street: step", left.errors.step_mm, 8.5, "mm"),
        _below("street: left against right, end", 100 * between.end_share, 0.10, "%"),
    ]


def room_verdicts(clip: Clip, rows: list[Row], options: Options) -> list[Verdict]:
    """The tracker on the whole clip and on parts of it."""
    every = [track("room", clip, options.threads) for _ in range(options.runs)]
    whole, poses = every[0]
    ms, cpu_ms = (float(np.median([getattr(row, name) for row, _ in every])) for name in ("ms", "cpu_ms"))
    rows.append(Row("room", whole.views, whole.errors, whole.lost, ms, cpu_ms))
    same = all(
        np.array_equal(one.pose(), other.pose())
        for _, again in every[1:]
        for one, other in zip(poses, again, strict=True)
    )
    strided = [
        track(f"room, one view in {n}", clip.only(range(0, len(clip.views), n)), options.threads)[0] for n in STRIDES
    ]
    dropped = [
        track(f"room, a tenth dropped, seed {seed}", clip.only(_kept(clip, seed)), options.threads)[0]
        for seed in range(options.seeds)
    ]
    rows += [*strided, *dropped]
    parts = [*strided, *dropped]
    off_mm, far = self_consistency(clip, poses, options.threads)
    return [
        *kidnap_verdicts(clip, poses, options.threads),
        *loop_verdicts(clip, rows, options.threads),
        _below("room: ATE", whole.errors.ate_mm, 19, "mm"),
        _below("room: end", whole.errors.end_mm, 28, "mm"),
        _below("room: self, median", off_mm, 10.5, "mm"),
        _below("room: self, more than 3 cm off", 100 * far, 10, "%"),
        _below("room: lost, all parts", float(whole.lost + sum(row.lost for row in parts)), 0, "views"),
        _below("room: worst ATE of the parts", max(row.errors.ate_mm for row in parts), 21, "mm"),
        _below("room: time of a view", ms, 30, "ms"),
        _below("room: CPU time of a view", cpu_ms, 45, "ms"),
        Verdict(f"room: the same poses in {len(every)} runs", same, "yes" if same else "no", "yes"),
    ]


def kidnap_verdicts(clip: Clip, whole: Sequence[SE3], threads: int) -> list[Verdict]:
    """The room with 30 views cut out, and with the camera covered for 15 views, one second: is it found again, and is nothing wrong fused?"""
    height, width = clip.views[0].grey.shape
    black = replace(
        clip.views[0],
        grey=np.zeros((height, width), np.uint8),
        colours=np.zeros((height, width, 3), np.uint8),
        depth_m=np.full((height, width), np.nan, np.float32),
    )
    verdicts = []
    for name, hidden in (("30 views cut out", 30), ("covered for 1 s", 15)):
        seen_again, is_cut = KIDNAPPED_AT + hidden, hidden == 30
        tracker, shown, off_mm = Tracker(ROOM, threads), list[int](), [0.0]
        fused_black = waited = returned = 0
        found = False
        for at, view in enumerate(clip.views):
            is_hidden = KIDNAPPED_AT <= at < seen_again
            if is_hidden and is_cut:
                continue
            shown.append(at)
            if at >= seen_again and not found:
                returned = returned or (at if _is_known(tracker.volume, view, whole[at]) else 0)
            told = tracker.track(black if is_hidden else view)
            fused_black += is_hidden and told.is_fused
            found = found or (at >= seen_again and told.is_fused)
            waited += bool(returned) and not found
            off_mm += [_off_mm(joined.world_camera, whole[shown[joined.number - 1]]) for joined in told.joined]
            if told.is_fused and not is_hidden:
                off_mm.append(_off_mm(told.world_camera, whole[at]))
        verdicts += [
            Verdict(f"room, {name}: found again", found, "yes" if found else "no", "yes"),
            _below(f"room, {name}: views from its return until then", float(waited + 1), 3, "views"),
            _below(f"room, {name}: farthest fused pose from the whole clip's", max(off_mm), 50, "mm"),
            _below(f"room, {name}: black views fused", float(fused_black), 0, "views"),
        ]
    return verdicts


def _off_mm(found: SE3, there: SE3) -> float:
    return 1e3 * float(np.linalg.norm((found.inverse() @ there).t_m))


def _is_known(volume: Volume, view: View, pose: SE3) -> bool:
    """Whether the camera has returned: half of what it shows lies on what was fused before."""
    depth, geometry = halved(*halved(view.depth_m, view.geometry))
    depth = np.where(depth < ROOM.far_m, depth, np.float32(np.nan))
    surface = volume.cast(Camera(geometry, depth.shape, pose))
    near = np.abs(surface.points_m[..., 2] - depth) < _KNOWN_M
    return bool(near.sum() >= _KNOWN_SHARE * np.isfinite(depth).sum())


def rest_verdicts(clip: Clip, rows: list[Row], threads: int) -> list[Verdict]:
    """The tracker on a rig at rest, its pairs back and forth."""
    there = range(len(clip.views))
    order = [at for _ in range(TURNS) for at in (*there, *reversed(there))]
    row, poses = track(f"rest, {TURNS} times back and forth", clip.only(order), threads)
    rows.append(row)
    away = 1e3 * np.array([np.linalg.norm(pose.t_m) for pose in poses])
    half = len(away) // 2
    grown = float(away[half:].max() - away[:half].max())
    return [
        _below("rest: farthest from the first pose", float(away.max()), 2, "mm"),
        _below("rest: growth from the first half to the second", grown, 0.1, "mm"),
        _below("rest: lost", row.lost, 0, "views"),
    ]


def _kept(clip: Clip, seed: int) -> list[int]:
    kept = np.random.default_rng(seed).uniform(size=len(clip.views)) >= _DROPPED
    return [int(at) for at in np.flatnonzero(kept)]


def _below(name: str, found: float, most: float, unit: str) -> Verdict:
    return Verdict(name, found <= most, f"{found:.2f} {unit}", f"at most {most:g} {unit}")


def main() -> int:
    """Run and print; exit code 3 when there are no sequences, 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_scan", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(
        "--runs", type=int, default=5, help="of the whole room, at least 2; their medians are told (default 5)"
    )
    parser.add_argument("--threads", type=int, default=2, help="of the native library and of OpenCV (default 2)")
    parser.add_argument("--seeds", type=int, default=20, help="of the views that are dropped (default 20)")
    options = parser.parse_args()
    if not os.environ.get("SCAN_DATA"):
        print("bench_scan was not run: SCAN_DATA does not name the folder of real images", file=sys.stderr)
        return 3
    data, rows = Path(os.environ["SCAN_DATA"]), list[Row]()
    cv2.setNumThreads(options.threads)
    console = Console(stderr=True)
    try:
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task("street", total=3)
            verdicts = street_verdicts(street(data), rows)
            progress.update(task, advance=1, description="rest")
            verdicts += rest_verdicts(at_rest(data), rows, options.threads)
            progress.update(task, advance=1, description="room")
            verdicts += room_verdicts(room(data), rows, Options(max(options.runs, 2), options.seeds, options.threads))
    except FileNotFoundError as error:
        print(f"bench_scan was not run: SCAN_DATA has no {error.filename or error.args[0]}", file=sys.stderr)
        return 3
    if options.json:
        told = {"rows": [asdict(row) for row in rows], "verdicts": [asdict(each) for each in verdicts]}
        print(json.dumps({"machine": str(machine()), "opencv": cv2.__version__, **told}))
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}, {options.threads} threads")
        _print(rows)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _print(rows: Sequence[Row]) -> None:
    table = Table(title="trajectories", title_justify="left")
    for title in ("sequence", "views", "lost", "ATE mm", "step mm", "end mm", "end %", "ms", "CPU ms"):
        table.add_column(title, justify="left" if title == "sequence" else "right")
    for row in rows:
        errors = row.errors
        figures = (errors.ate_mm, errors.step_mm, errors.end_mm, 100 * errors.end_share, row.ms, row.cpu_ms)
        table.add_row(row.name, str(row.views), str(row.lost), *(f"{figure:.2f}" for figure in figures))
    Console(width=130).print(table)


if __name__ == "__main__":
    sys.exit(main())
