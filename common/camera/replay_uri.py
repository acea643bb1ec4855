"""The options of a `replay:` URI."""

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Final, TypeVar

from common.camera.options import exact
from common.camera.replay import ReplaySettings
from common.errors import SettingsError
from common.protocol.message import Pacing

T = TypeVar("T")

_HELP: Final = {
    "fps": "images per second from 0.01 to 1000 without a unit, such as fps=30",
    "loop": "loop=1 to begin again after the last image, or loop=0",
    "pace": "pace=clock for a film, or pace=demand for photographs",
    "phase_ms": "a delay in ms without a unit, such as phase_ms=12.5",
}

_OF_A_FILM: Final = frozenset({"fps", "loop", "phase_ms"})
"""Options that only make sense for a film. Without any, the images are stills: shown on demand and paired by number."""


def replay_settings(uri: str, path: str, options: Mapping[str, str], clock: str) -> ReplaySettings:
    """Parse the options of a camera URI.

    Args:
        uri: the whole URI, for errors.
        path: folder, glob or file.
        options: the options after the question mark.
        clock: name of the clock of the stamps.

    Returns:
        The settings.

    Raises:
        SettingsError: an option is unknown or makes no sense.
    """
    if unknown := set(options) - set(_HELP):
        raise SettingsError(
            f"camera {uri!r} has an unknown option {min(unknown)!r}",
            f"the options are {', '.join(_HELP)}, rotate, flip",
        )

    def read(name: str, parse: Callable[[str], T], default: T) -> T:
        if name not in options:
            return default
        try:
            return parse(options[name])
        except (ValueError, KeyError, ZeroDivisionError):
            raise SettingsError(f"camera {uri!r} has {name}={options[name]}", f"give {_HELP[name]}") from None

    fps = read("fps", _rate, Fraction(30))
    loop = read("loop", _TRUTHS.__getitem__, _ONCE)
    pacing = read("pace", _PACINGS.__getitem__, _usual_pacing(options))
    phase_ns = read("phase_ms", _nanoseconds, 0)
    if phase_ns and pacing is Pacing.DEMAND:
        raise SettingsError(
            f"camera {uri!r} has phase_ms and pace=demand", "leave one out: with pace=demand there is no clock to shift"
        )
    return ReplaySettings(path=path, fps=fps, loop=loop, pacing=pacing, clock=clock, phase_ns=phase_ns)


_ONCE: Final[bool] = False
_TRUTHS: Final = {"0": False, "1": True}
_PACINGS: Final = {pacing.name.lower(): pacing for pacing in Pacing}


def _rate(text: str) -> Fraction:
    rate_hz = exact(text)
    if not Fraction(1, 100) <= rate_hz <= 1000:
        raise ValueError(text)
    return rate_hz


def _nanoseconds(text: str) -> int:
    return round(exact(text) * 1_000_000)


def _usual_pacing(options: Mapping[str, str]) -> Pacing:
    """Return the pace of a replay whose address does not name it: photographs have no time, a film has a rate."""
    return Pacing.CLOCK if _OF_A_FILM & set(options) else Pacing.DEMAND
