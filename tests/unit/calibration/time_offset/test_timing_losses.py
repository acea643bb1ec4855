"""Measuring the time offset when something goes wrong: lost frames, misread numbers, jumping stamps, a lens covered for a moment."""

from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import DataError
from common.frame import PixelFormat
from phone_host.calibration.time_offset.screen import (
    COUNT,
    Counted,
    PatternReader,
    Reading,
    counted,
    draw,
    measure_screen,
)
from phone_host.calibration.time_offset.shared_motion import measure_shared_motion
from phone_host.calibration.time_offset.shots import Measured, Shot, Times
from phone_host.model import CameraModel, Image, Rig
from phone_host.stereo.raw_images import EncodedImage
from phone_host.stereo.rectifier import Rectifier

REFRESH_HZ = 60.0


def offset_ms(measured: Measured) -> tuple[float, float]:
    """Offset and uncertainty, ms."""
    return measured.offset.offset_ns / 1e6, measured.offset.uncertainty_ns / 1e6


# A screen.


def read_at(times_s: Times, late_s: NDArray[np.float64] | float = 0.0, *, misread: tuple[int, ...] = ()) -> Counted:
    """A camera's readings of a count that began at 0: its stamps are late, and some numbers are far off."""
    numbers = [int(t * REFRESH_HZ) + 1000 * (k in misread) for k, t in enumerate(times_s)]
    return counted(times_s + late_s, [Reading(number % COUNT, 0.5) for number in numbers])


BOARD_S, HOST_S = np.arange(240) / 29.7, np.arange(240) / 30.31 + 0.004


def test_a_number_misread_now_and_then_changes_nothing() -> None:
    """If two of 240 numbers are off by a quarter of the count, the offset stays correct, and its uncertainty small."""
    found, doubt = offset_ms(measure_screen(read_at(BOARD_S, misread=(50, 180)), read_at(HOST_S, 0.021)))
    assert abs(found - 21.0) <= doubt < 2.0


def test_stamps_that_jump_a_little_are_allowed_for() -> None:
    """With random errors of up to 1.5 ms in the stamps the offset is still found, with a larger uncertainty."""
    off_s = np.random.default_rng(1).uniform(-0.0015, 0.0015, len(HOST_S))
    sure = offset_ms(measure_screen(read_at(BOARD_S), read_at(HOST_S, 0.021)))
    found, doubt = offset_ms(measure_screen(read_at(BOARD_S), read_at(HOST_S, 0.021 + off_s)))
    assert abs(found - 21.0) <= doubt
    assert sure[1] < doubt < 8.0


def test_stamps_that_jump_by_periods_are_refused() -> None:
    """Stamps with random errors of up to 60 ms fit no steady count: the error names the other ways to measure."""
    off_s = np.random.default_rng(2).uniform(-0.06, 0.06, len(HOST_S))
    with pytest.raises(DataError, match=r"do not fit the screen's count.*--by scene"):
        measure_screen(read_at(BOARD_S), read_at(HOST_S, off_s))


def test_a_pattern_half_out_of_view_or_too_faint_is_not_read() -> None:
    """One marker alone does not show where the cells are, and grey on grey does not show which are dark: no number is better than a wrong one."""
    reader, whole = PatternReader(), cv2.copyMakeBorder(draw(1234, 12), 30, 30, 30, 30, cv2.BORDER_CONSTANT, value=255)
    reading = reader.read(np.asarray(whole, np.uint8))
    assert reading is not None
    assert reading.number == 1234
    assert reader.read(np.asarray(whole[:150, :150], np.uint8)) is None
    faint = np.asarray(120 + whole / 255.0 * 16, np.uint8)
    assert reader.read(faint) is None


# A scene.

CAMERA = CameraModel(
    width_px=160,
    height_px=120,
    matrix=np.array([[160.0, 0, 79.5], [0, 160.0, 59.5], [0, 0, 1]]),
    distortion=np.zeros(5),
)
RECTIFIER = Rectifier(Rig(left=CAMERA, right=CAMERA, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0.0, 0.0])))
FRAMES, LATE_S = 34, 0.009


@cache
def poster() -> Image:
    """A strip of texture on a grey wall, larger than these cameras see of it."""
    noise = np.random.default_rng(4).uniform(0, 255, (200, 240))
    smooth = cv2.GaussianBlur(noise, (0, 0), 4.0)
    strip = np.asarray(cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX), np.uint8)  # type: ignore[call-overload]  # None: made by the call
    strip[:, :95] = strip[:, 155:] = 128
    return strip


def seen(moment_s: float, right_px: float = 0.0, down_px: float = 0.0) -> Image:
    """A poster that swings up and down by 10 px, 1.5 times a second, as seen by a camera to one side."""
    height_px = 10.0 * np.sin(2 * np.pi * 1.5 * moment_s) + down_px
    moved = np.array([[1.0, 0.0, -40.0 - right_px], [0.0, 1.0, -40.0 + height_px]])
    return np.asarray(cv2.warpAffine(poster(), moved, (160, 120), flags=cv2.INTER_CUBIC), np.uint8)


def film(board: list[Image], host: dict[int, Image], offset_s: float) -> Measured:
    """Measure with 30 frames a second from both cameras; the host's are 9 ms behind the board's and stamped late by `offset_s`."""
    images: dict[str, Image] = {}

    def shot(name: str, moment_s: float, image: Image) -> Shot:
        images[name] = image
        return Shot(
            10**14 + round(moment_s * 1e9),
            EncodedImage(payload=b"", pixel_format=PixelFormat.GREY, width_px=160, height_px=120, name=name),
        )

    ours = [shot(f"board {k}", k / 30, image) for k, image in enumerate(board)]
    theirs = [shot(f"host {k}", k / 30 + LATE_S + offset_s, image) for k, image in host.items()]
    return measure_shared_motion(ours, theirs, RECTIFIER, lambda one: images[one.image.name], lambda _: None)


def test_lost_frames_and_a_covered_lens_cost_only_themselves() -> None:
    """Four host frames lost in a row, and two board frames with a covered lens, do not change the offset."""
    board = [seen(k / 30) if k not in {20, 21} else np.zeros((120, 160), np.uint8) for k in range(FRAMES)]
    host = {k: seen(k / 30 + LATE_S, right_px=12.0) for k in range(FRAMES) if k not in range(8, 12)}
    found, doubt = offset_ms(film(board, host, 0.013))
    assert abs(found - 13.0) <= doubt < 8.0


def test_a_rig_that_shakes_against_itself_is_no_measurement() -> None:
    """If the second camera itself nods, the rows show that more than the time: refused, with the remaining uncertainty."""
    nods_px = np.random.default_rng(3).uniform(-5, 5, FRAMES)
    board = [seen(k / 30) for k in range(FRAMES)]
    host = {k: seen(k / 30 + LATE_S, right_px=12.0, down_px=float(nods_px[k])) for k in range(FRAMES)}
    with pytest.raises(DataError, match="no better than unmeasured"):
        film(board, host, 0.013)
