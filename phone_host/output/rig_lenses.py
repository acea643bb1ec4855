"""The lenses in rig.yaml: lens1 and lens2 say what D1 and D2 mean."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import CameraModel, Lens

Problem = Callable[[str, str, str], DataError]
"""Makes the error of a key, from what is wrong with it and the remedy."""

_COUNTS: Final = {Lens.PINHOLE: (4, 5), Lens.RATIONAL: (8, 12, 14), Lens.FISHEYE: (4,)}
"""Numbers of coefficients, as OpenCV defines them."""


def lens_of(model: CameraModel) -> Lens:
    """Return a camera's lens; with eight or more coefficients a pinhole is a rational one."""
    return usual_lens(model.distortion.size) if model.lens is Lens.PINHOLE else model.lens


def usual_lens(count: int) -> Lens:
    """Return what so many coefficients mean in a file of format 1, which does not name its lenses."""
    return Lens.RATIONAL if count > max(_COUNTS[Lens.PINHOLE]) else Lens.PINHOLE


def known_lens(name: str, key: str, problem: Problem) -> Lens:
    """Return the lens of a name.

    Raises:
        DataError: it is none of ours; nothing is guessed.
    """
    if name not in {each.value for each in Lens}:
        known = ", ".join(each.value for each in Lens)
        raise problem(key, f"is {name!r}", f"this program knows {known}; update tandemscan, or calibrate again")
    return Lens(name)


def require_count(distortion: NDArray[np.float64], lens: Lens, key: str, problem: Problem) -> None:
    """Check that a lens has as many coefficients as its formula takes.

    Raises:
        DataError: it has others.
    """
    if min(distortion.shape) != 1 or distortion.size not in _COUNTS[lens]:
        counts = " or ".join(map(str, _COUNTS[lens]))
        raise problem(key, f"has {distortion.size} values", f"a {lens.value} lens has {counts} coefficients")
