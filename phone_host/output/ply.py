"""Coloured point clouds and surfaces as binary PLY: metres, x y z float32, red green blue uchar, little endian.

The native library packs the vertices in one pass into one buffer, which is written by one call. Without it, and for very
large images, they are packed some rows at a time. Text PLY by `numpy.savetxt` takes 330 ms for a 640x480 cloud.
Source: Greg Turk, "The PLY Polygon File Format", 1994.
"""

from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.model import CloudImage, Image
from phone_host.native.library import Library, PackJob, native
from phone_host.output.atomic import write_parts
from phone_host.output.axes import Axes
from phone_host.output.strips import strips

_VERTEX = np.dtype([*((name, "<f4") for name in "xyz"), *((name, "u1") for name in ("red", "green", "blue"))])
_SEEN_VERTEX = np.dtype([*((name, _VERTEX[name]) for name in _VERTEX.names or ()), ("seen", "u1")])
_PROPERTIES = (
    "property float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
)
_TRIANGLE = np.dtype([("corners", "u1"), ("numbers", "<i4", 3)])
_MOST_AT_ONCE = 4_000_000  # pixels, 60 MB of vertices; larger images go by strips, which take little memory


@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """Points with colours.

    Attributes:
        points_m: (N, 3) float32, m, all finite.
        colours: (N, 3) uint8, red green blue.
    """

    points_m: NDArray[np.float32]
    colours: NDArray[np.uint8]


def write_ply(path: Path, cloud: CloudImage, colours: Image, axes: Axes = Axes.CAMERA) -> int:
    """Write the finite points of a cloud image with their colours.

    Args:
        path: the file; it appears whole or not at all.
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.
        colours: (H, W) grey or (H, W, 3) BGR, uint8: the rectified left image.
        axes: axes of the file's points.

    Raises:
        OSError: the file cannot be written.
        ValueError: the two sizes differ.
    """
    require_one_size(cloud, colours)
    library = native()
    at_once = isinstance(library, Library) and cloud.shape[0] * cloud.shape[1] <= _MOST_AT_ONCE
    if at_once:
        whole = packed_points(cloud, colours, axes, library)
        count, parts = whole.size, iter([whole.view(np.uint8).data])
    else:
        chosen = _finite(cloud)
        count = int(np.count_nonzero(chosen))
        parts = (
            packed_points(cloud[rows], colours[rows], axes, library).view(np.uint8).data
            for rows in strips(cloud.shape[0], cloud.shape[1])
        )
    write_parts(path, chain([_header(count, axes)], parts))
    return count


def cloud_ply(cloud: CloudImage, colours: Image, axes: Axes = Axes.CAMERA) -> bytes:
    """Return what `write_ply` writes, in memory.

    Args:
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.
        colours: (H, W) grey or (H, W, 3) BGR, uint8: the rectified left image.
        axes: axes of the points.

    Raises:
        ValueError: the two sizes differ.
    """
    points = packed_points(cloud, colours, axes)
    return _header(points.size, axes) + points.tobytes()


def write_surface(
    path: Path,
    cloud: PointCloud,
    triangles: NDArray[np.int32],
    axes: Axes = Axes.CAMERA,
    seen: NDArray[np.bool_] | None = None,
) -> None:
    """Write a surface with its colours.

    Args:
        path: the file; it appears whole or not at all.
        cloud: its points, in the left camera's axes.
        triangles: (T, 3) int32 numbers of points, anticlockwise from outside.
        axes: axes of the file's points.
        seen: (N,) whether some view saw each point: a property `seen`, 1 or 0, after the colours; None: there is none.

    Raises:
        OSError: the file cannot be written.
    """
    vertices = np.empty(len(cloud.points_m), _VERTEX if seen is None else _SEEN_VERTEX)
    for channel, name in enumerate("xyz"):
        vertices[name] = cloud.points_m[:, channel] * axes.signs[channel]
    for channel, name in enumerate(("red", "green", "blue")):
        vertices[name] = cloud.colours[:, channel]
    if seen is not None:
        vertices["seen"] = seen
    faces = np.empty(len(triangles), _TRIANGLE)
    faces["corners"], faces["numbers"] = 3, triangles
    further = "" if seen is None else "property uchar seen\n"
    header = _header(
        len(vertices), axes, f"{further}element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    )
    write_parts(path, [header, vertices.tobytes(), faces.tobytes()])


def _header(count: int, axes: Axes, further: str = "") -> bytes:
    return (
        f"ply\nformat binary_little_endian 1.0\ncomment unit metre; {axes.text}\n"
        f"element vertex {count}\n{_PROPERTIES}{further}end_header\n"
    ).encode()


def packed_points(
    cloud: CloudImage, colours: Image, axes: Axes = Axes.CAMERA, library: Library | Diagnostic | None = None
) -> NDArray[np.void]:
    """Pack the finite points of a cloud image with their colours, as the vertices of a PLY file, row by row.

    Args:
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.
        colours: (H, W) grey or (H, W, 3) BGR, uint8: the rectified left image.
        axes: axes of the packed points.
        library: packs; None: that of this installation.

    Returns:
        (N,) records x, y, z float32, m, and red, green, blue uint8: 15 bytes each, little endian.

    Raises:
        ValueError: the two sizes differ.
    """
    require_one_size(cloud, colours)
    library = native() if library is None else library
    if not isinstance(library, Library):
        return _vertices(cloud, colours, _finite(cloud), axes)
    cloud = np.ascontiguousarray(cloud, np.float32)
    colours = np.ascontiguousarray(colours, np.uint8)
    height, width = cloud.shape[:2]
    # Room for every pixel and one more: the kernel writes a point before it knows whether it counts (pack_kernel.c).
    records = np.empty(height * width + 1, _VERTEX)
    job = PackJob(
        cloud_m=cloud.ctypes.data,
        colours=colours.ctypes.data,
        records=records.ctypes.data,
        cloud_stride=3 * width,
        colour_stride=colours.strides[0],
        width=width,
        height=height,
        channels=3 if colours.ndim == 3 else 1,
        flips=tuple(int(sign < 0) for sign in axes.signs),
    )
    library.run(job)
    return records[: job.count]


def require_one_size(cloud: CloudImage, colours: Image) -> None:
    """Check that each point has a colour.

    Args:
        cloud: (H, W, 3) float32, m.
        colours: (H, W) grey or (H, W, 3) BGR, uint8.

    Raises:
        ValueError: the two sizes differ, or one of the two has another shape.
    """
    if cloud.shape[:2] != colours.shape[:2]:
        raise ValueError(f"cloud {cloud.shape[:2]} and colours {colours.shape[:2]} differ in size")
    if cloud.shape[2:] != (3,) or colours.shape[2:] not in {(), (3,)}:
        raise ValueError(f"cloud {cloud.shape} and colours {colours.shape} are not (H, W, 3) and grey or BGR")


def _finite(cloud: CloudImage) -> NDArray[np.bool_]:
    """Return (H, W): where all three coordinates are finite."""
    chosen = np.empty(cloud.shape[:2], dtype=np.bool_)
    for rows in strips(*cloud.shape[:2]):
        finite = np.isfinite(cloud[rows])
        # Channel by channel: `all(axis=2)` over a last axis of length 3 takes ten times as long.
        chosen[rows] = finite[..., 0] & finite[..., 1] & finite[..., 2]
    return chosen


def _vertices(cloud: CloudImage, colours: Image, chosen: NDArray[np.bool_], axes: Axes) -> NDArray[np.void]:
    """Pack the chosen points of some rows with numpy."""
    places = np.flatnonzero(chosen)
    vertices = np.empty(places.size, dtype=_VERTEX)
    # One field at a time: numpy gathers rows of three at a fifth of this speed.
    points = cloud.reshape(-1, 3)
    bgr = colours.reshape(len(points), -1)
    for channel, name in enumerate("xyz"):
        np.multiply(points[:, channel][places], axes.signs[channel], out=vertices[name])
    for channel, name in enumerate(("blue", "green", "red")):
        vertices[name] = bgr[:, channel if colours.ndim == 3 else 0][places]
    return vertices
