"""The settings that the board's owner may make, and the check for values that `run` could not use."""

import argparse
import os
from pathlib import Path
from typing import Final

from board_agent.rate_control import ways
from common.camera.factory import parse_camera
from common.errors import SettingsError
from common.keys import SERVICE_FOLDER, KeyFolder, default_folder
from common.link.factory import parse_link
from common.program.quantities import frames_per_second, seconds
from common.program.request import setting
from common.program.settings import Resolved, log_level, resolve
from common.value import value

ENVIRONMENT_PREFIX = "BOARD_AGENT"

LONGEST_S: Final = 1e9
"""Limit of every waiting time."""

_HIGHEST_FPS: Final = 1000
"""Limit of every camera URI's frame rate."""

SERVICE_SETTINGS: Final = Path("/etc/tandemscan/board-agent.toml")
"""The settings file of the package's service."""


@value()
class BoardSettings:
    """Settings of board-agent, from /etc/tandemscan/board-agent.toml or another file, the environment and options."""

    camera: str = setting(
        "",
        "the camera, for example v4l2:auto or v4l2:/dev/video0?size=640x480&fps=30; rotate= and flip= if it is mounted turned",
    )
    link: tuple[str, ...] = setting(
        ("tcp://127.0.0.1:5555",), "addresses to listen at; by default only this machine can connect"
    )
    wait_for_camera: bool = setting(default=False, doc="wait for a missing camera; otherwise exit with code 3")
    idle_after: float = setting(10.0, "switch the camera off after so many seconds without a host; 0: never", seconds)
    adapt: tuple[str, ...] = setting(
        ("quality", "rate"),
        "what may be lowered when the link is too slow, in this order: quality, rate, size; or nothing",
    )
    least_fps: float = setting(
        0.0, "never lower the frame rate below so many frames per second; 0: never lower the rate", frames_per_second
    )
    keys: str = setting(
        "",
        "folder with this machine's key and the keys of the hosts it lets in; empty: /var/lib/tandemscan or ~/.config/tandemscan",
    )
    log_level: str = setting("info", "least important messages that are logged: debug, info, warning or error")


def key_folder(keys: str) -> KeyFolder:
    """Return the key folder that a setting names.

    Args:
        keys: the setting; empty for the default.
    """
    return KeyFolder(Path(keys).expanduser() if keys else default_folder(os.environ, service=True))


def chosen_keys(options: argparse.Namespace) -> KeyFolder:
    """Return the key folder that the options name. If they name none, it is the service's where that is installed."""
    if not (options.config or options.keys) and SERVICE_SETTINGS.is_file():
        options.config = SERVICE_SETTINGS
    return key_folder(resolve_settings(options).values.keys)


def is_service_hidden(keys: KeyFolder) -> bool:
    """Return whether the machine has the service, but this user may not use its keys: then they see their own, which the service does not know."""
    return SERVICE_SETTINGS.is_file() and keys.path != SERVICE_FOLDER and not os.access(SERVICE_FOLDER, os.W_OK)


def resolve_settings(options: argparse.Namespace) -> Resolved[BoardSettings]:
    """Resolve the settings from file, environment and a verb's options."""
    link = tuple(options.link) if options.link else None
    adapt = None if options.adapt is None else tuple(way for way in options.adapt.split(",") if way)
    given = {"camera": options.camera, "link": link, "keys": options.keys, "log_level": options.log_level}
    given |= {"adapt": adapt, "least_fps": options.least_fps}
    return resolve(BoardSettings, ENVIRONMENT_PREFIX, options.config, given)


def check(settings: BoardSettings) -> None:
    """Refuse values that `run` could not use, as far as that is known without opening anything.

    Raises:
        SettingsError: a value makes no sense.
    """
    log_level(settings.log_level)
    if settings.camera:
        parse_camera(settings.camera, "")
    for uri in settings.link:
        parse_link(uri, listens_by_default=True)
    ways(settings.adapt)
    if not 0 <= settings.least_fps <= _HIGHEST_FPS:
        raise SettingsError(
            f"least_fps is {settings.least_fps:g}",
            f"give frames per second, at most {_HIGHEST_FPS}; 0 means never lower the rate",
        )
    if not 0 <= settings.idle_after < LONGEST_S:
        raise SettingsError(f"idle_after is {settings.idle_after}", "give a number of seconds; 0 means never")
