"""How the right camera stood in each view, against the rig that was computed from all of them. Pure.

Lenses and baseline are the rig's. In each view the board's pose and a turn of the right camera about its own centre are fitted to
both images' corners (Gauss-Newton, twelve corners give 48 equations for 9 numbers). The uncertainty is that by the corners' noise, pooled
over the views. `failure_modes.rules` weighs whether the turns follow a rule; these are the turns themselves, for the eye.
"""

from typing import Final

import numpy as np

from phone_host.calibration.solve.bundle_problem import Vector
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import project_linearised
from phone_host.geometry.se3 import SE3, cross_matrices, rotations_of
from phone_host.model import Rig
from phone_host.model.calibration_series import ViewTurns

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
