"""Folders without numbers, of which one lacks pictures: the boards tell which."""

import pytest

from common.errors import DataError
from phone_host.calibration.failure_modes.partners import out_of_step
from phone_host.calibration.failure_modes.remedies import out_of_step_error
from phone_host.calibration.target.pairs import FileCorners
from phone_host.model import Side
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import unlike_rig

_SIZES = ((640, 480), (1280, 720))
_PAIRS = exact_pairs(unlike_rig(), poses(10, seed=12), noise_px=0.1)
_LEFT = tuple(FileCorners(f"{name}.png", pair.left_px) for name, pair in zip("abcdefghij", _PAIRS, strict=True))
_RIGHT = tuple(FileCorners(file.name, pair.right_px) for file, pair in zip(_LEFT, _PAIRS, strict=True))


def _without(files: tuple[FileCorners, ...], *names: str) -> tuple[FileCorners, ...]:
    return tuple(file for file in files if file.name[0] not in names)


def _unseen(files: tuple[FileCorners, ...], *names: str) -> tuple[FileCorners, ...]:
    """The board was not found in some of the pictures."""
    return tuple(FileCorners(file.name, file.corners[:0] if file.name[0] in names else file.corners) for file in files)


@pytest.mark.parametrize(
    ("left", "right", "said"),
    [
        (_LEFT, _without(_RIGHT, "e"), "missing on the right: the folders are out of step from e.png on"),
        (_without(_LEFT, "a"), _RIGHT, "missing on the left: the folders are out of step from a.png on"),
        (_LEFT, _without(_RIGHT, "c", "g"), "delete c.png and g.png on the left"),
        (_unseen(_LEFT, "b"), _without(_RIGHT, "e"), "or delete e.png on the left"),
    ],
)
def test_the_first_picture_without_a_partner_is_named(
    left: tuple[FileCorners, ...], right: tuple[FileCorners, ...], said: str
) -> None:
    """Wherever pictures are missing, and even if the board is not seen in another, the line names those to delete."""
    found = out_of_step(left, right, BOARD, _SIZES)
    assert found is not None
    error = out_of_step_error(found)
    assert isinstance(error, DataError)
    assert said in str(error)


def test_folders_in_step_are_left_alone() -> None:
    """Equal counts, or a picture too many at the end, need no remedy; views that fit nowhere say nothing about a step."""
    assert out_of_step(_LEFT, _RIGHT, BOARD, _SIZES) is None
    assert out_of_step(_LEFT, _without(_RIGHT, "j"), BOARD, _SIZES) is None
    assert out_of_step(_LEFT, _RIGHT[:6][::-1], BOARD, _SIZES) is None
    assert out_of_step(_unseen(_LEFT, *"abcdefghij"), _RIGHT[:6], BOARD, _SIZES) is None


def test_the_side_that_lacks_pictures_is_named() -> None:
    """The shorter side is the one with the gap."""
    found = out_of_step(_without(_LEFT, "d"), _RIGHT, BOARD, _SIZES)
    assert found is not None
    assert (found.side, found.missing, found.alone) == (Side.LEFT, 1, ("d.png",))
