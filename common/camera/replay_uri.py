"""The options of a `replay:` URI."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Final

from common.camera.options import TRUTHS, OptionReader, exact, rate
from common.camera.replay import ReplaySettings
from common.errors import SettingsError
from common.protocol.message import Pacing

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
    read = OptionReader(uri, options, _HELP).read
    fps = read("fps", rate, Fraction(30))
    loop = read("loop", TRUTHS.__getitem__, _ONCE)
    pacing = read("pace", _PACINGS.__getitem__, _usual_pacing(options))
    phase_ns = read("phase_ms", _nanoseconds, 0)
    if phase_ns and pacing is Pacing.DEMAND:
        raise SettingsError(
            f"camera {uri!r} has phase_ms and pace=demand", "leave one out: with pace=demand there is no clock to shift"
        )
    return ReplaySettings(path=path, fps=fps, loop=loop, pacing=pacing, clock=clock, phase_ns=phase_ns)


_ONCE: Final[bool] = False
_PACINGS: Final = {pacing.name.lower(): pacing for pacing in Pacing}


def _nanoseconds(text: str) -> int:
    return round(exact(text) * 1_000_000)


def _usual_pacing(options: Mapping[str, str]) -> Pacing:
    """Return the pace of a replay whose address does not name it: photographs have no time, a film has a rate."""
    return Pacing.CLOCK if _OF_A_FILM & set(options) else Pacing.DEMAND
