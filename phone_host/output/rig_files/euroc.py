"""EuRoC's sensor.yaml: one file for each camera, in folders cam0 and cam1. Pure.

Keys: sensor_type, T_BS (a point p of the camera's axes is T_BS p in the body's, m), rate_hz, resolution [width, height],
camera_model, intrinsics [fu, fv, cu, cv], distortion_model, distortion_coefficients.
Source: M. Burri et al., "The EuRoC micro aerial vehicle datasets", 2016, and the files themselves.
"""

import numpy as np

from phone_host.model import Rig
from phone_host.output.rig_files.lenses import EUROC_LENSES, lens_name, lens_of, padded_coefficients
from phone_host.output.rig_files.stated import StatedCamera, StatedRig, rigid_of, stated_of
from phone_host.output.rig_files.texts import RigText, flow, matrix_map, rigid
from phone_host.output.rig_files.tree import Node


def is_euroc(node: Node) -> bool:
    """Return whether a file has the keys of a camera's sensor.yaml."""
    return node.has("T_BS") and node.has("intrinsics")


def read_euroc(left: Node, right: Node) -> StatedRig:
    """Read the sensor.yaml of two cameras of one body.

    Raises:
        DataError: a key is missing or not valid; names file and key.
    """
    (left_turn, left_at), (right_turn, right_at) = (rigid_of(node.child("T_BS")) for node in (left, right))
    return StatedRig(
        left=_camera(left),
        right=_camera(right),
        R_right_left=right_turn.T @ left_turn,
        t_right_left=right_turn.T @ (left_at - right_at),
        name=f"{right.file}: T_BS",
    )


def _camera(node: Node) -> StatedCamera:
    model = node.child("camera_model")
    if model.word() != "pinhole":
        raise model.problem(f"is {model.word()!r}", "read is pinhole")
    width_px, height_px = node.child("resolution").size_px()
    fx, fy, cx, cy = node.child("intrinsics").numbers(4)
    lens, values = lens_of(node.child("distortion_model"), node.child("distortion_coefficients"), EUROC_LENSES)
    return StatedCamera(node.file, width_px, height_px, (fx, fy), (cx, cy), lens, values)


def euroc_texts(rig: Rig) -> tuple[RigText, ...]:
    """Write a sensor.yaml for each camera; the body's axes are the left camera's.

    Raises:
        DataError: EuRoC has no model for a lens.
    """
    stated = stated_of(rig, "the rig")
    back = stated.R_right_left.T
    poses = (np.eye(4), rigid(back, -back @ stated.t_right_left))
    made = []
    for number, (camera, pose) in enumerate(zip((stated.left, stated.right), poses, strict=True)):
        lens = lens_name(camera, EUROC_LENSES, "euroc")
        text = (
            f"%YAML:1.0\nsensor_type: camera\ncomment: cam{number}\nT_BS:\n{matrix_map(pose, '  ')}"
            f"resolution: [{camera.width_px}, {camera.height_px}]\ncamera_model: pinhole\n"
            f"intrinsics: {flow((*camera.focal_px, *camera.centre_px))}\n"
            f"distortion_model: {lens.name}\ndistortion_coefficients: {flow(padded_coefficients(camera, 4))}\n"
        )
        made.append(RigText(f"cam{number}/sensor.yaml", text))
    return tuple(made)
