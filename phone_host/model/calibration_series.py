"""What a calibration's page shows: copied values of a series of board views and of the rig that came of it. No behaviour."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from phone_host.model.rig import Rectification, Rig, Verdict

Size = tuple[int, int]
"""Width and height, px."""

Floats = NDArray[np.float64]


def _none(*shape: int) -> Floats:
    return np.empty(shape)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SeenBoard:
    """The board in one image.

    Attributes:
        picture: the image, made small, as a JPEG file; empty: it is not at hand.
        corners_px: (N, 2) corners, px of the whole image; NaN where one is not seen; (0, 2): the board was not found.
        residuals_px: (N, 2) measured minus projected; (0, 2): the view is not used.
    """

    picture: bytes = b""
    corners_px: Floats = field(default_factory=lambda: _none(0, 2))
    residuals_px: Floats = field(default_factory=lambda: _none(0, 2))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BoardInSpace:
    """A board as a rig sees it in one view; NaN where fewer than twelve corners are seen by both cameras.

    Attributes:
        miss: by how much the two rays of a corner miss each other, in standard deviations; root mean square: 1 is noise.
        size: its size, as a share of the true one.
        size_sigma: standard deviation of that by the corners' noise.
        bows_m: (2,) how far its middle stands out from its ends along the rows and along the columns, m; positive: away from
            the cameras.
        bow_sigmas_m: (2,) standard deviations of these, m.
    """

    miss: float
    size: float
    size_sigma: float
    bows_m: Floats
    bow_sigmas_m: Floats

    @property
    def bow_m(self) -> tuple[float, float]:
        """The larger of both bows and its standard deviation, m; NaN: not known."""
        axis = int(abs(self.bows_m[1]) > abs(self.bows_m[0]))
        return float(self.bows_m[axis]), float(self.bow_sigmas_m[axis])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SeriesView:
    """One pair of images.

    Attributes:
        name: of the pair.
        left: what the left camera saw.
        right: what the right one saw.
        reason: why it is not used; empty: it is.
        detail: the reason in words, with numbers.
        outline_m: (4, 3) the board's outer corners in turn, in the left camera's axes, m; (0, 3): the view is not used.
        vertical_px: (M,) left minus right across the rows after rectification, px; empty: not known.
        as_seen_px: (M,) the same before a drift of the cameras was taken out of the corners.
        in_space: the board as the rig sees it; None: the view is not used.
    """

    name: str
    left: SeenBoard
    right: SeenBoard
    reason: str = ""
    detail: str = ""
    outline_m: Floats = field(default_factory=lambda: _none(0, 3))
    vertical_px: Floats = field(default_factory=lambda: _none(0))
    as_seen_px: Floats = field(default_factory=lambda: _none(0))
    in_space: BoardInSpace | None = None

    @property
    def is_used(self) -> bool:
        """Whether the rig was computed from it."""
        return not self.reason


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ViewTurns:
    """How the right camera stood in each view, against the rig.

    Attributes:
        names: of V views, in the order in which they were taken.
        turns_rad: (V, 3) about its own axes (x right, y down, z forward), rad.
        sigmas_rad: (V, 3) standard deviations by the corners' noise, rad.
    """

    names: tuple[str, ...]
    turns_rad: Floats
    sigmas_rad: Floats


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RectifiedView:
    """One pair after rectification, made small.

    Attributes:
        name: of the pair.
        left: JPEG file.
        right: JPEG file.
        size_px: of both, in the unit of the corners; the files may be smaller.
        left_px: (M, 2) corners that both cameras see, px.
        right_px: (M, 2) the same, right.
        is_vertical: whether rows are columns, because the cameras stand one above the other.
    """

    name: str
    left: bytes
    right: bytes
    size_px: Size
    left_px: Floats
    right_px: Floats
    is_vertical: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class LensTried:
    """One formula that was tried for a lens: what it is, and how it predicts views that it was not fitted to, px RMS."""

    words: str
    held_out_px: float
    is_chosen: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Up to where figures are good, and up to where usable.

    Attributes:
        good_px: of the 95th percentile of the vertical error, px.
        usable_px: likewise.
        good_share: of the uncertainties of baseline and depth, and of the squares' error, as a share.
        usable_share: likewise.
    """

    good_px: float
    usable_px: float
    good_share: float
    usable_share: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SeriesRig:
    """The rig that came of it, and its figures.

    Attributes:
        rig: the two cameras.
        rectification: of the rig; None: it cannot be rectified.
        vertical_px: (M,) absolute vertical error of every corner, px; NaN: not known.
        baseline_sigma_m: standard uncertainty of the baseline, m.
        square_m: the true side of a square, m.
        square_mean_m: mean of those on boards that were held out, m; NaN: not measured.
        square_sigma_m: their standard deviation, m.
        depths: depth and the standard uncertainty that the calibration leaves there, m.
        far_m: depth beyond which it is a guess, m; NaN: not known.
        limits: of the figures.
        tried: the formulas that were tried for the left and for the right lens.
        measured_m: the baseline as the user measured it, m; NaN: not given.
    """

    rig: Rig
    rectification: Rectification | None
    vertical_px: Floats
    baseline_sigma_m: float
    square_m: float
    square_mean_m: float
    square_sigma_m: float
    depths: tuple[tuple[float, float], ...]
    far_m: float
    limits: Limits
    tried: tuple[tuple[LensTried, ...], tuple[LensTried, ...]] = ((), ())
    measured_m: float = math.nan


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CalibrationSeries:
    """A series.

    Attributes:
        verdict: what the rig is good for.
        remedy: the one thing that helps most; empty when the verdict is good.
        problem: why there is no rig; empty: there is one.
        cause: the name of the mistake that the views tell; empty: they tell of none.
        cause_words: the mistake with its figures, in one sentence.
        board: the board in words.
        sizes_px: of the left and of the right images.
        views: all pairs, used or not, in the order in which they were taken.
        found: the rig; None: there is none.
        turns: how the cameras stood in each view; None: not known.
        rectified: one pair after rectification; None: not at hand.
        is_straightened: whether a drift of the cameras was taken out of the corners before the rig was computed.
        rig_file: name of the rig's file beside the page; empty: it was not written.
    """

    verdict: Verdict
    remedy: str
    board: str
    sizes_px: tuple[Size, Size]
    views: tuple[SeriesView, ...]
    problem: str = ""
    cause: str = ""
    cause_words: str = ""
    found: SeriesRig | None = None
    turns: ViewTurns | None = None
    rectified: RectifiedView | None = None
    is_straightened: bool = False
    rig_file: str = ""
