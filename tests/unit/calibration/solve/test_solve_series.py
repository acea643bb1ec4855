"""From the board in the pictures to a rig: a drift of the cameras is taken out, and what rig.yaml keeps of the pictures is as they were seen."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import DataError
from common.orientation import Flip, Orientation
from phone_host.calibration.failure_modes.arrangement import turned_corners
from phone_host.calibration.failure_modes.mistakes import Course, Mistake
from phone_host.calibration.solve.bundle_problem import Bend
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.verdict import Calibration, judge
from phone_host.calibration.target.board_views import BoardViews
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.se3 import vectors_of
from phone_host.jobs.calibrate.earlier import Series, saved_views
from phone_host.jobs.calibrate.pictures import Solved, judged, solve_series
from phone_host.jobs.calibrate.request import CalibrateRequest
from phone_host.model import Rig, Side, Verdict
from phone_host.output.rig_yaml import read_rig_views, write_rig
from phone_host.report.calibration_report import Judged
from phone_host.stereo.view_files import ViewFiles
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import unlike_rig

_SIZES = ((640, 480), (1280, 720))
_FIRST = 4
_WHOLE_TURN = math.radians(0.4)


def _turned(turn_rad: float) -> Rig:
    """The rig whose right camera rolled."""
    rig, turn = unlike_rig(), np.asarray(cv2.Rodrigues(np.array([0, 0, turn_rad]))[0], np.float64)
    return replace(rig, R_right_left=turn @ rig.R_right_left, t_right_left_m=turn @ rig.t_right_left_m)


@cache
def _pairs() -> list[BoardPair]:
    """Eight views, while the right camera rolled steadily by 0.4 degrees."""
    made = []
    for index, pose in enumerate(poses(2 * _FIRST, seed=3)):
        rig = _turned(_WHOLE_TURN * index / (2 * _FIRST - 1))
        (pair,) = exact_pairs(rig, pose[np.newaxis], noise_px=0.05, seed=index)
        made.append(replace(pair, name=str(index)))
    return made


def _solved(series: Series, pairs: list[BoardPair]) -> Solved:
    views = BoardViews(pairs=tuple(pairs), rejected=(), sizes_px=_SIZES)
    return solve_series(series, views, math.nan, lambda _: None)


def _from_file(solved: Solved, folder: Path) -> Series:
    """The series that `--from` makes of what was written."""
    found, path = solved.found, folder / "rig.yaml"
    assert isinstance(found, Calibration)
    assert found.rectification is not None
    nothing_earlier = Series(board=BOARD, side=Side.LEFT, path=Path())
    write_rig(path, found.rig, found.rectification, saved_views(nothing_earlier, found, solved.seen))
    return Series(board=BOARD, side=Side.LEFT, path=path, rig=found.rig, views=read_rig_views(path))


def _roll_off_deg(solved: Solved) -> float:
    """How far the right camera's roll is from that in the last view, degrees."""
    assert isinstance(solved.found, Calibration)
    between = solved.found.rig.R_right_left @ _turned(_WHOLE_TURN).R_right_left.T
    return math.degrees(vectors_of(between)[2])


def test_a_drift_is_taken_out_of_earlier_and_new_pictures_together(tmp_path: Path) -> None:
    """Four pictures, then four with --from, while the cameras turn: named as one drift, and the rig is that of the last picture. Corners are kept as they were seen: the same pictures again are none."""
    first = _solved(Series(board=BOARD, side=Side.LEFT, path=Path()), _pairs()[:_FIRST])
    solved = _solved(_from_file(first, tmp_path), _pairs()[_FIRST:])
    assert solved.finding is not None
    assert solved.finding.evidence.turned is not None
    assert solved.finding.evidence.turned.course is Course.DRIFT
    assert len(solved.pairs) == len(solved.seen) == 2 * _FIRST
    assert solved.pairs is not solved.seen
    assert abs(_roll_off_deg(solved)) < 0.03
    again = _solved(_from_file(solved, tmp_path), _pairs())
    assert isinstance(again.found, DataError)
    assert "all of these pictures are in" in again.found.problem


def test_a_stiff_rig_keeps_its_corners() -> None:
    """Without a drift the pairs that are used are those that were seen."""
    stiff = exact_pairs(unlike_rig(), poses(5, seed=3), noise_px=0.05)
    solved = _solved(Series(board=BOARD, side=Side.LEFT, path=Path()), stiff)
    assert solved.pairs is solved.seen
    assert solved.finding is None


@cache
def _good() -> tuple[list[BoardPair], Calibration]:
    pairs = exact_pairs(unlike_rig(), poses(7, seed=1), noise_px=0.02)
    return pairs, calibrate(pairs, BOARD, _SIZES)


@pytest.mark.parametrize(
    ("pose_only", "verdict"), [(False, Verdict.USABLE), (True, Verdict.GOOD)], ids=["lenses", "pose only"]
)
def test_pictures_from_folders_are_judged_as_live_ones(verdict: Verdict, *, pose_only: bool) -> None:
    """Good figures, and a lens of five coefficients that nobody saw in the corners: usable, with the corner as the remedy; lenses of an earlier calibration are judged by its pictures."""
    pairs, found = _good()
    assert judge(found, ()).verdict is Verdict.GOOD
    views = BoardViews(pairs=tuple(pairs), rejected=(), sizes_px=_SIZES)
    solved = Solved(views=views, seen=pairs, pairs=pairs, found=replace(found, bends=(Bend.WIDE, Bend.USUAL)))
    request = CalibrateRequest(pose_only=pose_only, out=Path("rig.yaml"))
    files = ViewFiles(pairs=(), by_number=True, by_name=False, left_alone=(), right_alone=())
    series = Series(board=BOARD, side=Side.LEFT, path=Path())
    found_rig = judged(files, series, solved, request)
    assert isinstance(found_rig, Judged)
    assert found_rig.judgement.verdict is verdict
    assert ("no board was seen in the" in found_rig.judgement.remedy) is (verdict is Verdict.USABLE)


def test_mirrored_new_pictures_are_named_so_beside_earlier_ones(tmp_path: Path) -> None:
    """Seven pictures, then four with --from whose right camera mirrors: they are named mirrored, not as of another moment."""
    pairs, found = _good()
    earlier = _from_file(
        Solved(
            views=BoardViews(pairs=tuple(pairs), rejected=(), sizes_px=_SIZES), seen=pairs, pairs=pairs, found=found
        ),
        tmp_path,
    )
    later = exact_pairs(unlike_rig(), poses(4, seed=9), noise_px=0.02)
    mirrored = [
        replace(pair, right_px=turned_corners(pair.right_px, _SIZES[1], Orientation(0, Flip.H), BOARD))
        for pair in later
    ]
    finding = _solved(earlier, mirrored).finding
    assert finding is not None
    assert finding.code is Mistake.MIRRORED
    assert finding.evidence.misplaced is not None
    assert finding.evidence.misplaced.side is Side.RIGHT
    assert finding.evidence.misplaced.is_mirrored
