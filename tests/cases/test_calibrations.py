"""Calibrations as `ros2 topic echo`, COLMAP and people's editors leave them: each is read right, or refused for the right reason."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from common.errors import DataError
from phone_host.model import Rig
from phone_host.output.rig_files.imported import import_rig

_D5 = ("0.01", "-0.02", "0.0005", "-0.0003", "0.004")
_ZERO9 = ("0.0",) * 9
_MIDDLEBURY = (
    "cam0=[500 0 320.5; 0 500 239.5; 0 0 1]\ncam1=[500 0 330.5; 0 500 239.5; 0 0 1]\n"
    "doffs=10\nbaseline=60\nwidth=640\nheight=480\n"
)


@dataclass(frozen=True, slots=True)
class _Echo:
    """What `ros2 topic echo` prints of one sensor_msgs/CameraInfo: lists in blocks, `---` behind the message."""

    model: str = "plumb_bob"
    d: tuple[str, ...] = _D5
    k: tuple[str, ...] = ("500.0", "0.0", "320.5", "0.0", "500.0", "239.5", "0.0", "0.0", "1.0")
    r: tuple[str, ...] = ("1.0", "0.0", "0.0", "0.0", "1.0", "0.0", "0.0", "0.0", "1.0")
    binning: int = 0
    roi: dict[str, int] = field(default_factory=dict)
    end: str = "---\n"
    repeats: int = 1

    def text(self, shift: str) -> str:
        p = ("500.0", "0.0", "320.5", shift, "0.0", "500.0", "239.5", "0.0", "0.0", "0.0", "1.0", "0.0")
        roi = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0} | self.roi
        lists = "".join(
            f"{name}: []\n" if not values else f"{name}:\n" + "".join(f"- {value}\n" for value in values)
            for name, values in (("d", self.d), ("k", self.k), ("r", self.r), ("p", p))
        )
        body = (
            f"height: 480\nwidth: 640\ndistortion_model: {self.model}\n{lists}"
            f"binning_x: {self.binning}\nbinning_y: {self.binning}\nroi:\n"
            + "".join(f"  {key}: {value}\n" for key, value in roi.items())
            + "  do_rectify: false\n"
        )
        return "".join(
            f"header:\n  stamp:\n    sec: {1_700_000_000 + at}\n    nanosec: 5\n  frame_id: cam\n{body}{self.end}"
            for at in range(self.repeats)
        )

    def read(self, folder: Path) -> Rig:
        for name, shift in (("left", "0.0"), ("right", "-30.0")):
            (folder / f"{name}.yaml").write_text(self.text(shift))
        return import_rig((folder,)).rig


@pytest.mark.parametrize(
    ("echo", "distortion"),
    [
        pytest.param(_Echo(), [0.01, -0.02, 0.0005, -0.0003, 0.004], id="one message"),
        pytest.param(_Echo(repeats=3), [0.01, -0.02, 0.0005, -0.0003, 0.004], id="three messages"),
        pytest.param(_Echo(end=""), [0.01, -0.02, 0.0005, -0.0003, 0.004], id="no separator"),
        pytest.param(_Echo(end="\r\n---\r\n"), [0.01, -0.02, 0.0005, -0.0003, 0.004], id="line ends of Windows"),
        pytest.param(_Echo(d=(*_D5, "0.0", "0.0", "0.0")), [0.01, -0.02, 0.0005, -0.0003, 0.004], id="plumb_bob of 8"),
        pytest.param(_Echo(d=_D5[:4]), [0.01, -0.02, 0.0005, -0.0003], id="plumb_bob of 4"),
        pytest.param(_Echo(d=()), [], id="no coefficients"),
        pytest.param(_Echo(model="''", d=()), [], id="no model and no coefficients"),
        pytest.param(_Echo(model="", d=()), [], id="an empty model and no coefficients"),
        pytest.param(_Echo(model="none", d=()), [], id="model none"),
        pytest.param(_Echo(model="none", d=("0.0",) * 5), [], id="model none, zeros"),
        pytest.param(_Echo(model="rational_polynomial"), [0.01, -0.02, 0.0005, -0.0003, 0.004], id="rational of 5"),
        pytest.param(
            _Echo(model="rational_polynomial", d=(*_D5, "0.1", "0.2", "0.3")),
            [0.01, -0.02, 0.0005, -0.0003, 0.004, 0.1, 0.2, 0.3],
            id="rational of 8",
        ),
    ],
)
def test_what_topic_echo_prints_is_the_rig_that_it_describes(
    echo: _Echo, distortion: list[float], tmp_path: Path
) -> None:
    """Two cameras 60 mm apart (P[0, 3] = -f b) with the stated coefficients; those that are missing are 0."""
    rig = echo.read(tmp_path)
    np.testing.assert_allclose(rig.t_right_left_m, [-0.06, 0, 0], atol=1e-12)
    for camera in (rig.left, rig.right):
        assert (camera.width_px, camera.height_px) == (640, 480)
        np.testing.assert_array_equal(camera.matrix, [[500, 0, 320.5], [0, 500, 239.5], [0, 0, 1]])
        assert not camera.distortion[len(distortion) :].any()
        np.testing.assert_array_equal(camera.distortion[: len(distortion)], distortion)


@pytest.mark.parametrize(
    ("echo", "size_px", "focal_px", "centre_px"),
    [
        pytest.param(_Echo(binning=2), (320, 240), 250, (160.25, 119.75), id="binned"),
        pytest.param(_Echo(binning=1), (640, 480), 500, (320.5, 239.5), id="binned by one"),
        pytest.param(
            _Echo(roi={"x_offset": 80, "y_offset": 60, "width": 480, "height": 360}),
            (480, 360),
            500,
            (240.5, 179.5),
            id="a region",
        ),
        pytest.param(
            _Echo(binning=2, roi={"x_offset": 80, "y_offset": 60, "width": 480, "height": 360}),
            (240, 180),
            250,
            (120.25, 89.75),
            id="a region, binned",
        ),
    ],
)
def test_binning_and_region_give_the_cameras_of_the_published_pictures(
    echo: _Echo, size_px: tuple[int, int], focal_px: float, centre_px: tuple[float, float], tmp_path: Path
) -> None:
    """K is of the full image; the region is cut first, then binned, as sensor_msgs/CameraInfo says."""
    camera = echo.read(tmp_path).right
    assert (camera.width_px, camera.height_px) == size_px
    expected = np.array([[focal_px, 0, centre_px[0]], [0, focal_px, centre_px[1]], [0, 0, 1]], np.float64)
    np.testing.assert_allclose(camera.matrix, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("echo", "reason"),
    [
        pytest.param(_Echo(r=_ZERO9), "r is all 0: the camera is not rectified", id="R of zeros"),
        pytest.param(_Echo(k=_ZERO9), "k is all 0: the camera is not calibrated", id="K of zeros"),
        pytest.param(_Echo(d=(*_D5, "0.1", "0.0", "0.0")), "d has 8 values", id="plumb_bob of 8 that counts"),
        pytest.param(_Echo(model="none"), "d bends rays", id="none that bends"),
        pytest.param(_Echo(model="equidistant", d=()), "d has 0 values", id="a fisheye without coefficients"),
        pytest.param(
            _Echo(roi={"x_offset": 600, "width": 480, "height": 360}), "roi reaches out", id="a region outside"
        ),
        pytest.param(_Echo(end="---\nheight: 240\n---\n"), "begins a second document", id="two cameras in one file"),
    ],
)
def test_what_topic_echo_prints_of_an_unfit_camera_is_refused(echo: _Echo, reason: str, tmp_path: Path) -> None:
    """The reason names the file and the key."""
    with pytest.raises(DataError, match=reason) as caught:
        echo.read(tmp_path)
    assert "left.yaml" in caught.value.problem


_LEFT, _RIGHT, _THIRD = (
    "1 1 0 0 0 0 0 0 1 left.png",
    "2 1 0 0 0 -0.06 0 0 1 right.png",
    "3 1 0 0 0 -0.5 0 0 1 third.png",
)
_POINTS = "10.5 20.25 -1 30 4e1 7"


def _colmap(folder: Path, lines: tuple[str, ...]) -> Rig:
    (folder / "cameras.txt").write_text("1 PINHOLE 640 480 500 500 320.5 240.5\n")
    (folder / "images.txt").write_text("\n".join(("# Image list with two lines of data per image:", *lines)) + "\n")
    return import_rig((folder,)).rig


@pytest.mark.parametrize(
    "lines",
    [
        pytest.param((_LEFT, "", _RIGHT, ""), id="empty lines"),
        pytest.param((_LEFT, _RIGHT), id="empty lines lost"),
        pytest.param((_LEFT, _POINTS, _RIGHT, _POINTS), id="points"),
        pytest.param((_LEFT, _POINTS, _RIGHT), id="points of one"),
        pytest.param((_LEFT, "", "# second", _RIGHT), id="a comment between"),
        pytest.param(("", _LEFT, "", "", _RIGHT, ""), id="more empty lines"),
        pytest.param((_RIGHT, "", _LEFT, ""), id="the other order"),
        pytest.param((_LEFT.replace("left", "the left one"), _RIGHT), id="spaces in a name"),
        pytest.param((_LEFT.replace("left.png", "7"), _RIGHT), id="a name that is a number"),
    ],
)
def test_images_txt_gives_its_two_images_whatever_became_of_its_empty_lines(
    lines: tuple[str, ...], tmp_path: Path
) -> None:
    """Image 2 stands 60 mm right of image 1."""
    np.testing.assert_allclose(_colmap(tmp_path, lines).t_right_left_m, [-0.06, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        pytest.param((_LEFT, _RIGHT, _THIRD), "has 3 images", id="three images"),
        pytest.param((_LEFT, "", _RIGHT, "", _THIRD, ""), "has 3 images", id="three images with empty lines"),
        pytest.param((_LEFT, "", _RIGHT, _THIRD, _THIRD.replace("3", "4", 1)), "has 4 images", id="four images"),
        pytest.param((_LEFT, _POINTS, _POINTS, _RIGHT), "points that belong to no image", id="points twice"),
        pytest.param((_LEFT, "2 1 0 0 right.png"), "image 2 is no image", id="a broken line"),
    ],
)
def test_images_txt_with_other_images_is_refused(lines: tuple[str, ...], reason: str, tmp_path: Path) -> None:
    """No image is skipped in silence: never a rig of images 1 and 3."""
    with pytest.raises(DataError, match=reason):
        _colmap(tmp_path, lines)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le"])
def test_calibrations_that_windows_redirected_are_read(encoding: str, tmp_path: Path) -> None:
    """PowerShell's `>` writes UTF-16 with a mark; a calib.txt is read in it, too. Without a mark UTF-16 is refused."""
    for name, shift in (("left", "0.0"), ("right", "-30.0")):
        (tmp_path / f"{name}.yaml").write_text(_Echo().text(shift), encoding=encoding)
    (tmp_path / "calib.txt").write_text(_MIDDLEBURY, encoding=encoding)
    for given in (tmp_path, tmp_path / "calib.txt"):
        if encoding == "utf-16-le":
            with pytest.raises(DataError):
                import_rig((given,))
        else:
            np.testing.assert_allclose(import_rig((given,)).rig.t_right_left_m, [-0.06, 0, 0], atol=1e-12)


def test_a_day_of_kittis_raw_data_is_read_by_its_folder(tmp_path: Path) -> None:
    """Beside the cameras' file lie those of the laser and of the inertial unit."""
    eye, shifts = "1 0 0 0 1 0 0 0 1", (0, -30)
    (tmp_path / "calib_cam_to_cam.txt").write_text(
        "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.95e-02\n"
        + "".join(
            f"S_rect_0{at}: 6.2e+02 1.9e+02\nR_rect_0{at}: {eye}\nP_rect_0{at}: 500 0 300 {shift} 0 500 90 0 0 0 1 0\n"
            for at, shift in enumerate(shifts)
        )
    )
    for name in ("calib_imu_to_velo.txt", "calib_velo_to_cam.txt"):
        (tmp_path / name).write_text(f"R: {eye}\nT: 0 0 0\n")
    assert import_rig((tmp_path,)).rig.left.width_px == 620


def test_camera_calibrations_ost_txt_is_named(tmp_path: Path) -> None:
    """It is as its program wrote it; the files beside it hold the same."""
    path = tmp_path / "ost.txt"
    path.write_text("# oST version 5.0 parameters\n\n\n[image]\n\nwidth\n640\n\nheight\n480\n")
    with pytest.raises(DataError, match=r"is ost.txt of camera_calibration") as caught:
        import_rig((path,))
    assert "left.yaml and right.yaml" in caught.value.remedy


@pytest.mark.parametrize("given", ["", "cameras.bin", "images.bin"])
def test_a_binary_model_of_colmap_is_named(given: str, tmp_path: Path) -> None:
    """One line says what it is and how to write it as text."""
    for name in ("cameras.bin", "images.bin"):
        (tmp_path / name).write_bytes(b"\x02" + bytes(79))
    with pytest.raises(DataError, match="is a binary model of COLMAP") as caught:
        import_rig((tmp_path / given,))
    assert "model_converter" in caught.value.remedy


@pytest.mark.parametrize("d", ["[[0.01, -0.02, 0, 0, 0.004]]", "[[0.01], [-0.02], [0], [0], [0.004]]"])
def test_matrices_as_numpy_lists_them_are_read(d: str, tmp_path: Path) -> None:
    """OpenCV's Python returns coefficients as one row or one column; `tolist` keeps that."""
    camera = "[[500, 0, 320.5], [0, 500, 239.5], [0, 0, 1]]"
    path = tmp_path / "calib.json"
    path.write_text(
        f'{{"M1": {camera}, "D1": {d}, "M2": {camera}, "D2": {d},'
        ' "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "T": [[-0.06], [0], [0]]}'
    )
    rig = import_rig((path,), sizes_px=((640, 480), (640, 480))).rig
    np.testing.assert_array_equal(rig.left.distortion[:5], [0.01, -0.02, 0, 0, 0.004])
    np.testing.assert_allclose(rig.t_right_left_m, [-0.06, 0, 0], atol=1e-12)
