"""How exact a scan on the mat is: `python -m tests.bench.bench_object [--json] [--poses N] [--seeds N] [--views N] [--sizes VGA,HD] [--objects speckled,plain] [--step DEG]`.

poses: a rendered mat with a ball on it, seen by two unlike cameras from N places a seed, with blur, noise and JPEG; off by, where the object stands (50 mm above
the sheet), and turned by. surface: things of `scene.object_scene` from N views all around, matched by `tandem` and scanned with --mat; the distance of points spread
evenly over the model from the true surface. box: a view taken into a box of 0.3 m at 2 mm, the mat
found and the depth fused, a second of processor time. turntable: `object_turntable`, without a mat.

Painting the mat at 720p takes most of the time: five seconds a place. Exit 4 when a figure is missed.
"""

import argparse
import json
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common import now
from phone_host.geometry.se3 import SE3, vectors_of
from phone_host.model import Processed
from phone_host.scan.blocks import Box
from phone_host.scan.mat import USUAL_MAT, mat_corners, parse_mat
from phone_host.scan.mat_pose import MatScale, fit_mat
from phone_host.scan.mesh import Mesh
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scene.object_scene import ObjectScene, Setting, Size, object_scene
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.object_turntable import turntable_verdicts
from tests.bench.row_table import print_rows
from tests.support.mat_rigs import rig_of
from tests.support.mats import MAT, MatPainter, looking_at, of_right

STANDS_M: Final = np.array([0.0, 0.0, 0.05])
NEAR_M: Final = 0.28
_POINTS: Final = 6000
_MOST_MEAN_MM: Final = {
    ("speckled", Size.VGA): 0.28,
    ("speckled", Size.HD): 0.20,
    ("plain", Size.VGA): 0.60,
}
_BOX: Final = Box((-0.15, -0.15, 0.0025), (0.15, 0.15, 0.3))


@dataclass(frozen=True, slots=True)
class PoseRow:
    """Errors of the mat's pose, of all places of a seed."""

    size: str
    seed: int
    places: int
    lost: int
    mean_mm: float
    p95_mm: float
    p95_degrees: float
    least_corners: int
    cpu_ms: float


@dataclass(frozen=True, slots=True)
class SurfaceRow:
    """How far a model is from the truth, mm, by how much of its volume it is too large, in all and where its surface was seen, and what a view took."""

    name: str
    size: str
    views: int
    lost: int
    mean_mm: float
    rms_mm: float
    p95_mm: float
    outward_mm: float
    seen_percent: float
    volume_percent: float
    voxel_mm: float
    pose_p95_mm: float
    cpu_ms: float


def pose_row(size: str, seed: int, places: int) -> PoseRow:
    """Render a mat from some places and find it."""
    rig = rig_of(size)
    rectifier, random = Rectifier(rig), np.random.default_rng(seed)
    upright = SE3(rectifier.rectification.R_left, np.zeros(3))
    painters = MatPainter(rig.left), MatPainter(rig.right)
    off, turned, least, took, lost = [], [], 999, [], 0
    for place in range(places):
        angle = 2 * math.pi * (place + random.uniform()) / places
        aim = np.array([0, 0, 0.035]) + random.normal(0, 0.01, 3)
        seen = looking_at(angle, math.radians(random.uniform(30, 50)), random.uniform(0.38, 0.46), aim)
        left = painters[0].image(seen, 1000 * seed + place)
        pair = rectifier.rectify(left, painters[1].image(of_right(rig, seen), 1000 * seed + place + 500))
        began = time.process_time()
        corners = mat_corners(pair.left, pair.right, MAT)
        found = fit_mat(MAT.points_m(), corners, rectifier.geometry, pair.epipolar, MatScale(1.0, 0.05))
        took.append(time.process_time() - began)
        least = min(least, *corners.counts)
        if found is None:
            lost += 1
            continue
        truth = upright @ seen
        off.append(1e3 * float(np.linalg.norm(found.camera_mat.apply(STANDS_M) - truth.apply(STANDS_M))))
        turned.append(math.degrees(float(np.linalg.norm(vectors_of(found.camera_mat.R.T @ truth.R)))))
    return PoseRow(
        size=size,
        seed=seed,
        places=places,
        lost=lost,
        mean_mm=float(np.mean(off)),
        p95_mm=float(np.percentile(off, 95)),
        p95_degrees=float(np.percentile(turned, 95)),
        least_corners=least,
        cpu_ms=1e3 * float(np.median(took)),
    )


def surface_row(name: str, size: Size, views: int) -> tuple[SurfaceRow, list[Processed]]:
    """Render a thing, scan it and compare it with the truth."""
    scene = object_scene(name, Setting(size=size, views=views))
    rectifier = Rectifier(scene.rig)
    settings = MatchSettings(matcher=MatcherName.TANDEM, disparities=512)
    core = StereoCore(settings, rectifier, wanted=DepthWanted(search_from_m=NEAR_M))
    scan, seen, took, off = scan_for(ScanWanted(mat=parse_mat(USUAL_MAT))), [], [], []
    for number in range(views):
        view = scene.view(number)
        seen.append(core.compute(view.left, view.right, now.monotonic_ns))
        began = time.process_time()
        told = scan.take(str(number), float(number), seen[-1])
        took.append(time.process_time() - began)
        if told.is_fused:
            off.append(_pose_error_mm(told.world_camera, view.T_mat_left, rectifier))
    model = scan.model()
    away = distances_mm(model.mesh, scene)
    where_seen, whole = too_large_percent(model, scene)
    settings_made = scan.settings
    return (
        SurfaceRow(
            name=name,
            size=size.name,
            views=views,
            lost=views - scan.fused,
            mean_mm=float(np.abs(away).mean()),
            rms_mm=float(np.sqrt((away**2).mean())),
            p95_mm=float(np.percentile(np.abs(away), 95)),
            outward_mm=float(away.mean()),
            seen_percent=where_seen,
            volume_percent=whole,
            voxel_mm=math.nan if settings_made is None else 1e3 * settings_made.voxel_m,
            pose_p95_mm=float(np.percentile(off, 95)),
            cpu_ms=1e3 * float(np.median(took)),
        ),
        seen,
    )


def _pose_error_mm(world_camera: SE3, left: NDArray[np.float64], rectifier: Rectifier) -> float:
    truth = SE3(left[:3, :3] @ rectifier.rectification.R_left.T, left[:3, 3])
    return 1e3 * float(np.linalg.norm(world_camera.inverse().apply(STANDS_M) - truth.inverse().apply(STANDS_M)))


def distances_mm(mesh: Mesh, scene: ObjectScene) -> NDArray[np.float64]:
    """Return how far points spread evenly over a mesh are from the true surface, mm, outward positive."""
    random, points = np.random.default_rng(0), mesh.points_m.astype(np.float64)
    a, b, c = (points[mesh.triangles[:, corner]] for corner in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = random.choice(len(areas), _POINTS, p=areas / areas.sum())
    shares = random.dirichlet([1, 1, 1], _POINTS)
    spread = a[chosen] * shares[:, :1] + b[chosen] * shares[:, 1:2] + c[chosen] * shares[:, 2:]
    return 1e3 * scene.solid.signed_distance(spread)


def too_large_percent(model: ScanModel, scene: ObjectScene) -> tuple[float, float]:
    """Return by how much of the true volume the thing is too large where its surface was seen, and in all, percent."""
    corners = model.mesh.points_m.astype(np.float64)[model.mesh.triangles]
    a, b, c = np.moveaxis(corners, 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    seen = model.seen[model.mesh.triangles].all(axis=1)
    off_m3 = float((areas * scene.solid.signed_distance(corners.mean(axis=1)))[seen].sum())
    true_m3 = scene.solid.volume_m3()
    whole_m3 = float((a * np.cross(b, c)).sum() / 6)
    return 100 * off_m3 / true_m3, 100 * (whole_m3 / true_m3 - 1)


def box_verdict(seen: Sequence[Processed], threads: int) -> Verdict:
    """Take views into a box of 0.3 m at 2 mm: how many a second of processor time?"""
    wanted = ScanWanted(mat=parse_mat(USUAL_MAT), voxel_m=0.002, box=_BOX, threads=threads)
    scan, took = scan_for(wanted), []
    for number, each in enumerate(seen):
        began = time.process_time()
        scan.take(str(number), float(number), each)
        took.append(time.process_time() - began)
    rate = 1 / float(np.median(took[1:]))
    return Verdict("box of 0.3 m at 2 mm: views", rate >= 15, f"{rate:.1f} a second of CPU", "at least 15")


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_object", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--poses", type=int, default=36, help="places of the mat a seed and size; 0: none (default 36)")
    parser.add_argument("--seeds", type=int, default=3, help="of these (default 3)")
    parser.add_argument("--views", type=int, default=24, help="of a thing, all around; 0: none (default 24)")
    parser.add_argument("--sizes", default="VGA,HD", help="of the things' images (default VGA,HD)")
    parser.add_argument("--objects", default="speckled,thin,shiny,plain", help="things (default all)")
    parser.add_argument("--threads", type=int, default=2, help="of the native library and of OpenCV (default 2)")
    parser.add_argument("--step", type=float, default=5.0, help="of the turntable, degrees; 0: none (default 5)")
    options = parser.parse_args()
    cv2.setNumThreads(options.threads)
    poses, surfaces, verdicts = list[PoseRow](), list[SurfaceRow](), list[Verdict]()
    for size in ("vga", "720p") if options.poses else ():
        rows = [pose_row(size, seed, options.poses) for seed in range(options.seeds)]
        poses += rows
        verdicts += [
            _below(f"mat at {size}: p95, worst seed", max(row.p95_mm for row in rows), 0.20, "mm"),
            _below(f"mat at {size}: turned, p95, worst seed", max(row.p95_degrees for row in rows), 0.05, "degrees"),
            _below(f"mat at {size}: not found", float(sum(row.lost for row in rows)), 0, "places"),
        ]
    for shown in [Size[each] for each in options.sizes.split(",")] if options.views else ():
        for name in options.objects.split(","):
            row, seen = surface_row(name, shown, options.views)
            surfaces.append(row)
            most = _MOST_MEAN_MM.get((name, shown))
            if most is not None:
                verdicts.append(_below(f"{name} at {shown.name}: surface, mean", row.mean_mm, most, "mm"))
            large = f"{name} at {shown.name}: volume, where the surface was seen"
            verdicts.append(_below(large, abs(row.seen_percent), 1.0, "% off"))
            verdicts.append(_below(f"{name} at {shown.name}: lost", float(row.lost), 0, "views"))
            if (name, shown) == ("speckled", Size.VGA):
                verdicts.append(box_verdict(seen, options.threads))
    if options.step:
        verdicts += turntable_verdicts(options.step)
    if options.json:
        told = {key: [asdict(row) for row in rows] for key, rows in (("poses", poses), ("surfaces", surfaces))}
        print(json.dumps({"machine": str(machine()), **told, "verdicts": [asdict(each) for each in verdicts]}))
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}, {options.threads} threads")
        print_rows("mat poses", poses)
        print_rows("surfaces", surfaces)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _below(name: str, found: float, most: float, unit: str) -> Verdict:
    return Verdict(name, found <= most, f"{found:.3f} {unit}", f"at most {most:g} {unit}")


if __name__ == "__main__":
    sys.exit(main())
