"""Paints rendered rooms as the hard cases of stereo: hardly textured walls, patterns that repeat, highlights that move with the eye.

The rays and the exact truth are those of `phone_host.scene`. The paint is not: it is stated in grey levels, because
how many of them a wall's texture spans is what decides whether a matcher can see it. A highlight depends on where the
eye is: a flat face mirrors a far lamp as if it were at infinity, with disparity 0; the truth stays that of the face.
"""

from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel
from phone_host.scene.cast import FACES, cast, pixel_rays, to_body
from phone_host.scene.round_shapes import dot
from phone_host.scene.scene_model import Body, Floats, Pose, Scene, Texture, Vector
from phone_host.scene.shade import albedo, surface_normals

SAMPLES: Final = 3
"""Samples per side of a pixel: a pole's edge gets one of four levels, and its place is right to a sixth of a pixel."""

_STRIP_ROWS: Final = 60
_PROBE: Final = Texture(light_bgr=(0.5, 0.5, 0.5), dark_bgr=(0.5, 0.5, 0.5), contrast=0.9)
"""A texture from which the bare noise, in -1..1, can be had back."""

Image = NDArray[np.uint8]


class Pattern(Enum):
    """What repeats on a surface: nothing, square tiles with joints, or upright bars."""

    NONE = "none"
    TILES = "tiles"
    BARS = "bars"


@dataclass(frozen=True, slots=True, kw_only=True)
class Paint:
    """The surface of one body.

    Attributes:
        level: grey level of the surface in full light.
        tint_bgr: factor of each channel.
        texture_levels: grey levels from the darkest to the brightest of its texture; 0: plain.
        shortest_m: wavelength of the texture's finest octave.
        plain_beyond_m: the texture ends where the body's x is beyond this.
        pattern: what repeats.
        period_m: how far apart.
        pattern_levels: how much darker joints and gaps are.
        gloss_levels: brightness of the highlight of the lamp.
        gloss_exponent: how small the highlight is (Phong's exponent): half as bright at 3.9 degrees for 300, 1.7 for 1500.
        gloss_towards: direction to the lamp or window that is mirrored; None: the scene's lamp.
        seed: of the texture.
    """

    level: float = 140.0
    tint_bgr: tuple[float, float, float] = (1.0, 1.0, 1.0)
    texture_levels: float = 4.0
    shortest_m: float = 0.006
    plain_beyond_m: float = np.inf
    pattern: Pattern = Pattern.NONE
    period_m: float = 0.1
    pattern_levels: float = 30.0
    gloss_levels: float = 0.0
    gloss_exponent: float = 40.0
    gloss_towards: Vector | None = None
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Painted:
    """A scene and the paint of each of its bodies, in their order."""

    scene: Scene
    paints: tuple[Paint, ...]


def paint_view(painted: Painted, model: CameraModel, pose: Pose) -> NDArray[np.float32]:
    """Render one view, without noise.

    Args:
        painted: the scene.
        model: intrinsics without distortion.
        pose: where the camera stands.

    Returns:
        (H, W, 3) float32 BGR, grey levels, not clipped.
    """
    image = np.empty((model.height_px, model.width_px, 3), np.float32)
    for top in range(0, model.height_px, _STRIP_ROWS):
        rows = min(_STRIP_ROWS, model.height_px - top)
        fine = _paint_samples(painted, _finer(model, top, rows), pose)
        image[top : top + rows] = cv2.resize(fine, (model.width_px, rows), interpolation=cv2.INTER_AREA)
    return image


def _finer(model: CameraModel, top: int, rows: int) -> CameraModel:
    """The camera that sees SAMPLES x SAMPLES pixels for each pixel of a strip of rows."""
    matrix = model.matrix.copy()
    matrix[1, 2] -= top
    matrix[:2, :2] *= SAMPLES
    matrix[:2, 2] = (matrix[:2, 2] + 0.5) * SAMPLES - 0.5
    return replace(model, width_px=model.width_px * SAMPLES, height_px=rows * SAMPLES, matrix=matrix)


def _paint_samples(painted: Painted, model: CameraModel, pose: Pose) -> NDArray[np.float32]:
    centre = pose.centre_m.astype(np.float32)
    rays = (pose.R_camera_scene.T @ pixel_rays(model).reshape(3, -1)).astype(np.float32)
    hits = cast(painted.scene.bodies, centre, rays)
    levels = np.full((3, rays.shape[1]), 5.0, np.float32)
    owner = hits.surface // FACES
    for index in np.unique(owner[owner >= 0]):
        at = np.flatnonzero(owner == index)
        points = centre[:, None] + hits.depth[at] * rays[:, at]
        # A pixel, not a sample, limits the texture's detail: every octave is one that the image can hold.
        footprint_m = hits.depth[at] * np.float32(SAMPLES / model.matrix[0, 0])
        body, paint = painted.scene.bodies[index], painted.paints[index]
        levels[:, at] = _levels(painted.scene, body, paint, points=points, rays=rays[:, at], footprint_m=footprint_m)
    return levels.T.reshape(model.height_px, model.width_px, 3)


def _levels(scene: Scene, body: Body, paint: Paint, *, points: Floats, rays: Floats, footprint_m: Floats) -> Floats:
    """Grey levels (3, N) of points on a body, as the eye sees them along the rays."""
    towards = _unit(scene.light.towards)
    normals = surface_normals(body, points, -rays)
    lambert = np.float32(0.55) + np.float32(0.45) * np.maximum(towards @ normals, 0)
    local = to_body(body, points)
    grey = np.float32(paint.level) * lambert
    if paint.texture_levels:
        noise = _noise(body, paint, local, footprint_m)
        plain = local[0] > paint.plain_beyond_m
        grey += np.where(plain, 0, np.float32(paint.texture_levels / 2) * noise)
    if paint.pattern is not Pattern.NONE:
        grey -= np.float32(paint.pattern_levels) * _pattern(paint, local, footprint_m)
    colour = np.asarray(paint.tint_bgr, np.float32)[:, None] * grey
    if paint.gloss_levels:
        lamp = _unit(paint.gloss_towards or scene.light.towards)
        mirrored = 2 * (lamp @ normals) * normals - lamp[:, None]
        along = np.maximum(-dot(mirrored, rays) / np.sqrt(dot(rays, rays)), 0)
        colour += np.float32(paint.gloss_levels) * along ** np.float32(paint.gloss_exponent)
    return colour


def _unit(vector: Vector) -> NDArray[np.float32]:
    values = np.asarray(vector, np.float32)
    return values / np.float32(np.linalg.norm(values))


def _noise(body: Body, paint: Paint, local: Floats, footprint_m: Floats) -> Floats:
    """Band-limited noise in -1..1 at points of a body."""
    texture = replace(_PROBE, seed=paint.seed, shortest_m=paint.shortest_m, longest_m=paint.shortest_m * 32)
    grey = albedo(replace(body, texture=texture), local, footprint_m)[0]
    bare: Floats = (grey * np.float32(2) - np.float32(1)) / np.float32(_PROBE.contrast)
    return bare


def _pattern(paint: Paint, local: Floats, footprint_m: Floats) -> Floats:
    """Share (0..1) of each point that is joint or gap; its edges are as wide as a pixel."""
    half_m = paint.period_m * (0.06 if paint.pattern is Pattern.TILES else 0.25)
    axes = (0, 1) if paint.pattern is Pattern.TILES else (0,)
    share = np.zeros(local.shape[1], np.float32)
    for axis in axes:
        away = np.abs((local[axis] / paint.period_m + 0.5) % 1 - 0.5) * paint.period_m
        inside = np.clip((half_m - away) / footprint_m + 0.5, 0, 1).astype(np.float32)
        # A joint that is thinner than a pixel darkens it by its share only.
        share = np.maximum(share, inside * np.minimum(1, 2 * half_m / footprint_m))
    return share
