"""Rendered rooms for bench_trust: random furniture, cameras, sizes, lights and faults that a good rig may have."""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from phone_host.model import CameraModel, Rig
from phone_host.scene.scene_model import Body, Box, Look, Plane, Scene, Sphere, Texture, rig_poses, rotation
from phone_host.scene.scene_render import Renderer
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import disparities_for_near
from tests.bench.depth_scenes import Image

SIZES: Final = ((320, 240), (640, 480), (640, 360), (800, 600), (1280, 960))


@dataclass(frozen=True, slots=True)
class Room:
    """A rendered room and the two cameras in it.

    Attributes:
        seed: chooses everything.
        scene: the bodies.
        rig: the cameras.
        looks: the two sensors.
        lower_px: how far too low the right image lies, px.
        blur_px: standard deviation of both lenses' blur, px.
        quality: of the JPEGs.
    """

    seed: int
    scene: Scene
    rig: Rig
    looks: tuple[Look, Look]
    lower_px: float
    blur_px: float
    quality: int

    def pairs(self, count: int) -> list[tuple[Image, Image]]:
        """Render both images a number of times; each has noise of its own."""
        poses = rig_poses(self.rig)
        left, right = (
            Renderer(self.scene, model, pose, look)
            for model, pose, look in zip((self.rig.left, self.rig.right), poses, self.looks, strict=True)
        )
        times_s = [0.05 * number for number in range(count)]
        return [(self._sent(left.frame(t_s), 0.0), self._sent(right.frame(t_s), self.lower_px)) for t_s in times_s]

    def _sent(self, image: Image, lower_px: float) -> Image:
        if lower_px:
            move = np.array([[1, 0, 0], [0, 1, lower_px]])
            size = (image.shape[1], image.shape[0])
            image = np.asarray(
                cv2.warpAffine(image, move, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
            )
        if self.blur_px:
            image = np.asarray(cv2.GaussianBlur(image, (0, 0), self.blur_px), np.uint8)
        done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, self.quality])
        assert done
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)

    def core(self) -> StereoCore:
        """The core that a user of this rig would run."""
        rectifier = Rectifier(self.rig)
        count = disparities_for_near(rectifier.geometry, 0.5, rectifier.rectification.width_px)
        return StereoCore(MatchSettings(MatcherName.SGBM, count), rectifier)


def room(seed: int, size_px: tuple[int, int] | None = None) -> Room:
    """Make a room; equal seeds make equal rooms."""
    random = np.random.default_rng([seed, 29])
    size = SIZES[int(random.choice(len(SIZES), p=(0.2, 0.4, 0.15, 0.15, 0.1)))] if size_px is None else size_px
    return Room(
        seed,
        _scene(random, seed),
        _rig(random, size),
        (_look(random, 2 * seed), _look(random, 2 * seed + 1)),
        lower_px=float(random.uniform(-1.5, 1.5)),
        blur_px=float(random.choice([0.0, 0.5, 0.8])) * size[0] / 640,
        quality=int(random.integers(50, 96)),
    )


def _texture(random: np.random.Generator, seed: int, contrast: float | None = None) -> Texture:
    light = random.uniform(0.3, 0.85, 3)
    dark = light * random.uniform(0.3, 0.8)
    shortest = float(random.uniform(0.004, 0.012))
    b, g, r = light.tolist()
    db, dg, dr = dark.tolist()
    return Texture(
        seed=seed,
        light_bgr=(b, g, r),
        dark_bgr=(db, dg, dr),
        contrast=float(random.choice([0.08, 0.15, 0.3, 0.6])) if contrast is None else contrast,
        shortest_m=shortest,
        longest_m=shortest * float(random.choice([8, 16, 32])),
    )


def _scene(random: np.random.Generator, seed: int) -> Scene:
    depth, floor = float(random.uniform(1.6, 5.0)), float(random.uniform(0.3, 0.9))
    flat = rotation((1.0, 0.0, 0.0), -math.pi / 2)
    aside = rotation((0.0, 1.0, 0.0), math.pi / 2)
    textures = iter(_texture(random, 1000 * seed + number) for number in range(100))
    bodies = [
        Body("wall", Plane(), (0.0, 0.0, depth), next(textures), rotation((0, 1, 0), float(random.uniform(-0.4, 0.4)))),
        Body("floor", Plane(), (0.0, floor, depth / 2), next(textures), flat),
        Body(
            "side",
            Plane(),
            (float(random.choice([-1, 1])) * float(random.uniform(1.0, 2.0)), 0.0, depth),
            next(textures),
            aside,
        ),
    ]
    for number in range(int(random.integers(3, 11))):
        z = float(random.uniform(0.7, depth - 0.3))
        size = float(random.uniform(0.05, 0.16)) * z
        x, y = float(random.uniform(-0.45, 0.45)) * z, min(float(random.uniform(-0.3, 0.3)) * z, floor - size / 2)
        turn = rotation((float(random.normal()), 1.0, 0.2), float(random.uniform(0, 3)))
        shape = (
            Sphere(size)
            if random.uniform() < 0.4
            else Box((size * float(random.uniform(0.5, 2)), size * float(random.uniform(0.5, 2)), size))
        )
        bodies.append(Body(f"thing {number}", shape, (x, y, z), next(textures), turn))
    return Scene(tuple(bodies))


def _rig(random: np.random.Generator, size: tuple[int, int]) -> Rig:
    width, height = size
    focal = width * float(random.uniform(0.65, 1.2))
    baseline = float(random.uniform(0.04, 0.14))
    unlike = random.uniform() < 0.5

    def model(factor: float) -> CameraModel:
        centre = np.array([(width - 1) / 2, (height - 1) / 2]) + random.normal(0, 0.012 * width, 2)
        matrix = np.array([[focal * factor, 0, centre[0]], [0, focal * factor, centre[1]], [0, 0, 1.0]])
        lens = np.array([random.uniform(-0.22, 0.06), random.uniform(-0.02, 0.06), 0.0005, -0.0004, 0.0])
        return CameraModel(width_px=width, height_px=height, matrix=matrix, distortion=lens * unlike)

    left, right = model(1.0), model(float(random.uniform(0.85, 1.2)) if unlike else 1.0)
    axis = random.normal(size=3)
    turn = rotation((float(axis[0]), float(axis[1]), float(axis[2])), math.radians(float(random.uniform(0, 2.5))))
    centre_m = np.array([baseline, float(random.normal(0, 0.03 * baseline)), float(random.normal(0, 0.03 * baseline))])
    return Rig(left=left, right=right, R_right_left=turn, t_right_left_m=-turn @ centre_m)


def _look(random: np.random.Generator, seed: int) -> Look:
    gain = float(random.uniform(0.65, 1.2))
    tint = random.uniform(0.92, 1.08, 3)
    return Look(
        gain_bgr=(gain * float(tint[0]), gain * float(tint[1]), gain * float(tint[2])),
        offset=float(random.uniform(0, 12)),
        vignetting=float(random.uniform(0, 0.35)),
        noise_sigma=float(random.uniform(0.5, 5.0)),
        seed=seed,
    )
