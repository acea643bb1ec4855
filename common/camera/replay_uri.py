"""The options of a `replay:` URI."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Final

from common.camera.options import EXAMPLE, exact
from common.camera.replay import ReplaySettings
from common.errors import SettingsError
from common.protocol.message import Pacing

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
    if unknown := set(options) - {"fps", "loop", "pace", "phase_ms"}:
        raise SettingsError(f"camera {uri!r} has an unknown option {min(unknown)!r}", f"give {EXAMPLE}")
    try:
        fps = exact(options.get("fps", "30"))
        loop = {"0": False, "1": True}[options.get("loop", "0")]
        pacing = Pacing[options["pace"].upper()] if "pace" in options else _usual_pacing(options)
        phase_ns = round(Fraction(options.get("phase_ms", "0")) * 1_000_000)
    except (ValueError, ZeroDivisionError, KeyError):
        raise SettingsError(f"camera {uri!r} has an option that cannot be used here", f"give {EXAMPLE}") from None
    if not Fraction(1, 100) <= fps <= 1000:
        raise SettingsError(f"camera {uri!r} has fps={options.get('fps')}", "give a rate between 0.01 and 1000")
    if phase_ns and pacing is Pacing.DEMAND:
        raise SettingsError(
            f"camera {uri!r} has phase_ms and pace=demand", "leave one out: with pace=demand there is no clock to shift"
        )
    return ReplaySettings(path=path, fps=fps, loop=loop, pacing=pacing, clock=clock, phase_ns=phase_ns)


def _usual_pacing(options: Mapping[str, str]) -> Pacing:
    """Return the pace of a replay whose address does not name it: photographs have no time, a film has a rate."""
    return Pacing.CLOCK if _OF_A_FILM & set(options) else Pacing.DEMAND
