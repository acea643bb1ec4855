"""What a seed stands for: two unlike cameras on a bar, a print, and the person who holds it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.board_names import named_board
from phone_host.calibration.target.corners import Board
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel, Lens, Rig, Side
from tests.bench.calibration_rendered import random_camera
from tests.support.novice.hands import Unrest

BOARD: Final = Board(9, 6, 0.025)
"""What `phone-host target chessboard` prints on A4."""

BOARDS: Final = {
    "chessboard": "9x6",
    "charuco": "charuco:8x6:28mm:20mm:5x5",
    "aprilgrid": "aprilgrid:4x3:48mm:12mm",
}
"""What a person may hold, as --board names it."""


def board_of(kind: str) -> Board:
    """Return the board of a kind."""
    return named_board(BOARDS[kind], BOARD.square_m * 1e3 if kind == "chessboard" else None)


SIZES: Final = ((640, 480), (800, 600))


@dataclass(frozen=True, slots=True, kw_only=True)
class Eye:
    """One camera.

    Attributes:
        model: its lens.
        exposure_s: how long it exposes, s.
        brightness: of white paper in full light, grey levels.
        sharp_m: distance at which it is in focus, m.
        aperture_px: sigma of the blur for each dioptre out of focus, px: a quarter of pupil (0.4 to 1.6 mm) times focal length.
        phase: when it exposes, as a share of the period.
        quality: of its JPEGs.
    """

    model: CameraModel
    exposure_s: float
    brightness: float
    sharp_m: float
    aperture_px: float
    phase: float
    quality: int


@dataclass(frozen=True, slots=True, kw_only=True)
class NoviceScene:
    """All that is drawn for one session.

    Attributes:
        seed: what it is drawn from.
        rig: the truth.
        left: the left camera.
        right: the right camera.
        unrest: of the hands.
    """

    seed: int
    rig: Rig
    left: Eye
    right: Eye
    unrest: Unrest

    def eye(self, side: Side) -> Eye:
        """Return one of the two cameras."""
        return self.left if side is Side.LEFT else self.right


def novice_scene(seed: int) -> NoviceScene:
    """Draw a session: two webcams of unlike size, lens, exposure and focus, 60 to 140 mm apart, turned by up to 3 degrees."""
    random = np.random.default_rng([15, seed])
    sizes = SIZES if random.random() < 0.5 else SIZES[::-1]
    left, right = (_eye(random, size_px) for size_px in sizes)
    rotation = rotations_of(np.radians(random.uniform(-3, 3, 3)))
    centre = np.array([random.uniform(0.06, 0.14), *random.uniform(-0.01, 0.01, 2)])
    rig = Rig(left=left.model, right=right.model, R_right_left=rotation, t_right_left_m=-rotation @ centre)
    return NoviceScene(seed=seed, rig=rig, left=left, right=right, unrest=Unrest.of(random))


def between_m(rig: Rig) -> NDArray[np.float64]:
    """Return the point between the two cameras, (3,) m, in the axes of the left one."""
    return np.asarray(-rig.R_right_left.T @ rig.t_right_left_m / 2)


def _eye(random: np.random.Generator, size_px: tuple[int, int]) -> Eye:
    return Eye(
        model=random_camera(random, size_px, Lens.PINHOLE, is_wide=False),
        exposure_s=random.uniform(0.006, 0.02),
        brightness=random.uniform(190, 245),
        sharp_m=random.uniform(0.4, 1.0),
        aperture_px=random.uniform(0.1, 0.4) * size_px[0] / 640,
        phase=random.uniform(0, 1),
        quality=int(random.integers(80, 93)),
    )
