"""What the host's owner may set once for all runs; every one is an option of `phone-host run` too."""

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from common.imagesize import MEGAPIXEL, MOST_PIXELS
from common.keys import KeyFolder, default_folder
from common.link.factory import parse_link
from common.program.settings import log_level, resolve, setting
from phone_host.camera.factory import check_camera

ENVIRONMENT_PREFIX = "PHONE_HOST"

_USUAL_MEGAPIXELS: Final = MOST_PIXELS // MEGAPIXEL
MAX_MEGAPIXELS_HELP: Final = (
    f"an image that claims to be larger is refused before it is decoded (1 = 2^20 px; default {_USUAL_MEGAPIXELS})"
)


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


def check(settings: PhoneHostSettings) -> None:
    """Refuse values that `run` could not use, as far as that can be said without opening anything.

    Raises:
        SettingsError: one makes no sense.
    """
    from phone_host.stereo.match import MatcherName  # noqa: PLC0415 - OpenCV, only now
    from phone_host.sync.fifo import FifoSettings  # noqa: PLC0415

    log_level(settings.log_level)
    if settings.camera:
        check_camera(settings.camera)
    for uri in settings.link:
        parse_link(uri, listens_by_default=False)
    if doubled := next((uri for uri in settings.link if settings.link.count(uri) > 1), None):
        raise SettingsError(f"link {doubled!r} is given twice", "give each link once")
    FifoSettings.parse(settings.fifo)
    matchers = [name.value for name in MatcherName]
    if settings.matcher not in matchers:
        raise SettingsError(f"matcher {settings.matcher!r} is unknown", f"give {' or '.join(matchers)}")
    _check_megapixels(settings)
    if settings.align_phase not in {"", "either", "board", "host"}:
        raise SettingsError(f"align_phase is {settings.align_phase!r}", "give either, board or host, or nothing")
    if not (math.isfinite(settings.tolerance) and settings.tolerance >= 0):
        raise SettingsError(f"tolerance is {settings.tolerance:g}", "give ms, 0 or more")


def key_folder(keys: str) -> KeyFolder:
    """Give the folder of keys that a setting means.

    Args:
        keys: the setting; empty for the usual place.
    """
    return KeyFolder(Path(keys).expanduser() if keys else default_folder(os.environ, service=False))


def chosen_keys(file: Path | None, option: str | None) -> KeyFolder:
    """Give the folder of keys for a verb that needs no other setting.

    Args:
        file: settings file, or None.
        option: what --keys says, or None.

    Raises:
        SettingsError: the file or the environment makes no sense.
    """
    return key_folder(resolve(PhoneHostSettings, ENVIRONMENT_PREFIX, file, {"keys": option}).values.keys)


def most_pixels(file: Path | None, option: int | None) -> int:
    """Give the most pixels of an image, for a verb that needs no other setting.

    Args:
        file: settings file, or None.
        option: what --max-megapixels says, or None.

    Raises:
        SettingsError: it makes no sense.
    """
    values = resolve(PhoneHostSettings, ENVIRONMENT_PREFIX, file, {"max_megapixels": option}).values
    _check_megapixels(values)
    return values.most_pixels


def _check_megapixels(settings: PhoneHostSettings) -> None:
    if settings.max_megapixels < 1:
        raise SettingsError(f"max_megapixels is {settings.max_megapixels}", "give 1 or more")
