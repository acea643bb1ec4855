"""A film whose image moves sideways at a known speed, to test the combined effect of time and motion."""

from pathlib import Path

import cv2
import numpy as np


def write_moving_film(folder: Path, frames: int, step_px: int) -> Path:
    """A texture that moves by this many pixels per image, back and forth."""
    folder.mkdir(parents=True)
    noise = np.random.default_rng(3).integers(0, 255, (240, 320 + frames * step_px), dtype=np.uint8)
    texture = np.asarray(cv2.GaussianBlur(noise, (0, 0), 2.5))
    texture = np.clip((texture.astype(float) - 127) * 5 + 127, 0, 255).astype(np.uint8)
    for number in range(frames):
        x_px = step_px * min(number, frames - number)
        done, jpeg = cv2.imencode(".jpg", texture[:, x_px : x_px + 320])
        assert done
        (folder / f"{number}.jpg").write_bytes(jpeg.tobytes())
    return folder
