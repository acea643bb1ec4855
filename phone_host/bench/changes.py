"""Settings to predict instead of running them, as `--predict` names them. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from common.errors import SettingsError
from phone_host.bench.cases import Size, parse_rates, parse_sizes
from phone_host.bench.emulate import Profile, parse_profiles
from phone_host.bench.prediction import Target, nominal_link
from phone_host.sync.fifo import FifoSettings

_HELP: Final = (
    "give changes such as fps=60,size=640x480,kB=40,fifo=4:drop-newest,processing=0.5,link=wifi, separated by commas"
)
_MOST_KILOBYTES: Final = 16_000
"""No frame is larger: the protocol takes 16 MB."""

_MOST_FACTOR: Final = 1000.0


@dataclass(frozen=True, slots=True)
class Change:
    """The differences from a run; None means as it was run.

    Attributes:
        words: the text that the user typed.
        rate_hz: rate of the cameras.
        size: size of the images; their bytes scale with their pixels unless frame_bytes is given.
        frame_bytes: mean size of a frame.
        fifo: depth and policy.
        processing_factor: predicted processing time as a multiple of the measured one.
        profile: an interface that replaces the link, described by its figures.
    """

    words: str
    rate_hz: int | None = None
    size: Size | None = None
    frame_bytes: float | None = None
    fifo: FifoSettings | None = None
    processing_factor: float = 1.0
    profile: Profile | None = None

    def applied(self, target: Target) -> Target:
        """Return the setting with these differences applied."""
        images = target.images
        if self.size is not None:
            share = self.size.width_px * self.size.height_px / (images.width_px * images.height_px)
            size_bytes = images.size_bytes * share
            images = replace(images, width_px=self.size.width_px, height_px=self.size.height_px, size_bytes=size_bytes)
        if self.frame_bytes is not None:
            images = replace(
                images, size_bytes=images.size_bytes * (self.frame_bytes / float(images.size_bytes.mean()))
            )
        if self.rate_hz is not None:
            images = replace(images, period_ns=1e9 / self.rate_hz)
        link = target.link
        if self.profile is not None:
            link = nominal_link(self.profile, self_paced=self.profile.carrier == "serial")
        return replace(
            target,
            images=images,
            link=link,
            fifo=self.fifo or target.fifo,
            processing_factor=target.processing_factor * self.processing_factor,
        )


def parse_changes(texts: Sequence[str]) -> tuple[Change, ...]:
    """Read the arguments of `--predict`, for example `fps=60,fifo=4:block`.

    Raises:
        SettingsError: one is not valid.
    """
    return tuple(_change(text) for text in texts)


def _change(text: str) -> Change:
    change = Change(text)
    for part in text.split(","):
        key, found, value = part.strip().partition("=")
        if not found:
            raise SettingsError(f"--predict {part!r} is not a change", _HELP)
        match key:
            case "fps":
                change = replace(change, rate_hz=parse_rates(value)[0])
            case "size":
                change = replace(change, size=parse_sizes(value)[0])
            case "kB":
                change = replace(change, frame_bytes=1e3 * _number(part, value, _MOST_KILOBYTES))
            case "fifo":
                change = replace(change, fifo=FifoSettings.parse(value))
            case "processing":
                change = replace(change, processing_factor=_number(part, value, _MOST_FACTOR))
            case "link":
                change = replace(change, profile=parse_profiles(value)[0])
            case _:
                raise SettingsError(f"--predict does not know {key!r}", _HELP)
    return change


def _number(part: str, value: str, most: float) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not 0.0 < number <= most:
        raise SettingsError(f"--predict {part!r}", f"give a number above 0, {most:g} at most")
    return number
