"""Copies what a calibration's page shows out of its parts: each view with its corners and what is left of them, and the rig."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from phone_host.calibration.solve.bend import Bend
from phone_host.calibration.solve.bundle_problem import Vector
from phone_host.calibration.solve.fitted_rig import vertical_errors_px
from phone_host.calibration.solve.result import Calibration, LensTrial
from phone_host.calibration.solve.verdict import limits_of
from phone_host.calibration.target.board_views import BoardViews, ViewPictures
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair, Rejected
from phone_host.geometry.se3 import SE3
from phone_host.model import Rig
from phone_host.model.calibration_series import LensTried, SeenBoard, SeriesRig, SeriesView

_UNUSED: Final = "no rig came of the views"
"""Why a view is not used whose board was found, if no rig came of any."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Taken:
    """What a series took.

    Attributes:
        order: names of the pairs in the order in which they were taken.
        views: what was found in the images.
        pairs: corners of all pairs that the calibration was given, those of an earlier one included; perhaps a drift of the
            cameras was taken out of them.
        seen: the same pairs in the same order, as they were seen.
        board: the board.
    """

    order: Sequence[str]
    views: BoardViews
    pairs: list[BoardPair]
    seen: list[BoardPair]
    board: Board

    def own(self, pair: BoardPair) -> BoardPair | None:
        """Return a pair as it was found in the images, where it may have another name; None: it is of an earlier calibration."""
        return next((each for each in self.views.pairs if each.left_px is pair.left_px), None)

    def as_seen(self, pair: BoardPair) -> BoardPair:
        """Return a pair as it was seen."""
        return next(each for each in self.seen if each.name == pair.name)

    @property
    def is_straightened(self) -> bool:
        """Whether a drift was taken out."""
        return any(used.right_px is not seen.right_px for used, seen in zip(self.pairs, self.seen, strict=True))


def series_views(taken: Taken, found: Calibration | None, rejected: tuple[Rejected, ...]) -> tuple[SeriesView, ...]:
    """Return all views of a series, used or not.

    Returns:
        Those of an earlier calibration first, the others in their order, those without a partner last.
    """
    reasons = {each.name: each for each in rejected}
    pictures = {each.name: each for each in taken.views.pictures}
    made = list[tuple[int, SeriesView]]()
    order = {name: index for index, name in enumerate(taken.order)}
    used = set() if found is None else {each.name for each in found.used}
    for pair in taken.pairs:
        own = taken.own(pair)
        name = "" if own is None else own.name
        # A pair of an earlier calibration may have the name of a rejected one.
        why = None if pair.name in used else reasons.pop(pair.name, None)
        view = _view((pair, taken.as_seen(pair)), pictures.get(name), found, why, taken.board)
        made.append((order.get(name, -1), view))
    for name, reason in reasons.items():
        picture = pictures.get(name)
        left, right = (SeenBoard(), SeenBoard()) if picture is None else _seen(picture)
        view = SeriesView(name=name, left=left, right=right, reason=reason.reason.value, detail=reason.detail)
        made.append((order.get(name, len(order)), view))
    return tuple(view for _, view in sorted(made, key=lambda each: each[0]))


def series_rig(found: Calibration, rig: Rig, far_m: float) -> SeriesRig:
    """Return the rig as it is written with its figures; beyond `far_m` depth is a guess."""
    left, right = (_tried(trials, bend) for trials, bend in zip(found.trials, found.bends, strict=True))
    return SeriesRig(
        rig=rig,
        rectification=found.rectification,
        vertical_px=found.vertical_px,
        baseline_sigma_m=found.baseline_sigma_m,
        square_m=found.squares.true_m,
        square_mean_m=found.squares.mean_m,
        square_sigma_m=found.squares.sigma_m,
        depths=found.depths,
        far_m=far_m,
        limits=limits_of(rig),
        tried=(left, right),
    )


def _tried(trials: tuple[LensTrial, ...], chosen: Bend) -> tuple[LensTried, ...]:
    return tuple(
        LensTried(
            words=f"{each.bend.lens.value}, {each.bend.terms} coefficients",
            held_out_px=each.rms_px,
            is_chosen=each.bend is chosen,
        )
        for each in trials
    )


def _seen(picture: ViewPictures) -> tuple[SeenBoard, SeenBoard]:
    return SeenBoard(picture=picture.left), SeenBoard(picture=picture.right)


def _view(
    both: tuple[BoardPair, BoardPair],
    picture: ViewPictures | None,
    found: Calibration | None,
    why: Rejected | None,
    board: Board,
) -> SeriesView:
    """Return a view whose board was found in both images, from its corners as they were used and as they were seen."""
    pair, seen = both
    place = None if found is None else next((i for i, each in enumerate(found.used) if each.name == pair.name), None)
    left, right = (b"", b"") if picture is None else (picture.left, picture.right)
    if found is None or place is None:
        return SeriesView(
            name=pair.name,
            left=SeenBoard(picture=left, corners_px=seen.left_px),
            right=SeenBoard(picture=right, corners_px=seen.right_px),
            reason=_UNUSED if why is None else why.reason.value,
            detail="" if why is None else why.detail,
        )
    vertical = as_seen = np.empty(0)
    if found.rectification is not None:
        vertical, as_seen = (vertical_errors_px(each, found.rig, found.rectification) for each in both)
    return SeriesView(
        name=pair.name,
        left=SeenBoard(picture=left, corners_px=seen.left_px, residuals_px=found.left_errors_px[place]),
        right=SeenBoard(picture=right, corners_px=seen.right_px, residuals_px=found.right_errors_px[place]),
        outline_m=SE3.of(found.poses[place]).apply(_outline_m(board)),
        vertical_px=vertical,
        as_seen_px=as_seen,
        in_space=found.used[place].in_space,
    )


def _outline_m(board: Board) -> Vector:
    """Return the outer corners in turn, (4, 3), in the board's axes."""
    points = board.points_m()
    low, high = points.min(axis=0), points.max(axis=0)
    return np.array([[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0]])
