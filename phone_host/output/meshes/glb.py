"""GLB, the binary form of glTF: what browsers, phones and Blender open. Its unit is the metre and y is up, by its specification. Pure.

Source: Khronos, glTF 2.0 Specification, sections 3.4 (axes, unit), 3.7.2 (meshes) and 4 (GLB).
"""

import json
import struct
from typing import Any, Final

import numpy as np

from phone_host.output.axes import Axes
from phone_host.output.meshes.solid import Solid

_FLOAT, _UNSIGNED, _BYTE = 5126, 5125, 5121
_POINTS_TARGET, _CORNERS_TARGET = 34962, 34963
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_MAGIC: Final = 0x46546C67
GENERATOR: Final = "tandemscan"


def glb_bytes(solid: Solid, axes: Axes | None) -> bytes:
    """Return a GLB file, in metres.

    Args:
        solid: the mesh; y up.
        axes: that it had before it was turned, for `read_glb` to turn it back; None: nobody knows.
    """
    points = np.ascontiguousarray(solid.points_m, "<f4")
    parts = [points.tobytes()]
    attributes, accessors = {"POSITION": 0}, [_accessor(0, _FLOAT, len(points), "VEC3")]
    accessors[0] |= {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    if solid.has_colours:
        # COLOR_0 is linear by specification, pictures are sRGB.
        share = solid.colours / 255
        linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        shades = np.full((len(points), 4), 65535, "<u2")
        shades[:, :3] = np.rint(65535 * linear)
        parts.append(shades.tobytes())
        attributes["COLOR_0"] = 1
        accessors.append(_accessor(1, 5123, len(points), "VEC4") | {"normalized": True})
    corners = len(parts)
    parts.append(solid.triangles.astype("<u4").tobytes())
    accessors.append(_accessor(corners, _UNSIGNED, solid.triangles.size, "SCALAR"))
    views, at = [], 0
    for number, part in enumerate(parts):
        target = _CORNERS_TARGET if number == corners else _POINTS_TARGET
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part), "target": target})
        at += len(part)
    told = {
        "asset": {"version": "2.0", "generator": GENERATOR} | ({"extras": {"axes": axes.text}} if axes else {}),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": corners, "mode": 4, "material": 0}]}],
        "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": at}],
    }
    text = json.dumps(told, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", at, _BINARY) + b"".join(parts)
    return struct.pack("<III", _MAGIC, 2, 12 + len(chunks)) + chunks


def _accessor(view: int, kind: int, count: int, shape: str) -> dict[str, Any]:
    return {"bufferView": view, "componentType": kind, "count": count, "type": shape}
