"""The options of a `replay:` URI."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Final

from common.camera.options import TRUTHS, OptionReader, exact, rate
from common.camera.recorded import RecordedFilm, RecordedSettings, RecordedStills, require_recording
from common.camera.replay import ReplayCamera, ReplaySettings, find_images
from common.errors import SettingsError
from common.protocol.message import Pacing
from common.recording.opened import is_recording

_HELP: Final = {
    "fps": "images per second from 0.01 to 1000 without a unit, such as fps=30",
    "loop": "loop=1 to begin again after the last image, or loop=0",
    "pace": "pace=clock for a film, or pace=demand for photographs",
    "phase_ms": "a delay in ms without a unit, such as phase_ms=12.5",
}

_OF_A_FILM: Final = frozenset({"fps", "loop", "phase_ms"})
"""Options that only make sense for a film. Without any, the images are stills: shown on demand and paired by number."""


_HELP_RECORDED: Final = {
    "topic": "topic=/left/image/compressed, or what else phone-host sessions info names",
    "loop": _HELP["loop"],
    "pace": "pace=clock for the times of then, or pace=demand for one image after the other",
}


def replay_settings(uri: str, path: str, options: Mapping[str, str], clock: str) -> ReplaySettings | RecordedSettings:
    """Parse the options of a camera URI.

    Args:
        uri: the whole URI, for errors.
        path: folder, glob, image or recording.
        options: the options after the question mark.
        clock: name of the clock of the stamps.

    Raises:
        SettingsError: an option is unknown or makes no sense.
    """
    if is_recording(path):
        return _recorded_settings(uri, path, options, clock)
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


def _recorded_settings(uri: str, path: str, options: Mapping[str, str], clock: str) -> RecordedSettings:
    read = OptionReader(uri, options, _HELP_RECORDED).read
    topic = read("topic", str, "")
    loop = read("loop", TRUTHS.__getitem__, _ONCE)
    pacing = read("pace", _PACINGS.__getitem__, Pacing.DEMAND)
    return RecordedSettings(path=path, topic=topic, pacing=pacing, loop=loop, clock=clock)


def require_replayed(settings: object) -> None:
    """Refuse a replay of images that are not there; any other camera may come later.

    Args:
        settings: of a camera, as its address says.

    Raises:
        UnavailableError: there is no such folder or file.
        DataError: there is no image in it.
    """
    if isinstance(settings, ReplaySettings):
        find_images(settings.path)
    elif isinstance(settings, RecordedSettings):
        require_recording(settings.path)


def open_replay(
    settings: ReplaySettings | RecordedSettings, now_ns: int
) -> ReplayCamera | RecordedFilm | RecordedStills:
    """Open what shows images of then.

    Raises:
        UnavailableError: there is no such folder or file.
        DataError: there is no image, or one is unreadable.
    """
    if isinstance(settings, ReplaySettings):
        return ReplayCamera(settings, now_ns)
    if settings.pacing is Pacing.CLOCK:
        return RecordedFilm(settings, now_ns)
    return RecordedStills(settings, now_ns)


_ONCE: Final[bool] = False
_PACINGS: Final = {pacing.name.lower(): pacing for pacing in Pacing}


def _nanoseconds(text: str) -> int:
    return round(exact(text) * 1_000_000)


def _usual_pacing(options: Mapping[str, str]) -> Pacing:
    """Return the pace of a replay whose address does not name it: photographs have no time, a film has a rate."""
    return Pacing.CLOCK if _OF_A_FILM & set(options) else Pacing.DEMAND
