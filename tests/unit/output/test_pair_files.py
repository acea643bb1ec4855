"""The files of one pair: names, content against independent readers, units and axes."""

import struct
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.ledger import StageTimes
from phone_host.model import Processed, RectifiedPair, StereoGeometry
from phone_host.output.axes import Axes
from phone_host.output.depth_png import depth_mm
from phone_host.output.pair_files import RUN_FILES, STEREO_FILES, PairFile, available, write_pair
from phone_host.stereo.reproject import project, reproject
from tests.support.point_files import read_pfm, read_ply, read_xyz

_GEOMETRY = StereoGeometry(focal_px=50, baseline_m=0.1, cx_px=9.5, cy_px=7.5, doffs_px=2)


@pytest.fixture
def processed() -> Processed:
    """A slanted plane of 20 x 16 px with a hole, seen with f b = 5 px m."""
    disparity = np.repeat(np.linspace(3, 8, 20, dtype=np.float32)[np.newaxis], 16, axis=0)
    disparity[4:6, 7:9] = np.nan
    image = np.random.default_rng(2).integers(0, 255, (16, 20, 3), dtype=np.uint8)
    cloud = reproject(disparity, _GEOMETRY)
    return Processed(RectifiedPair(image, image[:, ::-1]), disparity, cloud, StageTimes(), geometry=_GEOMETRY)


def test_the_names_are_those_that_other_programs_rely_on(tmp_path: Path, processed: Processed) -> None:
    """`stereo` writes six files of a pair, a run five."""
    (tmp_path / "s").mkdir()
    (tmp_path / "r").mkdir()
    names = {"cloud.ply", "depth.png", "depth_view.png", "disparity.pfm", "disparity.png", "xyz.pfm"}
    assert set(write_pair(tmp_path / "s", processed, STEREO_FILES).files) == names
    assert {path.name for path in (tmp_path / "s").iterdir()} == names
    write_pair(tmp_path / "r", processed, RUN_FILES)
    assert {path.name for path in (tmp_path / "r").iterdir()} == {
        "left.png", "right.png", "disparity.pfm", "cloud.ply", "depth.png",
    }  # fmt: skip


def test_without_metres_only_disparities_are_written_and_without_depth_only_images(
    tmp_path: Path, processed: Processed
) -> None:
    """What a pair does not have is left out, and no points are counted."""
    flat = replace(processed, cloud=None, geometry=None)
    written = write_pair(tmp_path, flat, (*RUN_FILES, *STEREO_FILES))
    assert set(written.files) == {"left.png", "right.png", "disparity.pfm", "disparity.png"}
    assert written.points is None
    assert available(RUN_FILES, has_disparity=False, has_cloud=False) == (PairFile.LEFT, PairFile.RIGHT)


def test_depth_png_holds_millimetres_that_any_reader_sees(tmp_path: Path, processed: Processed) -> None:
    """OpenCV reads 16 bit: 1000 f b / (d + doffs) to the millimetre, and 0 in the hole."""
    write_pair(tmp_path, processed, [PairFile.DEPTH])
    read = np.asarray(cv2.imread(str(tmp_path / "depth.png"), cv2.IMREAD_UNCHANGED))
    assert read.dtype == np.uint16
    expected_mm = np.repeat(1000 * 50 * 0.1 / (np.linspace(3, 8, 20) + 2)[np.newaxis], 16, axis=0)
    expected_mm[4:6, 7:9] = 0
    assert np.abs(read - expected_mm).max() <= 0.51
    assert not read[4:6, 7:9].any()


def test_depth_png_says_what_it_holds(tmp_path: Path, processed: Processed) -> None:
    """A tEXt chunk with a right checksum, before the pixels, states unit, axis and what 0 means."""
    write_pair(tmp_path, processed, [PairFile.DEPTH])
    content = (tmp_path / "depth.png").read_bytes()
    kinds, place, texts = [], 8, []
    while place < len(content):
        length, kind = struct.unpack(">I4s", content[place : place + 8])
        body = content[place + 8 : place + 8 + length]
        assert struct.unpack(">I", content[place + 8 + length : place + 12 + length])[0] == zlib.crc32(kind + body)
        kinds.append(kind)
        texts += [body.decode("latin-1")] if kind == b"tEXt" else []
        place += 12 + length
    assert kinds[:2] == [b"IHDR", b"tEXt"]
    assert kinds[-1] == b"IEND"
    [text] = texts
    assert text.startswith("Description\0")
    for words in ("millimetre", "0 = none", "optical axis", "z forward"):
        assert words in text


def test_depths_beyond_16_bits_become_none_and_are_counted() -> None:
    """65.535 m is the farthest; what rounds to 0 mm or lies beyond is not written as another depth."""
    depth_m = np.array([[0.0004, 0.0006, 65.535, 65.536, 1e9, np.nan]], dtype=np.float32)
    depth, unfit = depth_mm(np.dstack([depth_m] * 3))
    assert depth.tolist() == [[0, 1, 65535, 0, 0, 0]]
    assert unfit == 3


@pytest.mark.parametrize("axes", Axes)
def test_cloud_and_xyz_are_the_same_points_and_project_to_their_pixels(
    tmp_path: Path, processed: Processed, axes: Axes
) -> None:
    """Turned back to the camera's axes, each point lies on its pixel's ray at its disparity."""
    written = write_pair(tmp_path, processed, STEREO_FILES, axes)
    xyz = read_xyz(tmp_path / "xyz.pfm")
    found = np.isfinite(xyz[..., 2])
    np.testing.assert_array_equal(read_ply(tmp_path / "cloud.ply").points_m, xyz[found])
    assert written.points == found.sum() == 20 * 16 - 4
    # By hand: y up means up in the picture is positive, and ahead is negative.
    upper, lower = xyz[0, 0], xyz[15, 19]
    if axes is Axes.Y_UP:
        assert upper[1] > 0 > lower[1]
        assert (xyz[found][:, 2] < 0).all()
    else:
        assert upper[1] < 0 < lower[1]
        assert (xyz[found][:, 2] > 0).all()
    turned = xyz * (np.array([1, -1, -1]) if axes is Axes.Y_UP else 1)
    rows, columns = np.nonzero(found)
    expected = np.stack([columns, rows, read_pfm(tmp_path / "disparity.pfm")[found]], axis=-1)
    assert np.abs(project(turned[found], _GEOMETRY) - expected).max() < 1e-3


def test_several_threads_write_the_same_bytes(tmp_path: Path, processed: Processed) -> None:
    """How the files are written does not show in them."""
    for name, threads in (("one", 1), ("four", 4)):
        (tmp_path / name).mkdir()
        with ThreadPoolExecutor(threads) as writers:
            write_pair(tmp_path / name, processed, STEREO_FILES, run_all=writers.map)
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "four" / path.name).read_bytes()
