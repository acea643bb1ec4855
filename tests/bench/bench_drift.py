"""Whether a rig that turns while it runs is noticed and corrected, and a steady one left alone: `python -m tests.bench.bench_drift [--help]`.

Rendered films of a room through the core that `run` has, judged twice a second as `run` judges: the right camera turns by 0.3
degrees about each axis at once and in steps, its focal length changes by 1 %, somebody walks through half of the image, walls
are bare, the light is out, a pattern repeats. Ten rendered minutes and the given sequences of $SCAN_DATA that came with a rig,
in a loop, must raise no alarm. One film goes through real `board-agent` and `phone-host run`. Exit 4 when a figure is missed, 3 without SCAN_DATA.
"""

import argparse
import json
import math
import multiprocessing
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from phone_host.calibration.drift.fit import values_of
from phone_host.calibration.drift.watch import START_PX, WINDOW
from phone_host.diagnostics.drift import drift_concerns
from phone_host.model import AS_CALIBRATED, Departure, Drift
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from tests.bench.drift_films import (
    Play,
    bare_room,
    checked_wall,
    dark,
    furnished_room,
    in_steps,
    judged_pairs,
    play_rig,
    steady_minutes,
    turned,
    with_walker,
)
from tests.bench.drift_run import seconds_until_told
from tests.bench.drift_watched import Row, Watched, told
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.trust_scenes import GivenPair, given_pairs

_PERIOD_S: Final = 0.5
_TURN_S: Final = 3.0
_TOLD_S: Final = 2.0
_LEFT_PX: Final = 0.3
_PERSON_PX: Final = 0.05
_MOST_SIGMAS: Final = 2.0
"""The walker's own features are late by more than the rest of the room can tell; the estimate must say how little it knows then."""

_FEW: Final = ("bare", "dark", "repeated")
"""Films that show too little: whoever corrects there must be right."""

_LEAST_SEEN: Final = 11
"""Nine rendered minutes (of ten, one shows a pattern that repeats) and two given sequences. The others show a board, or one still
of a bare table: thirty features, which tell the rows to 0.3 to 0.8 px. There nothing is said and nothing is corrected."""

_MINUTES: Final = 10
_SEED: Final = 6
_LOOPS: Final = 3
_LEAST_PAIRS: Final = 12
"""Stills of one scene are looped more often, so that the watch's window fills."""


def _core() -> StereoCore:
    """The disparities do not matter here: the half size is fast."""
    return StereoCore(MatchSettings(MatcherName.SGBM, 96), Rectifier(play_rig()), None, DepthWanted(scale=0.5))


def watch_film(play: Play) -> Row:
    """Watch a film."""
    return _watched(play)[0]


def _watched(play: Play) -> tuple[Row, Watched]:
    watched, told_s, worst, settled, drift = Watched(_core()), float("nan"), 0.0, 0.0, Drift()
    for t_s, left, right, before in judged_pairs(play, play_rig(), _PERIOD_S):
        drift = watched.look(t_s, left, right, before, 1 / play.fps)
        begun = _seen_from_s(play, watched)
        if np.isnan(told_s) and any(change.at_s >= begun for change in drift.changes):
            told_s = t_s - begun
        if not np.isnan(told_s) or not play.acts:
            worst = max(worst, watched.left_px(play.departure_at(t_s)))
        if play.departure_at(t_s) == play.departure_at(t_s - _TOLD_S):
            settled = max(settled, watched.left_px(play.departure_at(t_s)))
    alarms = (*told(drift.changes), *(concern.code for concern in drift_concerns(drift)))
    row = Row(
        play.name,
        told_s,
        watched.left_px(play.departure_at(play.seconds)),
        worst,
        settled,
        alarms,
        drift.features,
        float(np.median(watched.cpu_ms)),
    )
    return row, watched


def _seen_from_s(play: Play, watched: Watched) -> float:
    """Return from when on the departure makes more vertical error than a good calibration may leave; infinity: never."""
    assert watched.model is not None
    everywhere = watched.model.everywhere()
    return next(
        (
            act.from_s
            for act in play.acts
            if np.percentile(np.abs(everywhere @ values_of(act.departure)), 95) >= START_PX
        ),
        float("inf"),
    )


def films() -> list[Play]:
    """All films but the walker's and the long one."""
    found = []
    for fps in (15, 30):
        for axis, name in enumerate(("pitch", "yaw", "roll")):
            for angle in (0.3, -0.3):
                act = turned(_TURN_S + 0.2, axis, angle)
                scene = furnished_room(2 * axis + (angle > 0) + fps)
                found.append(Play(name=f"{name} {angle:+} at {fps}/s", scene=scene, acts=(act,), seconds=6, fps=fps))
    for axis, name in enumerate(("pitch", "yaw", "roll")):
        steps = in_steps(_TURN_S, axis, 0.3, count=6, seconds=6)
        found.append(Play(name=f"{name} +0.3 in 6 steps", scene=furnished_room(40 + axis), acts=steps, seconds=13))
        steps = in_steps(_TURN_S, axis, 0.3, count=6, seconds=15)
        found.append(Play(name=f"{name} +0.3 in 6 slow steps", scene=furnished_room(43 + axis), acts=steps, seconds=21))
    focus = (replace(turned(_TURN_S, 0, 0.0), departure=Departure(focal=1.01)),)
    found.append(Play(name="focus +1 %", scene=furnished_room(50), acts=focus, seconds=6))
    walker = with_walker(furnished_room(51))
    turn = (turned(_TURN_S, 0, 0.3),)
    found.append(Play(name="pitch +0.3, walker", scene=walker, acts=turn, seconds=7))
    found.append(Play(name="pitch +0.3, walker 20 ms late", scene=walker, acts=turn, seconds=7, late_s=0.02))
    for name, scene in (("bare room", bare_room()), ("repeated pattern", checked_wall())):
        found.append(Play(name=f"{name}, pitch +0.3", scene=scene, acts=turn, seconds=7))
    found.append(dark(Play(name="dark room, pitch +0.3", scene=furnished_room(52), acts=turn, seconds=7)))
    return found


@dataclass(frozen=True, slots=True)
class Person:
    """What somebody who walks through half of the image does to the estimate.

    Attributes:
        late_s: by how much later than stated the left image is exposed.
        moved_px: by how much the rows that the latest sightings say move, proven or not, 95th percentile over the image; the largest of all moments.
        sigmas: the same in standard deviations, root mean square over the image, as the estimates state them.
        used_px: what is proven of it, or corrected.
    """

    late_s: float
    moved_px: float
    sigmas: float
    used_px: float


def person(late_s: float) -> Person:
    """Watch a room with and without somebody who walks through it.

    Args:
        late_s: by how much later than stated the left image is exposed.
    """
    room, rows, sigmas, used = furnished_room(51), [], [], 0.0
    for scene in (room, with_walker(room)):
        watched, each = Watched(_core()), []
        play = Play(name="person", scene=scene, seconds=9, late_s=late_s)
        for t_s, left, right, before in judged_pairs(play, play_rig(), _PERIOD_S):
            drift = watched.look(t_s, left, right, before, 1 / play.fps)
            used = max(used, watched.left_px(AS_CALIBRATED), drift.rows_px if drift.judged > WINDOW else 0.0)
            if drift.judged > WINDOW:
                each.append(watched.raw_rows_px())
        rows.append([off_px for off_px, _ in each])
        sigmas.append([sigma_px for _, sigma_px in each])
    moved = [np.abs(one - other) for one, other in zip(*rows, strict=True)]
    shares = [
        float(np.sqrt((off_px**2).mean())) / math.hypot(one, other)
        for off_px, one, other in zip(moved, *sigmas, strict=True)
    ]
    return Person(late_s, max(float(np.percentile(off_px, 95)) for off_px in moved), max(shares), used)


def _sequences(data: Path) -> list[Row]:
    """Loop the given sequences, each pair as a still; every rig as it was calibrated or published.

    KITTI's clip is none: its published rows are off by 0.6 px in one upper corner and by -0.9 px in the other, and are told and corrected.
    """
    rows = []
    families = groupby(given_pairs(data), key=_family)
    for family, pairs in families:
        if family:
            rows.append(_looped(family, list(pairs)))
    return rows


def _family(pair: GivenPair) -> str:
    known = ("euroc", "stereopi", "simplestereo board", "simplestereo", "opencv board", "sourishg board")
    return next((name for name in known if pair.name.startswith(name)), "")


def _looped(family: str, pairs: Sequence[GivenPair]) -> Row:
    watched = Watched(pairs[0].core())
    drift, count = Drift(), 0
    for _ in range(max(_LOOPS, math.ceil(_LEAST_PAIRS / len(pairs)))):
        for pair in pairs:
            drift = watched.look(_PERIOD_S * count, pair.left, pair.right, None, float("nan"))
            count += 1
    alarms = (*told(drift.changes), *(concern.code for concern in drift_concerns(drift)))
    return Row(
        f"{family}, {count} pairs ({drift.state.value})",
        float("nan"),
        drift.rows_px,
        0.0,
        0.0,
        alarms,
        drift.features,
        float(np.median(watched.cpu_ms)),
    )


def euroc_px(data: Path) -> float:
    """Return the mean distance of euroc's features from their rows with the published calibration, px; beyond 1 px matches are wrong."""
    off: list[float] = []
    for pair in given_pairs(data):
        if not pair.name.startswith("euroc"):
            if off:
                break
            continue
        watched = Watched(pair.core())
        watched.look(0.0, pair.left, pair.right, None, float("nan"))
        assert watched.model is not None
        seen = watched.seen[-1].off_px
        off.append(float(np.abs(seen[np.abs(seen) < 1.0]).mean()))
    return float(np.mean(off))


def _verdicts(rows: Sequence[Row], people: Sequence[Person], steady: Sequence[Row], run_s: float) -> list[Verdict]:
    prompt, late = people
    few = [row for row in rows if row.name.startswith(_FEW)]
    turns = [row for row in rows if row not in few]
    slowest = max((row.told_s if not np.isnan(row.told_s) else 99.0) for row in turns)
    left, settled = (max(getattr(row, name) for row in turns) for name in ("left_px", "settled_px"))
    seen, unseen = ([row for row in steady if bool(row.features) is has] for has in (True, False))
    alarms = [row.name for row in steady if any(not word.startswith("corrected") for word in row.alarms)]
    touched = [row.name for row in steady if row.alarms]
    wrong = [
        row.name for row in few if any(word.startswith("corrected") for word in row.alarms) and row.left_px > _LEFT_PX
    ]
    return [
        Verdict("told after", slowest <= _TOLD_S, f"{slowest:.2f} s", f"{_TOLD_S:g} s"),
        Verdict("vertical error left at the end, p95", left <= _LEFT_PX, f"{left:.2f} px", f"{_LEFT_PX} px"),
        Verdict(
            "vertical error from 2 s after each step on, p95",
            settled <= _LEFT_PX,
            f"{settled:.2f} px",
            f"{_LEFT_PX} px",
        ),
        Verdict(f"alarms of {len(seen)} steady rigs", not alarms, "; ".join(alarms) or "none", "none"),
        Verdict(f"corrections of {len(seen)} steady rigs", not touched, "; ".join(touched) or "none", "none"),
        Verdict(
            "steady rigs of which nothing can be told: too few features",
            len(seen) >= _LEAST_SEEN,
            ", ".join(row.name for row in unseen) or "none",
            f"told of {_LEAST_SEEN} at least",
        ),
        Verdict("person moves the rows", prompt.moved_px < _PERSON_PX, f"{prompt.moved_px:.3f} px", f"{_PERSON_PX} px"),
        Verdict(
            "person, images 20 ms late: the estimate, before it is proven",
            late.sigmas <= _MOST_SIGMAS,
            f"{late.sigmas:.1f} of its stated standard deviations ({late.moved_px:.2f} px)",
            f"{_MOST_SIGMAS:g}",
        ),
        Verdict(
            "person, images 20 ms late: what is told or used",
            late.used_px < _PERSON_PX,
            f"{late.used_px:.3f} px",
            f"{_PERSON_PX} px",
        ),
        Verdict("corrected from too few", not wrong, ", ".join(wrong) or "never", "never"),
        Verdict("real run, told after", run_s <= _TOLD_S, f"{run_s:.2f} s", f"{_TOLD_S:g} s"),
    ]


def main() -> int:
    """Run everything, print tables, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=int, default=_MINUTES, help="rendered minutes of a steady rig (figure: 10)")
    parser.add_argument("--seed", type=int, default=_SEED, help="of the steady rigs' rooms (default: %(default)s)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    data = os.environ.get("SCAN_DATA", "")
    if not data:
        print("bench_drift: SCAN_DATA is not set: name the folder of the given sequences", file=sys.stderr)
        return 3
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=spawn, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        minutes = pool.map(watch_film, steady_minutes(options.seed)[: options.minutes])
        turning = pool.map(watch_film, films())
        people = pool.map(person, (0.0, 0.02))
        given, euroc = pool.submit(_sequences, Path(data)), pool.submit(euroc_px, Path(data))
        rows, walked = list(turning), list(people)
        steady = [*minutes, *given.result()]
        mean_px = euroc.result()
    run_s = seconds_until_told()
    verdicts = _verdicts(rows, walked, steady, run_s)
    verdicts.append(Verdict("euroc, imported: |y| mean", mean_px <= 0.13, f"{mean_px:.3f} px", "0.13 px"))
    if options.json:
        parts: dict[str, Sequence[Row | Verdict]] = {"turning": rows, "steady": steady, "verdicts": verdicts}
        shown = {name: [asdict(row) for row in some] for name, some in parts.items()}
        print(json.dumps({"machine": str(machine()), **shown}))
        return exit_code(verdicts)
    console = Console(width=150)
    console.print(machine())
    console.print(_table("a rig that turns", rows))
    console.print(_table("a steady rig", steady))
    for verdict in verdicts:
        console.print(str(verdict))
    return exit_code(verdicts)


def _table(title: str, rows: Sequence[Row]) -> Table:
    table = Table(title=title)
    for name in (
        "film",
        "told after, s",
        "left p95, px",
        "worst after, px",
        "2 s after steps, px",
        "features",
        "CPU, ms",
        "told",
    ):
        table.add_column(name)
    for row in rows:
        numbers = (
            f"{row.told_s:.2f}",
            f"{row.left_px:.2f}",
            f"{row.worst_px:.2f}",
            f"{row.settled_px:.2f}",
            str(row.features),
            f"{row.cpu_ms:.1f}",
        )
        table.add_row(row.name, *numbers, ", ".join(row.alarms))
    return table


if __name__ == "__main__":
    sys.exit(main())
