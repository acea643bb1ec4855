"""How freely a lens may bend while a camera is calibrated: which of its parameters are estimated. Pure."""

from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.lens import PARAMETERS
from phone_host.model import Lens


class Bend(Enum):
    """Which coefficients are estimated, the simplest first.

    Attributes:
        USUAL: k1 k2 p1 p2, as the lenses of webcams and phones need.
        WIDE: k3 as well. Without it, a wide lens's views of the image's corners look like wrong corners.
        RATIONAL: k4 k5 k6 as well.
        FISHEYE: k1 k2 k3 k4 of the angle.
    """

    USUAL = "usual"
    WIDE = "wide"
    RATIONAL = "rational"
    FISHEYE = "fisheye"

    @property
    def lens(self) -> Lens:
        """The formula that these coefficients belong to."""
        return {Bend.RATIONAL: Lens.RATIONAL, Bend.FISHEYE: Lens.FISHEYE}.get(self, Lens.PINHOLE)

    @property
    def terms(self) -> int:
        """The number of coefficients that are estimated."""
        return _TERMS[self]

    def free(self) -> NDArray[np.bool_]:
        """Return (12,) which parameters of the camera are estimated, in the order of `geometry.lens`."""
        return np.arange(PARAMETERS) < 4 + self.terms


_TERMS: Final = {Bend.USUAL: 4, Bend.WIDE: 5, Bend.RATIONAL: 8, Bend.FISHEYE: 4}
