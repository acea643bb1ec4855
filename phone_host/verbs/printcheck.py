"""phone-host printcheck: whether a scan or mesh can be printed."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError, SettingsError, UnavailableError
from common.program.commandline import CHECK_FAILED
from common.program.request import Request, option
from common.program.terminal import say
from phone_host.jobs.output_folders import require_alone, require_folder, written_together
from phone_host.jobs.units import length_mm
from phone_host.output.atomic import write_bytes
from phone_host.output.json_text import json_text
from phone_host.output.meshes.decimated import Fixed, NoLibraryError, NotClosedError, fixed
from phone_host.output.meshes.formats import mesh_bytes
from phone_host.output.meshes.printable import Flaw, Printer, Problem, problems
from phone_host.output.meshes.printable_view import picture
from phone_host.output.meshes.solid import Solid
from phone_host.output.model_file import Model
from phone_host.output.upright import upright_model
from phone_host.printers.bed import BED_HELP, USUAL_BED, Bed, parse_bed
from phone_host.run.progress_bar import step_bar

EXAMPLES = """  phone-host printcheck scan                          # scan: the folder that phone-host scan wrote
  phone-host printcheck part.stl --unit mm --bed 180,180,180 --out print    # and draws what is wrong
  phone-host printcheck scan --fix --out print        # cuts a base, drops crumbs, scales; says what it did
"""


def _wall_mm(text: str, option: str) -> float:
    return length_mm(text, option, "0.8mm")


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintcheckRequest(Request):
    """What printcheck can be told."""

    model: str = option(metavar="MODEL", help="the folder of a scan, or a mesh: .ply, .stl, .obj, .glb, .3mf")
    unit: str | None = option(
        "--unit", choices=("m", "mm"), help="unit of a mesh file of another program (default m; our own files say it)"
    )
    up: str | None = option(
        "--up",
        choices=("z", "y", "-y"),
        help="axis of the model that points up (default: -y or y for a scan in the camera's axes, as its report says; z otherwise)",
    )
    bed: Bed | None = option("--bed", read=parse_bed, metavar="X,Y,Z", help=f"{BED_HELP} (default 220,220,250)")
    wall_mm: float = option(
        "--wall", read=_wall_mm, default="0.8mm", metavar="MM", help="least thickness of a wall (default 0.8mm)"
    )
    overhang_deg: float = option(
        "--overhang",
        type=float,
        default=45.0,
        metavar="DEG",
        help="what hangs over by more needs supports (default 45)",
    )
    fix: bool = option("--fix", action="store_true", help="write a mended model, and say what was done")
    out: Path | None = option(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder for a picture of what is wrong and for the mended model (default: nothing is written)",
    )


def run(request: PrintcheckRequest) -> int:
    """Check the model, draw what is wrong, mend it if asked, and check what came of that."""
    printer = _printer(request)
    if request.out is not None:
        require_folder(request.out)
    elif request.fix:
        raise SettingsError("--fix writes a mended model, but no --out is given", "add --out DIR")
    upright = upright_model(Path(request.model), request.unit, request.up)
    model, points = upright.model, upright.points_mm
    triangles = model.solid.triangles
    with step_bar("edges", None) as watcher:
        found = problems(points, triangles, printer, watcher.say)
        mended = _mended(points, triangles, printer, found) if request.fix else None
        left = found if mended is None else problems(mended.points_mm, mended.triangles, printer, watcher.say)
        paths: list[str] = []
        if request.out is not None:
            watcher.say("drawing")
            files = {f"{model.stem}-printcheck.png": _png(points, triangles, found)}
            if mended is not None:
                files[f"{model.stem}-fixed.stl"] = _stl(mended)
            paths = _written(request.out, files)
    if request.as_json:
        print(json_text(_told(model, found, left, mended, paths)))
    else:
        say(_lines(found, left, mended, paths))
    return CHECK_FAILED if any(problem.blocks for problem in left) else 0


def _stl(mended: Fixed) -> bytes:
    points_m = (mended.points_mm / 1000).astype(np.float32)
    return mesh_bytes(Solid(points_m, mended.triangles, np.zeros((0, 3), np.uint8)), "stl", None)


def _written(out: Path, files: dict[str, bytes]) -> list[str]:
    """Write the files into a folder; return their paths, as the user named it."""
    require_alone(out)
    with written_together(out, *files) as place:
        for name, content in files.items():
            write_bytes(place / name, content)
    return [str(out / name) for name in files]


def _printer(request: PrintcheckRequest) -> Printer:
    if not 0 < request.overhang_deg < 90:
        raise SettingsError(f"--overhang is {request.overhang_deg:g}", "give degrees between 0 and 90, for example 45")
    bed = request.bed or USUAL_BED
    return Printer(bed_mm=bed.size_mm, least_wall_mm=request.wall_mm, overhang_deg=request.overhang_deg)


def _mended(points: NDArray[np.float64], triangles: NDArray[np.int32], printer: Printer, found: list[Problem]) -> Fixed:
    needs_base = any(problem.flaw is Flaw.NO_BASE for problem in found)
    try:
        return fixed(points, triangles, printer, needs_base=needs_base)
    except NoLibraryError:
        raise UnavailableError(
            "manifold3d is not installed, so nothing can be mended", "pip install 'tandemscan[print]'"
        ) from None
    except NotClosedError:
        raise DataError(
            "the mesh is not closed, so nothing can be mended", "scan what is missing, or make a relief of one pair"
        ) from None


def _png(points: NDArray[np.float64], triangles: NDArray[np.int32], found: list[Problem]) -> bytes:
    wrong = np.zeros(len(triangles), np.bool_)
    for problem in found:
        if not problem.triangles.all():  # what is wrong everywhere shows nothing
            wrong |= problem.triangles
    return np.asarray(cv2.imencode(".png", picture(points, triangles, wrong))[1]).tobytes()


def _told(
    model: Model, found: list[Problem], left: list[Problem], mended: Fixed | None, files: list[str]
) -> dict[str, object]:
    return {
        "command": "printcheck",
        "model": str(model.path),
        "size_mm": [round(length, 3) for length in model.solid.size_mm],
        "is_printable": not any(problem.blocks for problem in left),
        "problems": [_problem(problem) for problem in found],
        "done": None if mended is None else list(mended.said),
        "left": None if mended is None else [_problem(problem) for problem in left],
        "files": files,
    }


def _problem(problem: Problem) -> dict[str, object]:
    return {
        "kind": problem.flaw.value,
        "problem": problem.sentence,
        "remedy": problem.remedy,
        "triangles": int(problem.triangles.sum()),
        "blocks": problem.blocks,
    }


def _lines(found: list[Problem], left: list[Problem], mended: Fixed | None, files: list[str]) -> list[str]:
    lines = [_verdict(found), *_sentences(found)]
    if mended is not None:
        lines += [f"done: {done}" for done in mended.said] or ["done: nothing, there was nothing to mend"]
        lines += [f"now: {_verdict(left)}", *_sentences(left)]
    return [*lines, f"written to {' and '.join(files)}"] if files else lines


def _verdict(found: list[Problem]) -> str:
    if any(problem.blocks for problem in found):
        return "it cannot be printed as it is"
    return "it can be printed, with care" if found else "it can be printed"


def _sentences(found: list[Problem]) -> list[str]:
    return [f"  {'stop' if problem.blocks else 'note'}: {problem.sentence} ({problem.remedy})" for problem in found]
