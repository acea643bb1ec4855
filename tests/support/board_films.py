"""Films of a rendered board for both cameras, from which a live calibration takes five views."""

from pathlib import Path
from typing import Final

import cv2
import numpy as np

from tests.support.boards import BOARD, render_pair
from tests.support.rigs import small_rig

SECONDS: Final = 1.2
"""How long each view stands still."""

FPS: Final = 10


def board_films(folder: Path) -> None:
    """Two films of a board that is tilted four ways and comes near, each still for a while."""
    tilts = ((0.5, 0.0, 0.5), (-0.5, 0.0, 0.5), (0.0, 0.5, 0.5), (0.0, -0.5, 0.5), (0.1, 0.1, 0.35))
    middle = BOARD.points_m().mean(axis=0)
    numbers = iter(range(1000))
    for side in ("left", "right"):
        (folder / side).mkdir()
    for across, down, away_m in tilts:
        turn = np.array([-down, across, 0.0])
        pose = np.concatenate([turn, np.array([0.03, 0.0, away_m]) - cv2.Rodrigues(turn)[0] @ middle])
        pair = [cv2.imencode(".jpg", image)[1].tobytes() for image in render_pair(small_rig(), pose)]
        for _ in range(round(SECONDS * FPS)):
            number = next(numbers)
            for side, image in zip(("left", "right"), pair, strict=True):
                (folder / side / f"{number}.jpg").write_bytes(image)
