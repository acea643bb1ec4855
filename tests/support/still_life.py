"""A still life on a table, photographed by two unlike cameras on the way around it; and how far points lie off its surfaces."""

import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel, Rig
from phone_host.output.rig_yaml import write_rig
from phone_host.scene.scene import PHONE_LOOK, WEBCAM_LOOK
from phone_host.scene.scene_model import Body, Box, Plane, Pose, Scene, Sphere, Texture, rig_poses, rotation
from phone_host.scene.scene_render import render
from phone_host.stereo.rectify import rectify_rig

TABLE_Y_M = 0.22
BALL_M, BALL_RADIUS_M = np.array([0.09, TABLE_Y_M - 0.09, 0.75]), 0.09
CUBE_M, CUBE_SIDE_M = np.array([-0.11, TABLE_Y_M - 0.07, 0.80]), 0.14
MIDDLE_M = np.array([0.0, TABLE_Y_M - 0.08, 0.75])
UPRIGHT = (0.0, 1.0, 0.0)
CUBE_TURN = rotation(UPRIGHT, 0.5)
RED = Texture(seed=13, light_bgr=(0.16, 0.22, 0.80), dark_bgr=(0.06, 0.08, 0.45), longest_m=0.06)
BLUE = Texture(seed=14, light_bgr=(0.72, 0.46, 0.16), dark_bgr=(0.44, 0.20, 0.06), longest_m=0.06)
WOOD = Texture(seed=12, light_bgr=(0.24, 0.42, 0.64), dark_bgr=(0.12, 0.24, 0.42), longest_m=0.13)

Floats = NDArray[np.float64]


def small_rig() -> Rig:
    """A 400x300 webcam on the left; on the right, 80 mm away, a phone of 480x360 with another focal length, turned by 1.5 degrees."""
    left = CameraModel(
        width_px=400,
        height_px=300,
        matrix=np.array([[330.0, 0, 198], [0, 331, 152], [0, 0, 1]]),
        distortion=np.array([-0.2, 0.06, 0.0005, -0.0004, 0]),
    )
    right = CameraModel(
        width_px=480,
        height_px=360,
        matrix=np.array([[421.0, 0, 243], [0, 420, 178], [0, 0, 1]]),
        distortion=np.array([0.06, -0.12, -0.0005, 0.0007, 0]),
    )
    turn = rotation((0.3, 1.0, 0.45), math.radians(-1.5))
    return Rig(left=left, right=right, R_right_left=turn, t_right_left_m=-turn @ np.array([0.08, -0.003, -0.004]))


def still_life(ball_aside_m: float = 0.0) -> Scene:
    """A ball and a cube on a table.

    Args:
        ball_aside_m: by how much somebody has moved the ball, m.
    """
    x, y, z = BALL_M.tolist()
    cube: tuple[float, float, float] = tuple(CUBE_M.tolist())
    return Scene(
        (
            Body("table", Plane(), (0.0, TABLE_Y_M, 1.0), WOOD, rotation((1.0, 0.0, 0.0), math.radians(-90))),
            Body("ball", Sphere(BALL_RADIUS_M), (x + ball_aside_m, y, z), RED),
            Body("cube", Box((CUBE_SIDE_M,) * 3), cube, BLUE, CUBE_TURN),
        )
    )


def photographed(folder: Path, turns_deg: list[float], scenes: list[Scene]) -> Path:
    """Write rig.yaml, left/ and right/ with a JPEG of each view.

    Args:
        folder: where to.
        turns_deg: how far the rig has gone around the middle of the still life, at each view.
        scenes: what it sees there.

    Returns:
        The folder.
    """
    rig = small_rig()
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    sides = zip(("left", "right"), (rig.left, rig.right), rig_poses(rig), (WEBCAM_LOOK, PHONE_LOOK), strict=True)
    for name, model, pose, look in sides:
        (folder / name).mkdir(exist_ok=True)
        for number, (turn_deg, scene) in enumerate(zip(turns_deg, scenes, strict=True)):
            turn = rotation(UPRIGHT, math.radians(turn_deg))
            there = Pose(pose.R_camera_scene @ turn.T, turn @ (pose.centre_m - MIDDLE_M) + MIDDLE_M)
            picture = render(scene, model, there, look)
            cv2.imwrite(str(folder / name / f"{number:03d}.jpg"), picture, [cv2.IMWRITE_JPEG_QUALITY, 92])
    return folder


def left_axes(points_m: Floats) -> Floats:
    """Take points (N, 3), m, from the rectified left camera's axes at the first view to the scene's."""
    return np.asarray(points_m @ rectify_rig(small_rig()).R_left, np.float64)


def off_surfaces_m(points_m: Floats) -> dict[str, Floats]:
    """How far points (N, 3), m, in the scene's axes lie off the surface that is nearest to each, by its name; (N of it,) m."""
    beside = np.abs((points_m - CUBE_M) @ CUBE_TURN) - CUBE_SIDE_M / 2
    cube = np.linalg.norm(np.maximum(beside, 0), axis=1) + np.minimum(beside.max(axis=1), 0)
    off = {
        "table": points_m[:, 1] - TABLE_Y_M,
        "ball": np.linalg.norm(points_m - BALL_M, axis=1) - BALL_RADIUS_M,
        "cube": cube,
    }
    every = np.abs(list(off.values()))
    nearest = every.argmin(axis=0)
    return {name: every[number, nearest == number] for number, name in enumerate(off)}
