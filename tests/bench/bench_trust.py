"""Whether mistakes are recognised in the images, and good pairs left alone: `python -m tests.bench.bench_trust [--help]`.

Mistakes are made on given pairs of $SCAN_DATA (rectified ones, and unrectified ones behind rigs) and on rendered rooms
of random furniture, cameras, sizes, light, noise, blur and JPEG quality. Half of the scenes were never looked at while
the limits of `phone_host/diagnostics/image_rules.py` were chosen (`held out`); both halves are shown. A mistake is
recognised if its own name is given and no other blocking one. Good pairs and good runs, several pairs each, must raise
no doubt at all. Figures to reach: 95 % of each kind of scene and half, every mistake 95 % over all; no false alarm.
Exit 4 when one is missed, 3 when there is no SCAN_DATA.
"""

import argparse
import json
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common import now
from phone_host.diagnostics.codes import BLOCKING, Code
from phone_host.diagnostics.image_rules import image_doubts
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import look_at, maps_of
from tests.bench.depth_scenes import Image
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.trust_rooms import room
from tests.bench.trust_scenes import (
    MISTAKES,
    OTHER_SCENE,
    PATTERN,
    SHORT_SEARCH,
    GivenPair,
    given_pairs,
    other_scene,
    short_core,
)

_ROOMS: Final = 100
_ROOMS_WITH_MISTAKES: Final = 20
_PAIRS_OF_A_RUN: Final = 3
_TO_REACH: Final = 0.95
_TUNED_ON: Final = "tuned on"
_HELD_OUT: Final = "held out"
_FAMILIES: Final = (
    "kitti",
    "euroc",
    "stereopi",
    "simplestereo board",
    "simplestereo",
    "opencv board",
    "sourishg board",
)
"""Series of like pairs: mistakes are made on the first of each."""


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    name: str
    kind: str
    half: str
    left: Image
    right: Image
    core: StereoCore


@dataclass(frozen=True, slots=True)
class Row:
    """One judged pair.

    Attributes:
        scene: name.
        kind: given or room.
        half: tuned on or held out.
        mistake: which was made; empty: none.
        outcome: right, other or missed; for good pairs right or alarm.
        doubts: what was named.
        cpu_ms: CPU time of the evidence.
        size_px: width and height.
    """

    scene: str
    kind: str
    half: str
    mistake: str
    outcome: str
    doubts: tuple[str, ...]
    cpu_ms: float
    size_px: tuple[int, int]


def _judge(core: StereoCore, left: Image, right: Image) -> tuple[frozenset[str], float]:
    processed = core.compute(left, right, now.monotonic_ns)
    began = time.process_time()
    evidence = look_at(processed, maps_of(core, processed)).evidence
    took_ms = (time.process_time() - began) * 1e3
    return frozenset(concern.code for concern in image_doubts(evidence)), took_ms


def _good(scene: _Scene, left: Image, right: Image) -> Row:
    found, took_ms = _judge(scene.core, left, right)
    return _row(scene, "", "alarm" if found else "right", found, took_ms)


def _row(scene: _Scene, mistake: str, outcome: str, found: frozenset[str], took_ms: float) -> Row:
    size_px = (scene.left.shape[1], scene.left.shape[0])
    names = tuple(sorted(doubt for doubt in found))
    return Row(scene.name, scene.kind, scene.half, mistake, outcome, names, took_ms, size_px)


def _mistaken(scene: _Scene, foreign: Image) -> Iterator[Row]:
    """Make every mistake on a scene; `foreign` is the right image of another one."""
    for name, (right_names, change) in MISTAKES.items():
        if name == PATTERN and scene.core.rig is not None:
            continue  # it is painted on rows, which unrectified images do not share
        found, took_ms = _judge(scene.core, *change(scene.left, scene.right))
        yield _row(scene, name, _outcome(found, right_names), found, took_ms)
    as_large = cv2.resize(foreign, (scene.right.shape[1], scene.right.shape[0]), interpolation=cv2.INTER_AREA)
    found, took_ms = _judge(scene.core, *other_scene(scene.left, np.asarray(as_large, np.uint8)))
    yield _row(scene, OTHER_SCENE, _outcome(found, frozenset({Code.OTHER_SCENE})), found, took_ms)


def _outcome(found: frozenset[str], right_names: frozenset[str]) -> str:
    if found & right_names and not BLOCKING & (found - right_names):
        return "right"
    return "other" if found else "missed"


@dataclass(frozen=True, slots=True, eq=False)
class GivenJob:
    """A given pair to judge.

    Attributes:
        pair: the pair.
        half: tuned on or held out.
        foreign: the right image of another scene; None: no mistakes are made on this pair.
    """

    pair: GivenPair
    half: str
    foreign: Image | None


def given_jobs(data: Path) -> list[GivenJob]:
    """List all given pairs, with mistakes to be made on the first of each series."""
    pairs = list(given_pairs(data))
    series: Counter[str] = Counter()
    jobs = []
    for number, pair in enumerate(pairs):
        family = next((name for name in _FAMILIES if pair.name.startswith(name)), pair.name)
        series[family] += 1
        others = [other for other in pairs if other.name.split()[0] != pair.name.split()[0]]
        makes = series[family] == 1 and "board" not in family
        foreign = others[(7 * number) % len(others)].right if makes else None
        jobs.append(GivenJob(pair, _TUNED_ON if number % 2 == 0 else _HELD_OUT, foreign))
    return jobs


def given_rows(job: GivenJob) -> list[Row]:
    """Judge a given pair, and the mistakes made on it."""
    cv2.setNumThreads(1)  # the CPU time of a judgement is asked for
    pair = job.pair
    scene = _Scene(pair.name, "given", job.half, pair.left, pair.right, pair.core())
    rows = [_good(scene, scene.left, scene.right)]
    if job.foreign is None:
        return rows
    rows += _mistaken(scene, job.foreign)
    if pair.rig is None:
        found, took_ms = _judge(short_core(pair), pair.left, pair.right)
        outcome = _outcome(found, frozenset({Code.SEARCH_TOO_SHORT}))
        rows.append(_row(scene, SHORT_SEARCH, outcome, found, took_ms))
    return rows


def room_rows(seed: int) -> list[Row]:
    """Judge a short good run in a rendered room; in some rooms make the mistakes as well."""
    cv2.setNumThreads(1)
    made = room(seed)
    half = _TUNED_ON if seed < _ROOMS // 2 else _HELD_OUT
    pairs = made.pairs(_PAIRS_OF_A_RUN)
    scene = _Scene(f"room {seed}", "room", half, *pairs[0], made.core())
    rows = [_good(scene, left, right) for left, right in pairs]
    if seed % (_ROOMS // _ROOMS_WITH_MISTAKES) == 0:
        rows += _mistaken(scene, room(seed + _ROOMS).pairs(1)[0][1])
    return rows


def all_rows(data: Path, jobs: int, progress: Progress) -> list[Row]:
    """Judge everything, in several processes."""
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        parts = [pool.submit(given_rows, job) for job in given_jobs(data)]
        parts += [pool.submit(room_rows, seed) for seed in range(_ROOMS)]
        return [row for part in progress.track(parts, description="scenes") for row in part.result()]


def judge(rows: Sequence[Row]) -> list[Verdict]:
    """Compare with the figures to reach."""
    verdicts = []
    for mistake in (*MISTAKES, OTHER_SCENE, SHORT_SEARCH):
        made = [row for row in rows if row.mistake == mistake]
        verdicts.append(_share(mistake, made))
    for kind in ("given", "room"):
        for half in (_TUNED_ON, _HELD_OUT):
            made = [row for row in rows if row.mistake and (row.kind, row.half) == (kind, half)]
            verdicts.append(_share(f"all mistakes, {kind}, {half}", made))
    for kind, what in (("given", "given pairs"), ("room", "pairs of rendered runs")):
        good = [row for row in rows if not row.mistake and row.kind == kind]
        alarms = sum(row.outcome == "alarm" for row in good)
        verdicts.append(Verdict(f"false alarms, {len(good)} {what}", alarms == 0, str(alarms), "0"))
    return verdicts


def _share(what: str, made: Sequence[Row]) -> Verdict:
    share = sum(row.outcome == "right" for row in made) / max(1, len(made))
    return Verdict(f"recognised: {what} ({len(made)})", share >= _TO_REACH, f"{share:.1%}", f"{_TO_REACH:.0%}")


def _print(rows: Sequence[Row]) -> None:
    table = Table(title="mistakes: right name / other name / missed", title_justify="left")
    groups = [(kind, half) for kind in ("given", "room") for half in (_TUNED_ON, _HELD_OUT)]
    table.add_column("mistake")
    for kind, half in groups:
        table.add_column(f"{kind}, {half}", justify="right")
    for mistake in (*MISTAKES, OTHER_SCENE, SHORT_SEARCH):
        cells = []
        for group in groups:
            found = Counter(row.outcome for row in rows if row.mistake == mistake and (row.kind, row.half) == group)
            cells.append(f"{found['right']} / {found['other']} / {found['missed']}")
        table.add_row(mistake, *cells)
    Console(width=130).print(table)
    for row in rows:
        if row.outcome != "right":
            said = ", ".join(row.doubts) or "nothing"
            print(f"{row.outcome}: {row.scene} ({row.half}), {row.mistake or 'no mistake'}: {said}")
    usual = [row.cpu_ms for row in rows if row.size_px == (640, 480)]
    print(
        f"CPU time of a judgement at 640x480: median {np.median(usual):.0f} ms, 95 % below {np.percentile(usual, 95):.0f} ms"
    )


def main() -> int:
    """Run and print; exit code 3 when there are no images, 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_trust", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="number of processes")
    options = parser.parse_args()
    if not os.environ.get("SCAN_DATA"):
        print("bench_trust was not run: SCAN_DATA does not name the folder of real images", file=sys.stderr)
        return 3
    console = Console(stderr=True)
    try:
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            rows = all_rows(Path(os.environ["SCAN_DATA"]), options.jobs, progress)
    except FileNotFoundError as error:
        print(f"bench_trust was not run: SCAN_DATA has no {error.args[0]}", file=sys.stderr)
        return 3
    verdicts = judge(rows)
    if options.json:
        parts = {"rows": [asdict(row) for row in rows], "verdicts": [asdict(verdict) for verdict in verdicts]}
        print(json.dumps({"machine": str(machine()), "opencv": cv2.__version__, **parts}))
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}")
        _print(rows)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


if __name__ == "__main__":
    sys.exit(main())
