"""phone-host export: write a scan or a mesh for other programs and printers."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from common.errors import SettingsError
from common.program.request import Request, option
from common.program.terminal import say
from common.words import counted
from phone_host.jobs.output_folders import require_alone, require_folder, written_together
from phone_host.jobs.units import length_mm
from phone_host.model import UnseenSurface
from phone_host.model.quality import UNSEEN_HELP
from phone_host.output.atomic import write_bytes
from phone_host.output.json_text import json_number, json_text
from phone_host.output.meshes.formats import FORMATS, METRES, WITHOUT_COLOUR, mesh_bytes
from phone_host.output.meshes.solid import Solid
from phone_host.output.model_file import Model, read_model
from phone_host.run.model_job import fewer_triangles, spare_model, usual_tolerance_m, with_unseen

EXAMPLES = """  phone-host export scan --to stl --out print                    # scan: the folder that phone-host scan wrote
  phone-host export scan --to stl,3mf,glb --out print
  phone-host export part.obj --unit mm --to 3mf --out print      # a mesh of another program, in millimetres
  phone-host export scan --to stl --tolerance 0                  # every triangle
  phone-host export scan --to glb --unseen cut                   # only what was in view
"""


def _kinds(text: str, option: str) -> tuple[str, ...]:
    kinds = [word.strip().lower() for word in text.split(",")]
    for kind in kinds:
        if kind not in FORMATS:
            what = f"{option} {text!r} names {kind!r}" if "," in text else f"{option} is {text!r}"
            raise SettingsError(f"{what}, which is no format", f"give some of {','.join(FORMATS)}")
    return tuple(dict.fromkeys(kinds))


def _tolerance_m(text: str, option: str) -> float:
    return 0.0 if text.strip() in {"0", "0mm"} else length_mm(text, option, "0.1mm") / 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportRequest(Request):
    """What export can be told."""

    model: str = option(metavar="MODEL", help="the folder of a scan, or a mesh: .ply, .stl, .obj, .glb, .3mf")
    to: tuple[str, ...] = option(
        "--to", read=_kinds, required=True, metavar="stl,3mf", help="formats: stl, obj, 3ds, ply, 3mf, glb"
    )
    unit: str | None = option(
        "--unit", choices=("m", "mm"), help="unit of a mesh file of another program (default m; our own files say it)"
    )
    tolerance_m: float | None = option(
        "--tolerance",
        read=_tolerance_m,
        metavar="MM",
        help="leave out triangles where the surface stays as near as this; 0: none (default: a tenth of the scan's voxel; none for a mesh file)",
    )
    unseen: UnseenSurface | None = option(
        "--unseen",
        read=lambda text, _: UnseenSurface(text),
        choices=tuple(each.value for each in UnseenSurface),
        help=f"{UNSEEN_HELP} (default: as the scan was told, else fill)",
    )
    out: Path = option(
        "--out", type=Path, default=Path(), metavar="DIR", help="folder for the files (default: the current folder)"
    )


_LARGE_MM: Final = 2000.0
"""Longer than any printer's bed: more likely millimetres taken for metres."""


def run(request: ExportRequest) -> int:
    """Read the model, leave out triangles that say nothing, write each format, say how large it is."""
    require_folder(request.out)
    model = read_model(Path(request.model), request.unit)
    tolerance_m = usual_tolerance_m(model) if request.tolerance_m is None else request.tolerance_m
    files = {f"{model.stem}.{kind}": kind for kind in request.to}
    spare_model(model, (request.out / name for name in files))
    whole = with_unseen(model, request.unseen)
    solid, notes = fewer_triangles(whole.solid, tolerance_m)
    notes = [*whole.notes, *notes]
    require_alone(request.out)
    sizes = {}
    with written_together(request.out, *files) as place:
        for name, kind in files.items():
            content = mesh_bytes(solid, kind, model.axes)
            write_bytes(place / name, content)
            sizes[name] = len(content)
    if request.as_json:
        of_unseen = {
            "unseen": None if whole.choice is None else whole.choice.value,
            "unseen_share": json_number(whole.share),
        }
        print(json_text(_told(request.out, solid, model, sizes, notes) | of_unseen))
    else:
        say(_lines(request.out, solid, model, sizes, notes))
    return 0


def _told(out: Path, solid: Solid, model: Model, sizes: dict[str, int], notes: list[str]) -> dict[str, Any]:
    return {
        "command": "export",
        "model": str(model.path),
        "points": len(solid.points_m),
        "triangles": len(solid.triangles),
        "triangles_before": len(model.solid.triangles),
        "size_mm": [round(length, 3) for length in solid.size_mm],
        "axes": None if model.axes is None else model.axes.text,
        "has_colours": solid.has_colours,
        "files": [{"path": str(out / name), "bytes": size, "unit": _unit(name)} for name, size in sizes.items()],
        "notes": notes,
    }


def _unit(name: str) -> str:
    return "m" if name.endswith(f".{METRES}") else "mm"


def _lines(out: Path, solid: Solid, model: Model, sizes: dict[str, int], notes: list[str]) -> list[str]:
    x, y, z = solid.size_mm
    before, after = len(model.solid.triangles), len(solid.triangles)
    written = f"{after} of {before} triangles" if after < before else counted(after, "triangle")
    lines = [f"{x:.1f} x {y:.1f} x {z:.1f} mm, {written}"]
    if model.axes is not None:
        lines.append(f"axes: {model.axes.text}")
    for name, size in sizes.items():
        lost = "; without colours" if solid.has_colours and name.rpartition(".")[2] in WITHOUT_COLOUR else ""
        unit = "mm" if _unit(name) == "mm" else "metres" if model.axes is None else "metres, y up"
        lines.append(f"written to {out / name} ({size / 1e6:.1f} MB, {unit}{lost})")
    if max(solid.size_mm) > _LARGE_MM:
        notes = [
            *notes,
            f"{max(solid.size_mm) / 1000:.1f} m is large for a print: give --unit mm if the file is in millimetres",
        ]
    return [*lines, *(f"note: {note}" for note in notes)]
