"""The time offset of two cameras, from a screen and a scene with known truth; and what is reported if nothing can be measured."""

import math
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from common.errors import DataError
from common.frame import PixelFormat
from phone_host.calibration.time_offset.misfit_plot import misfit_svg
from phone_host.calibration.time_offset.screen import (
    COUNT,
    HEIGHT,
    WIDTH,
    PatternReader,
    Reading,
    counted,
    draw,
    measure_screen,
)
from phone_host.calibration.time_offset.shared_motion import measure_shared_motion
from phone_host.calibration.time_offset.shots import Measured, Method, Shot, Times
from phone_host.model import Image, Side
from phone_host.scene.scene import PHONE_LOOK, WEBCAM_LOOK, demo_scene
from phone_host.scene.scene_model import Path, Scene, rig_poses
from phone_host.scene.scene_render import Renderer
from phone_host.stereo.raw_images import EncodedImage
from phone_host.stereo.rectifier import Rectifier
from tests.support.rigs import small_rig

REFRESH_S = 1 / 59.94
START_S = 12.3

UNIT_PX = 12
"""Size in the displayed pattern; it is filmed at half that, so that its markers are about as small as they may be."""


def stamps(seconds: float, fps: float, phase_s: float) -> Times:
    """Times at which a camera exposes."""
    return np.arange(0.0, seconds, 1 / fps) + phase_s


def offset_ms(measured: Measured) -> tuple[float, float]:
    """Offset and uncertainty, ms."""
    return measured.offset.offset_ns / 1e6, measured.offset.uncertainty_ns / 1e6


# A screen.


@cache
def shown(number: int) -> Image:
    """The pattern on a screen, drawn once."""
    return draw(number % COUNT, UNIT_PX)


def filmed(moment_s: float, exposure_s: float, *, host: bool) -> Image:
    """A screen in a room as a camera sees it: slanted, blurred, darker, and mixed if a refresh falls into the exposure."""
    corners = np.array([[0, 0], [WIDTH, 0], [WIDTH, HEIGHT], [0, HEIGHT]], dtype=np.float32) * UNIT_PX
    seen = [[66, 41], [199, 53], [197, 162], [72, 155]] if host else [[53, 57], [228, 48], [221, 160], [57, 162]]
    turn = cv2.getPerspectiveTransform(corners, np.array(seen, dtype=np.float32))
    first, last = (math.floor((moment_s + way * exposure_s / 2) / REFRESH_S) for way in (-1, 1))
    light = np.full((210, 280), 25, dtype=np.float32)
    for number in range(first, last + 1):
        begin_s = max(moment_s - exposure_s / 2, number * REFRESH_S)
        end_s = min(moment_s + exposure_s / 2, (number + 1) * REFRESH_S)
        picture = cv2.warpPerspective(shown(number), turn, (280, 210), flags=cv2.INTER_AREA, borderValue=(70,))
        light += picture * np.float32(0.6 * (end_s - begin_s) / exposure_s)
    noise = NOISE[round(moment_s * 1e6) % len(NOISE)]
    return np.asarray(np.clip(cv2.GaussianBlur(light, (0, 0), 0.8) + noise, 0, 255), dtype=np.uint8)


NOISE = np.random.default_rng(6).normal(0, 3, (13, 210, 280)).astype(np.float32)


@cache
def side_of_film(fps: float, phase_s: float, *, host: bool) -> tuple[Times, list[Reading | None]]:
    """Five seconds of the counting screen as one camera sees it: times from its start, and the numbers read; filmed once."""
    reader = PatternReader()
    moments = stamps(5.0, fps, phase_s) + START_S
    return moments - START_S, [reader.read(filmed(float(t), 0.008, host=host)) for t in moments]


def film_screen(offset_s: float, board_fps: float, host_fps: float) -> Measured:
    """Film the counting screen with both cameras; the host's stamps are late by `offset_s`."""
    board_s, seen = side_of_film(board_fps, 0.004, host=False)
    host_s, own = side_of_film(host_fps, 0.017, host=True)
    return measure_screen(counted(board_s, seen), counted(host_s + offset_s, own))


def test_every_number_is_read() -> None:
    """Numbers over the whole range are read from a slanted, noisy image of a still screen, and their row is near the middle."""
    reader = PatternReader()
    for number in (0, 1, 2, 3, 511, 2048, 3000, COUNT - 1):
        reading = reader.read(filmed((number + 0.5) * REFRESH_S, 0.001, host=True))
        assert reading is not None
        assert reading.number == number
        assert 0.4 < reading.row < 0.6


@pytest.mark.parametrize(
    ("offset", "board_fps", "host_fps", "most_ms"),
    [(0.0, 29.6, 29.75, 2), (0.021, 29.6, 30.2, 2), (-0.0605, 29.6, 24.1, 2), (0.02, 30.0, 30.0, 18)],
)
def test_a_screen_gives_the_offset(offset: float, board_fps: float, host_fps: float, most_ms: float) -> None:
    """The known delay of late stamps is measured, with an uncertainty that is small if every part of a refresh was seen in 5 s."""
    measured = film_screen(offset, board_fps, host_fps)
    found, doubt = offset_ms(measured)
    assert measured.method is Method.SCREEN
    assert abs(found - offset * 1e3) <= doubt < most_ms
    best = measured.offsets_s[int(measured.misfits.argmin())]
    assert abs(best - offset) < REFRESH_S


def test_a_camera_in_step_with_the_screen_is_doubted() -> None:
    """If a camera always sees each refresh at the same phase, half a refresh remains uncertain, and the result says so."""
    numbers = np.arange(240) * 2
    times = numbers / 60.0
    locked = counted(times + 0.003, [read_as(int(n)) for n in numbers])
    sweeping = counted(np.arange(240) / 29.7, [read_as(int(t * 60)) for t in np.arange(240) / 29.7])
    found, doubt = offset_ms(measure_screen(sweeping, locked))
    assert doubt >= 1000 / 60 / 2 * 0.9
    assert abs(found) <= doubt


def read_as(number: int) -> Reading:
    """A reading in the middle of the image."""
    return Reading(number % COUNT, 0.5)


@pytest.mark.parametrize(
    ("count", "moves", "words"),
    [(10, True, "too short"), (60, False, "did not change"), (60, None, "saw the pattern in 0 of 60")],
)
def test_a_screen_that_cannot_serve_is_named(count: int, moves: bool | None, words: str) -> None:  # noqa: FBT001
    """Too few frames, a still pattern and no pattern are three different errors, each with its remedy."""
    times = stamps(count / 30, 30, 0)[:count]
    readings = [None if moves is None else read_as(int(t * 60) if moves else 7) for t in times]
    with pytest.raises(DataError, match=words) as caught:
        measure_screen(counted(times, readings), counted(times, readings))
    assert caught.value.remedy


# A scene.

FRAMES = 30


def moving(amplitude_m: tuple[float, float, float], spin_rad_s: float) -> Scene:
    """The demo's scene with a cube and a ball that swing and turn."""
    swing = Path(
        amplitude_m=amplitude_m,
        phase_rad=(0.5, 0.0, 0.0),
        period_s=1.6,
        spin_axis=(0.0, 1.0, 0.0),
        spin_rad_s=spin_rad_s,
    )
    base = demo_scene()
    names = {"wall", "table", "poster", "cube", "ball"}
    bodies = [replace(body, path=swing) if body.path.moves else body for body in base.bodies if body.name in names]
    return Scene(tuple(bodies), base.light)


@cache
def rendered(amplitude_m: tuple[float, float, float], spin_rad_s: float) -> dict[Side, list[tuple[float, Image]]]:
    """The scene as both cameras of the demo's rig see it, with the times; the right one exposes 9 ms after the left."""
    rig, scene = small_rig(), moving(amplitude_m, spin_rad_s)
    views = zip(Side, (rig.left, rig.right), rig_poses(rig), (WEBCAM_LOOK, PHONE_LOOK), strict=True)
    film = {}
    for side, camera, pose, look in views:
        renderer = Renderer(scene, camera, pose, look)
        moments = [k / 30 + (0.009 if side is Side.RIGHT else 0.0) for k in range(FRAMES)]
        film[side] = [(moment, renderer.frame(moment)) for moment in moments]
    return film


def film_scene(film: dict[Side, list[tuple[float, Image]]], offset_s: float, board_side: Side) -> Measured:
    """Measure the offset of two cameras; the host camera's stamps are late."""
    images: dict[str, Image] = {}
    sides: dict[Side, list[Shot]] = {Side.LEFT: [], Side.RIGHT: []}
    for side, frames in film.items():
        late_s = offset_s if side is not board_side else 0.0
        for k, (moment_s, image) in enumerate(frames):
            name = f"{side.value} {k}"
            images[name] = image
            encoded = EncodedImage(
                payload=b"",
                pixel_format=PixelFormat.MJPEG,
                width_px=image.shape[1],
                height_px=image.shape[0],
                name=name,
            )
            sides[side].append(Shot(10**14 + round((moment_s + late_s) * 1e9), encoded))
    progress: list[float] = []
    rectifier = Rectifier(replace(small_rig(), board_side=board_side))
    board, host = sides[board_side], sides[board_side.other]
    found = measure_shared_motion(board, host, rectifier, lambda shot: images[shot.image.name], progress.append)
    assert progress == sorted(progress)
    return found


@pytest.mark.parametrize(("offset", "board_side"), [(0.013, Side.LEFT), (-0.024, Side.RIGHT)])
def test_a_moving_scene_gives_the_offset(offset: float, board_side: Side) -> None:
    """From a rendered scene that moves up and down, the known offset is measured within the stated uncertainty, whichever camera is the board's."""
    measured = film_scene(rendered((0.05, 0.10, 0.0), 0.3), offset, board_side)
    found, doubt = offset_ms(measured)
    assert abs(found - offset * 1e3) <= doubt < 3
    best = measured.offsets_s[int(measured.misfits.argmin())]
    assert abs(best - offset) < 0.004
    assert np.all(np.diff(measured.offsets_s) > 0)
    assert misfit_svg(measured).startswith("<svg")


def test_motion_along_the_rows_is_not_enough() -> None:
    """A scene that only moves sideways says nothing about time: the error says so, and what to do."""
    with pytest.raises(DataError, match="motion up or down") as caught:
        film_scene(rendered((0.10, 0.0, 0.0), 0.0), 0.01, Side.LEFT)
    assert "up and down" in caught.value.remedy
