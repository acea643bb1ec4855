"""Cameras that show images of then: the options of a `replay:` URI, and one stream of a recording.

The stream is shown with the bytes of then, and where it has a clock with the times of then. Folders of images: `replay`.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Final

from common.camera.base import CameraHealth, Ended, Grab, Mode, Offers, Spoiled
from common.camera.image_numbers import ImageNumbers, with_numbers
from common.camera.options import TRUTHS, OptionReader, exact, rate
from common.camera.replay import ReplayCamera, ReplaySettings, find_images
from common.errors import DataError, SettingsError, UnavailableError
from common.frame import Frame, SpoiledImageError, find_fault
from common.orientation import UPRIGHT
from common.places import Kind, kind_of
from common.protocol.message import Pacing, Steering
from common.recording.opened import is_recording, open_recorded
from common.recording.recorded import Recorded, Shown, period_ns, size_px
from common.recording.stamps import pairs_of_two
from common.stamp import Stamp
from common.words import listed

_FAR_FUTURE: Final = 2**62
_MOST_AT_ONCE: Final = 64


@dataclass(frozen=True, slots=True)
class RecordedSettings:
    """What to show.

    Attributes:
        path: the recording.
        topic: whose images; empty: the only ones.
        pacing: whether they come at their times, or on demand.
        loop: whether the first follows the last. Then the time of day of CLOCK_MONOTONIC alone says which one is shown.
        clock: name of the clock of the stamps.
    """

    path: str
    topic: str = ""
    pacing: Pacing = Pacing.DEMAND
    loop: bool = False
    clock: str = "host"


def require_recording(path: str) -> None:
    """Refuse a recording that is not there. As a camera, it is as one that is not plugged in.

    Raises:
        UnavailableError: so it is.
    """
    with suppress(OSError):  # whoever opens it will say why
        if kind_of(path) is Kind.MISSING:
            raise UnavailableError(f"replay {path!r} does not exist", "give a recording, or a folder of images")


def _topic(settings: RecordedSettings, found: Recorded) -> str:
    held = sorted(found.images)
    if settings.topic in held or (not settings.topic and len(held) == 1):
        return settings.topic or held[0]
    what = f"has no images {settings.topic}" if settings.topic else "holds images of several cameras"
    raise DataError(f"{settings.path} {what}", f"add ?topic= and one of: {listed(held)}")


class _Shower:
    """What both kinds have in common.

    Attributes:
        description: of the camera that was recorded.
    """

    def __init__(self, settings: RecordedSettings) -> None:
        self._settings = settings
        require_recording(settings.path)
        self._found = open_recorded(Path(settings.path))
        self._topic = _topic(settings, self._found)
        self._shown = self._found.images[self._topic]
        camera = self._found.camera(self._topic)
        self.description = replace(camera, pacing=settings.pacing, steering=Steering.NONE)
        self.stored = UPRIGHT
        self.offers = Offers()
        self.pollable: int | None = None
        self.health = CameraHealth()
        self._sequence = 0

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Do nothing: it shows what it has."""

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Do nothing: what was seen was seen then."""

    def anchor(self, exposed_ns: int, index: int) -> None:
        """Do nothing, unless it shows its images on demand."""

    def pause(self) -> None:
        """Do nothing: it goes on, seen or unseen."""

    def resume(self, now_ns: int) -> None:
        """Do nothing: there is nothing to wake."""

    def close(self) -> None:
        """Forget the recording."""
        self._shown = []

    def _grab(self, shown: Shown, exposed_ns: int, now_ns: int) -> Grab:
        image, sequence = shown.image.loaded(), self._sequence
        self._sequence += 1
        fault = find_fault(image.pixel_format, image.payload)
        try:
            width, height = size_px(image) if fault is None else (0, 0)
        except SpoiledImageError as error:
            fault, (width, height) = error.fault, (0, 0)
        if fault is not None:
            return Spoiled(sequence, fault)
        clock = self._settings.clock
        return Frame(
            sequence=sequence,
            exposed=Stamp(exposed_ns, clock),
            grabbed=Stamp(now_ns, clock),
            width_px=width,
            height_px=height,
            pixel_format=image.pixel_format,
            exposure_ns=None,
            payload=image.payload,
        )


class RecordedStills(_Shower):
    """Shows an image whenever one is asked for. Those of one moment have the same number on both sides.

    Those without a partner are not shown, unless the recording is of one camera.

    Attributes:
        images: what its description tells of them.
        numbers: their numbers.

    Args:
        settings: what to show.
        now_ns: not used: every image waits.
    """

    def __init__(self, settings: RecordedSettings, now_ns: int) -> None:
        del now_ns
        super().__init__(settings)
        paired = _paired(self._found, self._topic)
        self._shown = paired or self._shown
        self.numbers = tuple(range(len(paired)))
        ends = (self.numbers[0], self.numbers[-1]) if self.numbers else (None, None)
        self.images = ImageNumbers(count=len(self._shown), first=ends[0], last=ends[1], looped=settings.loop)
        self.description = replace(self.description, name=with_numbers(self.description.name, self.images))
        self._first_ns: int | None = None
        self._next = 0

    def due_ns(self, now_ns: int) -> int:
        """Never by itself."""
        del now_ns
        return _FAR_FUTURE

    def anchor(self, exposed_ns: int, index: int) -> None:
        """See Camera."""
        self._first_ns = exposed_ns - self._label_ns(index)
        self._next = index

    def read(self, now_ns: int) -> list[Grab]:
        """Return the next image."""
        if self._first_ns is None:
            self.anchor(now_ns, 0)
        assert self._first_ns is not None
        index, count = self._next, len(self._shown)
        if index >= count and not self._settings.loop:
            return [Ended()]
        self._next += 1
        return [self._grab(self._shown[index % count], self._first_ns + self._label_ns(index), now_ns)]

    def _label_ns(self, index: int) -> int:
        return index * self.description.period_ns


def _paired(found: Recorded, topic: str) -> list[Shown]:
    """Return those images of a stream that have a partner in the other one; none if it is the only one."""
    pair = [found.topic_of(side) for side in ("left", "right")]
    if topic not in pair or "" in pair:
        return []
    streams = [sorted(found.images[each], key=lambda shown: shown.image.stamp_ns) for each in pair]
    stamps = [[shown.image.stamp_ns for shown in stream] for stream in streams]
    side = pair.index(topic)
    places = pairs_of_two(stamps[0], stamps[1], max(map(period_ns, streams)) // 2)
    return [streams[side][both[side]] for both in places]


class RecordedFilm(_Shower):
    """Shows the images at their times: each is there as long after its exposure as it was then.

    Args:
        settings: what to show.
        now_ns: CLOCK_MONOTONIC now, ns: when it begins, unless it loops.
    """

    def __init__(self, settings: RecordedSettings, now_ns: int) -> None:
        super().__init__(settings)
        every = [shown for stream in self._found.images.values() for shown in stream]
        self._zero_ns = min(shown.image.stamp_ns for shown in every)
        longest_ns = max(period_ns(stream) for stream in self._found.images.values())
        last_ns = max(shown.image.stamp_ns for shown in every) - self._zero_ns
        self._lap_ns = (last_ns // longest_ns + 1) * longest_ns  # whole periods: the next lap is in step
        self._shown = sorted(self._shown, key=lambda shown: shown.grabbed_ns)
        self._lap, self._next = 0, 0
        self._start_ns = now_ns
        if settings.loop:
            self._start_ns = 0
            self._lap = now_ns // self._lap_ns
            passed_ns = now_ns % self._lap_ns
            self._next = sum(shown.grabbed_ns - self._zero_ns < passed_ns for shown in self._shown)
            self._turn()

    def due_ns(self, now_ns: int) -> int:
        """When the next image is there; at once after the last, to tell so."""
        if self._next >= len(self._shown):
            return now_ns
        return self._offset_ns + self._shown[self._next].grabbed_ns

    def read(self, now_ns: int) -> list[Grab]:
        """Return the images that have come since."""
        grabs: list[Grab] = []
        while self._next < len(self._shown) and self.due_ns(now_ns) <= now_ns and len(grabs) < _MOST_AT_ONCE:
            shown = self._shown[self._next]
            grabs.append(self._grab(shown, self._offset_ns + shown.image.stamp_ns, now_ns))
            self._next += 1
            self._turn()
        if not grabs and self._next >= len(self._shown):
            return [Ended()]
        return grabs

    @property
    def _offset_ns(self) -> int:
        return self._start_ns + self._lap * self._lap_ns - self._zero_ns

    def _turn(self) -> None:
        if self._settings.loop and self._next >= len(self._shown):
            self._lap, self._next = self._lap + 1, 0


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

    Returns:
        The settings.

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

    Args:
        settings: what to show.
        now_ns: CLOCK_MONOTONIC now, ns.

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
