"""phone-host relief: make a printable relief of one pair of images."""

import argparse
from pathlib import Path
from typing import Final

from common.program.terminal import say
from phone_host.jobs.output_folders import require_alone, require_folder, written_together
from phone_host.jobs.units import bounded_mm
from phone_host.output.atomic import write_bytes
from phone_host.output.json_text import json_text
from phone_host.output.meshes.decimated import NoLibraryError, decimated
from phone_host.output.meshes.formats import mesh_bytes
from phone_host.output.meshes.relief import Relief, Sizes, relief_of
from phone_host.output.meshes.solid import Solid
from phone_host.run.file_pairs import sound_pair
from phone_host.run.progress_bar import step_bar
from phone_host.verbs.picture_pairs import matching_of

_NAMES: Final = ("relief.stl", "relief.3mf")
_TOLERANCE_M: Final = 0.00005
"""0.05 mm: a quarter of a layer."""

_WIDTH_MM: Final = (10.0, 2000.0)
_THICK_MM: Final = (0.1, 1000.0)
"""What printers and mills make: a smaller plaque shows nothing at the tolerance, a larger one is a unit misread."""


def run(options: argparse.Namespace) -> int:
    """Match the pair, raise its depth out of a plate, write it for a slicer."""
    width_m = bounded_mm(options.width, "--width", "100mm", _WIDTH_MM) / 1000
    height_m = bounded_mm(options.height, "--height", "30mm", _THICK_MM) / 1000 if options.height else width_m / 3
    base_m = bounded_mm(options.base, "--base", "2mm", _THICK_MM) / 1000
    sizes = Sizes(width_m=width_m, height_m=height_m, base_m=base_m)
    require_folder(options.out)
    left, right = Path(options.left), Path(options.right)
    with step_bar("reading", None) as watcher:
        pair, concerns = sound_pair(matching_of(options, left), left, right, watcher)
        processed = pair.processed
        assert processed.cloud is not None
        assert processed.geometry is not None
        watcher.say("raising")
        relief = relief_of(processed.cloud, processed.pair.left, processed.geometry.focal_px, sizes)
        solid = _fewer(relief.solid)
    require_alone(options.out)
    with written_together(options.out, *_NAMES) as place:
        for name in _NAMES:
            write_bytes(place / name, mesh_bytes(solid, name.rpartition(".")[2], None))
    doubts = [f"{one.message}; {one.remedy}" for one in concerns]
    files = [str(options.out / name) for name in _NAMES]
    if options.json:
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
