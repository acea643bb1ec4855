"""OpenCV's stereo calibrations: FileStorage YAML or XML, one file or two (cameras, relative pose). Pure.

OpenCV prescribes no keys. Read are those of its own sample stereo_calib.cpp (M1 D1 M2 D2 in intrinsics.yml, R T in
extrinsics.yml) and the usual other names. Neither sizes nor the unit of T have to be there: T is in the unit in which the
board's squares were given, which in the sample is squares.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.words import counted
from phone_host.model import Lens, Rectification, Rig
from phone_host.output.rig_files.stated import StatedCamera, StatedRig, rotation_of, stated_of
from phone_host.output.rig_files.texts import RigText, number
from phone_host.output.rig_files.tree import Node, Tree

_SIDES: Final = (("1", "left"), ("2", "right"))
_MATRIX: Final = (
    "M{n}",
    "K{n}",
    "cameraMatrix{n}",
    "camera_matrix_{n}",
    "camera_matrix{n}",
    "{side}_camera_matrix",
    "K_{side}",
)
_DISTORTION: Final = (
    "D{n}", "distCoeffs{n}", "dist_coeffs_{n}", "dist_coeffs{n}", "distortion_coefficients{n}",
    "{side}_distortion_coefficients", "D_{side}",
)  # fmt: skip
_ROTATION: Final = ("R", "rotation_matrix", "rotation")
_TRANSLATION: Final = ("T", "t", "translation_vector", "translation")
_NEEDED: Final = frozenset({"M1", "M2", "D1", "D2", "R", "T"})
_LENSES: Final = {4: Lens.PINHOLE, 5: Lens.PINHOLE, 8: Lens.RATIONAL, 12: Lens.RATIONAL, 14: Lens.RATIONAL}


def is_opencv(node: Node) -> bool:
    """Return whether a file has a key of a stereo calibration: a camera's matrix, or the relative pose."""
    matrices = [form.format(n=n, side=side) for n, side in _SIDES for form in _MATRIX]
    return any(node.has(key) for key in matrices) or (
        any(node.has(key) for key in _ROTATION) and any(node.has(key) for key in _TRANSLATION)
    )


def merged(nodes: tuple[Node, ...]) -> Node:
    """Return the keys of all files as those of one, for calibrations that are kept in two.

    Raises:
        DataError: two files have the same camera or the same pose; which is right is not to be guessed.
    """
    whole: dict[str, Tree] = {}
    for node in nodes:
        if isinstance(node.tree, dict):
            both = sorted(whole.keys() & node.tree.keys() & _NEEDED)
            other = next((key for key in both if whole[key] != node.tree[key]), "")
            if other:
                raise node.problem(f"has another {other} than {nodes[0].file}", "give the files of one calibration")
            whole |= node.tree
    return Node(" and ".join(node.file for node in nodes), "", whole)


def read_opencv(node: Node) -> StatedRig:
    """Read two cameras and their relative pose.

    Raises:
        DataError: a key is missing or not valid; names file and key.
    """
    left, right = (_camera(node, n, side) for n, side in _SIDES)
    turn = node.first_of(*_ROTATION)
    translation = node.first_of(*_TRANSLATION)
    if isinstance(tree := translation.tree, dict):
        rows = translation.child("rows").whole()
    else:
        rows = len(tree) if isinstance(tree, list) and tree and isinstance(tree[0], list) else 1
    shift = translation.matrix(*((3, 1) if rows == 3 else (1, 3))).reshape(3)
    return StatedRig(left, right, _rotation(turn), shift, f"{translation.file}: {translation.key}")


def _rotation(node: Node) -> NDArray[np.float64]:
    return rotation_of(node, node.matrix(3, 3))


def _camera(node: Node, n: str, side: str) -> StatedCamera:
    matrix_node = node.first_of(*(form.format(n=n, side=side) for form in _MATRIX))
    matrix = matrix_node.matrix(3, 3)
    if matrix[0, 1] or matrix[1, 0] or not np.array_equal(matrix[2], [0, 0, 1]):
        raise matrix_node.problem("is no camera matrix", "it must be fx 0 cx 0 fy cy 0 0 1")
    distortion = node.first_of(*(form.format(n=n, side=side) for form in _DISTORTION))
    values = distortion.values()
    lens = _LENSES.get(len(values))
    if lens is None:
        raise distortion.problem(
            f"has {counted(len(values), 'value')}", f"OpenCV's models have {', '.join(map(str, _LENSES))}"
        )
    if node.has("fisheye_model") and node.child("fisheye_model").word() in {"1", "true"}:
        lens = Lens.FISHEYE
    width_px, height_px = _size_px(node, n, side)
    return StatedCamera(
        name=f"{matrix_node.file}: {matrix_node.key}",
        width_px=width_px,
        height_px=height_px,
        focal_px=(float(matrix[0, 0]), float(matrix[1, 1])),
        centre_px=(float(matrix[0, 2]), float(matrix[1, 2])),
        lens=lens,
        coefficients=values,
    )


def _size_px(node: Node, n: str, side: str) -> tuple[int, int]:
    """Return the size under the usual names; 0, 0 if it is not there."""
    for form in ("{side}_image_", "image_", "image{n}_"):
        keys = [form.format(n=n, side=side) + what for what in ("width", "height")]
        if all(node.has(key) for key in keys):
            width_px, height_px = (node.child(key).whole() for key in keys)
            return width_px, height_px
    for form in ("imageSize{n}", "imageSize", "image_size", "size"):
        if node.has(form.format(n=n)):
            return node.child(form.format(n=n)).size_px()
    return 0, 0


def opencv_texts(rig: Rig, rectification: Rectification, *, as_xml: bool) -> tuple[RigText, ...]:
    """Write one FileStorage file with the keys of OpenCV's sample, and the sizes; T in metres.

    Raises:
        DataError: one lens is a fisheye and the other is not: the file has one word for both.
    """
    stated = stated_of(rig, "the rig")
    fisheyes = [camera.lens is Lens.FISHEYE for camera in (stated.left, stated.right)]
    if any(fisheyes) and not all(fisheyes):
        raise DataError("opencv cannot hold a rig with one fisheye lens", "export it as ros, kalibr or colmap")
    sizes = {
        **({"fisheye_model": 1} if all(fisheyes) else {}),
        "left_image_width": stated.left.width_px,
        "left_image_height": stated.left.height_px,
        "right_image_width": stated.right.width_px,
        "right_image_height": stated.right.height_px,
    }
    matrices = {
        "M1": rig.left.matrix,
        "D1": np.array([stated.left.coefficients]),
        "M2": rig.right.matrix,
        "D2": np.array([stated.right.coefficients]),
        "R": rig.R_right_left,
        "T": rig.t_right_left_m.reshape(3, 1),
        "R1": rectification.R_left,
        "R2": rectification.R_right,
        "P1": rectification.P_left,
        "P2": rectification.P_right,
        "Q": rectification.Q,
    }
    if as_xml:
        body = "".join(f"<{key}>{value}</{key}>\n" for key, value in sizes.items())
        body += "".join(_xml_matrix(key, matrix) for key, matrix in matrices.items())
        return (RigText("stereo.xml", f'<?xml version="1.0"?>\n<opencv_storage>\n{body}</opencv_storage>\n'),)
    body = "".join(f"{key}: {value}\n" for key, value in sizes.items())
    body += "".join(_yaml_matrix(key, matrix) for key, matrix in matrices.items())
    return (RigText("stereo.yml", f"%YAML:1.0\n---\n{body}"),)


def _yaml_matrix(key: str, matrix: NDArray[np.float64]) -> str:
    rows, columns = matrix.shape
    data = ", ".join(number(value) for value in matrix.ravel())
    return f"{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n"


def _xml_matrix(key: str, matrix: NDArray[np.float64]) -> str:
    rows, columns = matrix.shape
    data = " ".join(number(value) for value in matrix.ravel())
    return (
        f'<{key} type_id="opencv-matrix">\n  <rows>{rows}</rows>\n  <cols>{columns}</cols>\n  <dt>d</dt>\n'
        f"  <data>\n    {data}</data></{key}>\n"
    )
