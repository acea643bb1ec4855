"""Copies what a calibration's page shows out of its parts: each view with its corners and what is left of them, and the rig.

Lenses and baseline are the rig's. In each view the board's pose and a turn of the right camera about its own centre are fitted to
both images' corners (Gauss-Newton, twelve corners give 48 equations for 9 numbers). The uncertainty is that by the corners' noise, pooled
over the views. `failure_modes.rules` weighs whether the turns follow a rule; these are the turns themselves, for the eye.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from phone_host.calibration.solve.bundle_problem import Bend, Vector
from phone_host.calibration.solve.fitted_rig import vertical_errors_px
from phone_host.calibration.solve.verdict import Calibration, LensTrial, limits_of
from phone_host.calibration.target.board_views import BoardViews, ViewPictures
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair, Rejected
from phone_host.geometry.lens import project_linearised
from phone_host.geometry.se3 import SE3, cross_matrices, rotations_of
from phone_host.model import Rig
from phone_host.model.calibration_series import LensTried, SeenBoard, SeriesRig, SeriesView, ViewTurns

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


_NUMBERS: Final = 9
_STEPS: Final = 5
"""The start is the rig's own optimum, and the turns are small: three steps suffice."""


def view_turns(pairs: list[BoardPair], poses: Vector, points_m: Vector, rig: Rig) -> ViewTurns | None:
    """Find out how the right camera stood in each view.

    Returns:
        The turns; None if a view has too few corners to tell.
    """
    try:
        found = [_fitted(pair, SE3.of(pose), points_m, rig) for pair, pose in zip(pairs, poses, strict=True)]
    except np.linalg.LinAlgError:
        return None
    if not found:
        return None
    noise_px2 = sum(squares for _, _, squares, _ in found) / max(1, sum(freedom for *_, freedom in found))
    variances = np.array([np.diag(inverse)[6:] for _, inverse, _, _ in found]) * noise_px2
    return ViewTurns(
        names=tuple(pair.name for pair in pairs),
        turns_rad=np.array([turn for turn, *_ in found]),
        sigmas_rad=np.sqrt(variances.clip(min=0)),
    )


def _fitted(pair: BoardPair, pose: SE3, points_m: Vector, rig: Rig) -> tuple[Vector, Vector, float, int]:
    """Return the turn (3,), the inverse normal equations (9, 9), the squares left and how many numbers were free.

    Raises:
        numpy.linalg.LinAlgError: the corners do not determine it.
    """
    turn: Vector = np.eye(3)
    inverse: Vector = np.eye(_NUMBERS)
    for _ in range(_STEPS):
        errors, jacobian = _linearised(pair, pose, turn, points_m, rig)
        inverse = np.asarray(np.linalg.inv(jacobian.T @ jacobian), np.float64)
        step = inverse @ jacobian.T @ errors
        pose = SE3(rotations_of(step[:3]) @ pose.R, pose.t_m + step[3:6])
        turn = np.asarray(rotations_of(step[6:]) @ turn, np.float64)
    errors, _ = _linearised(pair, pose, turn, points_m, rig)
    skew = (turn - turn.T) / 2  # of a small turn: the cross product with its vector
    vector = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return vector, inverse, float(errors @ errors), len(errors) - _NUMBERS


def _linearised(pair: BoardPair, pose: SE3, turn: Vector, points_m: Vector, rig: Rig) -> tuple[Vector, Vector]:
    """Return measured minus projected (M,) of the corners seen, and the projections' derivatives (M, 9) by a turn and a shift of the board and a turn of the right camera."""
    turned = points_m @ pose.R.T
    left = turned + pose.t_m
    right = (left @ rig.R_right_left.T + rig.t_right_left_m) @ turn.T
    by_board = np.concatenate([-cross_matrices(turned), np.broadcast_to(np.eye(3), (len(left), 3, 3))], axis=2)
    nothing = np.zeros((len(left), 3, 3))
    by_left = np.concatenate([by_board, nothing], axis=2)
    by_right = np.concatenate([turn @ rig.R_right_left @ by_board, -cross_matrices(right)], axis=2)
    errors, rows = [], []
    for points, model, corners, by_numbers in (
        (left, rig.left, pair.left_px, by_left),
        (right, rig.right, pair.right_px, by_right),
    ):
        seen = np.isfinite(corners).all(axis=1)
        pixels, by_point, _ = project_linearised(points[seen], model)
        errors.append((corners[seen] - pixels).ravel())
        rows.append((by_point @ by_numbers[seen]).reshape(-1, _NUMBERS))
    return np.concatenate(errors), np.concatenate(rows)
