"""The formats of meshes by name: the only place that knows all of them. Pure."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.errors import DataError
from phone_host.output.axes import Axes
from phone_host.output.meshes.glb import glb_bytes, read_glb
from phone_host.output.meshes.obj import obj_bytes, read_obj
from phone_host.output.meshes.ply_mesh import ply_bytes, read_ply_mesh
from phone_host.output.meshes.solid import Solid, weld_seams
from phone_host.output.meshes.stl import read_stl, stl_bytes
from phone_host.output.meshes.three_ds import three_ds_bytes
from phone_host.output.meshes.three_mf import three_mf_bytes
from phone_host.output.meshes.three_mf_read import read_three_mf

METRES: Final = "glb"
"""The only format whose specification wants metres and y up; all others are in mm, in the model's own axes."""

WITHOUT_COLOUR: Final = ("stl",)
OURS_MM: Final = b"tandemscan; unit mm"
"""Stands in the head of STL, OBJ and PLY, so that our own files are read in their unit."""

_WRITERS: Final[dict[str, Callable[[Solid, str], bytes]]] = {
    "stl": stl_bytes,
    "obj": obj_bytes,
    "3ds": lambda solid, _comment: three_ds_bytes(solid),
    "ply": ply_bytes,
}
_READERS: Final[dict[str, Callable[[bytes, str, float], Solid]]] = {
    "stl": read_stl,
    "obj": read_obj,
    "ply": read_ply_mesh,
}
_FIRST_BYTES: Final = {b"glTF": "glb", b"PK\x03\x04": "3mf", b"ply\n": "ply", b"ply\r": "ply"}
"""What a file is, whatever its name."""

_HEAD: Final = 256
_STL_HEAD: Final = 80

FORMATS: Final = (*_WRITERS, "3mf", METRES)
READABLE: Final = (*_READERS, "3mf", METRES)


@dataclass(frozen=True, slots=True, eq=False)
class MeshFile:
    """A mesh of a file.

    Attributes:
        solid: the mesh.
        axes: in which its points are; None: nobody says.
    """

    solid: Solid
    axes: Axes | None


def mesh_bytes(solid: Solid, kind: str, axes: Axes | None) -> bytes:
    """Return a mesh as a file of one format.

    Args:
        solid: the mesh.
        kind: one of `FORMATS`.
        axes: in which its points are; None: nobody knows. A GLB is turned so that y is up.
    """
    if kind == METRES:
        turned = solid if axes is None else Solid(solid.points_m @ axes.to_y_up.T, solid.triangles, solid.colours)
        return glb_bytes(turned, axes)
    if kind == "3mf":
        return three_mf_bytes(solid, axes)
    words = OURS_MM.decode() if axes is None else f"{OURS_MM.decode()}; {axes.text}"
    return _WRITERS[kind](solid, words)


def read_mesh(content: bytes, name: str, unit_m: float = math.nan) -> MeshFile:
    """Read a mesh file: by its first bytes where they say what it is, else by the ending of its name.

    Args:
        content: of the file; it may come from anybody.
        name: of the file.
        unit_m: its unit, m; NaN: what the file says, as ours and each 3MF do, else the metre.

    Raises:
        DataError: it is no mesh, or not in a format that is read.
    """
    kind = _FIRST_BYTES.get(content[:4], name.rpartition(".")[2].lower())
    if kind not in READABLE:
        raise DataError(f"{name} is no mesh that is read", f"give a scan's folder, or {', '.join(READABLE)}")
    has_unit = not math.isnan(unit_m)
    with np.errstate(all="ignore"):  # absurd numbers are judged afterwards
        if kind == METRES:
            solid, axes = read_glb(content, name, unit_m if has_unit else 1.0)
        elif kind == "3mf":
            solid, axes = read_three_mf(content, name, unit_m if has_unit else None)
        else:
            own_m = 0.001 if OURS_MM in content[:_HEAD] else 1.0
            solid = _READERS[kind](content, name, unit_m if has_unit else own_m)
            axes = next((axes for axes in Axes if _states_axes(content[:_HEAD], axes)), None)
    is_ours = OURS_MM in content[:_HEAD] or axes not in (None, Axes.GLTF)
    return MeshFile(solid if is_ours else weld_seams(solid), axes)


def _states_axes(head: bytes, axes: Axes) -> bool:
    """Return whether a file of ours says that it has these axes; an STL says them as far as they fit."""
    said = f"; {axes.text}".encode()
    return said + b"\n" in head or head[:_STL_HEAD].rstrip() == (OURS_MM + said)[:_STL_HEAD].rstrip()
