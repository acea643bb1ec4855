"""Calibrations that others published with their images are read, and rows match with them. Needs SCAN_DATA."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import Image
from phone_host.output.rig_files.imported import import_rig
from phone_host.stereo.rectify import across_lines_px, rectify_points, rectify_rig


def _data() -> Path:
    folder = os.environ.get("SCAN_DATA")
    if not folder:
        pytest.skip("SCAN_DATA is not set: no real images")
    return Path(folder)


@pytest.mark.data
def test_published_calibrations_are_read() -> None:
    """ETH3D's baseline is 59.5549 mm, EuRoC's 110.1 mm, KITTI's 0.5372 m (README of the data)."""
    eth3d = import_rig((_data() / "eth3d_two_view_gt" / "playground" / "calib.txt",)).rig
    assert -eth3d.t_right_left_m[0] == pytest.approx(0.0595549)
    assert (eth3d.left.width_px, eth3d.left.height_px) == (941, 490)
    euroc = import_rig((_data() / "euroc_v101_static",)).rig
    assert np.linalg.norm(euroc.t_right_left_m) == pytest.approx(0.1101, abs=5e-5)
    size_px = (1226, 370)
    path = _data() / "kitti_odometry_clips" / "KITTI_sequence_1" / "calib.txt"
    kitti = import_rig((path,), sizes_px=(size_px, size_px)).rig
    assert -kitti.t_right_left_m[0] == pytest.approx(0.5372, abs=5e-5)


@pytest.mark.data
def test_rows_match_with_eurocs_imported_calibration() -> None:
    """Features followed from left to right lie on the same rectified row to 0.13 px on average; less than 1 % lie farther than 1 px off."""
    folder = _data() / "euroc_v101_static"
    rig = import_rig((folder,)).rig
    made = rectify_rig(rig)
    down: list[NDArray[np.float64]] = []
    for path in sorted((folder / "mav0" / "cam0" / "data").glob("*.png")):
        images = [
            cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
            for file in (path, folder / "mav0" / "cam1" / "data" / path.name)
        ]
        left, right = _followed(np.asarray(images[0]), np.asarray(images[1]))
        a = rectify_points(left, rig.left, made.R_left, made.geometry)
        b = rectify_points(right, rig.right, made.R_right, made.geometry)
        down.append(np.abs(across_lines_px(a, b, made.epipolar))[a[:, 0] > b[:, 0]])
    down_px = np.concatenate(down)
    assert len(down_px) > 1000
    assert (down_px < 1).mean() > 0.98
    assert down_px[down_px < 1].mean() <= 0.13


def _followed(left: Image, right: Image) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of the left image that optical flow finds in the right one, and from there again to a tenth of a pixel."""
    at = np.asarray(cv2.goodFeaturesToTrack(left, 800, 0.01, 8), np.float32)
    there, found = _flow(left, right, at)
    back, again = _flow(right, left, there)
    same = found & again & (np.linalg.norm((back - at).reshape(-1, 2), axis=1) < 0.1)
    return at.reshape(-1, 2)[same].astype(np.float64), there.reshape(-1, 2)[same].astype(np.float64)


def _flow(source: Image, target: Image, at: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    end = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-4)
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        source, target, at, at.copy(), winSize=(21, 21), maxLevel=4, criteria=end
    )
    return np.asarray(there, np.float32), np.asarray(found).ravel().astype(np.bool_)
