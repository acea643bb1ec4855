"""calib.txt of Middlebury, ETH3D and KITTI: the geometry that the data sets state, and one-line errors for anything else."""

import os
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import DataError
from phone_host.output.calib_txt import KittiCameras, is_calib_txt, read_calib_txt
from phone_host.output.rig_yaml import read_rig

# Middlebury 2014, Motorcycle at quarter size (its own calib.txt).
MOTORCYCLE = """cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]
cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]
doffs=31.086
baseline=193.001
width=741
height=497
ndisp=70
isint=0
vmin=12
vmax=60
dyavg=0.234
dymax=0.913
"""

# KITTI odometry, sequence 00 to 02 (its own calib.txt, digits shortened).
KITTI = """P0: 718.856 0 607.1928 0 0 718.856 185.2157 0 0 0 1 0
P1: 718.856 0 607.1928 -386.1448 0 718.856 185.2157 0 0 0 1 0
P2: 718.856 0 607.1928 45.38225 0 718.856 185.2157 -0.1130887 0 0 1 0.003779761
P3: 718.856 0 607.1928 -337.2877 0 718.856 185.2157 2.369057 0 0 1 0.004915215
Tr: 4.27e-04 -9.99e-01 -8.08e-03 -1.19e-02 -7.21e-03 8.08e-03 -9.99e-01 -5.40e-02 9.99e-01 4.85e-04 -7.20e-03 -2.92e-01
"""


def _file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "calib.txt"
    path.write_text(text)
    return path


def test_middlebury_gives_the_published_geometry(tmp_path: Path) -> None:
    """Focal length, principal point, doffs, baseline in metres, size and number of disparities are those of the file."""
    path = _file(tmp_path, MOTORCYCLE)
    assert is_calib_txt(path)
    calib = read_calib_txt(path)
    geometry = calib.geometry
    assert (geometry.focal_px, geometry.cx_px, geometry.cy_px) == (994.978, 311.193, 254.877)
    assert geometry.doffs_px == 31.086
    assert geometry.baseline_m == pytest.approx(0.193001)
    assert (calib.size_px, calib.disparities) == ((741, 497), 70)


def test_doffs_follows_from_the_principal_points_where_it_is_not_stated(tmp_path: Path) -> None:
    """342.279 - 311.193 px."""
    calib = read_calib_txt(_file(tmp_path, MOTORCYCLE.replace("doffs=31.086\n", "")))
    assert calib.geometry.doffs_px == pytest.approx(31.086)


@pytest.mark.parametrize(
    ("prefer", "baseline_m", "cameras"),
    [
        (KittiCameras.GREY, 386.1448 / 718.856, "P0 and P1 (grey)"),
        (KittiCameras.COLOUR, (45.38225 + 337.2877) / 718.856, "P2 and P3 (colour)"),
    ],
)
def test_kitti_gives_the_baseline_of_the_chosen_cameras(
    tmp_path: Path, prefer: KittiCameras, baseline_m: float, cameras: str
) -> None:
    """The baseline is the difference of the two P[0, 3] over the focal length, and the cameras are named."""
    path = _file(tmp_path, KITTI)
    assert is_calib_txt(path)
    calib = read_calib_txt(path, prefer)
    assert calib.geometry.baseline_m == pytest.approx(baseline_m)
    assert calib.geometry.doffs_px == 0
    assert calib.cameras == cameras
    assert calib.size_px is None


def test_kittis_raw_data_states_its_size(tmp_path: Path) -> None:
    """calib_cam_to_cam.txt has other names, other lines between them, and the rectified size."""
    lines = ["calib_time: 09-Jan-2012 13:57:47", "corner_dist: 9.950000e-02"]
    for number in range(4):
        lines += [f"S_rect_0{number}: 1.242000e+03 3.750000e+02"]
        lines += [f"P_rect_0{number}: 721.5377 0 609.5593 {-387.5744 * (number % 2)} 0 721.5377 172.854 0 0 0 1 0"]
    calib = read_calib_txt(_file(tmp_path, "\n".join(lines)))
    assert calib.size_px == (1242, 375)
    assert calib.geometry.baseline_m == pytest.approx(387.5744 / 721.5377)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (MOTORCYCLE.replace("baseline=193.001", "baseline=nan"), "baseline is 'nan'"),
        (MOTORCYCLE.replace("baseline=193.001", "baseline=1e300"), "baseline is '1e300'"),
        (MOTORCYCLE.replace("baseline=193.001\n", ""), "baseline is missing"),
        (MOTORCYCLE.replace("baseline=193.001", "baseline=-193"), "baseline is '-193'"),
        (MOTORCYCLE.replace("cam1=[994.978", "cam1=[995.978"), "cam1 is no camera"),
        (MOTORCYCLE.replace("cam1", "cam2"), "cam1 is missing"),
        (MOTORCYCLE.replace("[994.978 0 311.193;", "[994.978 0;"), "cam0 is"),
        (MOTORCYCLE.replace("doffs=31.086", "doffs=60"), "doffs is 60"),
        (MOTORCYCLE.replace("width=741", "width=0"), "width is '0'"),
        (MOTORCYCLE.replace("width=741", "width=" + "9" * 5000), "width is '999"),
        (MOTORCYCLE.replace("ndisp=70", "ndisp=7.5"), "ndisp is '7.5'"),
        (MOTORCYCLE + MOTORCYCLE, "cam0 is there twice"),
        (MOTORCYCLE.replace("=193.001", "=abc"), "baseline is 'abc': it must be a number in mm, from 1 to 100000"),
        (MOTORCYCLE.replace("=193.001", "=193,001"), "in mm, from 1 to 100000, with a decimal point: 193.001"),
        (
            MOTORCYCLE.replace("=193.001", "=0.193001"),
            "baseline is '0.193001': it must be a number in mm, from 1 to 100000; 0.193001 m are 193.001 mm",
        ),
        (
            MOTORCYCLE.replace("doffs=31.086", "doffs=31,086"),
            "a number in px, from -1e+06 to 1e+06, with a decimal point: 31.086",
        ),
        (MOTORCYCLE.partition("\n")[2], "cam0 is missing: give calib.txt as"),
        (KITTI.partition("\n")[0], "has only P0"),
        (KITTI.replace("-386.1448", "386.1448"), "m apart"),
        (KITTI.replace("P1: 718.856 0", "P1: 1e999 0"), "P1 is no camera"),
        (KITTI.replace("-386.1448", "-386.1448 7"), "P1 is"),
        ("hello", "has neither cam0="),
        ("", "has neither cam0="),
    ],
)
def test_what_cannot_be_right_is_named_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    """A missing key, NaN, a huge or contradicting number, and a foreign text."""
    with pytest.raises(DataError) as failure:
        read_calib_txt(_file(tmp_path, text))
    assert said in str(failure.value)
    assert "\n" not in str(failure.value)
    assert len(str(failure.value)) < 300 + len(str(tmp_path))


def test_bytes_and_missing_files_are_no_calib_txt(tmp_path: Path) -> None:
    """A picture and a name without a file: not recognised, and refused in one line."""
    path = tmp_path / "calib.txt"
    path.write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe\x00cam0=")
    for each in (path, tmp_path / "none.txt", tmp_path):
        assert not is_calib_txt(each)
        with pytest.raises(DataError):
            read_calib_txt(each)


def test_a_byte_order_mark_changes_nothing(tmp_path: Path) -> None:
    """Windows' Notepad writes one, and ends lines with CR and LF."""
    path = tmp_path / "calib.txt"
    path.write_bytes(b"\xef\xbb\xbf" + MOTORCYCLE.replace("\n", "\r\n").encode())
    assert is_calib_txt(path)
    assert read_calib_txt(path) == read_calib_txt(_file(tmp_path, MOTORCYCLE))


def test_what_is_neither_rig_nor_calib_txt_is_told_what_to_give(tmp_path: Path) -> None:
    """A text, bytes and an empty file: whoever has a calib.txt learns that it is taken; a calib.txt without cam0 is read as one."""
    path = tmp_path / "calib.txt"
    for content in (b"hello", b"\x89PNG\r\n\x1a\n\xff\xfe", b""):
        path.write_bytes(content)
        assert not is_calib_txt(path)
        with pytest.raises(DataError, match=r"or a calib\.txt of Middlebury, ETH3D or KITTI"):
            read_rig(path)
    assert is_calib_txt(_file(tmp_path, MOTORCYCLE.partition("\n")[2]))
    assert is_calib_txt(_file(tmp_path, MOTORCYCLE + MOTORCYCLE))


def test_a_rig_is_no_calib_txt(tmp_path: Path) -> None:
    """FileStorage YAML has other keys."""
    assert not is_calib_txt(_file(tmp_path, "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n"))


@given(st.text(alphabet="cam01P:=[];. 0123456789-+e\nn_rect", max_size=200))
def test_any_text_is_read_or_refused(text: str) -> None:
    """No text leads to another error than the one that names the file."""
    with tempfile.TemporaryDirectory() as folder:
        path = _file(Path(folder), text)
        try:
            calib = read_calib_txt(path)
        except DataError:
            return
        assert calib.geometry.focal_px > 0


@pytest.mark.data
def test_the_given_data_sets_are_read() -> None:
    """ETH3D's playground and a clip of KITTI whose lines have no names; ETH3D's ndisp is its width, which bounds nothing."""
    folder = os.environ.get("SCAN_DATA")
    if not folder:
        pytest.skip("SCAN_DATA is not set: no real images")
    eth3d = read_calib_txt(Path(folder) / "eth3d_two_view_gt" / "playground" / "calib.txt")
    assert eth3d.geometry.baseline_m == pytest.approx(0.0595549)
    assert (eth3d.size_px, eth3d.disparities) == ((941, 490), None)
    path = Path(folder) / "kitti_odometry_clips" / "KITTI_sequence_1" / "calib.txt"
    assert is_calib_txt(path)
    assert read_calib_txt(path).geometry.baseline_m == pytest.approx(0.5372, abs=1e-4)
