"""A thing on a printed mat on a table, seen all around by two unlike cameras, with exact truth. Pure.

Axes of the mat: the origin is the sheet's middle, x to the right as one reads it (along the marks' rows), y towards its upper
edge, z up, metres. Poses, surface and volume are in these axes.

The rig goes around the mat, or the mat turns with what stands on it and the rest stands still. Both give the same poses in the
mat's axes; the light and the background tell them apart.
"""

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.marked import MarkFamily
from phone_host.calibration.target.sheet import Paper
from phone_host.calibration.target.sheet_layout import Chessboard, MarkedBoard, marked_sheet
from phone_host.model import CameraModel, Image, Rig, Side
from phone_host.scene.scene_model import (
    Body,
    Box,
    Light,
    Look,
    Plane,
    Pose,
    Rotation,
    Scene,
    Texture,
    Vector,
    printed_sheet,
    rotation,
)
from phone_host.scene.scene_render import render
from phone_host.scene.solid import OBJECTS, Solid

MAT: Final = MarkedBoard(Chessboard(10, 8, 25.0), 18.0, MarkFamily.ARUCO_5X5)
"""The mat that `target mat` prints."""

BASELINE_M: Final = 0.060
RING_M: Final = 0.42
ELEVATION_DEG: Final = 35.0

JPEG_QUALITY: Final = 85
"""What webcams and phones use for a film."""

LOOKS: Final = (
    Look(gain_bgr=(0.95, 0.97, 1.02), offset=4.0, gamma=2.0, vignetting=0.2, blur_px=0.6, noise_sigma=2.5, seed=1),
    Look(gain_bgr=(1.06, 1.04, 1.0), gamma=2.0, vignetting=0.1, blur_px=0.6, noise_sigma=2.0, seed=2),
)
"""The left and the right sensor: of unlike brightness, white balance and noise."""

_AIM_M: Final = (0.0, 0.0, 0.035)
_UP: Final = (0.0, 0.0, 1.0)
_PAPER_M: Final = 0.0002

# Scenes have y down and z forward.
_R_SCENE_MAT: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


class Size(Enum):
    """Of the images: its value is the left camera's focal length, px."""

    VGA = 600.0
    HD = 1100.0


class Motion(Enum):
    """What moves from view to view."""

    RIG = "rig"
    MAT = "mat"


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """How a thing is seen.

    Attributes:
        size: of the images; HD is 1280x720.
        motion: what moves.
        views: all around.
        seed: of the hand that carries the rig, and of the sensors' noise.
        has_mat: whether there is a mat under the thing; without one it stands on the bare table.
        jpeg_quality: 1 to 100; None: the images are not compressed.
        looks: the sensors.
        shake_m: how far the rig is from the ring, at random, standard deviation; only when the rig moves.
        turn_rad: turned by so much before the first view.
    """

    size: Size = Size.VGA
    motion: Motion = Motion.RIG
    views: int = 36
    seed: int = 0
    has_mat: bool = True
    jpeg_quality: int | None = JPEG_QUALITY
    looks: tuple[Look, Look] = LOOKS
    shake_m: float = 0.004
    turn_rad: float = 0.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ObjectView:
    """What both cameras see at one moment, and from where.

    Attributes:
        left: raw image of the left camera, (H, W, 3) uint8 BGR.
        right: raw image of the right camera.
        T_mat_left: (4, 4) float64, exact; takes the left camera's axes to the mat's, m.
    """

    left: Image
    right: Image
    T_mat_left: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ObjectScene:
    """A thing to scan, and all views of it.

    Attributes:
        solid: the thing in the mat's axes; its distances, surface and volume are the truth.
        rig: the cameras.
        setting: how it is seen.
    """

    solid: Solid
    rig: Rig
    setting: Setting
    _sheet: Body | None = field(repr=False)

    def pose(self, number: int) -> NDArray[np.float64]:
        """Return where the left camera is at a view: (4, 4) float64, takes its axes to the mat's."""
        setting = self.setting
        angle = setting.turn_rad + 2.0 * math.pi * number / setting.views
        if setting.motion is Motion.MAT:
            turned = np.eye(4)
            turned[:3, :3] = rotation(_UP, angle)
            return np.linalg.inv(turned) @ _looking(self.rig, 0.0, np.zeros(3), 0.0)
        rng = np.random.default_rng([setting.seed, 5, number])
        shake = rng.standard_normal(3) * setting.shake_m
        # As the mat turns one way, a rig would go around it the other way.
        return _looking(self.rig, -angle, shake, float(rng.standard_normal()) * setting.shake_m * 5.0)

    def scene(self, number: int) -> tuple[Scene, Pose, Pose]:
        """Return the bodies at a view, and where both cameras stand."""
        if self.setting.motion is Motion.RIG:
            carried, camera = np.eye(3), self.pose(number)
        else:
            carried = rotation(_UP, self.setting.turn_rad + 2.0 * math.pi * number / self.setting.views)
            camera = _looking(self.rig, 0.0, np.zeros(3), 0.0)
        on_mat = (*self.solid.parts, *(() if self._sheet is None else (self._sheet,)))
        bodies = tuple(_placed(body, _R_SCENE_MAT @ carried) for body in on_mat)
        left = Pose(camera[:3, :3].T @ _R_SCENE_MAT.T, _R_SCENE_MAT @ camera[:3, 3])
        rig = self.rig
        beside = -rig.R_right_left.T @ rig.t_right_left_m
        right = Pose(rig.R_right_left @ left.R_camera_scene, left.centre_m + left.R_camera_scene.T @ beside)
        return Scene((*_SURROUNDINGS, *bodies), _LIGHT), left, right

    def image(self, number: int, side: Side) -> Image:
        """Render what a camera sees, before it is compressed.

        Returns:
            (H, W, 3) uint8 BGR.
        """
        scene, *poses = self.scene(number)
        model, pose, look = (
            (self.rig.left, poses[0], self.setting.looks[0])
            if side is Side.LEFT
            else (self.rig.right, poses[1], self.setting.looks[1])
        )
        # The time chooses the noise of the frame.
        return render(scene, model, pose, look, t_s=float(number + 1000 * self.setting.seed))

    def view(self, number: int) -> ObjectView:
        """Render a view.

        Args:
            number: 0 to `setting.views` - 1; more go on around. Equal numbers give equal bytes.
        """
        left, right = (_compressed(self.image(number, side), self.setting.jpeg_quality) for side in Side)
        return ObjectView(left=left, right=right, T_mat_left=self.pose(number))


def object_scene(name: str, setting: Setting | None = None) -> ObjectScene:
    """Return a thing on the mat."""
    wanted = Setting() if setting is None else setting
    return ObjectScene(OBJECTS[name](), object_rig(wanted.size), wanted, mat_body() if wanted.has_mat else None)


def mat_body(board: MarkedBoard = MAT, paper: Paper = Paper.A4) -> Body:
    """Return a printed mat as a body in the mat's axes."""
    sheet = marked_sheet(board, paper, "mat", "")
    width, height = sheet.width_mm / 1000.0, sheet.height_mm / 1000.0
    return Body("mat", Plane(width, height), (0.0, 0.0, 0.0), printed_sheet(sheet))


def object_rig(size: Size) -> Rig:
    """Return two unlike cameras 60 mm apart: other lenses, another focal length, 1.5 degrees turned, a little higher and behind.

    Args:
        size: VGA: 640x480 on the left and 800x600 on the right; HD: 1280x720 both.
    """
    focal = size.value
    left_size, right_size, zoom = (
        ((640, 480), (800, 600), 1.3) if size is Size.VGA else ((1280, 720), (1280, 720), 1.06)
    )
    left = _camera(left_size, focal, (-3.2, 2.1), (-0.22, 0.07, 0.0006, -0.0004, -0.01))
    right = _camera(right_size, focal * zoom, (4.6, -3.3), (0.065, -0.14, -0.0005, 0.0007, 0.05))
    turn = rotation((0.3, 1.0, 0.45), math.radians(-1.5))
    centre = np.array([0.0599, -0.0026, -0.0022])
    centre *= BASELINE_M / np.linalg.norm(centre)
    return Rig(left=left, right=right, R_right_left=turn, t_right_left_m=-turn @ centre)


def _camera(size: tuple[int, int], focal: float, off: tuple[float, float], bend: tuple[float, ...]) -> CameraModel:
    """Return a camera whose axis meets the image `off` px beside its middle."""
    width, height = size
    middle_x, middle_y = (width - 1) / 2.0 + off[0], (height - 1) / 2.0 + off[1]
    matrix = np.array([[focal, 0.0, middle_x], [0.0, focal * 1.002, middle_y], [0.0, 0.0, 1.0]])
    return CameraModel(width_px=width, height_px=height, matrix=matrix, distortion=np.array(bend))


def _looking(rig: Rig, around_rad: float, shake_m: NDArray[np.float64], roll_rad: float) -> NDArray[np.float64]:
    """Return the pose of the left camera, (4, 4), when the rig's middle is on the ring and looks at the thing."""
    elevation = math.radians(ELEVATION_DEG)
    # At angle 0 one reads the sheet: the camera is on the side of its lower edge.
    around = around_rad - math.pi / 2.0
    away = np.array(
        [math.cos(elevation) * math.cos(around), math.cos(elevation) * math.sin(around), math.sin(elevation)]
    )
    aim = np.array(_AIM_M)
    middle = aim + RING_M * away + shake_m
    ahead = (aim - middle) / np.linalg.norm(aim - middle)
    across = np.cross(ahead, _UP)
    across /= np.linalg.norm(across)
    turn: Rotation = np.column_stack([across, np.cross(ahead, across), ahead]) @ rotation((0.0, 0.0, 1.0), roll_rad)
    half = -rig.R_right_left.T @ rig.t_right_left_m / 2.0
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, middle - turn @ half
    return pose


def _placed(body: Body, turn: Rotation) -> Body:
    """Return a body of the mat's axes in the scene's."""
    x, y, z = (turn @ np.asarray(body.position_m)).tolist()
    return Body(body.name, body.shape, (x, y, z), body.texture, turn @ body.R_scene_body)


def _compressed(image: Image, quality: int | None) -> Image:
    if quality is None:
        return image
    done, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    return np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), dtype=np.uint8)


def _block(name: str, size_m: Vector, place_m: tuple[float, float], texture: Texture, turn_rad: float) -> Body:
    """Return a block that lies on the table beside the mat, farther away than the sheet's corners reach; x and z tell where."""
    x, z = place_m
    return Body(name, Box(size_m), (x, _PAPER_M - size_m[1] / 2.0, z), texture, rotation((0.0, 1.0, 0.0), turn_rad))


_FLAT: Final = rotation((1.0, 0.0, 0.0), math.radians(-90.0))
_WOOD: Final = Texture(
    seed=12,
    light_bgr=(0.24, 0.42, 0.64),
    dark_bgr=(0.12, 0.24, 0.42),
    contrast=0.45,
    longest_m=0.13,
    stretch=(1.0, 2.5, 1.0),
)
_CARPET: Final = Texture(seed=61, light_bgr=(0.40, 0.34, 0.30), dark_bgr=(0.20, 0.17, 0.15), shortest_m=0.008)
_GREEN: Final = Texture(seed=16, light_bgr=(0.28, 0.60, 0.30), dark_bgr=(0.12, 0.36, 0.12), longest_m=0.06)
_RED: Final = Texture(seed=13, light_bgr=(0.16, 0.22, 0.80), dark_bgr=(0.06, 0.08, 0.45), longest_m=0.06)

_SURROUNDINGS: Final = (
    Body("floor", Plane(), (0.0, 0.75, 0.0), _CARPET, _FLAT),
    Body("table", Plane(1.5, 1.1), (0.0, _PAPER_M, 0.0), _WOOD, _FLAT),
    _block("book", (0.16, 0.022, 0.11), (-0.27, 0.16), _GREEN, 0.4),
    _block("box", (0.07, 0.035, 0.05), (0.25, 0.20), _RED, -0.5),
    _block("lid", (0.08, 0.018, 0.08), (0.20, -0.22), _GREEN, 0.2),
)
"""A table in a room with some low things on it. They stand still."""

_LIGHT: Final = Light(towards=(-0.5, -1.0, -0.45))
