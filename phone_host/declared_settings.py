"""The host's settings: names, defaults and a help sentence each. Each is also an option of `phone-host run`.

This module is light because the help text is generated from it. `settings` validates the values.
"""

from dataclasses import dataclass
from typing import Final

from common.imagesize.head import MEGAPIXEL, MOST_PIXELS
from common.program.quantities import milliseconds
from common.program.request import setting

_USUAL_MEGAPIXELS: Final = MOST_PIXELS // MEGAPIXEL
MAX_MEGAPIXELS_HELP: Final = f"refuse larger images before decoding them, in megapixels (default {_USUAL_MEGAPIXELS})"


PRINTERS_TABLE: Final = "printers"
"""The table of the settings file with the keys of printers' servers, by address. No option gives them: a command line is seen by all."""

NEAR_M: Final = 0.3
"""Default nearest depth to search for, m."""


@dataclass(frozen=True, slots=True)
class PhoneHostSettings:
    """Settings of phone-host run, from a TOML file, the environment and options."""

    link: tuple[str, ...] = setting(
        (),
        "addresses of the board; frames come over the best link that is up, the first if several are equal; if empty, look for the last"
        " board, the board on the USB cable, one on this machine, or one that announces itself on the network",
    )
    camera: str = setting("", "camera of this machine, for example v4l2:/dev/video0")
    calibration: str = setting("", "rig.yaml of the two cameras")
    matcher: str = setting("", "stereo matcher; by default the best that works on this machine")
    tolerance: float = setting(
        0.0,
        "greatest difference of the two exposure times in a pair, ms; 0: half of the longer frame period",
        milliseconds,
    )
    fifo: str = setting(
        "1:drop-oldest", "length of the queue before the matcher and what happens when it is full, DEPTH:POLICY"
    )
    budget: float = setting(
        0.0,
        "time for each pair, ms: working size, search range and matcher are chosen, and chosen again, to hold it; 0: no budget",
        milliseconds,
    )
    align_phase: str = setting(
        "", "which camera may be shifted until both expose together: either, board or host; empty: none"
    )
    interpolate: bool = setting(
        default=False, doc="move the board's image along the optical flow to the moment of the other camera's exposure"
    )
    keys: str = setting("", "folder with this machine's key and the keys of known boards; empty: ~/.config/tandemscan")
    max_megapixels: int = setting(_USUAL_MEGAPIXELS, MAX_MEGAPIXELS_HELP)
    log_level: str = setting("warning", "least important messages that are logged: debug, info, warning or error")

    @property
    def most_pixels(self) -> int:
        """The image size limit in pixels."""
        return self.max_megapixels * MEGAPIXEL
