"""The parts of a rendered scene: shapes, textures, paths, light, camera poses. No images here.

Scene axes are the axes of the rig's left camera: x right, y down, z forward, metres. Bodies move; cameras stand still.

The pattern is that of `calibration.target.sheet_layout`, which the printer gets, too: what is seen is what was printed.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Any, Final, assert_never

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.sheet import Ink, Sheet
from phone_host.model import Rig, StereoGeometry

Vector = tuple[float, float, float]
Rotation = NDArray[np.float64]
"""(3, 3) float64 rotation."""

Floats = NDArray[np.floating[Any]]
"""Real numbers. The same code makes images in float32 and truth in float64."""


def rotation(axis: Vector, angle_rad: float) -> Rotation:
    """Return the rotation about an axis, by Rodrigues' formula.

    Args:
        axis: direction, of any length except zero.
        angle_rad: right-handed angle.

    Returns:
        (3, 3) float64.
    """
    x, y, z = np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Rotation = np.eye(3) + math.sin(angle_rad) * cross + (1.0 - math.cos(angle_rad)) * (cross @ cross)
    return turn


@dataclass(frozen=True, slots=True)
class Plane:
    """A flat rectangle at z = 0 of the body's axes, visible from both sides. Infinite sides are allowed."""

    width_m: float = math.inf
    height_m: float = math.inf


@dataclass(frozen=True, slots=True)
class Box:
    """A cuboid around the body's origin with its edges along the body's axes."""

    size_m: Vector


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball around the body's origin."""

    radius_m: float


@dataclass(frozen=True, slots=True)
class Frustum:
    """A capped cone, cut parallel to its base, around the body's z axis, half of its height on either side of the origin.

    Equal radii make a cylinder, a radius of zero a whole cone.
    """

    bottom_radius_m: float
    top_radius_m: float
    height_m: float


@dataclass(frozen=True, slots=True)
class Torus:
    """A ring around the body's z axis: a tube whose middle runs around the origin."""

    ring_radius_m: float
    tube_radius_m: float


Shape = Plane | Box | Sphere | Frustum | Torus


@dataclass(frozen=True, slots=True, kw_only=True)
class Texture:
    """A solid texture: band-limited noise of several octaves, a function of the point in the body's axes.

    Attributes:
        seed: chooses the pattern.
        light_bgr: reflectance (0..1, linear) where the coarse noise is high.
        dark_bgr: reflectance where it is low.
        contrast: how strongly the octaves modulate the brightness, 0..1.
        shortest_m: wavelength of the finest octave.
        longest_m: wavelengths double from `shortest_m` up to this.
        stretch: at least 1 per axis of the body; 6 along an axis gives a grain along it.
        gloss: brightness of the lamp's reflection, as a share of the lamp; 0 is matt.
        sharpness: how narrow that reflection is, the exponent of Blinn and Phong.
    """

    seed: int = 0
    light_bgr: Vector = (0.75, 0.75, 0.75)
    dark_bgr: Vector = (0.25, 0.25, 0.25)
    contrast: float = 0.6
    shortest_m: float = 0.004
    longest_m: float = 0.26
    stretch: Vector = (1.0, 1.0, 1.0)
    gloss: float = 0.0
    sharpness: float = 60.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Print:
    """Black ink on white paper, on a plane: x to the right, y up, z towards who reads it; its middle is the origin.

    Attributes:
        ink: (H + 1, W + 1) float64; how many texels of ink lie above and to the left of each texel corner.
        texels_per_m: how fine it is.
        paper_bgr: reflectance (0..1, linear) of the paper.
        ink_bgr: reflectance of the ink.
    """

    ink: NDArray[np.float64]
    texels_per_m: float
    paper_bgr: Vector = (0.76, 0.80, 0.80)
    ink_bgr: Vector = (0.035, 0.035, 0.035)


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """A periodic motion about the body's rest pose: each coordinate swings as amplitude * sin(2 pi t / period + phase).

    Attributes:
        amplitude_m: swing along the scene's axes.
        phase_rad: phase per axis; (0, 0, pi / 2) makes a circle over x and z.
        period_s: duration of one swing.
        spin_axis: axis of the body's own rotation, in the body's axes.
        spin_rad_s: rate of that rotation.
    """

    amplitude_m: Vector = (0.0, 0.0, 0.0)
    phase_rad: Vector = (0.0, 0.0, 0.0)
    period_s: float = 4.0
    spin_axis: Vector = (0.0, 1.0, 0.0)
    spin_rad_s: float = 0.0

    @property
    def moves(self) -> bool:
        """Return whether anything changes with time."""
        return any(self.amplitude_m) or self.spin_rad_s != 0.0

    def shift_m(self, t_s: float) -> NDArray[np.float64]:
        """Return the displacement from the rest position at time `t_s`, (3,) m in the scene's axes."""
        angle = 2.0 * math.pi * t_s / self.period_s + np.asarray(self.phase_rad)
        return np.asarray(self.amplitude_m) * np.sin(angle)


STILL = Path()


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A textured shape at a position.

    Attributes:
        name: for reports and tests.
        shape: its shape.
        position_m: its origin in the scene's axes.
        R_scene_body: (3, 3) float64, takes body coordinates to the scene's axes.
        texture: its surface; only a plane can be printed on.
        path: how it moves.
    """

    name: str
    shape: Shape
    position_m: Vector
    texture: Texture | Print = field(default_factory=Texture)
    R_scene_body: Rotation = field(default_factory=lambda: np.eye(3))
    path: Path = STILL

    @property
    def bounding_radius_m(self) -> float:
        """Radius of a ball around the origin that contains the shape; infinite for an infinite plane."""
        match self.shape:
            case Plane(width_m, height_m):
                return math.hypot(width_m, height_m) / 2.0
            case Box(size_m):
                return math.hypot(*size_m) / 2.0
            case Sphere(radius_m):
                return radius_m
            case Frustum(bottom_radius_m, top_radius_m, height_m):
                return math.hypot(max(bottom_radius_m, top_radius_m), height_m / 2.0)
            case Torus(ring_radius_m, tube_radius_m):
                return ring_radius_m + tube_radius_m
            case _:
                assert_never(self.shape)

    def at(self, t_s: float) -> "Body":
        """Return the same body standing still where its path has taken it at time `t_s`."""
        if not self.path.moves:
            return self
        x, y, z = (np.asarray(self.position_m) + self.path.shift_m(t_s)).tolist()
        turn = rotation(self.path.spin_axis, self.path.spin_rad_s * t_s)
        return replace(self, position_m=(x, y, z), R_scene_body=self.R_scene_body @ turn, path=STILL)


@dataclass(frozen=True, slots=True)
class Light:
    """One far lamp and a sky.

    Attributes:
        towards: direction from the scene to the lamp, of any length (y is down, so a lamp above has a negative y).
        lamp_bgr: the lamp's strength per channel on a surface that faces it.
        sky_bgr: strength of the light from all directions.
    """

    towards: Vector = (-0.45, -1.0, -0.65)
    lamp_bgr: Vector = (0.62, 0.68, 0.74)
    sky_bgr: Vector = (0.36, 0.33, 0.30)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Bodies under a light.

    Attributes:
        bodies: in any order; the nearest surface wins.
        light: the lamp and the sky.
        void_bgr: brightness (0..1, linear) where a ray hits nothing.
    """

    bodies: tuple[Body, ...]
    light: Light = field(default_factory=Light)
    void_bgr: Vector = (0.02, 0.02, 0.02)

    def at(self, t_s: float) -> "Scene":
        """Return the scene frozen at time `t_s` (seconds)."""
        return replace(self, bodies=tuple(body.at(t_s) for body in self.bodies))


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Position and orientation of a camera.

    Attributes:
        R_camera_scene: (3, 3) float64, takes the scene's axes to the camera's.
        centre_m: (3,) float64, the camera's centre in the scene's axes.
    """

    R_camera_scene: Rotation = field(default_factory=lambda: np.eye(3))
    centre_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))


def rig_poses(rig: Rig) -> tuple[Pose, Pose]:
    """Return the poses of a rig's left camera (the scene's origin) and of its right one."""
    return Pose(), Pose(rig.R_right_left, -rig.R_right_left.T @ rig.t_right_left_m)


@dataclass(frozen=True, slots=True)
class Look:
    """How a sensor turns light into grey levels: 255 * gain * (light * vignette) ** (1 / gamma) + offset + noise.

    Attributes:
        gain_bgr: gain per channel (exposure and white balance).
        offset: black level, grey levels.
        gamma: exponent of the transfer curve.
        vignetting: fraction of the light lost in the corners, 0..1.
        blur_px: standard deviation of the lens's blur, px.
        noise_sigma: standard deviation of the sensor's noise, grey levels.
        seed: selects that noise.
    """

    gain_bgr: Vector = (1.0, 1.0, 1.0)
    offset: float = 0.0
    gamma: float = 2.0
    vignetting: float = 0.0
    blur_px: float = 0.0
    noise_sigma: float = 0.0
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class RectifiedView:
    """The rectified left camera for which truth is computed: an ideal pinhole at the left camera's centre.

    Attributes:
        geometry: focal length, baseline, principal point, doffs.
        width_px: image width.
        height_px: image height.
        R_rectified_left: (3, 3) float64, takes the left camera's axes to the rectified ones (OpenCV's R1).
    """

    geometry: StereoGeometry
    width_px: int
    height_px: int
    R_rectified_left: Rotation = field(default_factory=lambda: np.eye(3))


_TEXELS_PER_MM: Final = 7
"""With four strokes a texel, all edges of the usual mat (squares of 25 mm, cells of 18/7 mm) lie between two strokes."""

_STROKES: Final = 4
_M: Final = 1000.0


def printed_sheet(sheet: Sheet) -> Print:
    """Print the rectangles of a sheet; its words are left out.

    Args:
        sheet: what is printed. An edge that is no multiple of 1/28 mm moves to the next one.
    """
    fine = _TEXELS_PER_MM * _STROKES
    width, height = (round(side * _TEXELS_PER_MM) for side in (sheet.width_mm, sheet.height_mm))
    page = np.zeros((height * _STROKES, width * _STROKES), dtype=np.uint8)
    for each in sheet.rectangles:
        left, top = round(each.x_mm * fine), round(each.y_mm * fine)
        right, bottom = round((each.x_mm + each.width_mm) * fine), round((each.y_mm + each.height_mm) * fine)
        page[top:bottom, left:right] = 255 if each.ink is Ink.BLACK else 0
    texels = cv2.resize(page, (width, height), interpolation=cv2.INTER_AREA)
    ink = np.asarray(cv2.integral(texels, sdepth=cv2.CV_64F), dtype=np.float64) / 255.0
    return Print(ink=ink, texels_per_m=_TEXELS_PER_MM * _M)


def printed_albedo(sheet: Print, points: Floats, footprint_m: Floats) -> Floats:
    """Compute the reflectance of a printed plane: the mean over a square as large as a pixel's footprint.

    Args:
        sheet: what is printed on it.
        points: (3, N) in the body's axes, m; z is not used.
        footprint_m: (N,) side of the square.

    Returns:
        (3, N) float32 BGR, 0..1.
    """
    height, width = (side - 1 for side in sheet.ink.shape)
    u = points[0].astype(np.float64) * sheet.texels_per_m + width / 2.0
    v = height / 2.0 - points[1].astype(np.float64) * sheet.texels_per_m
    half = np.maximum(footprint_m.astype(np.float64) * sheet.texels_per_m, 1.0) / 2.0
    total = _ink_before(sheet, u + half, v + half) - _ink_before(sheet, u - half, v + half)
    total += _ink_before(sheet, u - half, v - half) - _ink_before(sheet, u + half, v - half)
    share = (total / (4.0 * half * half)).astype(np.float32)
    paper, ink = (_column(colour) for colour in (sheet.paper_bgr, sheet.ink_bgr))
    bgr: Floats = paper + (ink - paper) * np.clip(share, 0.0, 1.0)
    return bgr


def _ink_before(sheet: Print, u: Floats, v: Floats) -> Floats:
    """Return the ink above and to the left of places (N,) in texels; between texel corners it is bilinear, exactly."""
    height, width = (side - 1 for side in sheet.ink.shape)
    u, v = np.clip(u, 0.0, width), np.clip(v, 0.0, height)
    column, row = np.minimum(u.astype(np.intp), width - 1), np.minimum(v.astype(np.intp), height - 1)
    right, down = u - column, v - row
    above = sheet.ink[row, column] * (1.0 - right) + sheet.ink[row, column + 1] * right
    below = sheet.ink[row + 1, column] * (1.0 - right) + sheet.ink[row + 1, column + 1] * right
    total: Floats = above * (1.0 - down) + below * down
    return total


def _column(colour: Vector) -> Floats:
    return np.array(colour, dtype=np.float32)[:, None]
