"""A pair that passed through two processes and a link gives the same disparity, bit for bit, as the same files from disk."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.programs import board, host, program

SCAN_DATA = os.environ.get("SCAN_DATA", "")


def real_pairs() -> dict[str, tuple[str, str, int]]:
    """Rectified pairs with their number of disparities."""
    return {
        "cones": ("middlebury_v2/cones/imL.png", "middlebury_v2/cones/imR.png", 64),
        "motorcycle": (
            "middlebury_2014_q/Motorcycle/motorcycle_left.png",
            "middlebury_2014_q/Motorcycle/motorcycle_right.png",
            64,
        ),
        "aloe": ("opencv_aloe/aloeL.jpg", "opencv_aloe/aloeR.jpg", 224),
        "kitti": (
            "kitti_odometry_clips/KITTI_sequence_1/image_l/000000.png",
            "kitti_odometry_clips/KITTI_sequence_1/image_r/000000.png",
            96,
        ),
    }


@pytest.mark.data
@pytest.mark.skipif(not SCAN_DATA, reason="SCAN_DATA is not set: no real images here")
@pytest.mark.parametrize("matcher", ["sgbm", "tandem", "block"])
@pytest.mark.parametrize("name", real_pairs())
def test_a_streamed_real_pair_equals_the_same_files(name: str, matcher: str, tmp_path: Path) -> None:
    """`phone-host run` over ZeroMQ and `phone-host stereo` write the same bytes to disparity.pfm, and they hold a real map."""
    left, right, disparities = real_pairs()[name]
    paths, link = [Path(SCAN_DATA) / left, Path(SCAN_DATA) / right], f"ipc://{tmp_path}/link"
    options = ["--rectified", "--disparities", str(disparities), "--matcher", matcher]
    with board(["run", "--camera", f"replay:{paths[0]}?pace=demand", "--link", link], tmp_path) as sender:
        receiving = [
            "run",
            "--camera",
            f"replay:{paths[1]}?pace=demand",
            "--link",
            link,
            *options,
            "--out",
            str(tmp_path / "live"),
        ]
        with host([*receiving, "--pairs", "1"], tmp_path) as receiver:
            assert receiver.wait() == 0
        assert sender.wait() == 0
    stereo = ["stereo", *map(str, paths), *options, "--out", str(tmp_path / "files")]
    with program("phone_host.cli", stereo, tmp_path, "stereo") as from_files:
        assert from_files.wait() == 0
    live = (tmp_path / "live" / "pair-000000" / "disparity.pfm").read_bytes()
    assert live == (tmp_path / "files" / "disparity.pfm").read_bytes()
    values = np.asarray(cv2.imread(str(tmp_path / "files" / "disparity.pfm"), cv2.IMREAD_UNCHANGED))
    assert np.isfinite(values).mean() > 0.5
