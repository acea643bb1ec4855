"""How well a rig is known, in rig.yaml.

For people and other programs: sigma_M1 and sigma_M2 (fx fy cx cy, px), sigma_D1 and sigma_D2 (coefficients), sigma_R (a small turn of the
right camera about its own axes, rad), sigma_T (m), sigma_baseline (m): standard uncertainties, 0 for what was not estimated. This
program reads only `covariance` (30 x 30), from which they follow: of fx fy cx cy and eight coefficients of the left camera, the same
of the right one, the small turn, the translation. Without it nothing is known.
"""

from collections.abc import Callable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import RIG_PARAMETERS, Rig

Problem = Callable[[str, str, str], DataError]
"""Makes the error of a key, from what is wrong with it and the remedy."""

_REMEDY: Final = "calibrate again, or remove it"
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
        raise problem("covariance", f"is no matrix of {size}x{size}", _REMEDY)
    matrix = np.asarray(values, np.float64)
    scale = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
    is_even = np.isfinite(matrix).all() and (np.abs(matrix - matrix.T) <= _ASYMMETRY * scale).all()
    # Of a covariance no entry exceeds what its two variances allow.
    if not is_even or (np.diag(matrix) < 0).any() or (np.abs(matrix) > scale * (1 + _ASYMMETRY)).any():
        raise problem("covariance", "is no covariance", _REMEDY)
    return matrix
