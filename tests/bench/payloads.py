"""Folders of frames to send: JPEGs of about 50 KB, and raw images."""

from pathlib import Path

import cv2

from phone_host.scene.scene import WEBCAM_LOOK, demo_scene, matched_rig
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import Renderer

FRAMES = 30
_JPEG_BYTES = 50_000
_FPS = 15


def write_jpegs(folder: Path) -> int:
    """Write frames of 640x480 px at the JPEG quality that brings their mean size nearest to 50 KB.

    Args:
        folder: an empty folder.

    Returns:
        Their mean size, bytes.
    """
    images = _render()
    qualities = range(40, 96, 3)
    quality = min(qualities, key=lambda quality: abs(len(_encode(images[0], ".jpg", quality)) - _JPEG_BYTES))
    sizes = []
    for index, image in enumerate(images):
        data = _encode(image, ".jpg", quality)
        (folder / f"{index:03d}.jpg").write_bytes(data)
        sizes.append(len(data))
    return sum(sizes) // len(sizes)


def write_raw(folder: Path) -> int:
    """Write frames of 640x480x3 bytes as PNG without compression: raw bytes in a container that a replay camera accepts.

    Args:
        folder: an empty folder.

    Returns:
        Their mean size, bytes.
    """
    sizes = []
    for index, image in enumerate(_render()):
        data = _encode(image, ".png", 0)
        (folder / f"{index:03d}.png").write_bytes(data)
        sizes.append(len(data))
    return sum(sizes) // len(sizes)


def _render() -> list[cv2.typing.MatLike]:
    rig = matched_rig()
    renderer = Renderer(demo_scene(), rig.left, rig_poses(rig)[0], WEBCAM_LOOK)
    return [renderer.frame(index / _FPS) for index in range(FRAMES)]


def _encode(image: cv2.typing.MatLike, suffix: str, level: int) -> bytes:
    setting = cv2.IMWRITE_JPEG_QUALITY if suffix == ".jpg" else cv2.IMWRITE_PNG_COMPRESSION
    done, data = cv2.imencode(suffix, image, [setting, level])
    assert done
    return data.tobytes()
