"""An object that turns without a mat: `python -m tests.bench.object_turntable [--step DEG]`. A part of the object benchmark.

The speckled thing of `tests.support.turning_things`, 90 mm high at 0.43 m, on a table that stands still: rendered at 640x480 px with the noise of two
cameras and JPEG, matched by `tandem`, 375 degrees. Distances are those of the model's points from the exact surface, as the scan puts them: nothing is
aligned. Exit 4 when a figure is missed.
"""

import argparse
import math
import sys
import time
from typing import Final

import numpy as np
from rich.console import Console
from rich.progress import track

from phone_host.scan.scan import scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.turntable import TurntablePoses
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.support.turning_things import (
    Size,
    matched_view,
    off_thing_m,
    photographed,
    processed_of,
    turned_scene,
)

_SIZE: Final = Size()
_DISPARITIES: Final = 128
_SPAN_DEG: Final = 375.0


def turntable_verdicts(step_deg: float = 5.0) -> list[Verdict]:
    """Scan the thing.

    Args:
        step_deg: from pair to pair.
    """
    scan, took = scan_for(ScanWanted(turntable=True)), 0.0
    assert isinstance(scan.poses, TurntablePoses)
    count = round(_SPAN_DEG / step_deg) + 1
    console = Console(stderr=True)
    for number in track(range(count), "turning", console=console, transient=True, disable=not console.is_terminal):
        pair = photographed(turned_scene(math.radians(step_deg * number)), _SIZE, number)
        processed = processed_of(matched_view(pair, _SIZE, _DISPARITIES))
        began = time.process_time()
        scan.take(str(number), float(number), processed)
        took += time.process_time() - began
    began = time.process_time()
    points = scan.model().seen_mesh.points_m.astype(np.float64)
    ended, turn = time.process_time() - began, scan.poses.fit.turn
    off_mm = 1e3 * np.abs(off_thing_m(points))
    mean, far = (float(off_mm.mean()), float(np.percentile(off_mm, 95))) if len(off_mm) else (math.nan, math.nan)
    closed_mm = 1e3 * turn.closed_m if turn is not None else math.nan
    name = f"turntable without mat, speckled, steps of {step_deg:g} degrees"
    return [
        Verdict(f"{name}: surface, mean", mean <= 0.6, f"{mean:.3f} mm (95 %: {far:.2f})", "at most 0.6 mm"),
        Verdict(f"{name}: end on beginning", closed_mm <= 1, f"{closed_mm:.3f} mm", "at most 1 mm"),
        Verdict(f"{name}: pairs in the model", scan.fused == count, f"{scan.fused} of {count}", "all"),
        Verdict(
            f"{name}: CPU time", reached=True, found=f"{1e3 * took / count:.0f} ms a pair, {ended:.1f} s in the end"
        ),
    ]


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.object_turntable", description=__doc__)
    parser.add_argument("--step", type=float, default=5.0, metavar="DEG", help="from pair to pair (default 5)")
    verdicts = turntable_verdicts(parser.parse_args().step)
    print(machine(), *verdicts, sep="\n")
    return exit_code(verdicts)


if __name__ == "__main__":
    sys.exit(main())
