"""The settings of a run and the reasons why one ends: values only, so that whoever prepares a run needs no threads."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from common.imagesize.head import MOST_PIXELS
from phone_host.model import AS_CALIBRATED, Departure, Side, TimeOffset
from phone_host.output.axes import Axes
from phone_host.stereo.budget import BudgetWanted
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.phase import Whose


class EndReason(Enum):
    """Why a run ended."""

    PAIRS_REACHED = "pairs_reached"
    STREAM_ENDED = "stream_ended"
    SECONDS_OVER = "seconds_over"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class HostSettings:
    """The settings of a run, apart from its camera, links and core.

    Attributes:
        board_side: which view the board's camera is.
        tolerance_ns: greatest time skew of a pair; None for half of the longer frame period.
        fifo: depth and overflow policy.
        pairs: end after this many processed pairs; 0 for no limit.
        seconds_ns: end this long after the first pair; 0 for no limit.
        wait_ns: how long to wait for an absent board; None for ever.
        out: folder for results; None to write none.
        save_every: save every Nth pair; 0 for none.
        time_offset: time offset between the two cameras' stamps.
        interpolate: whether the decoded board image is first interpolated to the moment of the host's.
        steered: the cameras that may be steered until both expose together; empty: the phase stays as it is.
        most_pixels: largest accepted image size of either camera, pixels.
        resolved: the settings of the run with their origins, for settings.json; None: not saved.
        axes: of the points in saved clouds.
        matcher_note: what the summary says of the choice of the matcher; empty: nothing.
        budget: time budget for each pair; None: there is none. Only with a core that was built from settings.
        corrects: whether a rig that has turned since its calibration is corrected; it is watched in any case.
        overlay: the correction of an earlier run, in use from the start.
        command: the verb whose results these are.
    """

    board_side: Side = Side.LEFT
    tolerance_ns: int | None = None
    fifo: FifoSettings = field(default_factory=FifoSettings)
    pairs: int = 0
    seconds_ns: int = 0
    wait_ns: int | None = None
    out: Path | None = None
    save_every: int = 30
    time_offset: TimeOffset = field(default_factory=TimeOffset)
    interpolate: bool = False
    steered: frozenset[Whose] = frozenset()
    most_pixels: int = MOST_PIXELS
    resolved: Mapping[str, object] | None = None
    axes: Axes = Axes.CAMERA
    matcher_note: str = ""
    budget: BudgetWanted | None = None
    corrects: bool = True
    overlay: Departure = AS_CALIBRATED
    command: str = "run"
