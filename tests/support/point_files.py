"""Reads disparities and points that the programs wrote, by numpy alone: the programs themselves only write them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from phone_host.model import CloudImage, Disparity
from phone_host.output.ply import PointCloud

_VERTEX = np.dtype([*((name, "<f4") for name in "xyz"), *((name, "u1") for name in ("red", "green", "blue"))])


def read_pfm(path: Path) -> Disparity:
    """Return (H, W) float32, top row first; NaN where the file holds no finite value."""
    disparity = _rows(path, "Pf", 1)[..., 0]
    disparity[~np.isfinite(disparity)] = np.nan
    return disparity


def read_xyz(path: Path) -> CloudImage:
    """Return (H, W, 3) float32, top row first, in the axes of the file."""
    return _rows(path, "PF", 3)


def read_ply(path: Path) -> PointCloud:
    """Read a file that `write_ply` wrote."""
    header, data = path.read_bytes().split(b"end_header\n", 1)
    count = int(header.partition(b"element vertex ")[2].split(b"\n")[0])
    vertices = np.frombuffer(data, _VERTEX)
    assert len(vertices) == count
    points = np.stack([vertices[name] for name in "xyz"], axis=-1).astype(np.float32)
    return PointCloud(points, np.stack([vertices[name] for name in ("red", "green", "blue")], axis=-1))


def _rows(path: Path, magic: str, channels: int) -> NDArray[np.float32]:
    kind, size, scale, values = path.read_bytes().split(b"\n", 3)
    assert (kind.decode(), scale) == (magic, b"-1")
    width, height = (int(each) for each in size.split())
    return np.frombuffer(values, "<f4").reshape(height, width, channels)[::-1].astype(np.float32)
