"""The pose of the right camera relative to the left one that most pairs agree on, from each camera calibrated alone. Pure."""

from dataclasses import replace

import numpy as np

from phone_host.calibration.solve.bundle import BundleState, Vector, project_view, rms_px
from phone_host.calibration.solve.calibrate_alone import LoneCamera
from phone_host.calibration.target.corners import Corners
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel


def relative_pose(left: Vector, right: Vector) -> tuple[Vector, Vector]:
    """Return the rotation vector and translation, right from left, from two poses (6,) of one board."""
    pose = (SE3.of(right) @ SE3.of(left).inverse()).pose()
    return pose[:3], pose[3:]


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


def state_of(left: CameraModel, right: CameraModel, left_pose: Vector, right_pose: Vector) -> BundleState:
    """Return the rig that one pair gives.

    Args:
        left: the left camera.
        right: the right camera.
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
