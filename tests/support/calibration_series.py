"""Series of board views for the page of `calibrate`, from exact corners with noise: no image is rendered."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from common.errors import DataError
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.series_snapshot import Taken, series_rig, series_views, view_turns
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.board_views import BoardViews, ViewPictures
from phone_host.calibration.target.pairs import BoardPair, Reason, Rejected
from phone_host.calibration.target.small_picture import small_jpeg
from phone_host.model import Verdict
from phone_host.model.calibration_series import CalibrationSeries, RectifiedView
from phone_host.report.calibration_report import CalibrationReport, Judged, Known, Origin
from phone_host.stereo.view_files import ViewFiles
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import unlike_rig

SIZES = ((640, 480), (1280, 720))
JPEG = small_jpeg(np.full((24, 32), 90, np.uint8), 32)
REJECTED = (
    Rejected("8", Reason.NOT_FOUND_LEFT, "the board is not seen whole and sharp in the left image"),
    Rejected("left9.png", Reason.NO_PARTNER, "the left image has no partner on the other side"),
)
"""One whose pictures are known, and one without any."""


@cache
def pairs() -> tuple[BoardPair, ...]:
    """Eight views with noise of 0.1 px, one of which lacks a corner."""
    made = exact_pairs(unlike_rig(), poses(8, seed=4), 0.1, seed=5)
    made[2].right_px[7] = np.nan
    return tuple(made)


@cache
def calibration() -> Calibration:
    """What they give."""
    return calibrate(list(pairs()), BOARD, SIZES)


def taken(used: list[BoardPair] | None = None, seen: list[BoardPair] | None = None) -> Taken:
    """What was taken: the views, and one picture of a pair without a board; `used`: corners that were changed since they were `seen`."""
    names = [pair.name for pair in pairs()] + ["8"]
    views = BoardViews(pairs(), REJECTED, SIZES, pictures=tuple(ViewPictures(name, JPEG, JPEG) for name in names))
    seen = list(pairs()) if seen is None else seen
    return Taken(order=names, views=views, pairs=seen if used is None else used, seen=seen, board=BOARD)


def calibration_report(result: Judged | DataError) -> CalibrationReport:
    """The report of the command on them."""
    files = ViewFiles(pairs=(), by_number=True, by_name=False, left_alone=(), right_alone=())
    return CalibrationReport(
        files=files,
        views=taken().views,
        known=Known(BOARD, Origin.IMAGES),
        rejected=REJECTED,
        result=result,
        page=Path("index.html"),
    )


def series() -> CalibrationSeries:
    """A usable one."""
    found = calibration()
    return CalibrationSeries(
        verdict=Verdict.USABLE,
        remedy="take pairs with the board in the corners of both images",
        board="board of 9x6 corners",
        sizes_px=SIZES,
        views=series_views(taken(), found, REJECTED),
        found=series_rig(found, found.rig, 12.3),
        turns=view_turns(list(pairs()), found.poses, BOARD.points_m(), found.rig),
        rectified=rectified(),
        rig_file="rig.yaml",
    )


def rectified(*, is_vertical: bool = False) -> RectifiedView:
    """A rectified pair whose right corners lie 30 px beside the left ones, along the rows."""
    left = np.stack(np.meshgrid(np.arange(60.0, 200, 20), np.arange(40.0, 140, 20)), axis=2).reshape(-1, 2)
    shift = (0, -30) if is_vertical else (-30, 0)
    return RectifiedView(
        name="3",
        left=JPEG,
        right=JPEG,
        size_px=(320, 240),
        left_px=left,
        right_px=left + shift,
        is_vertical=is_vertical,
    )


def turned(degrees: float, index: int) -> list[BoardPair]:
    """The views, in one of which the right camera was turned about its x axis: its corners as that camera sees them."""
    made = list(pairs())
    model = calibration().rig.right
    pair = made[index]
    rays = cv2.undistortPointsIter(
        pair.right_px[:, np.newaxis], model.matrix, model.distortion, np.eye(3), np.eye(3), (3, 60, 1e-12)
    ).reshape(-1, 2)
    turn = cv2.Rodrigues(np.array([np.radians(degrees), 0, 0]))[0]
    points = np.column_stack([rays, np.ones(len(rays))]) @ turn.T
    seen = cv2.projectPoints(points, np.zeros(3), np.zeros(3), model.matrix, model.distortion)[0].reshape(-1, 2)
    made[index] = replace(pair, right_px=np.asarray(seen, np.float64))
    return made
