"""The combinations that the delay benchmark measures: link, emulated interface, image size, JPEG quality and frame rate. Pure."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final, TypeVar

from common.errors import SettingsError
from common.link.factory import parse_link
from common.program.quantities import frames_per_second, image_size
from phone_host.bench.emulate import Profile

T = TypeVar("T")

LOCAL_LINKS: Final = ("tcp", "ipc", "serial", "rfcomm")
"""The kinds of link whose two ends can both run on one machine; a remote board is named by its URI."""

SHAPED_LINKS: Final = ("tcp", "ipc", "serial")
"""The links that can stand in for another interface."""

BOARD_SETS: Final = 0
"""Stands in place of a JPEG quality when a remote board's own camera decides; this side cannot know it."""

_LEAST_PX, _MOST_PX = 64, 4096
_MOST_HZ: Final = 240
_LINKS_HELP: Final = f"the links are {', '.join(LOCAL_LINKS)}, or a board's URI such as tcp://192.168.7.2:5555"


@dataclass(frozen=True, slots=True, order=True)
class Size:
    """An image size, px."""

    width_px: int
    height_px: int

    def __str__(self) -> str:
        return f"{self.width_px}x{self.height_px}"


@dataclass(frozen=True, slots=True)
class Interface:
    """What carries the frames of a case.

    Attributes:
        link: kind of a local link, or the URI of a remote board.
        profile: the interface that it stands in for; None: itself.
    """

    link: str
    profile: Profile | None = None

    @property
    def is_remote(self) -> bool:
        """Whether the board is another machine."""
        return self.link not in LOCAL_LINKS

    def __str__(self) -> str:
        return self.link if self.profile is None else f"{self.profile.name} ({self.link})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One combination that is measured.

    Attributes:
        interface: the interface that carries its frames.
        size: image size of both cameras.
        quality_percent: quality of the JPEGs, 1 to 100; BOARD_SETS where a remote board's camera decides.
        rate_hz: rate of both cameras.
    """

    interface: Interface
    size: Size
    quality_percent: int
    rate_hz: int

    @property
    def images(self) -> str:
        """What the cameras show, as text."""
        quality = f" JPEG {self.quality_percent}" if self.quality_percent != BOARD_SETS else ""
        return f"{self.size}{quality} at {self.rate_hz} frames/s"

    @property
    def short(self) -> str:
        """The same in short for a table, for example `640x480 q80 30/s`."""
        quality = f" q{self.quality_percent}" if self.quality_percent != BOARD_SETS else ""
        return f"{self.size}{quality} {self.rate_hz}/s"

    def __str__(self) -> str:
        return f"{self.interface} {self.images}"


def parse_links(text: str) -> tuple[str, ...]:
    """Read names of links and URIs of boards, for example `tcp,ipc` or `serial,tcp://192.168.7.2:5555`.

    Raises:
        SettingsError: an item is neither.
    """
    names = _items(text)
    for name in names:
        if ":" in name:
            parse_link(name, listens_by_default=False)
        elif name not in LOCAL_LINKS:
            raise SettingsError(f"--links names {name!r}, which is not there", _LINKS_HELP)
    if not names:
        raise SettingsError("--links names no link", _LINKS_HELP)
    return names


def interfaces(links: Sequence[str], profiles: Sequence[Profile]) -> tuple[Interface, ...]:
    """Choose what to measure, from `--links` and `--emulate`.

    Args:
        links: as named; if empty, each profile's own carrier, or every kind if there are no profiles.
        profiles: interfaces to emulate; empty: nothing is emulated.

    Raises:
        SettingsError: a named link cannot be shaped.
    """
    if not profiles:
        return tuple(Interface(link) for link in links or LOCAL_LINKS)
    for link in links:
        if link not in SHAPED_LINKS:
            raise SettingsError(f"--emulate cannot shape {link}", f"name {' or '.join(SHAPED_LINKS)} in --links")
    return tuple(Interface(link, profile) for profile in profiles for link in links or (profile.carrier,))


def parse_sizes(text: str) -> tuple[Size, ...]:
    """Read image sizes, for example `320x240,640x480`.

    Raises:
        SettingsError: an item is not a size, or the size is out of range.
    """

    def size(item: str) -> Size:
        width_px, height_px = image_size(item, "--size")
        if not all(_LEAST_PX <= side_px <= _MOST_PX for side_px in (width_px, height_px)):
            raise SettingsError(
                f"--size {item!r}", f"give WIDTHxHEIGHT from {_LEAST_PX} to {_MOST_PX} px, for example 640x480"
            )
        return Size(width_px, height_px)

    return _parsed(text, size, "--size names no size", "give WIDTHxHEIGHT, for example 640x480")


def parse_qualities(text: str) -> tuple[int, ...]:
    """Read JPEG qualities, for example `50,80`.

    Raises:
        SettingsError: an item is not a whole number from 1 to 100.
    """

    def quality(item: str) -> int:
        percent = item.removesuffix("%").strip()
        if not _is_number(percent, 1, 100):
            raise SettingsError(f"--quality {item!r}", "give whole numbers from 1 to 100")
        return int(percent)

    return _parsed(text, quality, "--quality names no JPEG quality", "give 1 to 100, for example 80")


def parse_rates(text: str) -> tuple[int, ...]:
    """Read frame rates, for example `15,30`.

    Raises:
        SettingsError: an item is not a whole number from 1 to 240.
    """

    def rate(item: str) -> int:
        rate_hz = frames_per_second(item, "--fps")
        if not (rate_hz.is_integer() and 1 <= rate_hz <= _MOST_HZ):
            raise SettingsError(f"--fps {item!r}", f"give whole numbers of frames per second from 1 to {_MOST_HZ}")
        return int(rate_hz)

    return _parsed(text, rate, "--fps names no rate", "give frames per second, for example 30")


def cases(
    measured: Sequence[Interface], sizes: Sequence[Size], qualities: Sequence[int], rates_hz: Sequence[int]
) -> tuple[Case, ...]:
    """Return all combinations, with the interfaces next to each other, so that a change of the machine's load affects all of them."""
    return tuple(
        Case(interface=interface, size=size, quality_percent=quality, rate_hz=rate_hz)
        for size, quality, rate_hz, interface in product(sizes, qualities, rates_hz, measured)
    )


def _items(text: str) -> tuple[str, ...]:
    """Return the parts between commas, each once, in their order."""
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))


def _parsed(text: str, parse: Callable[[str], T], problem: str, remedy: str) -> tuple[T, ...]:
    values = tuple(dict.fromkeys(parse(item) for item in _items(text)))
    if not values:
        raise SettingsError(problem, remedy)
    return values


def _is_number(text: str, least: int, most: int) -> bool:
    # Six digits at most, because int() itself raises for thousands of them.
    return text.isascii() and text.isdigit() and len(text) <= 6 and least <= int(text) <= most
