"""How loops have moved a model, and where that takes what is known in its axes. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.stretches import Placed


@dataclass(frozen=True, slots=True, eq=False)
class ModelMotion:
    """A motion of a model, each part of which moves as a whole.

    Attributes:
        before_m: (N, 3) where its views were taken before, m.
        by: of the world, for each of them.
    """

    before_m: NDArray[np.float64]
    by: tuple[SE3, ...]

    @staticmethod
    def of(views: Sequence[Placed]) -> "ModelMotion":
        """Return the motion after which views are where they are now; there is at least one."""
        before = [view.by.inverse().apply(view.world_camera.t_m) for view in views]
        return ModelMotion(np.array(before).reshape(-1, 3), tuple(view.by for view in views))

    def carry(self, pose: SE3) -> SE3:
        """Move a pose in the model's axes as the view that was taken nearest to it has moved: the last one of several."""
        away_m = np.linalg.norm(self.before_m - pose.t_m, axis=1)[::-1]
        return (self.by[len(away_m) - 1 - int(np.argmin(away_m))] @ pose).exact()
