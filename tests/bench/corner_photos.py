"""How long photographs of 12 megapixels take until their boards are found, and those without a board, for bench_corners: through files, as `calibrate` reads them."""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from phone_host.calibration.target.board_views import look_for_boards
from phone_host.calibration.target.corners import Board
from phone_host.model import Image
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import Renderer
from phone_host.stereo.view_files import pair_files
from tests.bench.drift_films import furnished_room, play_rig

_SIZE_PX: Final = (4000, 3000)
_NOISE: Final = 3.0
_QUALITY: Final = 92


@dataclass(frozen=True, slots=True)
class Photos:
    """What some photographs took.

    Attributes:
        images: how many.
        found: images whose pair has a board.
        seconds: an image, by the clock, on all cores.
        cpu_seconds: an image, all threads together.
    """

    images: int
    found: int
    seconds: float
    cpu_seconds: float


def photos(boards: list[Image], board: Board, pairs: int = 4) -> Photos:
    """Write photographs of a room and search them.

    Args:
        boards: pictures of a board, one of which is pasted into each photograph; empty: no board is in them.
        board: what to look for.
        pairs: how many.
    """
    with tempfile.TemporaryDirectory(prefix="photos") as folder:
        for index in range(2 * pairs):
            pasted = boards[index % len(boards)] if boards else None
            cv2.imwrite(
                f"{folder}/{'lr'[index % 2]}{index // 2}.jpg",
                _photo(index, pasted),
                [cv2.IMWRITE_JPEG_QUALITY, _QUALITY],
            )
        files = pair_files(str(Path(folder) / "l*"), str(Path(folder) / "r*"))
        began_s, cpu_s = time.perf_counter(), time.process_time()
        views = look_for_boards(files, board, lambda: None)
        seconds, cpu_seconds = time.perf_counter() - began_s, time.process_time() - cpu_s
    return Photos(2 * pairs, 2 * len(views.pairs), seconds / pairs / 2, cpu_seconds / pairs / 2)


def _photo(seed: int, pasted: Image | None) -> Image:
    """Paint a furnished room at 12 megapixels, with the noise of a phone's sensor and perhaps a board in it."""
    rig, random = play_rig(), np.random.default_rng(seed)
    room = cv2.cvtColor(
        Renderer(furnished_room(80 + seed // 2), rig.left, rig_poses(rig)[0]).frame(), cv2.COLOR_BGR2GRAY
    )
    photo = np.asarray(cv2.resize(room, _SIZE_PX, interpolation=cv2.INTER_CUBIC), np.float32)
    if pasted is not None:
        height, width = pasted.shape
        y, x = random.integers(0, _SIZE_PX[1] - height), random.integers(0, _SIZE_PX[0] - width)
        photo[y : y + height, x : x + width] = pasted
    return np.clip(photo + random.normal(0, _NOISE, photo.shape), 0, 255).astype(np.uint8)
