"""Computes the light that leaves a surface point: solid band-limited texture, one lamp with soft shadows, a sky.

All of it depends only on the point on the surface, so two cameras see the same thing, each within the detail that its
own pixels can hold. The exception is the lamp's reflection in a glossy surface, which lies elsewhere for each camera.

The texture is a sum of octaves. Each octave reads one periodic tile of noise whose spectrum is a ring of one octave's
width. It reaches the tile through a projection of the body's three coordinates to two: along the normal of flat faces;
for a ball along slanted directions that differ between octaves, so that it has neither seams nor poles. An octave fades
out before its wavelength gets near two pixels, so nothing aliases.
"""

import functools
import math
from dataclasses import dataclass
from typing import assert_never

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.scene.cast import box_interval, column, faces_and_normals, to_body
from phone_host.scene.round_shapes import dot
from phone_host.scene.scene_model import (
    Body,
    Box,
    Floats,
    Frustum,
    Light,
    Plane,
    Print,
    Sphere,
    Texture,
    Torus,
    printed_albedo,
)

_TILE = 512
_WAVE_TEXELS = 16
"""A wavelength in texels. The error of bilinear reading of the tile is then about (pi / 16)^2 / 2 = 2 % of the finest detail."""

# The ring reaches from 0.7 to 1.4 of an octave's frequency, with half of its power within 0.84 to 1.19. At 2.5 px per
# wavelength, where an octave starts to count, that half stays above Nyquist's two pixels.
_FADE_FROM_PX, _FADE_TO_PX = 2.5, 4.0

_REMAP_COLUMNS = 4096
"""cv2.remap reads samples in rows of this length, because it takes no side beyond 32767."""

_UP_WEIGHT = 0.3
"""Share of the sky's light that depends on how much a surface faces upwards."""

_LEAST_SKY = 0.04
"""This share is subtracted from the sky that a body hides, so that its influence ends somewhere and frames stay cheap."""

_SQUARE_OF_CIRCLE = math.sqrt(math.pi)
"""Side of a square with the area of a circle of radius 1."""

_WRAP = 0.15
"""The lamp reaches this far around a ball, like the terminator of a lamp of finite size."""


@functools.cache
def _noise_tile() -> Floats:
    """Return periodic noise of unit variance with a ring spectrum, (513, 513) float32; last row and column repeat the first."""
    white = np.random.default_rng(20240607).standard_normal((_TILE, _TILE))
    cycles = np.hypot(*np.meshgrid(np.fft.fftfreq(_TILE, 1.0 / _TILE), np.fft.fftfreq(_TILE, 1.0 / _TILE)))
    octaves = np.log2(np.maximum(cycles, 1e-9) * _WAVE_TEXELS / _TILE)
    ring = np.where(np.abs(octaves) < 0.5, np.cos(np.pi * octaves) ** 2, 0.0)
    tile = np.fft.ifft2(np.fft.fft2(white) * ring).real
    return np.pad(tile / tile.std(), ((0, 1), (0, 1)), mode="wrap").astype(np.float32)


@functools.cache
def _projections(seed: int, count: int, *, flat: bool) -> tuple[Floats, Floats]:
    """Return projections of three coordinates to the tile, in wavelengths: (count, 2, 3) and offsets (count, 2).

    `flat` projects nearly along z. Otherwise it projects along the four diagonals of a cube in turn, so that a curved
    surface is nowhere parallel to all of them.
    """
    rng = np.random.default_rng([seed, 3])
    planes = np.empty((count, 2, 3))
    for octave in range(count):
        along = np.array([0.0, 0.0, 1.0] if flat else [1.0, 1.0 - 2.0 * (octave & 1), 1.0 - (octave & 2)])
        along += rng.uniform(-0.2, 0.2, 3)
        frame = np.linalg.qr(np.column_stack([along, rng.standard_normal((3, 2))]))[0]
        planes[octave] = frame[:, 1:].T
    return planes.astype(np.float32), rng.uniform(0.0, _TILE / _WAVE_TEXELS, (count, 2)).astype(np.float32)


def _texture_places(body: Body, texture: Texture, points: Floats) -> tuple[Floats, bool]:
    """Return points (3, N) as the texture takes them, and whether their third coordinate is the surface's normal.

    Each face of a box is textured separately (coordinates swapped), so that none is seen along a slanted projection.
    """
    places = points / column(texture.stretch, points)
    match body.shape:
        case Plane():
            return places, True
        case Sphere() | Frustum() | Torus():
            return places, False
        case Box():
            faces = faces_and_normals(body.shape, points)[0]
            places = np.take_along_axis(places, (faces // 2 + np.array([[1], [2], [3]])) % 3, axis=0)
            # Each face takes another part of the texture, a metre away.
            places[0] += faces
            return places, True
        case _:
            assert_never(body.shape)


def wavelengths_m(texture: Texture) -> list[float]:
    """Return the wavelengths of the texture's octaves, finest first, m."""
    count = max(1, 1 + math.floor(math.log2(texture.longest_m / texture.shortest_m)))
    return [texture.shortest_m * 2.0**octave for octave in range(count)]


def _smooth(low: float, high: float, x: Floats) -> Floats:
    """Return 0 below `low`, 1 above `high`, and a cubic between."""
    unit = np.clip((x - np.float32(low)) * np.float32(1.0 / (high - low)), 0.0, 1.0)
    cubic: Floats = unit * unit * (np.float32(3.0) - np.float32(2.0) * unit)
    return cubic


def _read_tile(u: Floats, v: Floats) -> Floats:
    """Return the noise at (N,) places given in wavelengths."""
    scale = np.float32(_WAVE_TEXELS)
    period = np.float32(_TILE / _WAVE_TEXELS)
    rows = -(-u.size // _REMAP_COLUMNS)
    maps = np.zeros((2, rows * _REMAP_COLUMNS), dtype=np.float32)
    for line, wave in zip(maps, (u, v), strict=True):
        np.multiply(wave - period * np.floor(wave / period), scale, out=line[: u.size])
    grid = maps.reshape(2, rows, _REMAP_COLUMNS)
    values = np.asarray(cv2.remap(_noise_tile(), grid[0], grid[1], cv2.INTER_LINEAR), dtype=np.float32)
    return values.reshape(-1)[: u.size]


def albedo(body: Body, points: Floats, footprint_m: Floats) -> Floats:
    """Compute the reflectance of a body's surface.

    Args:
        body: shape and texture.
        points: (3, N) float32 in the body's axes, m.
        footprint_m: (N,) float32, size of the area that a pixel covers on the surface.

    Returns:
        (3, N) float32 BGR, 0..1.
    """
    texture = body.texture
    if isinstance(texture, Print):
        return printed_albedo(texture, points, footprint_m)
    places, flat = _texture_places(body, texture, points)
    waves = wavelengths_m(texture)
    planes, offsets = _projections(texture.seed, len(waves), flat=flat)
    total = np.zeros(points.shape[1], dtype=np.float32)
    coarse = np.zeros_like(total)
    for octave, wave_m in enumerate(waves):
        weight = _smooth(_FADE_FROM_PX, _FADE_TO_PX, np.float32(wave_m) / footprint_m)
        if not np.any(weight):
            continue
        u, v = (planes[octave] / np.float32(wave_m)) @ places + offsets[octave][:, None]
        value = _read_tile(u, v) * weight
        total += value
        if octave >= len(waves) - 3:
            coarse += value
    mix = _smooth(-2.5, 2.5, coarse)
    shade = 1.0 + np.float32(texture.contrast) * np.tanh(total * np.float32(0.45))
    light, dark = (column(colour, points) for colour in (texture.light_bgr, texture.dark_bgr))
    bgr: Floats = np.clip((dark + (light - dark) * mix) * shade, 0.0, 1.0)
    return bgr


def lamp_reaching(body: Body, points: Floats, towards: Floats) -> Floats:
    """Return the share of the lamp that one body lets through to nearby points, (N,) 0..1, with a soft edge.

    Args:
        body: the body that may block the light.
        points: (3, N) float32 in the scene's axes.
        towards: (3,) unit vector to the lamp.
    """
    local = to_body(body, points)
    ray = body.R_scene_body.T.astype(np.float32) @ towards
    match body.shape:
        case Sphere(radius_m):
            ahead = -(ray @ local)
            miss = np.sqrt(np.maximum(dot(local, local) - ahead * ahead, 0.0))
            through = _smooth(0.8 * radius_m, 1.2 * radius_m, miss)
            return np.where(ahead > 0.0, through, np.float32(1.0))
        case Box(size_m):
            near, far = box_interval(size_m, local, ray[:, None])
            edge = 0.4 * min(size_m)
            through = _smooth(-edge, edge, near - far)
            return np.where(far > 0.0, through, np.float32(1.0))
        case Frustum(bottom_radius_m, top_radius_m, height_m):
            # Its shadow is that of a box as wide as its middle; the soft edge hides the difference.
            side = _SQUARE_OF_CIRCLE * (bottom_radius_m + top_radius_m) / 2.0
            near, far = box_interval((side, side, height_m), local, ray[:, None])
            edge = 0.4 * min(side, height_m)
            return np.where(far > 0.0, _smooth(-edge, edge, near - far), np.float32(1.0))
        case Plane() | Torus():
            # A ring's shadow is too narrow to matter.
            return np.ones(points.shape[1], dtype=np.float32)
        case _:
            assert_never(body.shape)


def _ball_radius_m(body: Body) -> float:
    """Return the radius of a ball that hides about as much of the sky as the body does."""
    match body.shape:
        case Sphere(radius_m):
            return radius_m
        case Box(size_m):
            return sum(size_m) / 6.0
        case Frustum(bottom_radius_m, top_radius_m, height_m):
            return (bottom_radius_m + top_radius_m + height_m / 2.0) / 3.0
        case Plane() | Torus():
            return 0.0
        case _:
            assert_never(body.shape)


def shadow_balls(light: Light, caster: Body, plane: Body) -> tuple[tuple[NDArray[np.float64], float], ...]:
    """Find where a body changes the light on a plane: balls (centre, radius) that contain its shadow and its dimming of the sky.

    Args:
        light: gives the lamp's direction.
        caster: the body, above the plane.
        plane: a body whose shape is a plane.

    Returns:
        Zero to two balls in the scene's axes, m.
    """
    normal = plane.R_scene_body[:, 2]
    centre = np.asarray(caster.position_m)
    height = float(normal @ (centre - np.asarray(plane.position_m)))
    towards = np.asarray(light.towards) / np.linalg.norm(light.towards)
    along = float(normal @ towards)
    balls = []
    if height * along > 0.0:
        reach = 1.3 * caster.bounding_radius_m / abs(along)
        balls.append((centre - towards * (height / along), reach))
    # At this distance d from the body's centre, cosine * r^2 / d^2 with cosine = height / d falls below the least
    # share.
    distance = (abs(height) * _ball_radius_m(caster) ** 2 / _LEAST_SKY) ** (1.0 / 3.0)
    if distance > abs(height):
        balls.append((centre - normal * height, math.sqrt(distance**2 - height**2)))
    return tuple(balls)


def may_darken(light: Light, caster: Body, other: Body) -> bool:
    """Return whether one solid body may cast its shadow on another or hide sky from it, judged by their bounding balls."""
    apart = np.asarray(other.position_m) - np.asarray(caster.position_m)
    towards = np.asarray(light.towards) / np.linalg.norm(light.towards)
    behind = -float(apart @ towards)
    aside = float(np.linalg.norm(apart + behind * towards))
    shadow_reach = other.bounding_radius_m + 1.3 * caster.bounding_radius_m
    sky_reach = other.bounding_radius_m + _ball_radius_m(caster) / math.sqrt(_LEAST_SKY)
    return (behind > 0.0 and aside < shadow_reach) or float(np.linalg.norm(apart)) < sky_reach


def sky_blocked(body: Body, points: Floats, normals: Floats) -> Floats:
    """Return the share of the sky that a body hides from points, (N,) 0..1: for a ball of its size, cosine * r^2 / d^2."""
    if isinstance(body.shape, Plane):
        return np.zeros(points.shape[1], dtype=np.float32)
    radius = _ball_radius_m(body)
    to_centre = column(body.position_m, points) - points
    square = np.maximum(dot(to_centre, to_centre), np.float32(radius * radius))
    cosine = np.maximum(dot(to_centre, normals), 0.0) / np.sqrt(square)
    hidden: Floats = np.maximum(cosine * np.float32(radius * radius) / square - np.float32(_LEAST_SKY), 0.0)
    return hidden


def surface_light(light: Light, casters: tuple[Body, ...], points: Floats, normals: Floats) -> Floats:
    """Compute the light that falls on surface points.

    Args:
        light: lamp and sky.
        casters: bodies that may cast a shadow on them.
        points: (3, N) float32, scene axes, m.
        normals: (3, N) float32 outward.

    Returns:
        (3, N) float32 BGR.
    """
    towards = (np.asarray(light.towards) / np.linalg.norm(light.towards)).astype(np.float32)
    lamp = np.maximum((towards @ normals + np.float32(_WRAP)) / np.float32(1.0 + _WRAP), 0.0)
    sky = np.float32(1.0 - _UP_WEIGHT) + np.float32(_UP_WEIGHT) * (np.float32(0.5) - np.float32(0.5) * normals[1])
    for body in casters:
        lamp = lamp * lamp_reaching(body, points, towards)
        sky = sky * (np.float32(1.0) - sky_blocked(body, points, normals))
    total: Floats = column(light.lamp_bgr, points) * lamp + column(light.sky_bgr, points) * sky
    return total


@dataclass(frozen=True, slots=True, eq=False)
class SeenPoints:
    """Surface points as one camera sees them.

    Attributes:
        points: (3, N) float32, scene axes, m.
        normals: (3, N) float32 outward.
        rays: (3, N) float32 directions from the camera, of any length.
    """

    points: Floats
    normals: Floats
    rays: Floats


def lamp_reflection(light: Light, body: Body, casters: tuple[Body, ...], seen: SeenPoints) -> Floats | None:
    """Compute the lamp's reflection in a glossy surface (Blinn 1977).

    Args:
        light: gives the lamp.
        body: the body whose surface it is.
        casters: bodies that may keep the lamp from it.
        seen: N points of that surface.

    Returns:
        (3, N) float32 BGR, to be added to the light that the surface scatters; None: it is matt.
    """
    texture = body.texture
    if isinstance(texture, Print) or texture.gloss == 0.0:
        return None
    towards = (np.asarray(light.towards) / np.linalg.norm(light.towards)).astype(np.float32)
    between = towards[:, None] - seen.rays / np.sqrt(dot(seen.rays, seen.rays))
    facing = np.maximum(dot(between, seen.normals), 0.0) / np.sqrt(np.maximum(dot(between, between), np.float32(1e-12)))
    share = np.where(towards @ seen.normals > 0.0, facing ** np.float32(texture.sharpness), np.float32(0.0))
    for caster in casters:
        share = share * lamp_reaching(caster, seen.points, towards)
    reflected: Floats = column(light.lamp_bgr, seen.points) * np.float32(texture.gloss) * share
    return reflected


def surface_normals(body: Body, points: Floats, towards_eye: Floats) -> Floats:
    """Return outward unit normals in the scene's axes; a plane's normal points to the side of the camera.

    Args:
        body: the body whose surface it is.
        points: (3, N) float32, scene axes.
        towards_eye: (3, N) float32 directions to the camera.

    Returns:
        (3, N) float32.
    """
    normals: Floats = body.R_scene_body.astype(np.float32) @ faces_and_normals(body.shape, to_body(body, points))[1]
    if isinstance(body.shape, Plane):
        return np.where(dot(normals, towards_eye) < 0.0, -normals, normals)
    return normals
