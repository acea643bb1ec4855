"""What is counted for a V4L2 camera over all lives of its device."""

from dataclasses import dataclass, field

from common.camera.v4l2_stamps import RateMeter, StampClock
from common.frame import FrameFault


@dataclass(slots=True)
class Tally:
    """Counts that outlive the device. `stamps` is the clock named by the last frame's flags; None before the first frame."""

    grabs: int = 0
    missed: int = 0
    distrusted: int = 0
    refused: int = 0
    faults: dict[FrameFault, int] = field(default_factory=dict)
    stamps: StampClock | None = None
    rate: RateMeter = field(default_factory=RateMeter)

    def number(self) -> int:
        """The sequence number of the next grab."""
        self.grabs += 1
        return self.grabs - 1
