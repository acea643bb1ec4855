"""The options of a `browser:` URI. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Final

from common.camera.options import OptionReader, rate
from common.errors import SettingsError

_MOST_PX: Final = 16_384
"""As on a board's wire; the protocol itself is not imported for `--help`."""

SCHEME: Final = "browser:"
EXAMPLE: Final = "browser:[?w=640&h=480&fps=30&encoding=luma|jpeg&quality=0.9]"

_HELP: Final = {
    "w": "the width in px, such as w=640, and with it h=480",
    "h": "the height in px, such as h=480, and with it w=640",
    "fps": "frames per second, such as fps=30",
    "encoding": "encoding=luma or encoding=jpeg; without it the browser takes the cheaper one",
    "quality": "the JPEG quality from 0.1 to 1, such as quality=0.9",
}


class Encoding(Enum):
    """How a browser sends its images: as JPEG, or the luma plane alone."""

    JPEG = "jpeg"
    LUMA = "luma"


@dataclass(frozen=True, slots=True, kw_only=True)
class BrowserSettings:
    """What a browser's camera is asked for.

    Attributes:
        size_px: width and height, px; None: the browser chooses.
        fps: frames per second; None: the browser chooses.
        encoding: of the images; None: the browser takes the cheaper one.
        quality: of JPEG images, 0.1 to 1; None: the browser chooses.
        clock: name of the stamps' clock.
    """

    size_px: tuple[int, int] | None = None
    fps: Fraction | None = None
    encoding: Encoding | None = None
    quality: float | None = None
    clock: str = "host"


def is_browser(uri: str) -> bool:
    """Return whether a camera URI means a browser's camera."""
    return uri.startswith(SCHEME)


def browser_settings(uri: str, clock: str) -> BrowserSettings:
    """Parse a camera URI.

    Args:
        uri: see EXAMPLE, without `rotate` and `flip`.
        clock: name of the stamps' clock.

    Raises:
        SettingsError: an option is unknown or makes no sense.
    """
    path, _, query = uri.removeprefix(SCHEME).partition("?")
    if path:
        raise SettingsError(f"camera {uri!r} names a browser", f"give {EXAMPLE}: whichever browser opens the page")
    reader = OptionReader(uri, _options(uri, query), _HELP)
    width, height = (reader.read(name, _side, None) for name in ("w", "h"))
    if (width is None) != (height is None):
        raise SettingsError(f"camera {uri!r} has half a size", "give both w= and h=, or neither")
    return BrowserSettings(
        size_px=None if width is None or height is None else (width, height),
        fps=reader.read("fps", rate, None),
        encoding=reader.read("encoding", Encoding, None),
        quality=reader.read("quality", _quality, None),
        clock=clock,
    )


def _options(uri: str, query: str) -> Mapping[str, str]:
    """Split the options.

    Raises:
        SettingsError: one of them has no value, or stands there twice.
    """
    found: dict[str, str] = {}
    for item in query.split("&") if query else ():
        name, equals, value = item.partition("=")
        if not equals or name in found:
            raise SettingsError(f"camera {uri!r} has an option {item!r} that says nothing", f"give {EXAMPLE}")
        found[name] = value
    return found


def _side(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) <= 5 and 16 <= int(text) <= _MOST_PX):
        raise ValueError(text)
    return int(text)


def _quality(text: str) -> float:
    value = float(text) if len(text) <= 12 else 0.0
    if not 0.1 <= value <= 1:  # NaN neither
        raise ValueError(text)
    return value
