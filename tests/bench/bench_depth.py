"""How exact the disparities are on real pairs with ground truth: `python -m tests.bench.bench_depth [--help]`.

Uses the eight scenes of $SCAN_DATA that have ground truth. (middlebury_v3_trainingQ_images has none and is left out.)
The four scenes with fine ground truth are matched in four cases: clean; both images as JPEG of quality 80; the right
image 0.5 px too low; and all of these with the right image darker as well. Each case is matched by each of our matchers
and, as the reference in the same run, by tuned OpenCV: StereoSGBM 3WAY, block 3, left border padded (decision 0002; the
recipe with WLS needs OpenCV's contrib modules and is not included). Only pixels that have known ground truth and that
both cameras see are counted.

density: pixels with a value, %. bad2: values off by more than 2 px, % of the values. fill2: the same over all pixels,
after each pixel without a value has taken the smaller of its neighbours' values in the row. ms/MP: time per megapixel
of the left image; CPU: of all cores. Figures to reach: bad2 and fill2 of `tandem` and `sgbm`, as means over all cases,
below those of the reference. Exit 4 when one is missed, 3 when there is no SCAN_DATA.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from phone_host.model import RectifiedPair
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from tests.bench.depth_accuracy import filled
from tests.bench.depth_scenes import CASES, Image, Scene, Values, scenes
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine


def _by_matcher(name: MatcherName) -> Callable[[Image, Image, int], Values]:
    def match(left: Image, right: Image, disparities: int) -> Values:
        return create_matcher(MatchSettings(name, disparities)).match(RectifiedPair(left, right))

    return match


def tuned_opencv(left: Image, right: Image, disparities: int) -> Values:
    """The reference method."""
    sgbm = cv2.StereoSGBM.create(
        numDisparities=disparities,
        blockSize=3,
        P1=72,
        P2=288,
        disp12MaxDiff=1,
        preFilterCap=31,
        uniquenessRatio=10,
        speckleWindowSize=100,
        speckleRange=2,
        mode=cv2.StereoSGBM_MODE_SGBM_3WAY,
    )
    grey = [
        cv2.copyMakeBorder(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), 0, 0, disparities, 0, cv2.BORDER_REPLICATE)
        for image in (left, right)
    ]
    return sgbm.compute(*grey)[:, disparities:].astype(np.float32) / np.float32(16)


ANCHOR: Final = "tuned OpenCV"
METHODS: Final[dict[str, Callable[[Image, Image, int], Values]]] = {
    **{name.value: _by_matcher(name) for name in MatcherName},
    ANCHOR: tuned_opencv,
}


@dataclass(frozen=True, slots=True)
class Row:
    """One scene in one case by one method, or a mean over several."""

    scene: str
    case: str
    method: str
    density: float
    bad2: float
    fill2: float
    ms_per_mp: float
    cpu_ms_per_mp: float


def measure(scene: Scene, case: str, method: str) -> Row:
    """Match once and score the result."""
    left, right = CASES[case](scene.left, scene.right)
    began_s, cpu_s = time.perf_counter(), time.process_time()
    found = METHODS[method](left, right, scene.disparities)
    took = time.perf_counter() - began_s, time.process_time() - cpu_s
    found = np.where(found > 0, found, np.float32(np.nan))
    counted = np.isfinite(scene.truth)
    valued = counted & np.isfinite(found)
    bad = ~(np.abs(found - scene.truth) <= 2)
    bad_filled = ~(np.abs(filled(found) - scene.truth) <= 2)
    shares = (valued.sum() / counted.sum(), bad[valued].mean(), bad_filled[counted].mean())
    per_mp = (1e9 * seconds / left[..., 0].size for seconds in took)
    return Row(scene.name, case, method, *(100 * float(share) for share in shares), *per_mp)


def mean(rows: Sequence[Row], method: str, case: str = "") -> Row:
    """Mean over all cases of a method, or over one kind of case; each case counts the same."""
    chosen = [row for row in rows if row.method == method and case in {"", row.case}]
    names = ("density", "bad2", "fill2", "ms_per_mp", "cpu_ms_per_mp")
    return Row("mean", case, method, *(float(np.mean([getattr(row, name) for row in chosen])) for name in names))


JUDGED: Final = (MatcherName.TANDEM.value, MatcherName.SGBM.value)
"""`block` is the paper's, for comparison."""


def judge(rows: Sequence[Row]) -> list[Verdict]:
    """Compare our best matchers with the reference."""
    anchor = mean(rows, ANCHOR)
    return [
        Verdict(
            f"{name} of {method}, mean of {len(rows) // len(METHODS)} cases",
            getattr(mean(rows, method), name) < getattr(anchor, name),
            f"{getattr(mean(rows, method), name):.2f} %",
            f"below {getattr(anchor, name):.2f} % of {ANCHOR}",
        )
        for method in JUDGED
        for name in ("bad2", "fill2")
    ]


def main() -> int:
    """Run and print; exit code 3 when there are no images, 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_depth", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    if not os.environ.get("SCAN_DATA"):
        print("bench_depth was not run: SCAN_DATA does not name the folder of real images", file=sys.stderr)
        return 3
    console = Console(stderr=True)
    rows = []
    try:
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            for scene in progress.track(list(scenes(Path(os.environ["SCAN_DATA"]))), description="scenes"):
                rows += [measure(scene, case, method) for case in scene.cases for method in METHODS]
    except FileNotFoundError as error:
        missing = Path(error.args[0] if isinstance(error.args[0], Path) else error.filename).name
        print(f"bench_depth was not run: SCAN_DATA has no {missing}", file=sys.stderr)
        return 3
    verdicts = judge(rows)
    if options.json:
        means = [mean(rows, method, case) for method in METHODS for case in ("", *CASES)]
        parts = {"rows": rows, "means": means, "verdicts": verdicts}
        shown = {name: [asdict(part) for part in content] for name, content in parts.items()}  # type: ignore[attr-defined]
        print(json.dumps({"machine": str(machine()), "opencv": cv2.__version__, **shown}))
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}")
        _print(rows)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _print(rows: Sequence[Row]) -> None:
    table = Table(title=f"{len(rows) // len(METHODS)} cases, the means over them last", title_justify="left")
    for title in ("scene", "case", "method", "density %", "bad2 %", "fill2 %", "ms/MP", "CPU ms/MP"):
        table.add_column(title, justify="left" if title in {"scene", "case", "method"} else "right")
    for row in (*rows, *(mean(rows, method) for method in METHODS)):
        shares = (f"{share:.2f}" for share in (row.density, row.bad2, row.fill2))
        table.add_row(row.scene, row.case, row.method, *shares, f"{row.ms_per_mp:.0f}", f"{row.cpu_ms_per_mp:.0f}")
    Console(width=130).print(table)


if __name__ == "__main__":
    sys.exit(main())
