"""A film of numbered images that a browser's fake camera reads, and when it read each."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, TextIO

import cv2
import numpy as np

from common.frame import Frame, PixelFormat
from tests.support.numbered import HEIGHT_PX, WIDTH_PX, draw, number_of

FPS: Final = 30
IMAGES: Final = 150
_READS: Final = IMAGES + 1
"""How often a film's file is read: once for its head, and once for each image."""

_SCALE: Final = 4
_ROOT: Final = Path(__file__).resolve().parents[2]


def write_numbered(path: Path) -> Path:
    """Write five seconds of numbered images, 640x480 at 30 a second, as Chromium's fake camera reads them (YUV4MPEG2); return the file."""
    width, height = WIDTH_PX * _SCALE, HEIGHT_PX * _SCALE
    with path.open("wb") as file:
        file.write(f"YUV4MPEG2 W{width} H{height} F{FPS}:1 Ip A1:1 C420jpeg\n".encode())
        for number in range(IMAGES):
            grey = cv2.resize(draw(number), (width, height), interpolation=cv2.INTER_NEAREST)
            file.write(b"FRAME\n" + grey.tobytes() + bytes([128]) * (width * height // 2))
    return path


def number_in(frame: Frame) -> int:
    """Return the number that an image shows."""
    pixels = np.frombuffer(frame.payload, np.uint8)
    if frame.pixel_format is PixelFormat.GREY:
        image = pixels.reshape(frame.height_px, frame.width_px)
    else:
        image = np.asarray(cv2.imdecode(pixels, cv2.IMREAD_GRAYSCALE), np.uint8)
    return number_of(np.ascontiguousarray(image[::_SCALE, ::_SCALE]))


Integers = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def against_reads(
    number: Integers, stamp_ns: Integers, reads_ns: Integers
) -> tuple["np.ndarray[tuple[int, ...], np.dtype[np.bool_]]", Integers]:
    """Compare stamps with readings.

    Args:
        number: what each image shows.
        stamp_ns: its stamp, CLOCK_MONOTONIC, ns.
        reads_ns: all readings of the film's file, ns.

    Returns:
        Whether each stamp is nearer to its own image's reading than to any other image's, and stamp minus nearest reading, ns.
    """
    nearest = np.abs(stamp_ns[:, None] - reads_ns).argmin(axis=1)
    first = np.bincount((nearest - number) % _READS).argmax()
    # The head is read a moment before the first image.
    nearest = np.minimum(nearest + ((nearest - first) % _READS == IMAGES), len(reads_ns) - 1)
    return (nearest - first) % _READS == number, stamp_ns - reads_ns[nearest]


@contextmanager
def reads_of(film: Path) -> Iterator[list[int]]:
    """Give the times at which other programs read a file, CLOCK_MONOTONIC, ns; the list grows while the block runs."""
    watcher = subprocess.Popen(
        [sys.executable, "-m", "tests.support.file_reads", str(film)], cwd=_ROOT, stdout=subprocess.PIPE, text=True
    )
    assert watcher.stdout is not None
    assert watcher.stdout.readline() == "ready\n"
    found: list[int] = []

    def listen(lines: TextIO) -> None:
        for line in lines:
            read_ns, count = map(int, line.split())
            found.extend([read_ns] * count)

    listener = threading.Thread(target=listen, args=(watcher.stdout,), daemon=True)
    listener.start()
    try:
        yield found
    finally:
        watcher.kill()
        watcher.wait()
        listener.join()
        watcher.stdout.close()
