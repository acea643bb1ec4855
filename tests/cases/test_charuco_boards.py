"""ChArUco boards of other printers: OpenCV before 4.6 and calib.io arrange the marks of boards with an even number of rows otherwise."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import SettingsError
from phone_host.calibration.target.board_names import board_name, named_board
from phone_host.calibration.target.moving_board import SizeCheck
from phone_host.model import Image
from phone_host.output.rig_yaml import read_rig
from phone_host.verbs.calibrate import run
from tests.support.boards import poses
from tests.support.pictures import encoded
from tests.support.requests import request_of

_SIZE_PX = (640, 480)
_CAMERA = np.array([[560.0, 0.0, 320.0], [0.0, 560.0, 240.0], [0.0, 0.0, 1.0]])
_BASELINE_M = 0.06
_PX_A_SQUARE = 60
_FINE = 3
_SQUARE_M = 0.028


def _sheet(columns: int, rows: int, *, is_legacy: bool) -> Image:
    """OpenCV's own drawing of the board: 60 px a square, a margin of one square."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000)
    board = cv2.aruco.CharucoBoard((columns, rows), 28.0, 20.0, family)
    board.setLegacyPattern(is_legacy)
    size = ((columns + 2) * _PX_A_SQUARE, (rows + 2) * _PX_A_SQUARE)
    return np.asarray(board.generateImage(size, marginSize=_PX_A_SQUARE), np.uint8)


def _view(sheet: Image, pose: NDArray[np.float64], shift_m: float) -> Image:
    """What a camera `shift_m` right of the left one sees of a sheet whose first inner corner is the pose's origin."""
    rotation = np.asarray(cv2.Rodrigues(pose[:3])[0], np.float64)
    plane = np.column_stack([rotation[:, :2], pose[3:] - [shift_m, 0, 0]])
    to_metres = np.array(
        [[1.0, 0.0, 0.5 - 2 * _PX_A_SQUARE], [0.0, 1.0, 0.5 - 2 * _PX_A_SQUARE], [0, 0, _PX_A_SQUARE / _SQUARE_M]]
    )
    finer = np.array([[_FINE, 0.0, (_FINE - 1) / 2], [0.0, _FINE, (_FINE - 1) / 2], [0.0, 0.0, 1.0]])
    size = (_SIZE_PX[0] * _FINE, _SIZE_PX[1] * _FINE)
    fine = cv2.warpPerspective(sheet, finer @ _CAMERA @ plane @ to_metres, size, borderValue=140.0)
    return np.asarray(cv2.resize(fine, _SIZE_PX, interpolation=cv2.INTER_AREA), np.uint8)


def _views(columns: int, rows: int, *, is_legacy: bool) -> Iterator[tuple[Image, Image]]:
    sheet = _sheet(columns, rows, is_legacy=is_legacy)
    for pose in poses(9, seed=4, depth_m=(0.42, 0.6)):
        yield _view(sheet, pose, 0.0), _view(sheet, pose, _BASELINE_M)


@pytest.mark.parametrize(
    ("columns", "rows", "is_legacy"),
    [
        pytest.param(8, 6, True, id="even rows, before 4.6"),
        pytest.param(8, 6, False, id="even rows, since 4.6"),
        pytest.param(7, 6, True, id="even rows and odd columns, before 4.6"),
        pytest.param(8, 5, True, id="odd rows, the same in both"),
    ],
)
def test_both_arrangements_give_the_same_rig(
    *, columns: int, rows: int, is_legacy: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The rig is the one that took the pictures, whatever --board says of the arrangement; the summary tells which it is."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
    for index, pair in enumerate(_views(columns, rows, is_legacy=is_legacy)):
        for side, image in zip(("left", "right"), pair, strict=True):
            (tmp_path / side / f"{index}.png").write_bytes(encoded(".png", image))
    board = f"charuco:{columns}x{rows}:28mm:20mm:5x5"
    folders = [str(tmp_path / "left"), str(tmp_path / "right")]
    assert run(request_of("calibrate", *folders, "--board", board, "--out", str(tmp_path / "rig.yaml"))) == 0
    rig = read_rig(tmp_path / "rig.yaml")
    np.testing.assert_allclose(rig.t_right_left_m, [-_BASELINE_M, 0, 0], atol=2e-4)
    np.testing.assert_allclose(rig.left.matrix[0, 0], 560, rtol=3e-3)
    has_other_arrangement = is_legacy and rows % 2 == 0
    assert ("arranged as by OpenCV before 4.6" in capsys.readouterr().out) is has_other_arrangement
    assert (f"{board}:legacy" in (tmp_path / "rig.yaml").read_text()) is has_other_arrangement


def test_a_live_board_of_the_other_arrangement_is_named() -> None:
    """A person who shows a board of the other arrangement gets the --board that fits, in place of a search without end."""
    shown = _sheet(8, 6, is_legacy=True)
    check = SizeCheck(named_board("charuco:8x6:28mm:20mm:5x5", None))
    for _ in range(11):
        check.missed(shown, shown)
    with pytest.raises(SettingsError, match="give --board charuco:8x6:28mm:20mm:5x5:legacy") as caught:
        check.missed(shown, shown)
    assert "OpenCV before 4.6" in caught.value.remedy


def test_the_name_of_a_board_tells_its_arrangement() -> None:
    """A name is read back as the same board; with an odd number of rows both arrangements are one."""
    name = "charuco:8x6:28mm:20mm:5x5:legacy"
    assert board_name(named_board(name, None)) == name
    assert named_board(name, None) != named_board(name.removesuffix(":legacy"), None)
    odd = "charuco:8x5:28mm:20mm:5x5"
    assert named_board(f"{odd}:legacy", None) == named_board(odd, None)
