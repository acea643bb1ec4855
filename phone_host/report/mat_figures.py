"""What a mat told a scan: where it was seen, and whether it was printed to scale. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.diagnostic import Diagnostic
from phone_host.scan.mat import Mat
from phone_host.scan.mat_pose import MatSaid

_RIG_SIGMA: Final = 0.002
"""Of the rig's baseline and of a ruler on the print, as shares: a good calibration, and 0.2 mm on ten centimetres."""

_SIGMAS: Final = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MatFigures:
    """A mat in numbers.

    Attributes:
        name: as `--mat` takes it.
        pairs: that show it.
        corners: that it has.
        seen: corners seen in the left and the right image, median of these pairs.
        sigma_m: standard deviation of where the object stands, m, median.
        square_m: side of a square as its name says, m.
        measured_m: as the rig measures it, m.
        measured_sigma_m: its standard deviation, the rig's own included, m.
    """

    name: str
    pairs: int
    corners: int
    seen: tuple[float, float]
    sigma_m: float
    square_m: float
    measured_m: float
    measured_sigma_m: float

    @property
    def is_to_scale(self) -> bool:
        """Whether what the rig measures agrees with the mat's name."""
        return abs(self.measured_m - self.square_m) <= _SIGMAS * self.measured_sigma_m

    @property
    def remarks(self) -> tuple[Diagnostic, ...]:
        """What must be said of it."""
        if self.is_to_scale:
            return ()
        named, measured = (f"{length * 1e3:.4g} mm" for length in (self.square_m, self.measured_m))
        return (
            Diagnostic(
                f"the mat's squares are {measured} long as the rig measures them, and {named} by its name; the model has the rig's metre",
                "measure ten squares with a ruler: if the rig is right, give --mat that side or print at 100 %, else calibrate again",
            ),
        )


def mat_figures(mat: Mat, told: Sequence[MatSaid]) -> MatFigures:
    """Sum up what a mat told."""
    scale, square_m = told[-1].scale, mat.board.square_m
    left, right = np.median([each.seen for each in told], axis=0).tolist()
    return MatFigures(
        name=mat.name,
        pairs=len(told),
        corners=mat.board.columns * mat.board.rows,
        seen=(left, right),
        sigma_m=float(np.median([each.sigma_m for each in told])),
        square_m=square_m,
        measured_m=scale.value * square_m,
        measured_sigma_m=math.hypot(scale.sigma, _RIG_SIGMA) * square_m,
    )
