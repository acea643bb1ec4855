"""Whether the figures of `phone-host quality` are those of the truth: `python -m tests.bench.bench_quality [--help]`.

A wall is rendered at 0.5, 1 and 2 m, facing the cameras and tilted by 20 degrees, with sensor noise of 1 and 4 levels, and measured
as the verb does. Each figure is compared with what the exact disparity and depth of every pixel give. Figures to reach, in each of the
twelve cases: bias within 0.1 % of the distance, sub-pixel RMS and plane RMS within 10 % (the fitted plane takes up what the matcher's
error has of one), fill rate within 1 point, and the offset of each part of the image within 0.1 px (the plane is fitted to the middle
and continued to the edges). Exit 4 when one is missed.
"""

import argparse
import json
import math
import sys
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np
from rich.console import Console
from rich.table import Table

from phone_host.model import Crop, PlaneQuality, Processed, Seen
from phone_host.scene.scene import truth, unlike_rig
from phone_host.scene.scene_model import Look, RectifiedView, Scene, rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.plane_quality import StatedDistance, measure_plane, middle_of
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import disparities_for_near
from tests.bench.drawn_rigs import Floats
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.support.plain_scenes import plane_scene

_DISTANCES_M: Final = (0.5, 1.0, 2.0)
_TILTS_DEG: Final = (0.0, 20.0)
_NOISES: Final = (1.0, 4.0)
_NEAR_M: Final = 0.3
_WRONG_PX: Final = 1.0
"""Disparities further off are wrong matches; no figure counts them."""

_MOST: Final = {
    "bias": 0.001,
    "sub-pixel RMS": 0.1,
    "plane RMS": 0.1,
    "fill rate": 0.01,
    "offset over the image": 0.1,
}
_IN_PX: Final = "offset over the image"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One wall: how it was seen, its figures, and by how much each is off (of `_MOST`, in its order)."""

    distance_m: float
    tilt_deg: float
    noise: float
    bias_share: float
    subpixel_px: float
    rms_mm: float
    fill: float
    off: tuple[float, ...]


def wall(distance_m: float, tilt_deg: float, noise: float) -> Row:
    """Render a wall, measure it, and compare."""
    rig, scene = unlike_rig(), plane_scene(distance_m, math.radians(tilt_deg), seed=3)
    left, right = (
        render(scene, model, pose, Look(noise_sigma=noise, seed=seed))
        for model, pose, seed in zip((rig.left, rig.right), rig_poses(rig), (1, 2), strict=True)
    )
    rectifier = Rectifier(rig)
    count = disparities_for_near(rectifier.geometry, _NEAR_M, rectifier.rectification.width_px)
    done = StereoCore(MatchSettings(default_matcher(), count), rectifier).compute(left, right, lambda: 0)
    height, width = done.pair.left.shape[:2]
    roi = middle_of(width, height)
    counts = np.zeros((height, width), np.bool_)
    counts[_cut(roi)] = True
    assert done.disparity is not None
    assert done.geometry is not None
    x, y, z = rectifier.rectification.R_left[:, 2].tolist()
    found = measure_plane(
        done.disparity,
        done.geometry,
        counts,
        area=Crop(x_px=0, y_px=0, width_px=width, height_px=height),
        truth=StatedDistance(distance_m=distance_m, axis=(x, y, z)),
        unit_px=1.0 if done.search is None else 1 / done.search.scale,
    )
    assert found.seen is Seen.PLANE, found.seen
    return Row(
        distance_m=distance_m,
        tilt_deg=tilt_deg,
        noise=noise,
        bias_share=found.bias_share,
        subpixel_px=found.subpixel_rms_px,
        rms_mm=found.rms_m * 1e3,
        fill=found.fill,
        off=_off(found, done, scene, rectifier),
    )


def _off(found: PlaneQuality, done: Processed, scene: Scene, rectifier: Rectifier) -> tuple[float, ...]:
    """Return by how much each figure differs from that of the truth."""
    assert done.geometry is not None
    height, width = done.pair.left.shape[:2]
    view = RectifiedView(
        geometry=done.geometry, width_px=width, height_px=height, R_rectified_left=rectifier.rectification.R_left
    )
    exact = truth(scene, view)
    error_px = np.asarray(done.disparity, np.float64) - exact.disparity_px
    error_px[np.abs(error_px) > _WRONG_PX] = np.nan
    depth_m = (
        done.geometry.focal_px * done.geometry.baseline_m / (exact.disparity_px + error_px + done.geometry.doffs_px)
    )
    roi = _cut(found.roi)
    off_px, off_m = error_px[roi], (depth_m - exact.depth_m)[roi]
    right = np.isfinite(off_px)
    tiles = [
        abs(one + float(np.nanmedian(off_px)) - float(np.nanmedian(part)))
        for part, one in zip(
            _parts(error_px, found.tiles.fill.shape), found.tiles.offset_px.ravel().tolist(), strict=True
        )
        if np.isfinite(part).mean() > 0.5
    ]
    return (
        abs(found.bias_m - float(np.nanmean(off_m))) / found.true_m,
        abs(found.subpixel_rms_px / float(np.nanstd(off_px)) - 1),
        abs(found.rms_m / float(np.nanstd(off_m)) - 1),
        abs(found.fill - float(right.mean())),
        max(tiles),
    )


def _parts(image: Floats, shape: tuple[int, ...]) -> list[Floats]:
    """Return the image's tiles, row by row."""
    rows = np.array_split(image, shape[0], axis=0)
    return [part for row in rows for part in np.array_split(row, shape[1], axis=1)]


def _cut(crop: Crop) -> tuple[slice, slice]:
    return slice(crop.y_px, crop.y_px + crop.height_px), slice(crop.x_px, crop.x_px + crop.width_px)


def judge(rows: list[Row]) -> list[Verdict]:
    """Compare with the figures to reach: the worst case counts."""
    worst = np.max([row.off for row in rows], axis=0).tolist()
    found = []
    for (what, most), off in zip(_MOST.items(), worst, strict=True):
        if what == _IN_PX:
            shown, limit = f"{off:.3f} px", f"<= {most:g} px"
        else:
            shown, limit = f"{off:.2%}", f"<= {most:.1%}"
        found.append(Verdict(f"{what}, off from the truth by at most", off <= most, shown, limit))
    return found


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_quality", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    rows = [wall(*case) for case in ((d, t, n) for d in _DISTANCES_M for t in _TILTS_DEG for n in _NOISES)]
    verdicts = judge(rows)
    if options.json:
        parts = {"rows": [asdict(row) for row in rows], "verdicts": [asdict(verdict) for verdict in verdicts]}
        print(json.dumps({"machine": str(machine()), **parts}))
        return exit_code(verdicts)
    table = Table(title=str(machine()), title_justify="left")
    heads = ("distance", "tilt", "noise", "bias", "sub-pixel RMS", "plane RMS", "fill rate")
    for head in (*heads, *(f"{what} off" for what in _MOST)):
        table.add_column(head, justify="right")
    for row in rows:
        table.add_row(
            f"{row.distance_m:g} m",
            f"{row.tilt_deg:g}°",
            f"{row.noise:g}",
            f"{row.bias_share:+.2%}",
            f"{row.subpixel_px:.3f} px",
            f"{row.rms_mm:.2f} mm",
            f"{row.fill:.1%}",
            *(f"{off:.4f}" for off in row.off),
        )
    Console(width=150).print(table)
    print(*verdicts, sep="\n")
    return exit_code(verdicts)


if __name__ == "__main__":
    sys.exit(main())
