"""COLMAP's text model: cameras.txt and images.txt. Pure.

cameras.txt: CAMERA_ID MODEL WIDTH HEIGHT PARAMS... images.txt: two lines for each image, IMAGE_ID QW QX QY QZ TX TY TZ
CAMERA_ID NAME, and its points, an empty line where it has none. Editors and scripts drop empty lines, so each line is told
from the other kind by what it holds: points are X Y POINT3D_ID, three numbers each. A point p of the world is R(q) p + t in the camera's axes. The centre of the first pixel is
(0.5, 0.5). A reconstruction has no unit of its own; ETH3D's are in metres.
Source: https://colmap.github.io/format.html and cameras.html.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import Lens, Rig
from phone_host.output.rig_files.stated import StatedCamera, StatedRig, stated_of
from phone_host.output.rig_files.texts import RigText, number
from phone_host.output.rig_files.tree import Node
from phone_host.output.trajectory_text import quaternion_of

CAMERAS: Final = "cameras.txt"
IMAGES: Final = "images.txt"

_CENTRE_PX: Final = 0.5
"""COLMAP's coordinate of the centre of the first pixel."""

_QUATERNION_TOLERANCE: Final = 1e-3
_POSE_WORDS: Final = 10
_CAMERA_LINE: Final = re.compile(r"\s*\d+\s+[A-Z][A-Z_]+\s+-?\d+\s+-?\d+\s+\S.*")
_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?nan|[+-]?inf", re.ASCII | re.IGNORECASE)
_IMAGE_LINE: Final = re.compile(r"\s*\d+(?:\s+[-+.\deE]+){7}\s+\d+\s+\S.*")


@dataclass(frozen=True, slots=True)
class _Model:
    """A camera model: whether fx and fy differ, which lens it is, and where its parameters stand among OpenCV's coefficients."""

    two_focals: bool
    lens: Lens
    places: tuple[int, ...] = ()
    length: int = 4


_MODELS: Final = {
    "SIMPLE_PINHOLE": _Model(two_focals=False, lens=Lens.PINHOLE),
    "PINHOLE": _Model(two_focals=True, lens=Lens.PINHOLE),
    "SIMPLE_RADIAL": _Model(two_focals=False, lens=Lens.PINHOLE, places=(0,)),
    "RADIAL": _Model(two_focals=False, lens=Lens.PINHOLE, places=(0, 1)),
    "OPENCV": _Model(two_focals=True, lens=Lens.PINHOLE, places=(0, 1, 2, 3)),
    "FULL_OPENCV": _Model(two_focals=True, lens=Lens.RATIONAL, places=tuple(range(8)), length=8),
    "OPENCV_FISHEYE": _Model(two_focals=True, lens=Lens.FISHEYE, places=(0, 1, 2, 3)),
    "SIMPLE_RADIAL_FISHEYE": _Model(two_focals=False, lens=Lens.FISHEYE, places=(0,)),
    "RADIAL_FISHEYE": _Model(two_focals=False, lens=Lens.FISHEYE, places=(0, 1)),
}


def is_cameras(text: str) -> bool:
    """Return whether a text is like a cameras.txt: its first line that is no comment has an id, a model and a size."""
    first = next(_lines(text), "")
    return _CAMERA_LINE.fullmatch(first) is not None


def is_images(text: str) -> bool:
    """Return whether a text is like an images.txt."""
    first = next(_lines(text), "")
    return _IMAGE_LINE.fullmatch(first) is not None


def _lines(text: str) -> Iterator[str]:
    return (line for line in text.removeprefix("\ufeff").splitlines() if line.strip() and not line.startswith("#"))


def read_colmap(cameras: str, cameras_file: str, images: str, images_file: str) -> StatedRig:
    """Read the cameras of two images.

    Raises:
        DataError: there are not exactly two images, or a value is not valid; names file and id.
    """
    known = _cameras(cameras, cameras_file)
    posed = _images(images, images_file)
    if len(posed) != 2:
        raise DataError(
            f"{images_file} has {len(posed)} image{'' if len(posed) == 1 else 's'}",
            "leave the two of one pair in it, those of both cameras",
        )
    for each in posed:
        if each.camera not in known:
            raise DataError(f"{images_file}: image {each.id} is of camera {each.camera}", f"add it to {cameras_file}")
    left, right = posed
    rotation = right.rotation @ left.rotation.T
    return StatedRig(
        left=known[left.camera],
        right=known[right.camera],
        R_right_left=rotation,
        t_right_left=right.translation - rotation @ left.translation,
        name=f"{images_file}: images {left.id} and {right.id}",
    )


def _cameras(text: str, file: str) -> dict[str, StatedCamera]:
    found: dict[str, StatedCamera] = {}
    for line in _lines(text):
        words = line.split()
        node = Node(file, f"camera {words[0]}", list(words))
        if len(words) < 5:
            raise node.problem("is no camera", "write CAMERA_ID MODEL WIDTH HEIGHT PARAMS")
        if words[0] in found:
            raise node.problem("is there twice", "give each camera an id of its own")
        model = _MODELS.get(words[1])
        if model is None:
            raise node.problem(f"is a {words[1]}", f"read are {', '.join(_MODELS)}")
        width_px, height_px = Node(file, node.key, list(words[2:4])).size_px()
        focals = 2 if model.two_focals else 1
        values = Node(file, node.key, list(words[4:])).numbers(focals + 2 + len(model.places))
        coefficients = np.zeros(model.length)
        coefficients[list(model.places)] = values[focals + 2 :]
        cx, cy = (value - _CENTRE_PX for value in values[focals : focals + 2])
        found[words[0]] = StatedCamera(
            name=f"{file}: {node.key}",
            width_px=width_px,
            height_px=height_px,
            focal_px=(values[0], values[focals - 1]),
            centre_px=(cx, cy),
            lens=model.lens,
            coefficients=tuple(float(value) for value in coefficients),
        )
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _Posed:
    id: str
    camera: str
    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]


def _images(text: str, file: str) -> list[_Posed]:
    """Return the images in the order of their ids."""
    found: list[_Posed] = []
    is_owner_known = False  # of points that may follow
    for line in _lines(text):
        if _is_points(line):
            if not is_owner_known:
                raise DataError(f"{file} has points that belong to no image", "write an image's line before its points")
            is_owner_known = False
            continue
        words = line.split(maxsplit=_POSE_WORDS - 1)
        node = Node(file, f"image {words[0]}", list(words[1:8]))
        if len(words) < _POSE_WORDS or not (words[0].isdecimal() and words[8].isdecimal()):
            raise node.problem("is no image", "write IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME")
        values = node.numbers(7)
        found.append(_Posed(words[0], words[8], _rotation(node, values[:4]), np.array(values[4:], np.float64)))
        is_owner_known = True
    return sorted(found, key=lambda each: int(each.id))


def _is_points(line: str) -> bool:
    """Return whether a line holds points of an image: nothing but numbers, three for each."""
    words = line.split()
    return len(words) % 3 == 0 and all(_NUMBER.fullmatch(word) for word in words)


def _rotation(node: Node, quaternion: tuple[float, ...]) -> NDArray[np.float64]:
    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1) <= _QUATERNION_TOLERANCE:
        raise node.problem(f"has a quaternion of length {length:g}", "it must be 1")
    w, x, y, z = (value / length for value in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def colmap_texts(rig: Rig) -> tuple[RigText, ...]:
    """Write cameras.txt, images.txt and an empty points3D.txt; the world's axes are the left camera's, its unit metres.

    Raises:
        DataError: COLMAP has no model for a lens.
    """
    stated = stated_of(rig, "the rig")
    cameras, images = ["# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]"], ["# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"]
    poses = ((np.eye(3), np.zeros(3)), (stated.R_right_left, stated.t_right_left))
    for id_, (camera, (rotation, translation)) in enumerate(
        zip((stated.left, stated.right), poses, strict=True), start=1
    ):
        if len(camera.coefficients) > 8:
            raise DataError(
                f"colmap cannot hold {camera.name}: a rational lens of {len(camera.coefficients)} coefficients",
                "export it as opencv or ros",
            )
        name, count = ("OPENCV", 4) if len(camera.coefficients) <= 4 else ("FULL_OPENCV", 8)
        name = "OPENCV_FISHEYE" if camera.lens is Lens.FISHEYE else name
        coefficients = (*camera.coefficients, *(0.0,) * (count - len(camera.coefficients)))
        centre = (value + _CENTRE_PX for value in camera.centre_px)
        values = " ".join(number(value) for value in (*camera.focal_px, *centre, *coefficients))
        cameras.append(f"{id_} {name} {camera.width_px} {camera.height_px} {values}")
        pose = " ".join(number(value) for value in (*quaternion_of(rotation), *translation))
        images += [f"{id_} {pose} {id_} {('left', 'right')[id_ - 1]}.png", ""]
    return (
        RigText(CAMERAS, "\n".join(cameras) + "\n"),
        RigText(IMAGES, "\n".join(images) + "\n"),
        RigText("points3D.txt", "# POINT3D_ID X Y Z R G B ERROR TRACK[]\n"),
    )
