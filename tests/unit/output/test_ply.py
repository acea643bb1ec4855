"""Point clouds as PLY, against the format's description."""

import struct
from pathlib import Path

import numpy as np
import pytest

from phone_host.output.axes import Axes
from phone_host.output.ply import write_ply
from tests.support.point_files import read_ply

_CLOUD = np.array([[[0.1, -0.2, 1.5], [np.nan, np.nan, np.nan]], [[1, 2, np.inf], [4, 5, 6]]], dtype=np.float32)
_BGR = np.array([[[10, 20, 30], [1, 1, 1]], [[2, 2, 2], [40, 50, 60]]], dtype=np.uint8)


def test_file_holds_a_header_and_packed_vertices_of_the_finite_points(tmp_path: Path) -> None:
    """The bytes are those of the PLY description: header lines, then x y z float32 and red green blue uchar."""
    path = tmp_path / "c.ply"
    assert write_ply(path, _CLOUD, _BGR) == 2
    header, data = path.read_bytes().split(b"end_header\n")
    lines = [line for line in header.decode().splitlines() if not line.startswith("comment")]
    assert lines == [
        "ply", "format binary_little_endian 1.0", "element vertex 2",
        "property float x", "property float y", "property float z",
        "property uchar red", "property uchar green", "property uchar blue",
    ]  # fmt: skip
    assert data == struct.pack("<3f3B", 0.1, -0.2, 1.5, 30, 20, 10) + struct.pack("<3f3B", 4, 5, 6, 60, 50, 40)


def test_round_trip_with_grey_colours(tmp_path: Path) -> None:
    """Grey becomes equal red, green and blue, and the reader returns what was written."""
    path = tmp_path / "c.ply"
    write_ply(path, _CLOUD, np.array([[7, 0], [0, 9]], dtype=np.uint8))
    cloud = read_ply(path)
    np.testing.assert_array_equal(cloud.points_m, _CLOUD[[0, 1], [0, 1]])
    np.testing.assert_array_equal(cloud.colours, [[7, 7, 7], [9, 9, 9]])


def test_no_finite_point_gives_an_empty_cloud(tmp_path: Path) -> None:
    """A pair without any match still gives a readable file."""
    path = tmp_path / "c.ply"
    assert write_ply(path, np.full((2, 3, 3), np.nan, dtype=np.float32), np.zeros((2, 3), dtype=np.uint8)) == 0
    assert read_ply(path).points_m.shape == (0, 3)


def test_colours_of_another_size_are_refused(tmp_path: Path) -> None:
    """A cloud is never coloured from an image of another size, and then no file appears."""
    with pytest.raises(ValueError, match="differ in size"):
        write_ply(tmp_path / "c.ply", _CLOUD, np.zeros((3, 3), dtype=np.uint8))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("axes", "words", "signs"),
    [
        (Axes.CAMERA, "x right, y down, z forward of the left camera", (1, 1, 1)),
        (Axes.Y_UP, "x right, y up, z backward of the left camera", (1, -1, -1)),
    ],
)
def test_a_comment_states_unit_and_axes_and_the_points_follow_them(
    tmp_path: Path, axes: Axes, words: str, signs: tuple[int, int, int]
) -> None:
    """With y up, the point 0.2 m above the optical axis and 1.5 m ahead lies at y = +0.2, z = -1.5; both frames are right-handed."""
    path = tmp_path / "c.ply"
    write_ply(path, _CLOUD, _BGR, axes)
    assert f"comment unit metre; {words}\n".encode() in path.read_bytes()
    np.testing.assert_array_equal(read_ply(path).points_m[0], np.array([0.1, -0.2, 1.5], np.float32) * signs)
    assert np.prod(axes.signs) == 1


def test_a_cloud_of_many_strips_is_whole_and_in_the_order_of_rows(tmp_path: Path) -> None:
    """A large image is packed some rows at a time; every point is there, once, with its own colour."""
    height, width = 700, 900
    cloud = np.arange(height * width * 3, dtype=np.float32).reshape(height, width, 3)
    cloud[::7, ::5] = np.nan
    colours = np.arange(height * width, dtype=np.uint32).reshape(height, width).astype(np.uint8)
    chosen = np.isfinite(cloud[..., 0])
    assert write_ply(tmp_path / "c.ply", cloud, colours) == chosen.sum()
    read = read_ply(tmp_path / "c.ply")
    np.testing.assert_array_equal(read.points_m, cloud[chosen])
    np.testing.assert_array_equal(read.colours[:, 1], colours[chosen])
