"""The formats of meshes by name: the only place that knows all of them. Pure."""

from collections.abc import Callable
from typing import Final

import numpy as np

from common.errors import DataError
from phone_host.output.axes import Axes
from phone_host.output.meshes.glb import glb_bytes
from phone_host.output.meshes.obj import obj_bytes, read_obj
from phone_host.output.meshes.ply_mesh import ply_bytes, read_ply_mesh
from phone_host.output.meshes.solid import Solid
from phone_host.output.meshes.stl import read_stl, stl_bytes
from phone_host.output.meshes.three_ds import three_ds_bytes
from phone_host.output.meshes.three_mf import three_mf_bytes

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
    "3mf": lambda solid, _comment: three_mf_bytes(solid),
    "glb": lambda solid, _comment: glb_bytes(solid),
}
_READERS: Final[dict[str, Callable[[bytes, str, float], Solid]]] = {
    "stl": read_stl,
    "obj": read_obj,
    "ply": read_ply_mesh,
}

FORMATS: Final = tuple(_WRITERS)
READABLE: Final = tuple(_READERS)


def mesh_bytes(solid: Solid, kind: str, axes: Axes | None) -> bytes:
    """Return a mesh as a file of one format.

    Args:
        solid: the mesh.
        kind: one of `FORMATS`.
        axes: in which its points are; None: nobody knows. A GLB is turned so that y is up.
    """
    turned = solid
    if kind == METRES and axes is Axes.CAMERA:
        turned = Solid(solid.points_m * Axes.Y_UP.signs, solid.triangles, solid.colours)
    words = OURS_MM.decode() if axes is None else f"{OURS_MM.decode()}; {axes.text}"
    return _WRITERS[kind](turned, words)


def read_mesh(content: bytes, name: str, unit_m: float) -> Solid:
    """Read a mesh file by the ending of its name.

    Args:
        content: of the file; it may come from anybody.
        name: of the file.
        unit_m: its unit, m.

    Raises:
        DataError: it is no mesh, or not in a format that is read.
    """
    kind = name.rpartition(".")[2].lower()
    if kind not in _READERS:
        raise DataError(f"{name} is no mesh that is read", f"give a scan's folder, or {', '.join(_READERS)}")
    with np.errstate(all="ignore"):  # absurd numbers are judged afterwards
        return _READERS[kind](content, name, unit_m)
