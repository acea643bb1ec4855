"""Views of a room with eight papered walls by a camera that goes round in its middle, with exact depth."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.view import View
from tests.support.plane_films import Plane, nearest_view, plane_at, plane_view

Paper = NDArray[np.uint8]

WALLS = 8
_AWAY_M = 1.5
_FLOOR_M = 0.6
_DOWN = 0.2
_ASIDE_M = 0.15


def walls() -> list[Plane]:
    """The walls, 1.5 m from the middle, and the floor last."""
    turns = [2 * np.pi * at / WALLS for at in range(WALLS)]
    stand = [plane_at([_AWAY_M * np.sin(turn), 0.0, _AWAY_M * np.cos(turn)], [0.0, turn, 0.0]) for turn in turns]
    return [*stand, plane_at([0.0, _FLOOR_M, 0.0], [-np.pi / 2, 0.0, 0.0])]


def station(turn: float) -> SE3:
    """Where the camera is when it has gone round by so much, rad: looking outwards and down, a little beside the middle."""
    outward = SE3.of(np.array([0.0, turn, 0.0, 0.0, 0.0, 0.0]))
    return outward @ SE3.of(np.array([0.0, 0.0, 0.0, 0.0, 0.0, _ASIDE_M])) @ SE3.of(np.array([-_DOWN, 0, 0, 0, 0, 0]))


def room_view(world_camera: SE3, papers: Sequence[Paper], focal_share: float = 1.0) -> View:
    """What the camera sees.

    Args:
        world_camera: where it is.
        papers: of the walls and of the floor.
        focal_share: of the true focal length that its calibration says.
    """
    views = [
        plane_view(world_camera, paper, (plane,))
        for plane, paper in zip(walls(), papers, strict=True)
        if plane.axes[0] @ world_camera.R[:, 2] < 0.2
    ]
    view = nearest_view(views)
    return replace(view, geometry=replace(view.geometry, focal_px=focal_share * view.geometry.focal_px))
