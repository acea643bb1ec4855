"""A scan's surface as the bytes of one message: a header in JSON, then the patches. Pure.

uint32, little endian: length of the header; the header, UTF-8, with blanks so that what follows begins at a multiple of 4; then for each
patch, in the header's order: points (uint16 x 3: steps from its lowest corner), triangles (uint16 x 3), colours (uint8 x 3), each filled up
to a multiple of 4. A patch without triangles takes away what was in its place. At the end, for each patch with unseen points, a flag (uint8)
for each of its points: 1 where a view measured it; filled up likewise. docs/page.md describes the header.
"""

import struct
from typing import Final

import numpy as np

from phone_host.output.json_text import json_text
from phone_host.web.source import Surface, SurfacePatch

_STEPS: Final = 65_535
_BEYOND: Final = 0.1
"""Of a cube's side: so far beyond it points may lie."""


def surface_bytes(surface: Surface, since: int) -> bytes:
    """Write what of a surface is new.

    Args:
        surface: its patches.
        since: what the reader knows, told again where nothing is new.
    """
    patches = surface.patches
    header = {
        "kind": "surface",
        "begun": surface.begun,
        "newest": patches[-1].number if patches else since,
        "axes": surface.axes,
        "patches": [_entry(each) for each in patches],
    }
    text = json_text(header).encode()
    text += b" " * (-len(text) % 4)
    parts = [part for each in patches for part in _parts(each)]
    flags = [_filled(each.seen.astype(np.uint8).tobytes()) for each in patches if not each.seen.all()]
    return b"".join([struct.pack("<I", len(text)), text, *parts, *flags])


def _entry(patch: SurfacePatch) -> dict[str, object]:
    return {
        "place": list(patch.place),
        "low": [coordinate * patch.side_m for coordinate in patch.place],
        "step": _step_m(patch),
        "points": len(patch.mesh.points_m),
        "triangles": len(patch.mesh.triangles),
        "unseen": int((~patch.seen).sum()),
    }


def _step_m(patch: SurfacePatch) -> float:
    return patch.side_m * (1 + _BEYOND) / _STEPS


def _parts(patch: SurfacePatch) -> tuple[bytes, bytes, bytes]:
    mesh = patch.mesh
    low_m = np.array(patch.place) * patch.side_m
    steps = np.clip(np.rint((mesh.points_m - low_m) / _step_m(patch)), 0, _STEPS).astype("<u2")
    return _filled(steps.tobytes()), _filled(mesh.triangles.astype("<u2").tobytes()), _filled(mesh.colours.tobytes())


def _filled(data: bytes) -> bytes:
    return data + b"\0" * (-len(data) % 4)
