"""3DS, the format of 3D Studio: written in pieces, each with the colours of its faces as materials. Pure.

Limits of the format: at most 65 535 points and faces in a piece, names of ten letters, no unit, no colours of points. Points on the border of two
pieces stand in both; a reader that welds them has the closed mesh again.
Source: chunks as in "3D Studio File Format", Jim Pitts, 1994: u16 id, u32 length with its head, little endian.
"""

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.output.meshes.solid import Solid

MOST: Final = 65_535
"""Points and faces of a piece."""

_SHADES: Final = 6
"""Of each of the three colours: at most 216 materials."""


def three_ds_bytes(solid: Solid) -> bytes:
    """Return a 3DS file in mm."""
    numbers, shades = _materials(solid)
    materials = b"".join(_material(f"COLOUR{at}", shade) for at, shade in enumerate(shades))
    pieces = b"".join(_piece(f"PIECE{at}", solid, faces, numbers) for at, faces in enumerate(_pieces(solid)))
    version = _chunk(0x0002, struct.pack("<I", 3))
    editor = _chunk(
        0x3D3D, _chunk(0x3D3E, struct.pack("<I", 3)), materials, _chunk(0x0100, struct.pack("<f", 1.0)), pieces
    )
    return _chunk(0x4D4D, version, editor)


def _chunk(number: int, *parts: bytes) -> bytes:
    body = b"".join(parts)
    return struct.pack("<HI", number, 6 + len(body)) + body


def _materials(solid: Solid) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return each face's material (T,), and the materials' colours (M, 3): the mean of the faces in each cell of colours."""
    faces = solid.face_colours() if solid.has_colours else np.full((len(solid.triangles), 3), 192, np.uint8)
    cells = faces.astype(np.int64) * _SHADES // 256 @ np.array([_SHADES**2, _SHADES, 1])
    _, numbers, counts = np.unique(cells, return_inverse=True, return_counts=True)
    numbers = numbers.ravel()
    means = np.column_stack([np.bincount(numbers, faces[:, channel]) / counts for channel in range(3)])
    return numbers, np.rint(means).astype(np.uint8)


def _material(name: str, colour: NDArray[np.uint8]) -> bytes:
    shade = _chunk(0x0011, colour.tobytes())
    white = _chunk(0x0011, b"\0\0\0")
    return _chunk(
        0xAFFF,
        _chunk(0xA000, name.encode() + b"\0"),
        _chunk(0xA010, shade),
        _chunk(0xA020, shade),
        _chunk(0xA030, white),
    )


def _pieces(solid: Solid) -> list[NDArray[np.int64]]:
    """Return the faces of each piece, in their order: as many as its points and faces allow."""
    pieces, begin, triangles = [], 0, solid.triangles
    while begin < len(triangles):
        end = min(len(triangles), begin + MOST)
        while len(np.unique(triangles[begin:end])) > MOST:
            end = begin + (end - begin) * 3 // 4
        pieces.append(np.arange(begin, end))
        begin = end
    return pieces


def _piece(name: str, solid: Solid, faces: NDArray[np.int64], numbers: NDArray[np.int64]) -> bytes:
    used, corners = np.unique(solid.triangles[faces], return_inverse=True)
    points = solid.points_mm[used].astype("<f4")
    records = np.zeros(len(faces), np.dtype([("corners", "<u2", 3), ("flags", "<u2")]))
    records["corners"], records["flags"] = corners.reshape(-1, 3), 0b111  # all three edges are visible
    own = numbers[faces]
    groups = b"".join(
        _chunk(
            0x4130,
            f"COLOUR{material}".encode() + b"\0",
            struct.pack("<H", len(chosen)),
            chosen.astype("<u2").tobytes(),
        )
        for material in np.unique(own)
        if len(chosen := np.flatnonzero(own == material))
    )
    mesh = _chunk(
        0x4100,
        _chunk(0x4110, struct.pack("<H", len(points)), points.tobytes()),
        _chunk(0x4160, np.eye(4, 3, dtype="<f4").tobytes()),
        _chunk(0x4120, struct.pack("<H", len(records)), records.tobytes(), groups),
    )
    return _chunk(0x4000, name.encode() + b"\0", mesh)
