"""Images that show their own number, so that a test can tell from the pixels alone which two frames were paired."""

from pathlib import Path

import cv2
import numpy as np

from phone_host.model import Image

BITS = 12
_CELL_PX = 12
WIDTH_PX, HEIGHT_PX = 160, 120


def draw(number: int) -> Image:
    """Grey 160x120 texture with the number as a row of 12 dark or bright cells."""
    noise = np.random.default_rng(7).integers(60, 190, (HEIGHT_PX, WIDTH_PX), dtype=np.uint8)
    image: Image = np.asarray(cv2.GaussianBlur(noise, (5, 5), 1.0), np.uint8)
    for bit in range(BITS):
        image[:_CELL_PX, bit * _CELL_PX : (bit + 1) * _CELL_PX] = 230 if number >> bit & 1 else 20
    return image


def number_of(image: Image) -> int:
    """Read the number back."""
    grey = image if image.ndim == 2 else image[..., 0]
    cells = (int(grey[_CELL_PX // 2, bit * _CELL_PX + _CELL_PX // 2] > 128) << bit for bit in range(BITS))
    return sum(cells)


def write_film(folder: Path, frames: int, spoil_every: int = 0) -> Path:
    """Write numbered JPEGs 0 .. frames-1; every `spoil_every`-th (from that one on) is cut in half."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(frames):
        done, jpeg = cv2.imencode(".jpg", draw(number), [cv2.IMWRITE_JPEG_QUALITY, 92])
        assert done
        data = jpeg.tobytes()
        spoiled = spoil_every and number % spoil_every == spoil_every - 1
        (folder / f"{number}.jpg").write_bytes(data[: len(data) // 2] if spoiled else data)
    return folder


def saved_numbers(out: Path) -> list[tuple[int, int]]:
    """Numbers shown by the left and right image of every saved pair, in order."""

    def read(path: Path) -> int:
        return number_of(np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8))

    return [(read(pair / "left.png"), read(pair / "right.png")) for pair in sorted(out.glob("pair-*[0-9]"))]
