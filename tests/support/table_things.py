"""Things on a table: small rendered pictures of one, from some sides, and exact or noisy views of planes."""

import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common import now
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Processed, StereoGeometry
from phone_host.output.rig_yaml import write_rig
from phone_host.scan.view import View
from phone_host.scene.object_scene import ObjectScene, Setting, Size, object_scene
from phone_host.scene.scene_model import Body, Sphere, Texture
from phone_host.scene.solid import Solid
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_rig

Floats = NDArray[np.float64]

STEP_DEG: Final = 8.0
"""Between two views."""


@cache
def small_scene() -> ObjectScene:
    """A speckled figure on a bare table, before two cameras of 400x300 and 500x375 px."""
    setting = Setting(size=Size.VGA, views=round(360 / STEP_DEG), has_mat=False, jpeg_quality=92)
    whole = object_scene("speckled", setting)
    rig = whole.rig
    return replace(whole, rig=replace(rig, left=_shrunk(rig.left), right=_shrunk(rig.right)))


def _shrunk(camera: CameraModel) -> CameraModel:
    share = 0.625
    matrix = camera.matrix * np.array([[share], [share], [1.0]])
    return replace(
        camera, width_px=round(share * camera.width_px), height_px=round(share * camera.height_px), matrix=matrix
    )


def bare_scene() -> ObjectScene:
    """The same table, on which a small stone lies far out of the picture."""
    stone = Body("stone", Sphere(0.01), (0.6, -0.3, 0.01), Texture(seed=1))
    return replace(small_scene(), solid=Solid((stone,)))


def write_pictures(folder: Path, count: int, scene: ObjectScene) -> None:
    """Write the first views into left/ and right/, and rig.yaml."""
    write_rig(folder / "rig.yaml", scene.rig, rectify_rig(scene.rig))
    for side in ("left", "right"):
        (folder / side).mkdir()
    for number in range(count):
        view = scene.view(number)
        cv2.imwrite(str(folder / "left" / f"{number:02}.png"), view.left)
        cv2.imwrite(str(folder / "right" / f"{number:02}.png"), view.right)


def true_camera(number: int) -> SE3:
    """Where the rectified left camera is at a view, in the axes of the figure."""
    pose = small_scene().pose(number)
    turn = Rectifier(small_scene().rig).rectification.R_left
    return SE3(pose[:3, :3] @ turn.T, pose[:3, 3])


@dataclass(frozen=True, slots=True)
class Slope:
    """A table that is seen at an angle, before a wall, with a ball on it.

    Attributes:
        down_deg: how far the camera looks down.
        height_m: of the camera above the table.
        deep_m: how far the table reaches from below the camera; beyond it is a wall, and below it a floor 0.4 m lower.
        wide_m: of the table, to either side.
        ball_m: radius of the ball; 0: there is none.
    """

    down_deg: float = 35.0
    height_m: float = 0.3
    deep_m: float = 5.0
    wide_m: float = 9.0
    ball_m: float = 0.04

    @property
    def normal(self) -> Floats:
        """Of the table, in the camera's axes."""
        return np.array([0.0, -math.cos(math.radians(self.down_deg)), -math.sin(math.radians(self.down_deg))])

    def view(self, seed: int | None = None, noise_px: float = 0.5) -> View:
        """Return what a camera of 320x240 px sees, with noise of its disparities where there is a seed."""
        of = StereoGeometry(focal_px=300, baseline_m=0.06, cx_px=159.5, cy_px=119.5, doffs_px=0.0)
        rows, columns = np.indices((240, 320), np.float64)
        rays = np.stack([(columns - of.cx_px) / 300, (rows - of.cy_px) / 300, np.ones_like(rows)], axis=-1)
        level = math.radians(self.down_deg)
        ahead = np.array([0.0, -math.sin(level), math.cos(level)])
        with np.errstate(divide="ignore", invalid="ignore"):
            table, floor = (-height / (rays @ self.normal) for height in (self.height_m, self.height_m + 0.4))
            wall = 1.5 / (rays @ ahead)
            table[
                (table < 0) | (table * (rays @ ahead) > self.deep_m) | (np.abs(table * rays[..., 0]) > self.wide_m)
            ] = np.inf
            floor[floor < 0], wall[wall < 0] = np.inf, np.inf
        depth = np.minimum(np.minimum(table, floor), wall)
        if self.ball_m:
            foot = np.array([0.0, 0.0, self.height_m / math.sin(level)])
            middle = foot + self.ball_m * self.normal
            a, b = (rays**2).sum(axis=-1), rays @ middle
            inside = b**2 - a * (middle @ middle - self.ball_m**2)
            ball = np.where(inside > 0, (b - np.sqrt(np.maximum(inside, 0))) / a, np.inf)
            depth = np.minimum(depth, ball)
        disparity = of.focal_px * of.baseline_m / depth
        if seed is not None:
            disparity = disparity + np.random.default_rng(seed).normal(0, noise_px, disparity.shape)
        seen = np.where(disparity > 1, of.focal_px * of.baseline_m / np.maximum(disparity, 1), np.nan)
        grey = np.zeros(depth.shape, np.uint8)
        return View(
            grey=grey,
            colours=grey[..., np.newaxis].repeat(3, axis=2),
            depth_m=seen.astype(np.float32),
            geometry=of,
            noise_px=noise_px,
        )


def computed(folder: Path, number: int) -> Processed:
    """Compute a pair that `write_pictures` wrote."""
    left, right = (cv2.imread(str(folder / side / f"{number:02}.png")) for side in ("left", "right"))
    assert left is not None
    assert right is not None
    return _core().compute(np.asarray(left, np.uint8), np.asarray(right, np.uint8), now.monotonic_ns)


def computed_view(number: int) -> Processed:
    """Compute what is seen of the figure at a view."""
    view = small_scene().view(number)
    return _core().compute(view.left, view.right, now.monotonic_ns)


def _core() -> StereoCore:
    return StereoCore(
        MatchSettings(matcher=MatcherName.TANDEM, disparities=96),
        Rectifier(small_scene().rig),
        wanted=DepthWanted(search_from_m=0.25),
    )
