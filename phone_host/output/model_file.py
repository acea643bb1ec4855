"""A model as the user names it: the folder of a scan, or a mesh file."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import DataError
from common.files import read_input, read_whole
from common.places import Kind, kind_of
from phone_host.model import UnseenSurface
from phone_host.output.axes import Axes
from phone_host.output.meshes.formats import read_mesh
from phone_host.output.meshes.solid import Solid

_MODEL = "model.ply"
_REPORTS: Final = ("report.json", "report-scan.json")
"""The second one is the first, moved aside by another command that has written its own beside the model."""

_UNITS_M: Final = {"m": 1.0, "mm": 0.001}
_MOST_BYTES: Final = 2 << 30
_MOST_REPORT_BYTES: Final = 16 << 20


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Model:
    """A mesh, and what its scan says of it.

    Attributes:
        path: of the mesh.
        stem: name for files made of it.
        solid: the mesh.
        axes: in which its points are; None: nobody says.
        voxel_m: fineness of its scan, m; NaN: of no scan.
        unseen: what the scan made of unseen surface; None: nobody says.
    """

    path: Path
    stem: str
    solid: Solid
    axes: Axes | None
    voxel_m: float
    unseen: UnseenSurface | None = None


def mesh_file(path: Path) -> Path:
    """Return the mesh that a path names: the one in a scan's folder, or the path itself.

    Raises:
        DataError: there is none.
    """
    kind = kind_of(path)
    if kind is Kind.MISSING:
        raise DataError(f"{path} does not exist", "give the folder of a scan, or a mesh file")
    if kind is not Kind.FOLDER:
        return path
    if kind_of(path / _MODEL) is Kind.MISSING:
        raise DataError(f"{path} holds no {_MODEL}", "give the folder that phone-host scan wrote")
    return path / _MODEL


def read_model(path: Path, unit: str | None = None) -> Model:
    """Read a model.

    Args:
        path: the folder of a scan, or a mesh file.
        unit: of a mesh file, m or mm; None: what the file says, as ours and each 3MF do, else the metre.

    Raises:
        DataError: there is none, it is no mesh, or a spoiled one.
    """
    file = mesh_file(path)
    is_scan = file != path
    content = read_input(file, _MOST_BYTES, "check its permissions")
    reports = [_report(path / name) for name in _REPORTS] if is_scan else []
    report = next((told for told in reports if told), {})
    mesh = read_mesh(content, file.name, math.nan if is_scan else _UNITS_M.get(unit or "", math.nan))
    stem = (path.resolve().name or "model") if is_scan else path.stem
    axes = next((axes for axes in Axes if axes.text == report.get("axes")), mesh.axes)
    voxel = report.get("voxel_m")
    voxel_m = float(voxel) if isinstance(voxel, int | float) and 0 < voxel < 1 else math.nan
    unseen = next((each for each in UnseenSurface if each.value == report.get("unseen")), None)
    return Model(path=file, stem=stem, solid=mesh.solid, axes=axes, voxel_m=voxel_m, unseen=unseen)


def _report(path: Path) -> dict[str, object]:
    """Return what a scan's report says of its model; nothing if it is not there or spoiled: the mesh is what counts."""
    try:
        told = json.loads(read_whole(path, _MOST_REPORT_BYTES))
    except (OSError, ValueError, DataError, RecursionError):
        return {}
    model = told.get("model") if isinstance(told, dict) else None
    return model if isinstance(model, dict) else {}
