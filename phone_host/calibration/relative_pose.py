"""The pose of the right camera relative to the left one that most pairs agree on, from each camera calibrated alone. Pure."""

from dataclasses import replace

import cv2
import numpy as np

from phone_host.calibration.bundle import BundleState, Vector, project_view, rms_px
from phone_host.calibration.calibrate_alone import LoneCamera
from phone_host.calibration.target import Corners


def relative_pose(left: Vector, right: Vector) -> tuple[Vector, Vector]:
    """Return the rotation vector and translation, right from left, from two poses (6,) of one board."""
    inverse = np.asarray(cv2.Rodrigues(left[:3])[0]).T
    rotation = np.asarray(cv2.Rodrigues(right[:3])[0]) @ inverse
    return np.ravel(cv2.Rodrigues(rotation)[0]).astype(np.float64), right[3:] - rotation @ left[3:]


def states_of(left: LoneCamera, right: LoneCamera) -> list[BundleState]:
    """Return the rig that each pair gives on its own.

    Args:
        left: the left camera, with one pose for each pair.
        right: the right camera, with as many.
    """
    return [
        replace(state_of(left.parameters, right.parameters, a, b), poses=left.poses)
        for a, b in zip(left.poses, right.poses, strict=True)
    ]


def state_of(left: Vector, right: Vector, left_pose: Vector, right_pose: Vector) -> BundleState:
    """Return the rig that one pair gives.

    Args:
        left: (9,) the left camera's parameters.
        right: (9,) the right camera's.
        left_pose: (6,) of the board in the left camera's axes.
        right_pose: (6,) of the same board in the right camera's.
    """
    rotation, translation_m = relative_pose(left_pose, right_pose)
    return BundleState(
        left=left, right=right, rotation=rotation, translation_m=translation_m, poses=left_pose[np.newaxis]
    )


def prediction_errors_px(states: list[BundleState], right_px: list[Corners], points_m: Vector) -> Vector:
    """Predict the right corners of all pairs from their left poses, by the rig that each pair gives.

    Args:
        states: of V pairs, as `states_of` gives them.
        right_px: (N, 2) right corners of each pair.
        points_m: (N, 3) corners in the board's axes.

    Returns:
        (V, V) root mean square error, px: rig by pair.
    """
    return np.array(
        [
            [
                rms_px(seen - project_view(state, pose, points_m)[1])
                for seen, pose in zip(right_px, state.poses, strict=True)
            ]
            for state in states
        ]
    )
