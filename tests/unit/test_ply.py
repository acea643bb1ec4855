"""Point clouds as PLY, against the format's description."""

import struct
from pathlib import Path

import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.ply import read_ply, write_ply
from phone_host.output.preview import colour_disparity, write_preview
from phone_host.stereo.images import read_image

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


@pytest.mark.parametrize("cut", [0, 20, -1])
def test_bad_files_are_named(tmp_path: Path, cut: int) -> None:
    """An empty file, a truncated header and a truncated body are refused by name."""
    path = tmp_path / "bad.ply"
    write_ply(path, _CLOUD, _BGR)
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(DataError, match=r"bad\.ply"):
        read_ply(path)


def test_preview_is_black_without_value_and_brighter_when_nearer(tmp_path: Path) -> None:
    """NaN is black, nothing else is, and lightness rises with disparity."""
    disparity = np.linspace(0, 60, 64, dtype=np.float32).reshape(8, 8)
    disparity[0, 0] = np.nan
    colours = colour_disparity(disparity, 0, 60)
    assert colours[0, 0].tolist() == [0, 0, 0]
    lightness = (colours @ np.array([0.114, 0.587, 0.299])).ravel()[1:]  # ITU-R BT.601 luma
    assert (np.diff(lightness) > -1.0).all()  # rounding to 8 bits
    assert lightness[0] > 20
    assert lightness[-1] > 200
    write_preview(tmp_path / "d.png", disparity)
    assert read_image(tmp_path / "d.png").shape == (8, 8, 3)


def test_preview_of_nothing_is_black(tmp_path: Path) -> None:
    """A map without values can be shown."""
    write_preview(tmp_path / "d.png", np.full((4, 5), np.nan, dtype=np.float32))
    assert not read_image(tmp_path / "d.png").any()
