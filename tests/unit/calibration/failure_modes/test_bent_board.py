"""A board that is not flat is named where all views show it, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from phone_host.calibration.failure_modes.mistakes import Mistake
from phone_host.calibration.failure_modes.name import bent
from phone_host.calibration.solve.verdict import Calibration
from tests.support.boards import BOARD
from tests.support.calibration_series import calibration


def _with_bows(bows_mm: list[float], sigma_mm: float = 0.1) -> Calibration:
    """The views whose boards are bent along their rows."""
    found = calibration()
    used = [
        replace(
            each,
            in_space=replace(each.in_space, bows_m=np.array([bow / 1e3, 0.0]), bow_sigmas_m=np.full(2, sigma_mm / 1e3)),
        )
        for each, bow in zip(found.used, bows_mm, strict=False)
    ]
    return replace(found, used=tuple(used))


def test_a_bend_of_all_views_is_named_with_its_figures() -> None:
    """3 mm over rows of 200 mm, known to 0.1 mm in each of 8 views: to 0.04 mm in all."""
    found = bent(_with_bows([3.0] * 8), BOARD)
    assert found is not None
    assert found.code is Mistake.BENT
    assert "along its rows it is bent by 3.00 +- 0.04 mm over 200 mm" in found.message


@pytest.mark.parametrize(
    ("bows_mm", "sigma_mm"),
    [
        ([0.7] * 8, 0.01),  # less than 0.4 % of the side
        ([3.0] * 8, 2.0),  # within the noise
        ([9.0, -3.0] * 4, 0.1),  # each view another
        ([3.0] * 5, 0.1),  # too few views
    ],
)
def test_less_accuses_nobody(bows_mm: list[float], sigma_mm: float) -> None:
    """A slight bend, noise, views that contradict each other, and few views tell nothing."""
    assert bent(_with_bows(bows_mm, sigma_mm), BOARD) is None


def test_a_flat_board_accuses_nobody() -> None:
    """Views of a flat board with noise of 0.1 px."""
    assert bent(calibration(), BOARD) is None
