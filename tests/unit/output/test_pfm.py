"""PFM files, against Middlebury's description of them."""

import resource
import struct
from pathlib import Path

import cv2
import hypothesis.extra.numpy as hnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phone_host.model import Disparity
from phone_host.output.axes import Axes
from phone_host.output.pair_files import write_pfm, write_xyz
from tests.support.point_files import read_pfm, read_xyz


def test_file_holds_header_bottom_row_first_little_endian_and_infinity(tmp_path: Path) -> None:
    """The bytes of a 2x2 map are exactly those of Middlebury's convention."""
    path = tmp_path / "d.pfm"
    write_pfm(path, np.array([[1.5, np.nan], [3.0, 4.0]], dtype=np.float32))
    assert path.read_bytes() == b"Pf\n2 2\n-1\n" + struct.pack("<4f", 3.0, 4.0, 1.5, float("inf"))


@given(
    hnp.arrays(
        np.float32,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=20),
        elements=st.floats(0, 4096, width=32) | st.just(float("nan")),
    )
)
@settings(deadline=None, max_examples=50)
def test_round_trip(tmp_path_factory: pytest.TempPathFactory, disparity: Disparity) -> None:
    """What is written is read back to the bit, NaN included."""
    path = tmp_path_factory.mktemp("pfm") / "d.pfm"
    write_pfm(path, disparity)
    np.testing.assert_array_equal(read_pfm(path), disparity)


def test_a_write_that_fails_half_way_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    """If the operating system refuses more bytes, the caller gets its OSError and no partial file is left."""
    path = tmp_path / "d.pfm"
    write_pfm(path, np.zeros((1, 1), dtype=np.float32))
    before = path.read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    # A real limit of the kernel (EFBIG); it fails as a full disk (ENOSPC) does.
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**20, hard))
    try:
        with pytest.raises(OSError, match="too large"):
            write_pfm(path, np.zeros((1024, 1024), dtype=np.float32))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["d.pfm"]


def test_an_image_of_points_is_the_three_channels_bottom_row_first_with_nan_for_none(tmp_path: Path) -> None:
    """The bytes of a 1x2 image: header PF, then X Y Z of the lower pixel, then of the upper one."""
    path = tmp_path / "xyz.pfm"
    cloud = np.array([[[1, 2, 3]], [[np.nan, np.nan, np.nan]]], dtype=np.float32)
    write_xyz(path, cloud)
    nan = struct.pack("<f", float("nan"))
    assert path.read_bytes() == b"PF\n1 2\n-1\n" + 3 * nan + struct.pack("<3f", 1, 2, 3)
    write_xyz(path, cloud, Axes.Y_UP)
    assert path.read_bytes().endswith(struct.pack("<3f", 1, -2, -3))


def test_an_image_of_points_is_read_by_numpy_alone_and_by_opencv(tmp_path: Path) -> None:
    """Independent readers see every pixel in its place: numpy by hand, and OpenCV, which calls the channels B G R."""
    path = tmp_path / "xyz.pfm"
    cloud = np.random.default_rng(3).normal(size=(600, 500, 3)).astype(np.float32)  # several strips
    cloud[::9, ::4] = np.nan
    write_xyz(path, cloud)
    header, values = path.read_bytes().split(b"\n-1\n", 1)
    assert header == b"PF\n500 600"
    by_hand = np.frombuffer(values, "<f4").reshape(600, 500, 3)[::-1]
    np.testing.assert_array_equal(by_hand, cloud)
    by_opencv = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))[..., ::-1]
    np.testing.assert_array_equal(by_opencv, cloud)
    np.testing.assert_array_equal(read_xyz(path), cloud)
