"""phone-host relief: make a printable relief of one pair of images."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.program.request import Request, option, part
from common.program.terminal import say
from phone_host.jobs.depth import DEFAULT_NEAR_MM, OnePairDepthOptions, crop_of, far_of, near_of
from phone_host.jobs.options import ImageOptions
from phone_host.jobs.output_folders import require_alone, require_folder, written_together
from phone_host.jobs.picture_pairs import matching_of
from phone_host.jobs.units import bounded_mm
from phone_host.model import Crop
from phone_host.output.atomic import write_bytes
from phone_host.output.json_text import json_text
from phone_host.output.meshes.decimated import NoLibraryError, decimated
from phone_host.output.meshes.formats import mesh_bytes
from phone_host.output.meshes.relief import Relief, Sizes, relief_of
from phone_host.output.meshes.solid import Solid
from phone_host.run.file_pairs import sound_pair
from phone_host.run.progress_bar import step_bar

EXAMPLES = """  phone-host relief left.png right.png --calibration rig.yaml --out print
  phone-host relief left.png right.png --calibration rig.yaml --width 150mm --far 2m --out print
"""

_NAMES: Final = ("relief.stl", "relief.3mf")
_TOLERANCE_M: Final = 0.00005
"""0.05 mm: a quarter of a layer."""

_WIDTH_MM: Final = (10.0, 2000.0)
_THICK_MM: Final = (0.1, 1000.0)
"""What printers and mills make: a smaller plaque shows nothing at the tolerance, a larger one is a unit misread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReliefDepthOptions(OnePairDepthOptions):
    """How the pair is matched, and what of it is raised."""

    near_m: float | None = option(
        "--near", read=near_of, metavar="MM", help=f"look for nothing nearer (default: {DEFAULT_NEAR_MM:g} mm)"
    )
    far_m: float | None = option(
        "--far", read=far_of, metavar="MM", help="what is farther is bare plate (default: as the rig can tell)"
    )
    crop: Crop | None = option("--crop", read=crop_of, metavar="X,Y,W,H", help="part of the rectified left image, px")
    disparities: int | None = option("--disparities", type=int, metavar="N", help="search disparities from 0 to N-1 px")


def _thickness_m(example: str) -> Callable[[str, str], float]:
    return lambda text, name: bounded_mm(text, name, example, _THICK_MM) / 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class ReliefRequest(Request):
    """What relief can be told."""

    left: Path = option(type=Path, metavar="LEFT", help="image of the left camera")
    right: Path = option(type=Path, metavar="RIGHT", help="image of the right camera, taken at the same moment")
    depth: ReliefDepthOptions = part(ReliefDepthOptions)
    width_m: float = option(
        "--width",
        read=lambda text, name: bounded_mm(text, name, "100mm", _WIDTH_MM) / 1000,
        metavar="MM",
        default="100mm",
        help="longer side of the plaque (default 100mm)",
    )
    height_m: float | None = option(
        "--height",
        read=_thickness_m("30mm"),
        metavar="MM",
        help="of the relief above its plate at most; what is deeper at that scale is flattened (default: a third of --width)",
    )
    base_m: float = option(
        "--base", read=_thickness_m("2mm"), metavar="MM", default="2mm", help="thickness of the plate (default 2mm)"
    )
    out: Path = option(
        "--out", type=Path, default=Path(), metavar="DIR", help="folder for the files (default: the current folder)"
    )
    pictures: ImageOptions = part(ImageOptions, group="pictures")


def run(request: ReliefRequest) -> int:
    """Match the pair, raise its depth out of a plate, write it for a slicer."""
    height_m = request.width_m / 3 if request.height_m is None else request.height_m
    sizes = Sizes(width_m=request.width_m, height_m=height_m, base_m=request.base_m)
    require_folder(request.out)
    left, right = request.left, request.right
    with step_bar("reading", None) as watcher:
        pair, concerns = sound_pair(matching_of(request.depth, request.pictures, left), left, right, watcher)
        processed = pair.processed
        assert processed.cloud is not None
        assert processed.geometry is not None
        watcher.say("raising")
        relief = relief_of(processed.cloud, processed.pair.left, processed.geometry.focal_px, sizes)
        solid = _fewer(relief.solid)
    require_alone(request.out)
    with written_together(request.out, *_NAMES) as place:
        for name in _NAMES:
            write_bytes(place / name, mesh_bytes(solid, name.rpartition(".")[2], None))
    doubts = [f"{one.message}; {one.remedy}" for one in concerns]
    files = [str(request.out / name) for name in _NAMES]
    if request.as_json:
        told = {
            "command": "relief",
            "size_mm": [round(length, 3) for length in solid.size_mm],
            "triangles": len(solid.triangles),
            "scale": relief.scale,
            "flattened": relief.flattened,
            "covered": round(relief.covered, 4),
            "files": files,
            "doubts": doubts,
        }
        print(json_text(told))
    else:
        say([*_lines(relief, solid), f"written to {' and '.join(files)}", *(f"doubt: {doubt}" for doubt in doubts)])
    return 0


def _fewer(solid: Solid) -> Solid:
    """Leave out triangles that no printer shows, where the library for it is installed."""
    try:
        return decimated(solid, _TOLERANCE_M).solid
    except NoLibraryError:
        return solid


def _lines(relief: Relief, solid: Solid) -> list[str]:
    x, y, z = solid.size_mm
    scale = f"1:{1 / relief.scale:.3g}" if relief.scale < 1 else f"{relief.scale:.3g}:1"
    depth = "" if relief.flattened == 1 else f", depth flattened to {relief.flattened:.0%}"
    return [
        f"{x:.1f} x {y:.1f} x {z:.1f} mm, scale {scale}{depth}, {len(solid.triangles)} triangles",
        f"{relief.covered:.0%} of the picture has a depth; the rest is bare plate",
    ]
