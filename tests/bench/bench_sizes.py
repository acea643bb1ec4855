"""Time and memory of `phone-host stereo` from 0.3 to 50 megapixels: `python -m tests.bench.bench_sizes [--help]`.

Each size is a pair of photographs (JPEG, quality 92) of the demo's still life by two ideal cameras 100 mm apart, whose
rig.yaml was written for 640x480: the program has to scale it. Pairs up to 12 megapixels are rendered, the largest is
enlarged from them. Each run is a process of its own; s: from start to exit; CPU: of all cores;
MB: the peak of its resident set.

wrong: depths off by more than 2 %, % of the pixels that both cameras see and that have a depth. density: share of these
pixels that have one. Both against the exact depth of the scene. The row with `--scale 1` shows what matching 12
megapixels at full size would cost and gain; `--quick` leaves it out.

Figures to reach: a pair of 12 megapixels ends within 10 s and 2 GB. Exit 4 when one is missed.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from phone_host.model import CameraModel, Image
from phone_host.output.rig_yaml import write_rig
from phone_host.scene.scene import demo_scene, matched_rig, rectified_cameras, truth
from phone_host.scene.scene_model import Look, Pose, RectifiedView, Scene
from phone_host.scene.scene_render import render
from phone_host.stereo.rectify import rectify_rig
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.support.plain_scenes import matched_view
from tests.support.point_files import read_pfm

SIZES_PX: Final = ((640, 480), (1632, 1224), (4000, 3000), (8160, 6120))
"""0.3 megapixels: a webcam. 2, 12 and 50: photographs of phones."""

MOST_SECONDS: Final = 10.0
MOST_MEGABYTES: Final = 2000.0
_FIGURE_PX: Final = (4000, 3000)
_WRONG_SHARE: Final = 0.02
_STRIP_ROWS: Final = 250
"""Rendered at a time: a strip of 4000 px takes about 1 GB."""

_LARGEST_RENDERED_PX: Final = 4000
_LAUNCHER: Final = """
import os, subprocess, sys
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, usage = os.wait4(process.pid, 0)
print(usage.ru_utime + usage.ru_stime, usage.ru_maxrss)
sys.exit(os.waitstatus_to_exitcode(status))
"""
"""Starts a program and prints its CPU time, s, and peak memory, KB. Linux counts the memory of whoever starts a program as that
program's, until it runs; this one is small."""

_LOOK: Final = Look(noise_sigma=1.0)


@dataclass(frozen=True, slots=True)
class Row:
    """One run."""

    megapixels: float
    size: str
    options: str
    scale: float
    disparities: int
    seconds: float
    cpu_seconds: float
    megabytes: float
    density: float
    wrong: float


def view_of(size_px: tuple[int, int]) -> RectifiedView:
    """The left camera of the pair at this size."""
    own = matched_view()
    scale = size_px[0] / own.width_px
    g = own.geometry
    geometry = replace(
        g, focal_px=g.focal_px * scale, cx_px=(g.cx_px + 0.5) * scale - 0.5, cy_px=(g.cy_px + 0.5) * scale - 0.5
    )
    return RectifiedView(geometry, *size_px)


def strips_of(view: RectifiedView) -> list[RectifiedView]:
    """The view cut into strips of rows."""
    g = view.geometry
    return [
        RectifiedView(replace(g, cy_px=g.cy_px - top), view.width_px, min(_STRIP_ROWS, view.height_px - top))
        for top in range(0, view.height_px, _STRIP_ROWS)
    ]


def rendered_pair(scene: Scene, view: RectifiedView) -> tuple[Image, Image]:
    """Render both images, strip by strip."""
    strips = [rectified_cameras(strip) for strip in strips_of(view)]
    looks = (replace(_LOOK, seed=1), replace(_LOOK, seed=2))

    def joined(side: int) -> Image:
        cameras: list[tuple[CameraModel, Pose]] = [pair[side] for pair in strips]
        return np.vstack([render(scene, model, pose, looks[side]) for model, pose in cameras])

    return joined(0), joined(1)


def depth_of(scene: Scene, view: RectifiedView) -> NDArray[np.float32]:
    """The exact depth of the pixels that both cameras see, NaN elsewhere."""
    parts = [truth(scene, strip) for strip in strips_of(view)]
    return np.vstack([np.where(part.visible, part.depth_m, np.nan).astype(np.float32) for part in parts])


def write_pairs(folder: Path, progress: Progress) -> None:
    """Write rig.yaml and a pair and its exact depth for each size."""
    scene = demo_scene().at(0.0)
    rig = matched_rig()
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    pair: tuple[Image, Image] | None = None
    for size_px in progress.track(SIZES_PX, description="rendering"):
        if pair is None or size_px[0] <= _LARGEST_RENDERED_PX:
            view = view_of(size_px)
            pair, depth = rendered_pair(scene, view), depth_of(scene, view)
        else:
            pair = tuple(np.asarray(cv2.resize(i, size_px, interpolation=cv2.INTER_CUBIC), np.uint8) for i in pair)  # type: ignore[assignment]
            depth = cv2.resize(depth, size_px, interpolation=cv2.INTER_NEAREST_EXACT)  # type: ignore[assignment]
        assert pair is not None
        for side, image in zip(("left", "right"), pair, strict=True):
            cv2.imwrite(str(folder / f"{side}-{size_px[0]}.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 92])
        np.save(folder / f"depth-{size_px[0]}.npy", depth)


def run_stereo(folder: Path, size_px: tuple[int, int], options: Sequence[str]) -> Row:
    """Run the program on a pair and compare its disparity with the truth."""
    out = folder / "out"
    command = [sys.executable, "-m", "phone_host.cli", "stereo"]
    images = [str(folder / f"{side}-{size_px[0]}.jpg") for side in ("left", "right")]
    rest = ["--calibration", str(folder / "rig.yaml"), "--out", str(out), "--json", *options]
    began_s = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", _LAUNCHER, *command, *images, *rest], capture_output=True, text=True, check=True
    )
    seconds = time.perf_counter() - began_s
    cpu_seconds, kilobytes = (float(word) for word in done.stdout.split())
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    geometry = report["geometry"]
    with np.errstate(divide="ignore"):
        found_m = (
            geometry["focal_px"] * geometry["baseline_m"] / (read_pfm(out / "disparity.pfm") + geometry["doffs_px"])
        )
    exact_m = np.load(folder / f"depth-{size_px[0]}.npy")
    both = np.isfinite(exact_m)
    valued = both & np.isfinite(found_m)
    wrong = np.abs(found_m - exact_m)[valued] > _WRONG_SHARE * exact_m[valued]
    return Row(
        megapixels=size_px[0] * size_px[1] / 1e6,
        size=f"{size_px[0]}x{size_px[1]}",
        options=" ".join(options),
        scale=report["scale"],
        disparities=report["disparities"],
        seconds=seconds,
        cpu_seconds=cpu_seconds,
        megabytes=kilobytes * 1024 / 1e6,
        density=100 * float(valued.sum() / both.sum()),
        wrong=100 * float(wrong.mean()),
    )


def judge(rows: Sequence[Row], load: float) -> list[Verdict]:
    """Compare the run of 12 megapixels with the figures.

    Args:
        rows: the runs.
        load: jobs that wanted a core in the minute before the first of them.
    """
    size = f"{_FIGURE_PX[0]}x{_FIGURE_PX[1]}"
    row = next(row for row in rows if row.size == size and not row.options)
    return [
        Verdict(
            f"time at {size}, beside a load of {load:.0f}",
            row.seconds <= MOST_SECONDS,
            f"{row.seconds:.1f} s",
            f"{MOST_SECONDS:g} s",
        ),
        Verdict(
            f"memory at {size}", row.megabytes <= MOST_MEGABYTES, f"{row.megabytes:.0f} MB", f"{MOST_MEGABYTES:g} MB"
        ),
    ]


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_sizes", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quick", action="store_true", help="leave out the run at full working size")
    options = parser.parse_args()
    runs: list[tuple[tuple[int, int], tuple[str, ...]]] = [(size_px, ()) for size_px in SIZES_PX]
    runs += [] if options.quick else [(_FIGURE_PX, ("--scale", "1"))]
    load = os.getloadavg()[0]
    console = Console(stderr=True)
    with (
        tempfile.TemporaryDirectory() as name,
        Progress(console=console, transient=True, disable=not console.is_terminal) as progress,
    ):
        folder = Path(name)
        write_pairs(folder, progress)
        rows = [run_stereo(folder, *run) for run in progress.track(runs, description="runs")]
    verdicts = judge(rows, load)
    if options.json:
        parts = {"rows": [asdict(row) for row in rows], "verdicts": [asdict(verdict) for verdict in verdicts]}
        print(json.dumps({"machine": str(machine()), "opencv": cv2.__version__, "load": load, **parts}))
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}")
        _print(rows)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _print(rows: Sequence[Row]) -> None:
    table = Table()
    for title in ("MP", "size", "options", "scale", "N", "s", "CPU s", "MB", "density %", "wrong %"):
        table.add_column(title, justify="left" if title in {"size", "options"} else "right")
    for row in rows:
        table.add_row(
            f"{row.megapixels:.1f}",
            row.size,
            row.options,
            f"{row.scale:.2f}",
            str(row.disparities),
            f"{row.seconds:.1f}",
            f"{row.cpu_seconds:.1f}",
            f"{row.megabytes:.0f}",
            f"{row.density:.1f}",
            f"{row.wrong:.2f}",
        )
    Console(width=110).print(table)


if __name__ == "__main__":
    sys.exit(main())
