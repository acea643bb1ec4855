"""What came of a calibration, as report.json, the summary and the page tell it. Values only."""

import math
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

from common.diagnostic import Diagnostic
from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.calibration.guide.snapshot import GuideSnapshot
from phone_host.calibration.solve.verdict import Assessment, Calibration
from phone_host.calibration.target.board_views import BoardViews
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.marked import Charuco
from phone_host.calibration.target.pairs import Rejected
from phone_host.declared_settings import NEAR_M
from phone_host.model import Verdict
from phone_host.output.rig_files.imported import Imported, RigKind
from phone_host.stereo.depth_limits import DepthWanted, depth_limits, disparity_error_px
from phone_host.stereo.reproject import disparities_for_near
from phone_host.stereo.view_files import ViewFiles
from phone_host.stereo.working import chosen_scale


class Origin(Enum):
    """Who says how many corners the board has."""

    OPTION = "option"
    IMAGES = "images"
    EARLIER = "earlier calibration"


_SAID: Final = {
    Origin.OPTION: "as --board says",
    Origin.IMAGES: "as found in the images",
    Origin.EARLIER: "as in the earlier calibration",
}


@dataclass(frozen=True, slots=True)
class Known:
    """The board, and who said its size."""

    board: Board
    origin: Origin

    def as_line(self) -> str:
        """Return it for the summary."""
        marks = self.board.marks
        kind = "" if marks is None else "ChArUco board of " if isinstance(marks, Charuco) else "AprilGrid of "
        what = "inner corners" if marks is None else "corners"
        size = size_text((self.board.columns, self.board.rows))
        legacy = isinstance(marks, Charuco) and marks.is_legacy
        arrangement = ", marks arranged as by OpenCV before 4.6 and calib.io" if legacy else ""
        return f"board    {kind}{size} {what}, {_SAID[self.origin]}{arrangement}; squares of {self.board.square_m * 1e3:g} mm"


@dataclass(frozen=True, slots=True)
class Exported:
    """The files of another program that were written."""

    kind: RigKind
    files: tuple[Path, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A rig, and what is said of it.

    Attributes:
        found: the calibration.
        judgement: the verdict with its remedy.
        finding: what is wrong with the series; None: nothing.
        hint: what to do about a turned or mirrored side; empty: it is none.
        measured_m: the baseline as the user measured it, m; NaN: not given.
    """

    found: Calibration
    judgement: Assessment
    finding: Diagnostic | None = None
    hint: str = ""
    measured_m: float = math.nan

    @property
    def cause_words(self) -> str:
        """What is wrong with the series, in one sentence; empty: nothing."""
        return "" if self.finding is None else self.hint or self.finding.message

    @property
    def depth_limit_m(self) -> float:
        """The far limit that `stereo` uses with this rig if the user gives none, m; NaN if it cannot be rectified."""
        made = self.found.rectification
        if made is None:
            return math.nan
        along, across = (
            (made.height_px, made.width_px) if made.epipolar.is_vertical else (made.width_px, made.height_px)
        )
        scale = chosen_scale(along, across, disparities_for_near(made.geometry, NEAR_M, along))
        error_px = disparity_error_px(scale, self.found.rig.zero_sigma_px)
        return depth_limits(made.geometry, error_px, DepthWanted()).far_m


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CalibrationReport:
    """What came of pictures.

    Attributes:
        files: the pictures.
        views: what was found in them.
        known: the board.
        rejected: all pairs that are not used.
        result: the rig; or why there is none.
        page: where the page is.
        earlier_rig: the name that an earlier rig has now if it was not replaced; empty: there is none.
        exported: files of other programs.
        live: how the pictures were taken; None: by somebody else.
    """

    files: ViewFiles
    views: BoardViews
    known: Known
    rejected: tuple[Rejected, ...]
    result: Judged | DataError
    page: Path
    earlier_rig: str = ""
    exported: tuple[Exported, ...] = ()
    live: GuideSnapshot | None = None

    @property
    def verdict(self) -> Verdict:
        """The verdict; no rig is a rejected one."""
        return Verdict.REJECT if isinstance(self.result, DataError) else self.result.judgement.verdict

    @property
    def remedy(self) -> str:
        """What to do; empty: nothing."""
        return self.result.remedy if isinstance(self.result, DataError) else self.result.judgement.remedy


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ImportReport:
    """What came of a calibration of another program.

    Attributes:
        imported: what was read.
        earlier_rig: the name that an earlier rig has now if it was not replaced; empty: there is none.
        exported: files of other programs.
    """

    imported: Imported
    earlier_rig: str = ""
    exported: tuple[Exported, ...] = ()
