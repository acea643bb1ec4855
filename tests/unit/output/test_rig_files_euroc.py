"""EuRoC's sensor.yaml, one of each camera."""

from pathlib import Path

import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.output.rig_files.imported import RigKind, import_rig
from tests.support.rig_files import assert_refused, assert_side_by_side, two_texts

EUROC = """T_BS: [1, 0, 0, {x}, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
resolution: [752, 480]
camera_model: pinhole
intrinsics: [450.0, 451.0, 370.0, 250.0]
distortion_model: radtan
distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]
"""


def test_euroc_poses_are_of_the_body(tmp_path: Path) -> None:
    """p_body = T_BS p_camera: cameras at y = +0.05 and y = -0.06 of a body whose -y is the cameras' x are 0.11 m apart in x."""
    for number, y in ((0, 0.05), (1, -0.06)):
        folder = tmp_path / f"cam{number}"
        folder.mkdir()
        (folder / "sensor.yaml").write_text(
            "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
            f"  data: [0.0, 0.0, 1.0, 0.2,\n   -1.0, 0.0, 0.0, {y},\n   0.0, -1.0, 0.0, 0.0,\n   0.0, 0.0, 0.0, 1.0]\n"
            "rate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [450.0, 451.0, 370.0, 250.0] # fu fv\n"
            "distortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n"
        )
    found = import_rig((tmp_path,))
    assert found.kind is RigKind.EUROC
    np.testing.assert_allclose(found.rig.t_right_left_m, [-0.11, 0, 0], atol=1e-12)
    with pytest.raises(SettingsError, match="is one camera of two"):
        import_rig((tmp_path / "cam0" / "sensor.yaml",))


def test_the_text_is_sound_until_one_thing_is_wrong(tmp_path: Path) -> None:
    """The right camera stands 0.12 m right of the left one, the pose in one list."""
    assert_side_by_side(tmp_path, two_texts(EUROC, x="0.12"))


def test_a_camera_of_euroc_that_is_no_pinhole_is_refused(tmp_path: Path) -> None:
    """The model's word is told, with the one that is read."""
    texts = two_texts(EUROC.replace("pinhole", "omni"), x="0.12")
    assert_refused(tmp_path, texts, "a.yaml: camera_model is 'omni'", "read is pinhole")
