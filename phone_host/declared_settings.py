"""The host's settings: name, default, and the option of `phone-host run` that gives it, with its help. Light. `settings` validates the values."""

from dataclasses import dataclass
from typing import Final

from common.camera.options import TURNED
from common.imagesize.head import MEGAPIXEL, MOST_PIXELS
from common.program.quantities import milliseconds
from common.program.request import setting
from phone_host.camera.uris import EXAMPLE
from phone_host.stereo.matcher_names import MatcherName, default_words

_USUAL_MEGAPIXELS: Final = MOST_PIXELS // MEGAPIXEL
LINK_HELP: Final = "address of the board: tcp://HOST:PORT, ipc://PATH[?owner=USER], serial:DEVICE or rfcomm://DEVICE (default: look for a board)"

PRINTERS_TABLE: Final = "printers"
"""The table of the settings file with the keys of printers' servers, by address. No option gives them: a command line is seen by all."""

NEAR_M: Final = 0.3
"""Default nearest depth to search for, m."""


@dataclass(frozen=True, slots=True)
class PhoneHostSettings:
    """Settings of phone-host run, from a TOML file, the environment and options."""

    link: tuple[str, ...] = setting(
        (),
        f"{LINK_HELP}; repeat the option: the frames come over the best link that is up",
        flag="--link",
        action="append",
        metavar="URI",
    )
    camera: str = setting("", f"camera of this machine: {EXAMPLE}; {TURNED}", flag="--camera", metavar="URI")
    calibration: str = setting(
        "",
        "rig.yaml of the two cameras, made by phone-host calibrate; or, for rectified images, the calib.txt of Middlebury, ETH3D or KITTI",
        flag="--calibration",
        metavar="FILE",
    )
    matcher: str = setting(
        "",
        f"stereo matcher: {' or '.join(name.value for name in MatcherName)}, onnx:PATH for a network, or one from an installed package ({default_words()})",
        flag="--matcher",
        metavar="NAME",
    )
    tolerance: float = setting(
        0.0,
        "greatest difference of the two exposure times in a pair (default: half of the longer frame period)",
        milliseconds,
        "--tolerance",
        metavar="MS",
    )
    fifo: str = setting(
        "1:drop-oldest",
        "length of the queue before the matcher, and what happens when it is full: drop-oldest, drop-newest or block (default 1:drop-oldest)",
        flag="--fifo",
        metavar="DEPTH:POLICY",
    )
    budget: float = setting(
        0.0,
        "time for each pair: choose working size, search range and matcher to hold it, and follow when the machine slows down; --scale, --matcher, --disparities and --near stay as given (default: no budget)",
        milliseconds,
        "--budget",
        metavar="MS",
    )
    align_phase: str = setting(
        "",
        "shift the exposure of one camera until both expose together; say which one may be shifted (default either)",
        flag="--align-phase",
        nargs="?",
        const="either",
        choices=("either", "board", "host"),
    )
    interpolate: bool = setting(
        default=False,
        doc="move the board's image along the optical flow to the moment of the other camera's exposure",
        flag="--interpolate",
        action="store_true",
    )
    keys: str = setting("", "folder of keys (default ~/.config/tandemscan)", flag="--keys", page=False, metavar="DIR")
    max_megapixels: int = setting(
        _USUAL_MEGAPIXELS,
        f"refuse larger images before decoding them, in megapixels (default {_USUAL_MEGAPIXELS})",
        flag="--max-megapixels",
        type=int,
        metavar="N",
    )
    log_level: str = setting(
        "warning",
        "least important messages that are logged to stderr",
        flag="--log-level",
        page=False,
        choices=("debug", "info", "warning", "error"),
    )

    @property
    def most_pixels(self) -> int:
        """The image size limit in pixels."""
        return self.max_megapixels * MEGAPIXEL
