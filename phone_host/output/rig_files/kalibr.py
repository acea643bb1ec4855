"""Kalibr's camchain, one YAML file for all cameras of a chain, and EuRoC's sensor.yaml, one for each camera. Pure.

camchain: cam0, cam1, ...: camera_model, intrinsics [fu, fv, pu, pv], distortion_model, distortion_coeffs, resolution [width, height],
and from cam1 on T_cn_cnm1, which takes points of the camera before to this one's axes, m. What else it holds (rostopic,
cam_overlaps, T_cam_imu, timeshift_cam_imu) is not used.
sensor.yaml, in folders cam0 and cam1: sensor_type, T_BS (a point p of the camera's axes is T_BS p in the body's, m), rate_hz, resolution,
camera_model, intrinsics, distortion_model, distortion_coefficients.
Source: https://github.com/ethz-asl/kalibr/wiki/yaml-formats; M. Burri et al., "The EuRoC micro aerial vehicle datasets", 2016, and its files.
"""

import numpy as np

from phone_host.model import Rig
from phone_host.output.rig_files.lenses import EUROC_LENSES, KALIBR_LENSES, lens_name, lens_of, padded_coefficients
from phone_host.output.rig_files.stated import StatedCamera, StatedRig, rigid_of, stated_of
from phone_host.output.rig_files.texts import RigText, flow, matrix_map, rigid
from phone_host.output.rig_files.tree import Node

_POSE = "T_cn_cnm1"


def is_kalibr(node: Node) -> bool:
    """Return whether a file holds a chain of cameras."""
    return node.has("cam0") and node.child("cam0").has("intrinsics")


def read_kalibr(node: Node) -> StatedRig:
    """Read the first two cameras of a camchain.

    Raises:
        DataError: a key is missing or not valid; names file and key.
    """
    pose = node.child("cam1").child(_POSE)
    rotation, translation = rigid_of(pose)
    notes = ("it has more than two cameras: cam0 and cam1 are taken",) if node.has("cam2") else ()
    left, right = (_camera(node.child(name)) for name in ("cam0", "cam1"))
    return StatedRig(left, right, rotation, translation, f"{pose.file}: {pose.key}", notes)


def _camera(node: Node) -> StatedCamera:
    model = node.child("camera_model")
    if model.word() != "pinhole":
        raise model.problem(f"is {model.word()!r}", "read is pinhole; calibrate with --models pinhole-radtan")
    width_px, height_px = node.child("resolution").size_px()
    fx, fy, cx, cy = node.child("intrinsics").numbers(4)
    coefficients = node.child("distortion_coeffs") if node.has("distortion_coeffs") else Node(node.file, node.key, [])
    lens, values = lens_of(node.child("distortion_model"), coefficients, KALIBR_LENSES)
    return StatedCamera(f"{node.file}: {node.key}", width_px, height_px, (fx, fy), (cx, cy), lens, values)


def kalibr_texts(rig: Rig) -> tuple[RigText, ...]:
    """Write a camchain.

    Raises:
        DataError: Kalibr has no model for a lens.
    """
    stated = stated_of(rig, "the rig")
    lines = []
    for number, camera in enumerate((stated.left, stated.right)):
        lens = lens_name(camera, KALIBR_LENSES, "kalibr")
        lines += [f"cam{number}:", f"  cam_overlaps: [{1 - number}]", "  camera_model: pinhole"]
        lines += [f"  distortion_coeffs: {flow(padded_coefficients(camera, 4))}", f"  distortion_model: {lens.name}"]
        lines += [f"  intrinsics: {flow((*camera.focal_px, *camera.centre_px))}"]
        lines += [f"  resolution: [{camera.width_px}, {camera.height_px}]", f"  rostopic: /cam{number}/image_raw"]
        if number:
            rows = rigid(stated.R_right_left, stated.t_right_left)
            lines += [f"  {_POSE}:", *(f"  - {flow(row)}" for row in rows)]
    return (RigText("camchain.yaml", "\n".join(lines) + "\n"),)


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
        left=_euroc_camera(left),
        right=_euroc_camera(right),
        R_right_left=right_turn.T @ left_turn,
        t_right_left=right_turn.T @ (left_at - right_at),
        name=f"{right.file}: T_BS",
    )


def _euroc_camera(node: Node) -> StatedCamera:
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
