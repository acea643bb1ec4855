"""How far a trajectory is from another: after rigid alignment without scale, step by step, and at its end.

Source: J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", 2012; S. Umeyama, PAMI 13(4), 1991.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from phone_host.geometry.se3 import SE3


@dataclass(frozen=True, slots=True)
class TrajectoryErrors:
    """Errors of a trajectory.

    Attributes:
        ate_mm: root mean square of the places after alignment.
        step_mm: median error of the motion from one pose to the next.
        end_mm: error of the last place, the first poses put together.
        end_share: the same as a share of the path.
    """

    ate_mm: float
    step_mm: float
    end_mm: float
    end_share: float


def trajectory_errors(found: Sequence[SE3], truth: Sequence[SE3]) -> TrajectoryErrors:
    """Compare two trajectories, pose by pose."""
    here, there = (np.array([pose.t_m for pose in poses]) for poses in (found, truth))
    mine, other = here - here.mean(axis=0), there - there.mean(axis=0)
    left, _, right = np.linalg.svd(other.T @ mine)
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    ate = np.sqrt(((mine @ turn.T - other) ** 2).sum(axis=1).mean())
    steps = [_off(*moves) for moves in zip(_moves(found), _moves(truth), strict=True)]
    end = _off(found[0].inverse() @ found[-1], truth[0].inverse() @ truth[-1])
    path = float(np.linalg.norm(np.diff(there, axis=0), axis=1).sum())
    return TrajectoryErrors(1e3 * float(ate), 1e3 * float(np.median(steps)), 1e3 * end, end / path if path else 0.0)


def _moves(poses: Sequence[SE3]) -> list[SE3]:
    return [one.inverse() @ other for one, other in pairwise(poses)]


def _off(found: SE3, truth: SE3) -> float:
    return float(np.linalg.norm((truth.inverse() @ found).t_m))
