"""Each kind of calibration that is imported, as its program writes it, for one pair of cameras: both see alike, 60 mm apart."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from phone_host.output.rig_files.imported import import_rig

_EYE = "1 0 0 0 1 0 0 0 1"
_CAMCHAIN = """cam0:
  camera_model: pinhole
  distortion_coeffs: [0.01, -0.02, 0.0005, -0.0003]
  distortion_model: radtan
  intrinsics: [500.0, 500.0, 320.5, 239.5]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.06]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.01, -0.02, 0.0005, -0.0003]
  distortion_model: radtan
  intrinsics: [500.0, 500.0, 320.5, 239.5]
  resolution: [640, 480]
  rostopic: /cam1/image_raw
"""
_MATRIX = "!!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n"
_STEREO_YML = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n" + "".join(
    f"{name}: {_MATRIX.format(rows, columns, values)}"
    for name, rows, columns, values in (
        ("M1", 3, 3, "500., 0., 320.5, 0., 500., 239.5, 0., 0., 1."),
        ("D1", 1, 5, "0.01, -0.02, 0.0005, -0.0003, 0."),
        ("M2", 3, 3, "500., 0., 320.5, 0., 500., 239.5, 0., 0., 1."),
        ("D2", 1, 5, "0.01, -0.02, 0.0005, -0.0003, 0."),
        ("R", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1."),
        ("T", 3, 1, "-0.06, 0., 0."),
    )
)
_CELLS = '<{0} type_id="opencv-matrix">\n<rows>{1}</rows><cols>{2}</cols><dt>d</dt><data>{3}</data></{0}>\n'
_STEREO_XML = (
    '<?xml version="1.0"?>\n<opencv_storage>\n<image_width>640</image_width><image_height>480</image_height>\n'
    + "".join(
        _CELLS.format(name, rows, columns, values)
        for name, rows, columns, values in (
            ("M1", 3, 3, "500. 0. 320.5 0. 500. 239.5 0. 0. 1."),
            ("D1", 1, 5, "0.01 -0.02 0.0005 -0.0003 0."),
            ("M2", 3, 3, "500. 0. 320.5 0. 500. 239.5 0. 0. 1."),
            ("D2", 1, 5, "0.01 -0.02 0.0005 -0.0003 0."),
            ("R", 3, 3, "1. 0. 0. 0. 1. 0. 0. 0. 1."),
            ("T", 3, 1, "-0.06 0. 0."),
        )
    )
    + "</opencv_storage>\n"
)


def _sensor(x_m: float) -> str:
    return f"""sensor_type: camera
comment: VI-Sensor cam (MT9M034)
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, {x_m}, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
rate_hz: 20
resolution: [640, 480]
camera_model: pinhole
intrinsics: [500.0, 500.0, 320.5, 239.5]
distortion_model: radial-tangential
distortion_coefficients: [0.01, -0.02, 0.0005, -0.0003]
"""


def _kitti(name: str) -> str:
    shifts = enumerate((0, -30))
    lines = [f"{name.format(at)}: 500 0 320.5 {shift} 0 500 239.5 0 0 0 1 0\n" for at, shift in shifts]
    return "".join(lines)


KINDS: dict[str, Mapping[str, str]] = {
    "kalibr": {"camchain.yaml": _CAMCHAIN},
    "opencv, one file": {"stereo.yml": _STEREO_YML},
    "opencv, XML": {"stereo.xml": _STEREO_XML},
    "euroc": {"cam0/sensor.yaml": _sensor(0.0), "cam1/sensor.yaml": _sensor(0.06)},
    "middlebury": {
        "calib.txt": "cam0=[500 0 320.5; 0 500 239.5; 0 0 1]\ncam1=[500 0 320.5; 0 500 239.5; 0 0 1]\n"
        "doffs=0\nbaseline=60\nwidth=640\nheight=480\n"
    },
    "kitti, calib.txt": {"calib.txt": _kitti("P{}")},
    "kitti, raw data": {
        "calib_cam_to_cam.txt": "calib_time: 09-Jan-2012 13:57:47\n"
        + "".join(f"S_rect_0{at}: 6.4e+02 4.8e+02\nR_rect_0{at}: {_EYE}\n" for at in (0, 1))
        + _kitti("P_rect_0{}")
    },
}


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_gives_the_cameras_that_it_describes(kind: str, tmp_path: Path) -> None:
    """Two cameras of 640x480 with a focal length of 500 px, the right one 60 mm to the right."""
    for name, text in KINDS[kind].items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    is_alone = len(KINDS[kind]) == 1
    path = tmp_path / next(iter(KINDS[kind])) if is_alone else tmp_path
    sizes = ((640, 480), (640, 480)) if kind == "kitti, calib.txt" else None
    rig = import_rig((path,), sizes_px=sizes).rig
    np.testing.assert_allclose(rig.t_right_left_m, [-0.06, 0, 0], atol=1e-9)
    for camera in (rig.left, rig.right):
        assert (camera.width_px, camera.height_px) == (640, 480)
        np.testing.assert_array_equal(camera.matrix, [[500, 0, 320.5], [0, 500, 239.5], [0, 0, 1]])
