"""A rig that turns before a real `board-agent` and `phone-host run`: how long until the run says so."""

import tempfile
import time
from pathlib import Path
from typing import Final

import cv2

from phone_host.output.rig_yaml import write_rig
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import Renderer
from phone_host.stereo.rectifier import corrected_rig
from phone_host.stereo.rectify import rectify_rig
from tests.bench.drift_films import furnished_room, play_rig, turned
from tests.support.programs import board, host

_FPS: Final = 15
_HALF: Final = 8 * _FPS
_PATIENCE_S: Final = 60.0


def write_turning_film(folder: Path) -> None:
    """Write rig.yaml and a film for a loop, in whose second half the right camera is turned by 0.3 degrees of pitch and roll.

    Args:
        folder: receives rig.yaml and the folders left and right.
    """
    rig, scene = play_rig(), furnished_room(7)
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    stands = corrected_rig(corrected_rig(rig, turned(0.0, 0, 0.3).departure), turned(0.0, 2, 0.2).departure)
    left = Renderer(scene, rig.left, rig_poses(rig)[0]).frame()
    rights = [Renderer(scene, each.right, rig_poses(each)[1]).frame() for each in (rig, stands)]
    for name in ("left", "right"):
        (folder / name).mkdir()
    for number in range(2 * _HALF):
        for name, image in (("left", left), ("right", rights[number // _HALF])):
            path, first = folder / name / f"{number:03d}.jpg", folder / name / f"{number // _HALF * _HALF:03d}.jpg"
            if path == first:
                cv2.imwrite(str(path), image, [cv2.IMWRITE_JPEG_QUALITY, 92])
            else:
                path.hardlink_to(first)


def seconds_until_told() -> float:
    """Return how long after the turn the run's log named it, s; infinity if it never did."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_turning_film(folder)
        link, film = f"ipc://{folder}/link", f"?fps={_FPS}&loop=1"
        run = ["run", "--link", link, "--camera", f"replay:{folder}/right{film}", "--calibration", f"{folder}/rig.yaml"]
        with (
            board(["run", "--camera", f"replay:{folder}/left{film}", "--link", link], folder),
            host([*run, "--out", f"{folder}/out"], folder) as running,
        ):
            return _watched(running.err, folder / "out" / "delays.jsonl")


def _watched(log: Path, lines: Path) -> float:
    """Wait for the first pairs, then until a turn, then until it is told."""
    period_s, until_s = 2 * _HALF / _FPS, time.monotonic() + _PATIENCE_S
    while time.monotonic() < until_s and not (lines.exists() and lines.stat().st_size):
        time.sleep(0.05)
    begun = time.monotonic() + 4.0  # its first estimate
    turn_s = (int(begun / period_s) + (0.5 if begun % period_s < 0.5 * period_s else 1.5)) * period_s
    told = 0
    while time.monotonic() < min(turn_s, until_s):
        told = _news(log)
        time.sleep(0.01)
    while time.monotonic() < turn_s + period_s / 2:
        if _news(log) > told:
            return time.monotonic() - turn_s
        time.sleep(0.01)
    return float("inf")


def _news(log: Path) -> int:
    text = log.read_text(errors="replace")
    return text.count("drift_corrected") + text.count("rig_knocked")
