"""A rig as a file states it, whatever its lenses are: what all readers give and all writers take. Pure."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.model import CameraModel, Lens, Rig
from phone_host.output.rig_files.tree import Node

Matrix = NDArray[np.float64]

_ROTATION_TOLERANCE: Final = 5e-4
"""A matrix written with four decimals has errors of half a unit of the last one, which leaves 2e-4 in R R^T. With three
decimals a rotation is off by up to 0.05 degrees, which costs a pixel: such files are refused."""

# As in rig.yaml.
_FOCAL_WIDTHS: Final = (0.05, 50.0)
_MOST_ASIDE: Final = 1.5
_BASELINE_M: Final = (1e-3, 10.0)


@dataclass(frozen=True, slots=True)
class StatedCamera:
    """One camera.

    Attributes:
        name: the words by which errors call it: file and key.
        width_px: image width, px; 0: not stated.
        height_px: image height, px; 0: not stated.
        focal_px: fx and fy, px.
        centre_px: principal point, px, where pixel centres are integers.
        lens: which model.
        coefficients: of that model.
    """

    name: str
    width_px: int
    height_px: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    lens: Lens
    coefficients: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class StatedRig:
    """Two cameras and their relative pose: a point p of the left camera's axes is R p + t in the right camera's.

    Attributes:
        left: of the left camera.
        right: of the right camera.
        R_right_left: (3, 3) float64.
        t_right_left: (3,) float64, in the file's unit.
        name: the words by which errors call the pose: file and key.
        notes: what was decided for the user while reading, a sentence each.
    """

    left: StatedCamera
    right: StatedCamera
    R_right_left: Matrix
    t_right_left: Matrix
    name: str
    notes: tuple[str, ...] = ()

    def exchanged(self) -> "StatedRig":
        """Return the same rig with its cameras exchanged."""
        back = self.R_right_left.T
        return StatedRig(self.right, self.left, back, -back @ self.t_right_left, self.name, self.notes)


def rotation_of(node: Node, matrix: Matrix) -> Matrix:
    """Return the rotation next to a matrix that a file rounded.

    Args:
        node: where it comes from, for errors.
        matrix: (3, 3).

    Raises:
        DataError: it is no rotation, or mirrors.
    """
    if not np.abs(matrix @ matrix.T - np.eye(3)).max() <= _ROTATION_TOLERANCE or np.linalg.det(matrix) < 0:
        raise node.problem("holds no rotation", "its three axes must have length 1, right angles and four decimals")
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(u @ vt, np.float64)


def rigid_of(node: Node) -> tuple[Matrix, Matrix]:
    """Read a 4x4 matrix of a rotation and a translation: (3, 3) rotation, (3,) translation in the file's unit.

    Raises:
        DataError: it is no such matrix.
    """
    matrix = node.matrix(4, 4)
    if not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise node.problem("has another last row than 0 0 0 1", "it must be a rotation and a translation")
    return rotation_of(node, matrix[:3, :3]), matrix[:3, 3]


def rig_of(stated: StatedRig, unit_m: float, sizes_px: tuple[tuple[int, int], tuple[int, int]] | None) -> Rig:
    """Make a rig of what a file states, and check what cannot be.

    Args:
        stated: as read.
        unit_m: what 1 of its translation is, m.
        sizes_px: width and height of the left and of the right image where the file does not state them; None: not known.

    Raises:
        DataError: a size is missing or contradicts the file, a number is one that no camera has, or rig.yaml cannot hold
            the lens; names file and key.
    """
    length_m = float(np.linalg.norm(stated.t_right_left)) * unit_m
    if not _BASELINE_M[0] <= length_m <= _BASELINE_M[1]:
        apart = f"{length_m * 1e3:g} mm" if 0 < length_m < 1 else f"{length_m:g} m"
        raise DataError(
            f"{stated.name} puts the cameras {apart} apart",
            "check which two cameras they are, and --unit: it says what 1 in the file is, such as 1mm; without it, 1 m",
        )
    left_px, right_px = sizes_px or (None, None)
    return Rig(
        left=_model(stated.left, left_px),
        right=_model(stated.right, right_px),
        R_right_left=stated.R_right_left,
        t_right_left_m=stated.t_right_left * unit_m,
    )


def _model(camera: StatedCamera, given_px: tuple[int, int] | None) -> CameraModel:
    size_px = (camera.width_px, camera.height_px)
    if size_px == (0, 0):
        if given_px is None:
            raise DataError(f"{camera.name} does not state the images' size", "add --size, such as --size 640x480")
        size_px = given_px
    elif given_px not in {None, size_px}:
        raise DataError(
            f"{camera.name} is for images of {size_text(size_px)} px, and --size says otherwise", "leave --size out"
        )
    for focal_px in camera.focal_px:
        if not _FOCAL_WIDTHS[0] <= focal_px / size_px[0] <= _FOCAL_WIDTHS[1]:
            said = f"{camera.name} has a focal length of {focal_px:g} px for images {size_px[0]} px wide"
            raise DataError(said, "give it in px, for images of this size")
    if any(abs(at - size / 2) > _MOST_ASIDE * size for at, size in zip(camera.centre_px, size_px, strict=True)):
        said = f"{camera.name} has its principal point at {camera.centre_px[0]:g},{camera.centre_px[1]:g} px"
        raise DataError(said, "give it in px: it lies near the image's middle")
    matrix = np.array(
        [[camera.focal_px[0], 0, camera.centre_px[0]], [0, camera.focal_px[1], camera.centre_px[1]], [0, 0, 1]],
        np.float64,
    )
    distortion = np.array(camera.coefficients, np.float64)
    return CameraModel(
        width_px=size_px[0], height_px=size_px[1], matrix=matrix, distortion=distortion, lens=camera.lens
    )


def stated_of(rig: Rig, file: str) -> StatedRig:
    """Return what a file would have to state for a rig."""
    left, right = (
        StatedCamera(
            name=f"the {side} camera of {file}",
            width_px=model.width_px,
            height_px=model.height_px,
            focal_px=(float(model.matrix[0, 0]), float(model.matrix[1, 1])),
            centre_px=(float(model.matrix[0, 2]), float(model.matrix[1, 2])),
            lens=_lens_of(model),
            coefficients=tuple(float(value) for value in _without_zeros(model.distortion)),
        )
        for side, model in (("left", rig.left), ("right", rig.right))
    )
    return StatedRig(left, right, rig.R_right_left, rig.t_right_left_m, file)


def _lens_of(model: CameraModel) -> Lens:
    """Return the plainest lens that has these coefficients."""
    if model.lens is Lens.FISHEYE:
        return Lens.FISHEYE
    return Lens.RATIONAL if model.distortion[5:].any() else Lens.PINHOLE


def _without_zeros(distortion: Matrix) -> Matrix:
    """Cut trailing zeros down to the shortest length that OpenCV knows and that loses nothing."""
    return next((padded(distortion, length) for length in (4, 5, 8, 12) if not distortion[length:].any()), distortion)


def padded(distortion: Matrix, length: int) -> Matrix:
    """Return coefficients with zeros added, or zeros cut, up to a length."""
    return np.concatenate([distortion, np.zeros(length)])[:length]


def baseline_of(stated: StatedRig) -> float:
    """Return the x of the right camera's centre in the left camera's axes, in the file's unit."""
    return float((-stated.R_right_left.T @ stated.t_right_left)[0])
