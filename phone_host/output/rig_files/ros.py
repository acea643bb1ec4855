"""ROS camera_info: one YAML file for each camera, as camera_calibration and camera_info_manager keep it. Pure.

Keys: image_width, image_height, camera_name, camera_matrix (K), distortion_model, distortion_coefficients (D),
rectification_matrix (R), projection_matrix (P). What `ros2 topic echo` prints of the message (width, height, k, d, r, p) is
read, too, with its binning and its region of interest: K and P are those of the full image, the pictures that a driver
publishes show the region, binned. A matrix whose first number is 0 means that the camera is not calibrated. The message holds no relative pose; it follows from the rectification: with P = K' [I | t'],

    p_rectified = R_left p_left,  p_rectified + t'_right = R_right p_right,

so R_right_left = R_right^T R_left and t = R_right^T t'. Metres.
Source: sensor_msgs/msg/CameraInfo; http://wiki.ros.org/image_pipeline/CameraInfo.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import Lens, Rectification, Rig
from phone_host.output.rig_files.lenses import ROS_LENSES, lens_name, lens_of, padded_coefficients
from phone_host.output.rig_files.stated import StatedCamera, StatedRig, rotation_of, stated_of
from phone_host.output.rig_files.texts import RigText, flow, matrix_map
from phone_host.output.rig_files.tree import Node

_SAME: Final = 1e-3
"""By how many px the two projections may differ where rectified cameras are alike; files hold five digits."""

_NAMES: Final = ("left.yaml", "right.yaml")
_LEAST_COUNT: Final = {Lens.PINHOLE: 5, Lens.RATIONAL: 8, Lens.FISHEYE: 4}


def is_ros(node: Node) -> bool:
    """Return whether a file has the keys of a camera_info."""
    return (node.has("camera_matrix") and node.has("projection_matrix")) or (
        any(node.has(key) for key in ("K", "k"))
        and any(node.has(key) for key in ("P", "p"))
        and isinstance(node.tree, dict)
        and "distortion_model" in node.tree  # it may be empty: no distortion
    )


def read_ros(left: Node, right: Node) -> StatedRig:
    """Read two camera_info files.

    Raises:
        DataError: a key is missing or not valid; names file and key.
    """
    cameras = _camera(left), _camera(right)
    (turn_left, shift_left), (turn_right, shift_right) = (_rectified(node) for node in (left, right))
    _require_alike(left, right)
    shift = shift_right - shift_left
    if not shift.any():
        raise right.first_of("projection_matrix", "P", "p").problem(
            "has no baseline in its last column",
            "calibrate both as one stereo pair: camera_calibration does with --approximate",
        )
    return StatedRig(
        left=cameras[0],
        right=cameras[1],
        R_right_left=turn_right.T @ turn_left,
        t_right_left=turn_right.T @ shift,
        name=f"{right.file}: projection_matrix",
        notes=tuple(
            f"{node.file} publishes a part of its image or bins it: the pictures must be {camera.width_px}x{camera.height_px} px"
            for node, camera in zip((left, right), cameras, strict=True)
            if _published(node) != _Published(*_full_size_px(node))
        ),
    )


@dataclass(frozen=True, slots=True)
class _Published:
    """The part of the full image that a driver publishes, px of the full image, and how many of these px make one."""

    width_px: int
    height_px: int
    x_px: int = 0
    y_px: int = 0
    binning_x: int = 1
    binning_y: int = 1


def _full_size_px(node: Node) -> tuple[int, int]:
    return node.first_of("image_width", "width").whole(), node.first_of("image_height", "height").whole()


def _published(node: Node) -> _Published:
    """Read binning and region of interest; 0 stands for "all" in both."""
    width_px, height_px = _full_size_px(node)
    binning = [max(_count(node, key), 1) for key in ("binning_x", "binning_y")]
    if not node.has("roi"):
        return _Published(width_px, height_px, binning_x=binning[0], binning_y=binning[1])
    roi = node.child("roi")
    x, y, width, height = (_count(roi, key) for key in ("x_offset", "y_offset", "width", "height"))
    part = _Published(width or width_px - x, height or height_px - y, x, y, *binning)
    if not (0 < part.width_px <= width_px - x and 0 < part.height_px <= height_px - y):
        raise roi.problem("reaches out of the image", f"the image has {width_px}x{height_px} px")
    return part


def _count(node: Node, key: str) -> int:
    """Read a whole number that may be 0; it is 0 where the key is missing."""
    if not node.has(key):
        return 0
    value = node.child(key).number()
    return 0 if value == 0 else node.child(key).whole()


def _camera(node: Node) -> StatedCamera:
    matrix_node = node.first_of("camera_matrix", "K", "k")
    matrix = matrix_node.matrix(3, 3)
    if not matrix.any():
        raise matrix_node.problem("is all 0: the camera is not calibrated", "calibrate it, then write its file again")
    if matrix[0, 1] or matrix[1, 0] or not np.array_equal(matrix[2], [0, 0, 1]):
        raise matrix_node.problem("is no camera matrix", "it must be fx 0 cx 0 fy cy 0 0 1")
    model = (
        node.child("distortion_model") if node.has("distortion_model") else Node(node.file, "distortion_model", "none")
    )
    lens, coefficients = lens_of(model, _coefficients(node), ROS_LENSES)
    part = _published(node)
    # As ROS' image_geometry has it (PinholeCameraModel::fromCameraInfo): first the region, then the binning.
    return StatedCamera(
        name=node.file,
        width_px=part.width_px // part.binning_x,
        height_px=part.height_px // part.binning_y,
        focal_px=(float(matrix[0, 0]) / part.binning_x, float(matrix[1, 1]) / part.binning_y),
        centre_px=(
            (float(matrix[0, 2]) - part.x_px) / part.binning_x,
            (float(matrix[1, 2]) - part.y_px) / part.binning_y,
        ),
        lens=lens,
        coefficients=coefficients,
    )


def _coefficients(node: Node) -> Node:
    names = ("distortion_coefficients", "D", "d")
    is_empty = isinstance(node.tree, dict) and any(node.tree.get(name) in ([], "") for name in names)
    return Node(node.file, "d", []) if is_empty else node.first_of(*names)


def _rectified(node: Node) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rotation to the rectified axes, and the shift of its projection, m."""
    turn_node = node.first_of("rectification_matrix", "R", "r")
    matrix = turn_node.matrix(3, 3)
    projection_node = node.first_of("projection_matrix", "P", "p")
    projection = projection_node.matrix(3, 4)
    for each, values in ((turn_node, matrix), (projection_node, projection)):
        if not values.any():
            raise each.problem(
                "is all 0: the camera is not rectified",
                "calibrate both cameras as one stereo pair, then write the file again",
            )
    turn = rotation_of(turn_node, matrix)
    focal = projection[0, 0], projection[1, 1]
    if not min(focal) > 0 or not np.array_equal(projection[2], [0, 0, 1, 0]) or projection[0, 1] or projection[1, 0]:
        raise projection_node.problem(
            "is no projection", "it must be fx 0 cx t 0 fy cy 0 0 0 1 0; a stereo calibration fills it"
        )
    return turn, np.array([projection[0, 3] / focal[0], projection[1, 3] / focal[1], 0.0])


def _require_alike(left: Node, right: Node) -> None:
    """Check that both files are halves of one stereo calibration: rectified cameras share focal lengths and rows."""
    projections = [node.first_of("projection_matrix", "P", "p").matrix(3, 4) for node in (left, right)]
    for what, at in (("fx", (0, 0)), ("fy", (1, 1)), ("cy", (1, 2))):
        a, b = (float(projection[at]) for projection in projections)
        if abs(a - b) > _SAME:
            node = right.first_of("projection_matrix", "P", "p")
            raise node.problem(
                f"has another {what} than {left.file} ({b:g} and {a:g} px)",
                "give the two files of one stereo calibration",
            )


def ros_texts(rig: Rig, rectification: Rectification) -> tuple[RigText, ...]:
    """Write two camera_info files.

    ROS rectifies to images of the cameras' own size, this program to the window that both cameras fill. So the
    principal point is moved until that window lies in the middle of the left camera's image.

    Raises:
        DataError: the cameras stand one above the other, which ROS has no message for.
    """
    if rectification.epipolar.is_vertical:
        raise DataError(
            "ros has no rectification of cameras that stand one above the other", "export it as opencv or kalibr"
        )
    aside = np.zeros((3, 4))
    aside[0, 2] = (rig.left.width_px - rectification.width_px) / 2
    aside[1, 2] = (rig.left.height_px - rectification.height_px) / 2
    stated = stated_of(rig, "the rig")
    made = []
    for name, camera, turn, projection in (
        (_NAMES[0], stated.left, rectification.R_left, rectification.P_left),
        (_NAMES[1], stated.right, rectification.R_right, rectification.P_right),
    ):
        made.append(RigText(name, _camera_text(name.removesuffix(".yaml"), camera, turn, projection + aside)))
    return tuple(made)


def _camera_text(name: str, camera: StatedCamera, turn: NDArray[np.float64], projection: NDArray[np.float64]) -> str:
    lens = lens_name(camera, ROS_LENSES, "ros")
    # plumb_bob is written with 5 coefficients (some readers take no 4), rational_polynomial with as few as hold all.
    count = next(count for count in lens.counts if count >= max(len(camera.coefficients), _LEAST_COUNT[camera.lens]))
    coefficients = padded_coefficients(camera, count)
    matrix = np.array(
        [[camera.focal_px[0], 0, camera.centre_px[0]], [0, camera.focal_px[1], camera.centre_px[1]], [0, 0, 1]]
    )
    return (
        f"image_width: {camera.width_px}\nimage_height: {camera.height_px}\ncamera_name: {name}\n"
        f"camera_matrix:\n{matrix_map(matrix, '  ')}"
        f"distortion_model: {lens.name}\n"
        f"distortion_coefficients:\n  rows: 1\n  cols: {count}\n  data: {flow(coefficients)}\n"
        f"rectification_matrix:\n{matrix_map(turn, '  ')}"
        f"projection_matrix:\n{matrix_map(projection, '  ')}"
    )
