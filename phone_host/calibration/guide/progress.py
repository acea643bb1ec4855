"""How a calibration grows: its verdict after some views, and what each wanted view would add. Pure."""

from dataclasses import dataclass
from typing import Final

from phone_host.calibration.guide.wants import ORDER, Want, spot_of
from phone_host.calibration.solve.next_view import DEPTH_M, DEPTHS_M, after_one_m
from phone_host.calibration.solve.result import Calibration
from phone_host.calibration.target.corners import Board
from phone_host.model import Verdict

LEAST_STATED: Final = 5
"""Fewer views do not show how much they contradict each other (`bundle`): what a rig of them states is too good, and is not told."""


@dataclass(frozen=True, slots=True)
class Taught:
    """What one more view would bring.

    Attributes:
        want: the view.
        after_m: standard uncertainty of depth at 1 m that it would leave, m; NaN: one of the cameras would not see it.
    """

    want: Want
    after_m: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Progress:
    """What some views give.

    Attributes:
        views: how many.
        calibration: the rig; None: there is none, for the reason that `remedy` names.
        verdict: of it.
        remedy: what would mend it; empty: nothing is to be mended.
        is_hopeless: whether no further view mends it: a camera is turned, mirrored or on the wrong side.
        taught: what each kind of view would add.
    """

    views: int
    calibration: Calibration | None
    verdict: Verdict
    remedy: str
    is_hopeless: bool = False
    taught: tuple[Taught, ...] = ()

    @property
    def is_stated(self) -> bool:
        """Whether its figures and verdict may be told; why there is no rig is told at once."""
        return self.calibration is None or len(self.calibration.used) >= LEAST_STATED

    @property
    def depth_error_m(self) -> float:
        """Standard uncertainty of depth at 1 m, m; NaN: not known."""
        if self.calibration is None or not self.calibration.depths:
            return float("nan")
        return self.calibration.depths[DEPTHS_M.index(DEPTH_M)][1]

    def after_m(self, want: Want) -> float:
        """Return the same after one more view, m; NaN: not known."""
        return next((each.after_m for each in self.taught if each.want is want), float("nan"))


def lessons(calibration: Calibration, board: Board) -> tuple[Taught, ...]:
    """Return what each kind of view would add to a calibration."""
    if calibration.rectification is None:
        return ()
    points_m = board.points_m()
    return tuple(
        Taught(want, after_one_m(calibration.rig, calibration.rectification, points_m, spot_of(want))) for want in ORDER
    )
