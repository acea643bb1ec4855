"""What rig.yaml says beside the rig: from which views it was computed (the map `views`, to which a later calibration can add), and how well it is known.

It holds board (as `--board` names it; in format 2 it may be absent: a chessboard), board_columns and board_rows (inner corners), square (m), names (one text
per pair), left and right (corners, px, one row per pair: x y x y ..., .Nan where one is not seen). The corners are as they were seen, in the order in which
they were taken, also where a drift was taken out of them for the rig (format 2: without the drift). A rig without the map cannot be added to.

How well the rig is known, for people and other programs: sigma_M1 and sigma_M2 (fx fy cx cy, px), sigma_D1 and sigma_D2 (coefficients), sigma_R (a small turn
of the right camera about its own axes, rad), sigma_T (m), sigma_baseline (m): standard uncertainties, 0 for what was not estimated. This program reads only
`covariance` (30 x 30), from which they follow: of fx fy cx cy and eight coefficients of the left camera, the same of the right one, the small turn, the
translation. Without it nothing is known.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import RIG_PARAMETERS, Rig

Problem = Callable[[str, str, str], DataError]
"""Makes the error of a key, from what is wrong with it and the remedy."""

KEY: Final = "views"
_REMEDY: Final = "calibrate again from all pictures"
_MOST_CORNERS: Final = 10_000
_MOST_VIEWS: Final = 1000


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RigViews:
    """What a rig was computed from.

    Attributes:
        columns: inner corners of the board in a row.
        rows: inner corners in a column.
        square_m: side of a square, m.
        names: of V pairs.
        left_px: (V, N, 2) corners; NaN where one is not seen.
        right_px: (V, N, 2), in the same order.
        board: the board as `--board` names it, with its marks; empty: a chessboard.
    """

    columns: int
    rows: int
    square_m: float
    names: tuple[str, ...]
    left_px: NDArray[np.float64]
    right_px: NDArray[np.float64]
    board: str = ""


def write_views(storage: cv2.FileStorage, views: RigViews) -> None:
    """Write the views."""
    storage.startWriteStruct(KEY, cv2.FileNode_MAP)
    storage.write("board", views.board or f"{views.columns}x{views.rows}")
    storage.write("board_columns", views.columns)
    storage.write("board_rows", views.rows)
    storage.write("square", views.square_m)
    storage.startWriteStruct("names", cv2.FileNode_SEQ)
    for name in views.names:
        storage.write("", name)
    storage.endWriteStruct()
    # float32: a ten-thousandth of a pixel, half the digits
    storage.write("left", views.left_px.reshape(len(views.names), -1).astype(np.float32))
    storage.write("right", views.right_px.reshape(len(views.names), -1).astype(np.float32))
    storage.endWriteStruct()


def read_views(storage: cv2.FileStorage, problem: Problem) -> RigViews | None:
    """Read the views, and check them: the views; None if the file has none.

    Raises:
        DataError: they are not valid.
    """
    node = storage.getNode(KEY)
    if node.empty():
        return None
    if not node.isMap():
        raise problem(KEY, "is no map", _REMEDY)
    counts = [_whole(node, key, problem) for key in ("board_columns", "board_rows")]
    square = node.getNode("square")
    square_m = square.real() if square.isReal() or square.isInt() else np.nan
    if not 0 < square_m < 10:
        raise problem(f"{KEY}.square", "is no length", _REMEDY)
    listed = node.getNode("names")
    names = tuple(listed.at(i).string() for i in range(listed.size())) if listed.isSeq() else ()
    if not 0 < len(names) <= _MOST_VIEWS:
        raise problem(f"{KEY}.names", "names no pairs", _REMEDY)
    corners = []
    for key in ("left", "right"):
        found = node.getNode(key)
        try:
            values = found.mat() if found.isMap() else None
        except cv2.error:  # its counts and its data differ
            values = None
        if values is None or values.shape != (len(names), 2 * counts[0] * counts[1]) or np.isinf(values).any():
            raise problem(f"{KEY}.{key}", "does not hold the corners of each pair", _REMEDY)
        corners.append(np.asarray(values, np.float64).reshape(len(names), -1, 2))
    return RigViews(
        columns=counts[0],
        rows=counts[1],
        square_m=float(square_m),
        names=names,
        left_px=corners[0],
        right_px=corners[1],
        board=node.getNode("board").string() if node.getNode("board").isString() else "",
    )


def _whole(node: cv2.FileNode, key: str, problem: Problem) -> int:
    found = node.getNode(key)
    value = found.real() if found.isInt() else np.nan
    if not 1 <= value <= _MOST_CORNERS:
        raise problem(f"{KEY}.{key}", "is no number of corners", _REMEDY)
    return int(value)


_REMEDY_OF_SIGMAS: Final = "calibrate again, or remove it"
_ASYMMETRY: Final = 1e-6
"""Files hold 16 digits; a matrix that differs from its mirror image by more than a millionth is none of ours."""


def write_sigmas(storage: cv2.FileStorage, rig: Rig) -> None:
    """Write how well a rig is known, if it is."""
    if not np.isfinite(rig.covariance).all():
        return
    sigmas = np.sqrt(np.diag(rig.covariance).clip(min=0))
    storage.writeComment("standard uncertainties: px, coefficients, rad, m; 0: not estimated")
    for key, at, count in (("1", 0, rig.left.distortion.size), ("2", 12, rig.right.distortion.size)):
        storage.write(f"sigma_M{key}", sigmas[at : at + 4].reshape(1, -1))
        storage.write(f"sigma_D{key}", sigmas[at + 4 : at + 4 + min(count, 8)].reshape(1, -1))
    storage.write("sigma_R", sigmas[24:27].reshape(3, 1))
    storage.write("sigma_T", sigmas[27:].reshape(3, 1))
    storage.write("sigma_baseline", rig.baseline_sigma_m)
    storage.write("covariance", rig.covariance)


def read_covariance(node: cv2.FileNode, problem: Problem) -> NDArray[np.float64]:
    """Read the covariance and check it: (30, 30); NaN if the file has none.

    Raises:
        DataError: it is none.
    """
    size = RIG_PARAMETERS
    if node.empty() or node.isNone():
        return np.full((size, size), np.nan)
    try:
        values = node.mat() if node.isMap() else None
    except cv2.error:
        values = None
    if values is None or values.shape != (size, size):
        raise problem("covariance", f"is no matrix of {size}x{size}", _REMEDY_OF_SIGMAS)
    matrix = np.asarray(values, np.float64)
    scale = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
    is_even = np.isfinite(matrix).all() and (np.abs(matrix - matrix.T) <= _ASYMMETRY * scale).all()
    # Of a covariance no entry exceeds what its two variances allow.
    if not is_even or (np.diag(matrix) < 0).any() or (np.abs(matrix) > scale * (1 + _ASYMMETRY)).any():
        raise problem("covariance", "is no covariance", _REMEDY_OF_SIGMAS)
    return matrix
