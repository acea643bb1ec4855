"""What the host's owner may set once for all runs: names, defaults, a sentence for each; every one is an option of `phone-host run` too.

Light: help is made of it. What the values must be is checked in `settings`.
"""

from dataclasses import dataclass
from typing import Final

from common.imagesize.head import MEGAPIXEL, MOST_PIXELS
from common.program.declaration import setting

_USUAL_MEGAPIXELS: Final = MOST_PIXELS // MEGAPIXEL
MAX_MEGAPIXELS_HELP: Final = (
    f"an image that claims to be larger is refused before it is decoded (1 = 2^20 px; default {_USUAL_MEGAPIXELS})"
)


NEAR_M: Final = 0.3
"""Nearest depth that is searched where nobody says another, m."""


@dataclass(frozen=True, slots=True)
class PhoneHostSettings:
    """Settings of phone-host run, from a TOML file, the environment and options."""

    link: tuple[str, ...] = setting(
        (),
        "links to the board; frames come over the best that is up, the first where some are alike; none: the last board that was used, the one"
        " on the USB cable, one on this machine, or one that announces itself on the network",
    )
    camera: str = setting("", "own camera URI, for example replay:PATH?fps=30&loop=1")
    calibration: str = setting("", "rig.yaml of the two cameras")
    matcher: str = setting("sgbm", "stereo matcher")
    tolerance: float = setting(0.0, "greatest time skew of a pair, ms; 0 = half of the longer frame period")
    fifo: str = setting("1:drop-oldest", "DEPTH:POLICY of the queue before the stereo pipeline")
    align_phase: str = setting(
        "", "which camera is steered until both expose together: either, board or host; empty: none"
    )
    interpolate: bool = setting(default=False, doc="move the board's image to the host's moment along the optical flow")
    keys: str = setting("", "folder of this machine's key and the boards that it knows; empty: ~/.config/tandemscan")
    max_megapixels: int = setting(_USUAL_MEGAPIXELS, MAX_MEGAPIXELS_HELP)
    log_level: str = setting("warning", "debug, info, warning or error")

    @property
    def most_pixels(self) -> int:
        """The limit in pixels."""
        return self.max_megapixels * MEGAPIXEL
