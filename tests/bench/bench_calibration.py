"""How exact a calibration is, beside OpenCV's stereo_calib recipe: `python -m tests.bench.bench_calibration [--help]`.

Cases: four real rigs ($SCAN_DATA), untouched and with unlike cameras (right images cropped off-centre, scaled by 0.6,
re-exposed, recompressed at quality 75), and ten rendered rigs of two unlike cameras (calibration_rendered) whose every number is
known. The recipe has the same images, and its own search for corners.

Figures to reach: opencv 13 of 13 used, RMS <= 0.19 px, rows p95 <= 0.25, max <= 1.0 px, found and solved in 2 s; simplestereo RMS <= 0.145 px,
baseline 80.2 within 0.2 mm, squares of boards not used 60.5 within 0.2 mm with a deviation <= 0.6 mm; stereopi from OpenCV's own corners, of which
its search spoils three views, those three found and the baseline within 1.5 % of OpenCV's on the same 27 views; sourishg RMS <= 0.25 px. Unlike: errors of squares at most twice those of the
untouched images, on boards that neither rig was fitted to. Rendered: focal lengths within 0.1 %, baseline 0.2 %, rotation 0.02 degrees, truth inside the
stated 95 % for 90 to 99 % of all parameters; the same of pairs of alike fisheyes of 100 to 138 degrees, from exact corners with noise, all of
whose views must be used. Exit 4 when one is missed, 3 when there is no SCAN_DATA.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from phone_host.calibration.solve.verdict import Calibration, vertical_p95_px
from phone_host.calibration.solve.verdict import judge as judged
from tests.bench.calibration_real import (
    RIGS,
    Corners,
    HeldOut,
    RealRig,
    Recipe,
    Spoiled,
    corners_of,
    held_out,
    ours,
    recipe,
    spoiled,
    unlike,
)
from tests.bench.calibration_rendered import RenderedResult, fisheyes_result, rendered_result
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine

RENDERED: Final = 10
_PROCESSES: Final = 2
FISHEYE_VIEWS: Final = 20
_FISHEYE_SEEDS: Final = 5
_ACROSS_DEG: Final = (100.0, 120.0, 138.0)
_BOTH_FISHEYES: Final = ", ".join(["fisheye>fisheye4"] * 2)
_TIMES: Final = 2.0
"""By how much unlike cameras may be worse than the untouched images."""


@dataclass(frozen=True, slots=True)
class Row:
    """One real rig.

    Attributes:
        rig: its name.
        is_unlike: whether its cameras were made unlike.
        used: pairs used, of `pairs`.
        pairs: pairs looked at.
        rms_px: stereo RMS.
        p95_px: of the rows.
        max_px: of the rows.
        baseline_mm: its length.
        baseline_sigma_mm: its stated uncertainty.
        squares_mm: mean side of the squares of boards that were held out.
        squares_sigma_mm: their deviation.
        held_out: squares of boards that the rig was not fitted to, of those pairs that both variants use.
        seconds: search, and solving.
        verdict: good, usable or reject.
        lenses: what was chosen.
        recipe: OpenCV's answer from its own corners.
        recipe_on_ours: OpenCV's answer from our corners, without views that it can make nothing of.
    """

    rig: str
    is_unlike: bool
    used: int
    pairs: int
    rms_px: float
    p95_px: float
    max_px: float
    baseline_mm: float
    baseline_sigma_mm: float
    squares_mm: float
    squares_sigma_mm: float
    held_out: HeldOut
    seconds: tuple[float, float]
    verdict: str
    lenses: str
    recipe: Recipe
    recipe_on_ours: Recipe


def real_rows(rig: RealRig) -> list[Row]:
    """Calibrate a real rig untouched and unlike; squares are compared on pairs that both used."""
    cases = []
    for change in (None, unlike):
        corners = corners_of(rig, change)
        found, seconds = ours(rig, corners)
        cases.append((change is not None, corners, found, seconds))
    common = frozenset.intersection(*(frozenset(used.name for used in found.used) for _, _, found, _ in cases))
    return [
        _row(rig, corners, found, seconds, common, is_unlike=is_unlike) for is_unlike, corners, found, seconds in cases
    ]


def _row(
    rig: RealRig, corners: Corners, found: Calibration, seconds: float, common: frozenset[str], *, is_unlike: bool
) -> Row:
    fair = [pair for pair in corners.ours if int(pair.name) not in rig.spoiled]
    return Row(
        rig=rig.name,
        is_unlike=is_unlike,
        used=len(found.used),
        pairs=corners.count,
        rms_px=found.rig.rms_stereo_px,
        p95_px=vertical_p95_px(found),
        max_px=float(found.vertical_px.max()),
        baseline_mm=float(np.linalg.norm(found.rig.t_right_left_m)) * 1e3,
        baseline_sigma_mm=found.baseline_sigma_m * 1e3,
        squares_mm=found.squares.mean_m * 1e3,
        squares_sigma_mm=found.squares.sigma_m * 1e3,
        held_out=held_out(rig, corners, common),
        seconds=(corners.our_seconds, seconds),
        verdict=judged(found, found.rejected).verdict.value,
        lenses=", ".join(f"{bend.lens.value} {bend.terms}" for bend in found.bends),
        recipe=recipe(rig.board, corners.theirs, corners.sizes_px),
        recipe_on_ours=recipe(rig.board, fair, corners.sizes_px, to_its_end=True),
    )


def judge_real(rows: Sequence[Row]) -> list[Verdict]:
    """Compare the real rigs with their figures."""
    by_name = {(row.rig, row.is_unlike): row for row in rows}
    verdicts = []
    if ("opencv", False) in by_name:
        row = by_name["opencv", False]
        whole = sum(row.seconds)
        verdicts += [
            Verdict("opencv, pairs used", row.used == 13, f"{row.used}", "13"),
            _most("opencv, RMS", row.rms_px, 0.19, "px"),
            _most("opencv, rows p95", row.p95_px, 0.25, "px"),
            _most("opencv, rows max", row.max_px, 1.0, "px"),
            Verdict("opencv, seconds", whole <= 2.0, f"{row.seconds[0]:.2f} + {row.seconds[1]:.2f} s", "2 s"),
        ]
    if ("simplestereo", False) in by_name:
        row = by_name["simplestereo", False]
        verdicts += [
            _most("simplestereo, RMS", row.rms_px, 0.145, "px"),
            _most("simplestereo, baseline off 80.2 mm", abs(row.baseline_mm - 80.2), 0.2, "mm"),
            _most("simplestereo, squares off 60.5 mm", abs(row.squares_mm - 60.5), 0.2, "mm"),
            _most("simplestereo, deviation of squares", row.squares_sigma_mm, 0.6, "mm"),
        ]
    if ("sourishg", False) in by_name:
        verdicts.append(_most("sourishg, RMS", by_name["sourishg", False].rms_px, 0.25, "px"))
    for name in dict.fromkeys(row.rig for row in rows):
        plain, other = by_name[name, False], by_name[name, True]
        for what, own, untouched in (
            ("scale of boards not used", other.held_out.scale_share, plain.held_out.scale_share),
            ("scatter of their squares", other.held_out.scatter_share, plain.held_out.scatter_share),
        ):
            verdicts.append(
                Verdict(
                    f"{name} unlike, {what}",
                    own <= _TIMES * untouched,
                    f"{100 * own:.2f} %",
                    f"{_TIMES:g} x {100 * untouched:.2f} %",
                )
            )
    return verdicts


def judge_spoiled(found: Spoiled) -> list[Verdict]:
    """Compare what our solver makes of OpenCV's corners with the views that are spoiled, and with OpenCV's baseline."""
    said = ", ".join(map(str, found.found)) or "none"
    off = abs(found.baseline_mm / found.recipe_mm - 1) * 100
    return [
        Verdict(
            f"stereopi, views that OpenCV's corners spoil: found by our solver from those corners, of {len(found.views)}",
            found.found == found.views,
            f"{len(set(found.found) & set(found.views))} ({said})",
            ", ".join(map(str, found.views)),
        ),
        _most(f"stereopi, baseline off OpenCV's on the same {found.used} views", off, 1.5, "%"),
    ]


def judge_rendered(results: Sequence[RenderedResult]) -> list[Verdict]:
    """Compare the rendered rigs with the truth."""
    inside = [each for result in results for each in result.inside]
    share = 100 * float(np.mean(inside))
    return [
        _most("rendered, focal length", 100 * max(r.focal_share for r in results), 0.1, "%"),
        _most("rendered, baseline", 100 * max(r.baseline_share for r in results), 0.2, "%"),
        _most("rendered, rotation", max(r.rotation_deg for r in results), 0.02, "degrees"),
        Verdict(
            f"rendered, truth inside the stated 95 % of {len(inside)} parameters",
            90 <= share <= 99,
            f"{share:.1f} %",
            "90 to 99 %",
        ),
    ]


def judge_fisheyes(results: Sequence[RenderedResult]) -> list[Verdict]:
    """Compare pairs of alike wide fisheyes with the truth: their outermost views tell the lens, so all must be used."""
    wrong = [each.name for each in results if each.lenses != _BOTH_FISHEYES or each.views != FISHEYE_VIEWS]
    inside = [each for result in results for each in result.inside]
    share = 100 * float(np.mean(inside))
    return [
        Verdict(
            f"two alike wide fisheyes: lens known and all {FISHEYE_VIEWS} views used",
            not wrong,
            f"{len(results) - len(wrong)} of {len(results)}" + (f" (not: {'; '.join(wrong)})" if wrong else ""),
            "all",
        ),
        _most(
            "two alike wide fisheyes, corners off by 0.1 px, focal length",
            100 * max(r.focal_share for r in results),
            0.2,
            "%",
        ),
        _most("two alike wide fisheyes, baseline", 100 * max(r.baseline_share for r in results), 0.2, "%"),
        Verdict(
            f"two alike wide fisheyes, truth inside the stated 95 % of {len(inside)} parameters",
            share >= 90,
            f"{share:.1f} %",
            "90 % at least",
        ),
    ]


def _most(what: str, value: float, limit: float, unit: str) -> Verdict:
    return Verdict(what, bool(value <= limit), f"{value:.3g} {unit}", f"{limit:g} {unit}")


def main() -> int:
    """Run and print; exit code 3 when there are no images, 4 when a figure is missed."""
    parser = argparse.ArgumentParser(
        "python -m tests.bench.bench_calibration",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--only", default="", help="real rigs whose name contains this; 'rendered' or 'fisheyes'")
    parser.add_argument("--rigs", type=int, default=RENDERED, help="number of rendered rigs (default: %(default)s)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    if not os.environ.get("SCAN_DATA"):
        print("bench_calibration was not run: SCAN_DATA does not name the folder of real images", file=sys.stderr)
        return 3
    rows = [row for rig in RIGS if options.only in rig.name for row in real_rows(rig)]
    results = _rendered(options.rigs) if options.only in "rendered" else []
    wide = _fisheyes() if options.only in "fisheyes" else []
    verdicts = [
        *judge_real(rows),
        *(judge_rendered(results) if results else []),
        *(judge_fisheyes(wide) if wide else []),
    ]
    for rig in RIGS:
        if rig.spoiled and options.only in rig.name:
            verdicts += judge_spoiled(spoiled(rig))
    results += wide
    if options.json:
        shown = {"real": [asdict(row) for row in rows], "rendered": [asdict(each) for each in results]}
        said = {"verdicts": [asdict(each) for each in verdicts]}
        print(json.dumps({"machine": str(machine()), "opencv": cv2.__version__, **shown, **said}))
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}")
        _print(rows, results)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _rendered(count: int) -> list[RenderedResult]:
    with ProcessPoolExecutor(
        _PROCESSES, mp_context=get_context("spawn"), initializer=cv2.setNumThreads, initargs=(1,)
    ) as pool:
        return list(pool.map(rendered_result, range(count)))


def _fisheyes() -> list[RenderedResult]:
    """The figures for focal length are those of corners ten times worse than a rendered webcam's."""
    seeds = range(_FISHEYE_SEEDS)
    return [
        fisheyes_result(across_deg, 10 * kind + seed) for kind, across_deg in enumerate(_ACROSS_DEG) for seed in seeds
    ]


def _print(rows: Sequence[Row], results: Sequence[RenderedResult]) -> None:
    titles = (
        "rig",
        "used",
        "RMS px",
        "p95",
        "max",
        "baseline mm",
        "squares mm",
        "s search + solve",
        "verdict",
        "lenses",
        "OpenCV: RMS",
        "p95",
        "baseline mm",
    )
    table = Table(*titles, title="real rigs; beside: OpenCV's recipe from its own corners", title_justify="left")
    for row in rows:
        table.add_row(
            f"{row.rig}{' unlike' if row.is_unlike else ''}",
            f"{row.used}/{row.pairs}",
            *(f"{value:.3f}" for value in (row.rms_px, row.p95_px, row.max_px)),
            f"{row.baseline_mm:.2f} ± {row.baseline_sigma_mm:.2f}",
            f"{row.squares_mm:.2f} ± {row.squares_sigma_mm:.2f}",
            f"{row.seconds[0]:.1f} + {row.seconds[1]:.2f}",
            row.verdict,
            row.lenses,
            f"{row.recipe.rms_px:.3f}",
            f"{row.recipe.vertical_p95_px:.2f}",
            f"{row.recipe.baseline_m * 1e3:.2f}",
        )
    console = Console(width=190)
    console.print(table)
    table = Table(
        "rig",
        "lenses (true > found)",
        "views",
        "f %",
        "baseline %",
        "rotation deg",
        "inside",
        "RMS px",
        title="rendered rigs",
        title_justify="left",
    )
    for each in results:
        table.add_row(
            each.name,
            each.lenses,
            str(each.views),
            f"{100 * each.focal_share:.4f}",
            f"{100 * each.baseline_share:.4f}",
            f"{each.rotation_deg:.4f}",
            f"{sum(each.inside)}/{len(each.inside)}",
            f"{each.rms_px:.3f}",
        )
    console.print(table)


if __name__ == "__main__":
    sys.exit(main())
