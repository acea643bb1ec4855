"""How numbers, lists and matrices are written into files of other programs. Pure."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class RigText:
    """One file of an exported calibration."""

    name: str
    text: str


def number(value: float) -> str:
    """Return a number with all of its digits, and with a decimal point."""
    return repr(float(value))


def flow(values: Iterable[float]) -> str:
    """Return numbers as a YAML list in brackets."""
    return f"[{', '.join(number(value) for value in values)}]"


def matrix_map(matrix: NDArray[np.float64], indent: str) -> str:
    """Return a matrix as a YAML map of rows, cols and data, each on a line of its own."""
    rows, columns = matrix.shape
    return f"{indent}rows: {rows}\n{indent}cols: {columns}\n{indent}data: {flow(matrix.ravel())}\n"


def rigid(rotation: NDArray[np.float64], translation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a (4, 4) float64 matrix of a rotation (3, 3) and a translation (3,)."""
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = rotation, translation
    return whole
