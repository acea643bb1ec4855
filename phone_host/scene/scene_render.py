"""Renders images of a scene as one camera sees it.

A renderer keeps what does not change: the rays of all pixels and the picture of everything that stands still. A frame
then costs only the moving bodies, their shadows and their edges. Inside a surface one sample per pixel is enough,
because the texture is band-limited; pixels at the border of two surfaces are averaged over 3 x 3 samples.
"""

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel, Image
from phone_host.scene.cast import BATCH, FACES, NOTHING, Hits, cast, cast_one, pixel_rays, to_body
from phone_host.scene.round_shapes import dot
from phone_host.scene.scene_model import Body, Floats, Look, Plane, Pose, Scene
from phone_host.scene.shade import (
    SeenPoints,
    albedo,
    lamp_reflection,
    may_darken,
    shadow_balls,
    surface_light,
    surface_normals,
)

_BLOCK_PX = 16
_SUB_PIXELS = (-1.0 / 3.0, 0.0, 1.0 / 3.0)
_NOISE_MARGIN_PX = 64
_SLANTED = 1.6
"""A footprint that is this many times longer than wide is sampled along its length."""

_ALONG_PIXEL = (-0.375, -0.125, 0.125, 0.375)
"""Positions of the samples along a slanted pixel's footprint, px."""

_LEAST_COSINE = 0.04
"""Surfaces seen more edge-on than this cosine get the footprint of this cosine; they cover few pixels."""

Window = tuple[slice, slice]
Flat = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class _Still:
    """The picture of everything that stands still: depth (H * W), surface (H * W), reflectance (3, H * W), levels."""

    hits: Hits
    reflectance: Floats
    levels: Floats


class Renderer:
    """Renders frames of one scene for one camera."""

    def __init__(self, scene: Scene, model: CameraModel, pose: Pose, look: Look | None = None) -> None:
        self._scene = scene
        self._look = Look() if look is None else look
        self._size = (model.height_px, model.width_px)
        self._focal_px = model.mean_focal_px
        self._centre = pose.centre_m.astype(np.float32)
        rays = np.tensordot(pose.R_camera_scene.T, _rays_of(model), axes=1)
        self._rays = rays.astype(np.float32).reshape(3, -1)
        self._steps = tuple(np.gradient(rays, axis=axis).astype(np.float32).reshape(3, -1) for axis in (2, 1))
        self._block_rays, self._block_angle = _blocks(rays)
        self._vignette = _vignette(self._size, self._look.vignetting)
        self._noise = _noise_bank(self._size, self._look)
        self._moving = tuple(index for index, body in enumerate(scene.bodies) if body.path.moves)
        self._still = self._render_still()

    def frame(self, t_s: float = 0.0) -> Image:
        """Render the image at time `t_s`.

        Returns:
            (H, W, 3) uint8 BGR. Equal arguments give equal bytes.
        """
        levels = self._still.levels.copy()
        if self._moving:
            bodies = self._scene.at(t_s).bodies
            hits = Hits(self._still.hits.depth.copy(), self._still.hits.surface.copy())
            touched = np.zeros(self._size[0] * self._size[1], dtype=np.bool_)
            self._cast_moving(bodies, hits, touched)
            self._mark_shadows(bodies, hits, touched)
            self._paint(bodies, hits, touched, levels)
        if self._look.blur_px > 0.0:
            levels = self._blurred(levels)
        if self._noise is not None:
            levels += self._noise_at(t_s)
        return np.clip(np.rint(levels, out=levels), 0.0, 255.0, out=levels).astype(np.uint8).reshape(*self._size, 3)

    def _render_still(self) -> _Still:
        bodies = self._scene.bodies
        hits = Hits(
            np.full(self._rays.shape[1], np.inf, dtype=np.float32),
            np.full(self._rays.shape[1], NOTHING, dtype=np.int16),
        )
        for index, body in enumerate(bodies):
            if index not in self._moving:
                cast_one(index, body, self._centre, self._rays, hits)
        still = tuple(body for body in bodies if not body.path.moves)
        reflectance = np.zeros_like(self._rays)
        void = np.asarray(self._scene.void_bgr, dtype=np.float32)[:, None]
        levels = self._develop(np.repeat(void, self._rays.shape[1], axis=1), np.arange(self._rays.shape[1]))
        for index, at in _by_body(hits.surface, np.arange(self._rays.shape[1])):
            rays, depth = self._rays[:, at], hits.depth[at]
            points = self._centre[:, None] + depth * rays
            normals = surface_normals(bodies[index], points, -rays)
            reflectance[:, at] = self._reflectance(bodies[index], depth=depth, rays=rays, normals=normals, pixels=at)
            light = self._light_from(bodies[index], still, SeenPoints(points, normals, rays), reflectance[:, at])
            levels[at] = self._develop(light, at)
        self._smooth_edges(still, hits.surface, None, levels)
        return _Still(hits, reflectance, levels)

    def _cast_moving(self, bodies: tuple[Body, ...], hits: Hits, touched: NDArray[np.bool_]) -> None:
        """Put the moving bodies in front of the still picture and mark their pixels."""
        for index in self._moving:
            body = bodies[index]
            at = self._inside(np.asarray(body.position_m), body.bounding_radius_m)
            part = Hits(hits.depth[at], hits.surface[at])
            cast_one(index, body, self._centre, self._rays[:, at], part)
            mine = part.surface // FACES == index
            hits.depth[at], hits.surface[at] = part.depth, part.surface
            touched[at[mine]] = True

    def _mark_shadows(self, bodies: tuple[Body, ...], hits: Hits, touched: NDArray[np.bool_]) -> None:
        """Mark the still pixels whose light a moving body may change."""
        for index, body in enumerate(bodies):
            if index in self._moving:
                continue
            for caster in (bodies[moving] for moving in self._moving):
                if isinstance(caster.shape, Plane):
                    continue
                balls: tuple[tuple[NDArray[np.float64], float], ...]
                if isinstance(body.shape, Plane):
                    balls = shadow_balls(self._scene.light, caster, body)
                elif may_darken(self._scene.light, caster, body):
                    balls = ((np.asarray(body.position_m), body.bounding_radius_m),)
                else:
                    balls = ()
                for centre, radius in balls:
                    at = self._inside(centre, radius)
                    touched[at[hits.surface[at] // FACES == index]] = True

    def _paint(self, bodies: tuple[Body, ...], hits: Hits, touched: NDArray[np.bool_], levels: Floats) -> None:
        """Shade all marked pixels, then smooth the borders among them."""
        for index, at in _by_body(hits.surface, np.flatnonzero(touched)):
            rays, depth = self._rays[:, at], hits.depth[at]
            points = self._centre[:, None] + depth * rays
            normals = surface_normals(bodies[index], points, -rays)
            if index in self._moving:
                reflectance = self._reflectance(bodies[index], depth=depth, rays=rays, normals=normals, pixels=at)
            else:
                reflectance = self._still.reflectance[:, at]
            light = self._light_from(bodies[index], bodies, SeenPoints(points, normals, rays), reflectance)
            levels[at] = self._develop(light, at)
        self._smooth_edges(bodies, hits.surface, touched, levels)

    def _light_from(self, body: Body, bodies: tuple[Body, ...], seen: SeenPoints, reflectance: Floats) -> Floats:
        """Compute the light (3, N) that leaves points of a body towards the camera."""
        solid = (other for other in bodies if other is not body and not isinstance(other.shape, Plane))
        casters = tuple(
            other for other in solid if isinstance(body.shape, Plane) or may_darken(self._scene.light, other, body)
        )
        scattered: Floats = reflectance * surface_light(self._scene.light, casters, seen.points, seen.normals)
        reflected = lamp_reflection(self._scene.light, body, casters, seen)
        return scattered if reflected is None else scattered + reflected

    def _reflectance(self, body: Body, *, depth: Floats, rays: Floats, normals: Floats, pixels: Flat) -> Floats:
        """Compute the reflectance (3, N) as a pixel averages it.

        A pixel's footprint on a slanted surface is long and narrow. A round filter as wide as the footprint is long
        would blur a table top, so a slanted pixel takes the mean of several samples along its footprint, each filtered
        for its share of the length.
        """
        across, along = self._footprint_m(depth, rays, normals)
        colour = np.empty_like(rays)
        slanted = along > np.float32(_SLANTED) * across
        at = np.flatnonzero(~slanted)
        if at.size:
            points = self._centre[:, None] + depth[at] * rays[:, at]
            colour[:, at] = albedo(body, to_body(body, points), along[at])
        at = np.flatnonzero(slanted)
        if at.size:
            normal, ray = normals[:, at], rays[:, at]
            step = self._steepest_step(normal, pixels[at])
            height = depth[at] * dot(normal, ray)
            footprint = np.maximum(across[at], along[at] / np.float32(len(_ALONG_PIXEL)))
            total = np.zeros_like(ray)
            for share in _ALONG_PIXEL:
                # The samples lie on the tangent plane.
                aside = ray + np.float32(share) * step
                points = self._centre[:, None] + height / dot(normal, aside) * aside
                total += albedo(body, to_body(body, points), footprint)
            colour[:, at] = total / np.float32(len(_ALONG_PIXEL))
        return colour

    def _footprint_m(self, depth: Floats, rays: Floats, normals: Floats) -> tuple[Floats, Floats]:
        """Return the width and length (N,) of the area that a pixel covers on a surface, m."""
        across = depth / np.float32(self._focal_px)
        cosine = np.abs(dot(normals, rays)) / np.sqrt(dot(rays, rays))
        return across, across / np.maximum(cosine, np.float32(_LEAST_COSINE))

    def _steepest_step(self, normals: Floats, pixels: Flat) -> Floats:
        """Return the change of the ray (3, N) over one pixel in the image direction in which a surface recedes fastest."""
        step_x, step_y = (step[:, pixels] for step in self._steps)
        x, y = dot(normals, step_x), dot(normals, step_y)
        length = np.hypot(x, y) + np.float32(1e-12)
        return (x / length) * step_x + (y / length) * step_y

    def _smooth_edges(
        self,
        bodies: tuple[Body, ...],
        surface: NDArray[np.int16],
        touched: NDArray[np.bool_] | None,
        levels: Floats,
    ) -> None:
        """Replace pixels at the border of two surfaces by the mean of 3 x 3 samples; `touched` limits where."""
        border = _borders(surface.reshape(self._size))
        if touched is not None:
            near = cv2.dilate(touched.reshape(self._size).astype(np.uint8), np.ones((3, 3), dtype=np.uint8))
            border &= near.astype(np.bool_)
        at = np.flatnonzero(border)
        if not at.size:
            return
        rays = self._rays[:, at]
        step_x, step_y = (step[:, at] for step in self._steps)
        samples = np.concatenate(
            [rays + np.float32(dx) * step_x + np.float32(dy) * step_y for dy in _SUB_PIXELS for dx in _SUB_PIXELS],
            axis=1,
        )
        hits = cast(bodies, self._centre, samples)
        colour = np.repeat(np.asarray(self._scene.void_bgr, dtype=np.float32)[:, None], samples.shape[1], axis=1)
        for index, part in _by_body(hits.surface, np.arange(samples.shape[1])):
            ray, depth = samples[:, part], hits.depth[part]
            points = self._centre[:, None] + depth * ray
            normals = surface_normals(bodies[index], points, -ray)
            across, along = self._footprint_m(depth, ray, normals)
            local = to_body(bodies[index], points)
            reflectance = albedo(bodies[index], local, np.maximum(across, along / np.float32(len(_SUB_PIXELS))))
            colour[:, part] = self._light_from(bodies[index], bodies, SeenPoints(points, normals, ray), reflectance)
        levels[at] = self._develop(colour.reshape(3, -1, at.size).mean(axis=1), at)

    def _develop(self, colour: Floats, at: Flat) -> Floats:
        """Return the grey levels (N, 3) of light (3, N) on the pixels `at`, without noise and unrounded."""
        look = self._look
        lit = np.maximum(colour if self._vignette is None else colour * self._vignette[at], 0.0)
        curve = np.sqrt(lit) if look.gamma == 2.0 else np.power(lit, np.float32(1.0 / look.gamma))
        gain = 255.0 * np.asarray(look.gain_bgr, dtype=np.float32)[:, None]
        return (gain * curve + np.float32(look.offset)).T

    def _blurred(self, levels: Floats) -> Floats:
        """Return grey levels (N, 3) as a lens blurs them: the light is blurred, not its levels."""
        look = self._look
        gain = 255.0 * np.asarray(look.gain_bgr, dtype=np.float32)
        light = np.maximum((levels - np.float32(look.offset)) / gain, 0.0) ** np.float32(look.gamma)
        picture = light.reshape(*self._size, 3)
        soft = np.asarray(cv2.GaussianBlur(picture, (0, 0), look.blur_px, borderType=cv2.BORDER_REPLICATE))
        curve = np.power(soft.reshape(-1, 3), np.float32(1.0 / look.gamma))
        blurred: Floats = gain * curve + np.float32(look.offset)
        return blurred

    def _inside(self, centre: NDArray[np.float64], radius: float) -> Flat:
        """Return flat indices of pixels that may see a ball: all 16 x 16 blocks whose cone of rays meets the ball's cone."""
        to_centre = centre - self._centre
        distance = float(np.linalg.norm(to_centre))
        height, width = self._size
        if distance <= radius or not math.isfinite(radius):
            return np.arange(height * width)
        cosine = np.tensordot(to_centre / distance, self._block_rays, axes=1)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        near = angle <= math.asin(radius / distance) + self._block_angle
        if not near.any():
            return np.zeros(0, dtype=np.intp)
        rows, columns = (np.flatnonzero(near.any(axis=axis)) for axis in (1, 0))
        y = np.arange(rows[0] * _BLOCK_PX, min((rows[-1] + 1) * _BLOCK_PX, height))
        x = np.arange(columns[0] * _BLOCK_PX, min((columns[-1] + 1) * _BLOCK_PX, width))
        return (y[:, None] * width + x).ravel()

    def _noise_at(self, t_s: float) -> Floats:
        """Return the noise of the frame at `t_s`: another section of the bank."""
        assert self._noise is not None
        rng = np.random.default_rng([self._look.seed, 7, round(t_s * 1e6) & 0xFFFFFFFF])
        y, x = rng.integers(0, _NOISE_MARGIN_PX + 1, 2)
        return self._noise[y : y + self._size[0], x : x + self._size[1]].reshape(-1, 3)


def render(
    scene: Scene, model: CameraModel, pose: Pose | None = None, look: Look | None = None, t_s: float = 0.0
) -> Image:
    """Render one image of a scene. For a film, keep a `Renderer`.

    Args:
        scene: the scene to render.
        model: intrinsics of the camera, distortion included.
        pose: position and orientation of the camera; the scene's origin by default.
        look: its sensor; a noise-free one by default.
        t_s: seconds on the scene's clock.

    Returns:
        (H, W, 3) uint8 BGR.
    """
    return Renderer(scene.at(t_s), model, Pose() if pose is None else pose, look).frame(t_s)


@functools.lru_cache(maxsize=4)
def _rays_of(model: CameraModel) -> NDArray[np.float64]:
    """Return the rays of a camera, which a walk around a thing needs at each step."""
    rays = pixel_rays(model)
    rays.setflags(write=False)
    return rays


def _by_body(surface: NDArray[np.int16], at: Flat) -> Iterator[tuple[int, Flat]]:
    """Split flat indices by the body that is visible there, in parts that fit a cache; indices that see nothing are left out."""
    owner = surface[at] // FACES
    for index in range(int(owner.max(initial=NOTHING)) + 1):
        mine = at[owner == index]
        for start in range(0, mine.size, BATCH):
            yield index, mine[start : start + BATCH]


def _borders(surface: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Return the pixels (H, W) that have another surface above, below, left or right of them."""
    border = np.zeros(surface.shape, dtype=np.bool_)
    beside = surface[:, 1:] != surface[:, :-1]
    above = surface[1:] != surface[:-1]
    border[:, 1:] |= beside
    border[:, :-1] |= beside
    border[1:] |= above
    border[:-1] |= above
    return border


def _blocks(rays: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the middle direction (3, h, w) of each 16 x 16 block of pixels and the angle (h, w) to its farthest corner, rad."""
    height, width = rays.shape[1:]
    unit = rays / np.linalg.norm(rays, axis=0)
    low = [np.arange(0, size, _BLOCK_PX) for size in (height, width)]
    high = [np.minimum(start + _BLOCK_PX - 1, size - 1) for start, size in zip(low, (height, width), strict=True)]
    corners = [unit[:, y[:, None], x[None, :]] for y in (low[0], high[0]) for x in (low[1], high[1])]
    middle = np.sum(corners, axis=0)
    middle /= np.linalg.norm(middle, axis=0)
    angles = [np.arccos(np.clip(np.einsum("ihw,ihw->hw", middle, corner), -1.0, 1.0)) for corner in corners]
    return middle, np.max(angles, axis=0)


def _vignette(size: tuple[int, int], loss: float) -> Floats | None:
    """Return the share of the light per pixel (H * W), which falls with the square of the distance from the middle."""
    if loss == 0.0:
        return None
    y, x = np.mgrid[-1.0 : 1.0 : size[0] * 1j, -1.0 : 1.0 : size[1] * 1j]
    share: Floats = (1.0 - loss * (x * x + y * y) / 2.0).astype(np.float32).ravel()
    return share


def _noise_bank(size: tuple[int, int], look: Look) -> Floats | None:
    """Make the noise of one sensor, somewhat larger than its image; every frame takes another section of it.

    Fresh noise for each frame would cost more than the frame itself.
    """
    if look.noise_sigma == 0.0:
        return None
    shape = (size[0] + _NOISE_MARGIN_PX, size[1] + _NOISE_MARGIN_PX, 3)
    drawn = np.random.default_rng([look.seed, 11]).standard_normal(shape, dtype=np.float32)
    bank: Floats = drawn * np.float32(look.noise_sigma)
    return bank
