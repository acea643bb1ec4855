"""What the board's owner may set."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.keys import KeyFolder, default_folder
from common.program.settings import setting

ENVIRONMENT_PREFIX = "BOARD_AGENT"

SERVICE_SETTINGS: Final = Path("/etc/tandemscan/board-agent.toml")
"""What the package's service is run with."""


@dataclass(frozen=True, slots=True)
class BoardSettings:
    """Settings of board-agent, from /etc/tandemscan/board-agent.toml or another file, the environment and options."""

    camera: str = setting("", "camera URI, for example v4l2:auto or v4l2:/dev/video0?size=640x480&fps=30")
    link: tuple[str, ...] = setting(("tcp://127.0.0.1:5555",), "links to serve; loopback unless told otherwise")
    wait_for_camera: bool = setting(
        default=False, doc="whether a missing camera is waited for; else it ends the program with exit 3"
    )
    idle_after: float = setting(
        10.0, "seconds without a host after which the camera's stream is switched off; 0: never"
    )
    adapt: tuple[str, ...] = setting(
        ("quality", "rate"),
        "what of the camera gives way where the link does not carry it: quality, rate, size (in this order), or nothing",
    )
    least_fps: float = setting(
        0.0, "frames per second below which the rate is not lowered; 0: it stays as it was asked for"
    )
    keys: str = setting(
        "",
        "folder of this machine's key and those that may connect; empty: /var/lib/tandemscan or ~/.config/tandemscan",
    )
    log_level: str = setting("info", "debug, info, warning or error")


def key_folder(keys: str) -> KeyFolder:
    """Give the folder of keys that a setting means.

    Args:
        keys: the setting; empty for the usual place.
    """
    return KeyFolder(Path(keys).expanduser() if keys else default_folder(os.environ, service=True))
