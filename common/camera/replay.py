"""A camera that shows a folder of images, in name order, by the clock or on demand.

pace=clock: at any moment the image is number floor(t * fps) of CLOCK_MONOTONIC, exposed exactly at k / fps. So two replays on one machine agree
whenever they were started; `phase_ms` delays all its exposures by that much. A slower mode shows every n-th of these images at its own time.
pace=demand: one image per read, nothing dropped; the stamps are first + k / fps, where k counts from the first image's number in its name:
a missing number leaves a gap. Where the numbers are times, the stamps are these, modulo 2**59. The camera's name tells how many images there are and their numbers (`image_numbers.py`).
"""

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Final

from common.camera.base import CameraHealth, Ended, Grab, Mode, Offers, Skipped, Spoiled
from common.camera.image_numbers import TIMES_RING, ImageNumbers, numbers_of, with_numbers
from common.camera.imagefile import SUFFIXES, ImageFile, load
from common.errors import DataError, SettingsError, UnavailableError
from common.frame import Frame, FrameFault, find_fault
from common.name_order import name_order
from common.places import Kind, kind_of
from common.protocol.message import CameraDescription, Pacing, Steering
from common.stamp import Stamp

_FAR_FUTURE: Final = 2**63 - 1
_CACHE_BYTES: Final = 64 * 1024 * 1024
"""Files are cached in memory up to this size: a tenth of a BeagleBone's RAM, and no disk delay in measurements with short clips."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplaySettings:
    """What to show, and when.

    Attributes:
        path: a folder, or a glob.
        fps: images per second.
        loop: begin again after the last.
        pacing: by the clock or on demand.
        clock: name of the clock of the stamps.
        phase_ns: with the clock, delay of every exposure after k / fps: a camera that is out of step with others.
    """

    path: str
    fps: Fraction = Fraction(30)
    loop: bool = False
    pacing: Pacing = Pacing.CLOCK
    clock: str = "host"
    phase_ns: int = 0


def find_images(pattern: str) -> list[Path]:
    """List the images that a folder or glob names, in name order.

    Returns:
        At least one path.

    Raises:
        SettingsError: the pattern is empty or not a glob.
        UnavailableError: there is no such folder, or it cannot be read.
        DataError: it holds no image.
    """
    folder = Path(pattern)
    try:
        if not pattern:
            raise SettingsError("replay: names no folder", "give a folder of images, an image or a quoted glob")
        kind = kind_of(folder)
        if kind is Kind.FOLDER:
            shown = (path for path in folder.iterdir() if not path.name.startswith("."))  # ._1.png: macOS, on any stick
            found = [path for path in shown if path.suffix.lower() in SUFFIXES]
        elif kind is Kind.MISSING and any(letter in pattern for letter in "*?["):
            anchor = Path(folder.anchor or ".")
            found = [
                path
                for path in anchor.glob(str(folder.relative_to(anchor) if folder.anchor else folder))
                if kind_of(path) is Kind.FILE
            ]
        elif kind is Kind.FILE:
            found = [folder]
        else:
            what = "does not exist" if kind is Kind.MISSING else f"is {kind.value}, no file of an image"
            raise UnavailableError(f"replay {pattern!r} {what}", "give a folder of images, an image or a quoted glob")
    except OSError as error:
        raise UnavailableError(
            f"replay {pattern!r} cannot be read ({error.strerror})", "check its permissions"
        ) from None
    except RecursionError:
        raise SettingsError(f"replay {pattern[:40]!r} ... has too many folders", "give a shorter pattern") from None
    except ValueError as error:  # pathlib's error for a pattern such as a**b
        raise SettingsError(
            f"replay {pattern!r} is not a valid pattern ({error})", "give a folder or another pattern"
        ) from None
    if not found:
        raise DataError(
            f"replay {pattern!r} holds no image",
            f"put {', '.join(sorted(SUFFIXES))} files there or give another folder",
        )
    return sorted(found, key=name_order)


def _in_order(paths: list[Path], pacing: Pacing) -> tuple[list[Path], tuple[int, ...]]:
    """Return images in the order in which they are shown, with their numbers; none if their names do not number them.

    A film stays in name order; stills come in the order of their numbers.
    """
    numbers = numbers_of([path.stem for path in paths])
    if not numbers or (pacing is Pacing.CLOCK and list(numbers) != sorted(numbers)):
        return paths, ()
    ordered = sorted(zip(numbers, paths, strict=True))
    return [path for _, path in ordered], tuple(number for number, _ in ordered)


class ReplayCamera:
    """A folder of images as a camera.

    Attributes:
        images: what its description tells of them.
        numbers: the numbers in their names, in the order of showing; empty if the names do not number them.
        stored: how the first image becomes upright by its own header.

    Args:
        settings: what to show.
        now_ns: CLOCK_MONOTONIC now, ns; images before it are not shown.

    Raises:
        UnavailableError: there is no such folder.
        DataError: there is no image, one is unreadable, or images differ in size or encoding.
    """

    def __init__(self, settings: ReplaySettings, now_ns: int) -> None:
        self._settings = settings
        self._paths, self.numbers = _in_order(find_images(settings.path), settings.pacing)
        self.images = ImageNumbers(
            count=len(self._paths),
            first=self.numbers[0] if self.numbers else None,
            last=self.numbers[-1] if self.numbers else None,
            looped=settings.loop,
        )
        self._cache: list[tuple[ImageFile, FrameFault | None] | None] = [None] * len(self._paths)
        self._cached_bytes = 0
        # Image k is exposed k * _step / _rate ns after the start. Integers, because a Fraction costs 0.1 ms a frame where caches are cold.
        self._step, self._rate = settings.fps.denominator * 1_000_000_000, settings.fps.numerator
        first = self._check_alike()
        self.stored = first.orientation
        self._period_ns = self._step // self._rate
        name = Path(settings.path).name
        steering = Steering.GRID if settings.pacing is Pacing.CLOCK else Steering.NONE
        self.description = CameraDescription(
            name=with_numbers(f"replay {name}", self.images),
            width_px=first.width_px,
            height_px=first.height_px,
            pixel_format=first.pixel_format,
            period_ns=self._period_ns,
            pacing=settings.pacing,
            steering=steering,
        )
        self._phase_ns = settings.phase_ns
        strides = _STRIDES if settings.pacing is Pacing.CLOCK else ()
        self.offers = Offers(tuple(self._period_ns * stride for stride in strides))
        self._stride = 1
        self.pollable: int | None = None
        self.health = CameraHealth()
        self._next = self._index_at(now_ns) + 1 if settings.pacing is Pacing.CLOCK else 0
        self._first_shown = self._next
        self._first_ns: int | None = None
        self._due_ns = self._time_of(self._next) if settings.pacing is Pacing.CLOCK else _FAR_FUTURE
        self._sequence = 0

    def due_ns(self, now_ns: int) -> int:
        """When the next image is exposed; never by itself on demand."""
        del now_ns
        return self._due_ns

    def anchor(self, exposed_ns: int, index: int) -> None:
        """Make a demand-paced camera's next image number `index`, exposed at `exposed_ns`. Without this, the first read sets the time."""
        if self._settings.pacing is Pacing.DEMAND:
            self._first_ns = 0
            self._first_ns = exposed_ns - self._time_of(index)
            self._next = index

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Delay all coming images by this much. Their content stays the same; only a real camera would see a later moment."""
        del now_ns
        if self._settings.pacing is Pacing.CLOCK:
            self._phase_ns += later_ns
            self._due_ns = self._time_of(self._next)

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Show only every n-th image: those whose number is divisible by n, so that two replays still show the same one at a time."""
        del now_ns
        if mode.period_ns not in self.offers.periods_ns:
            return
        self._stride = mode.period_ns // self._period_ns
        self._next = -(-self._next // self._stride) * self._stride
        self._due_ns = self._time_of(self._next)
        self.description = replace(self.description, period_ns=mode.period_ns)

    def read(self, now_ns: int) -> list[Grab]:
        """Return the images that have become due. If several were missed, return all of them, so that each is accounted for.

        Raises:
            DataError: a file has become unreadable.
        """
        grabs: list[Grab]
        if self._settings.pacing is Pacing.DEMAND:
            if self._first_ns is None:
                self.anchor(self._time_of(0) if self.images.are_times else now_ns, 0)
            return [self._grab(now_ns, self._time_of(self._next))]
        if now_ns < self._due_ns:
            return []
        if now_ns < (next_ns := self._time_of(self._next + self._stride)):  # the usual case: one image
            grabs = [self._grab(now_ns, self._due_ns)]
            self._due_ns = next_ns
            return grabs
        newest = self._index_at(now_ns) // self._stride * self._stride
        # After a long stall (a stopped process) only the newest images are read; the others are reported by number.
        passed = max(0, (newest - self._next) // self._stride + 1 - _BACKLOG) if self._settings.loop else 0
        grabs = [Skipped(self._sequence, passed)] if passed else []
        self._sequence += passed
        self._next += passed * self._stride
        while self._next <= newest and not (grabs and isinstance(grabs[-1], Ended)):
            grabs.append(self._grab(now_ns, self._time_of(self._next)))
        self._due_ns = self._time_of(self._next)
        return grabs

    def pause(self) -> None:
        """Do nothing: a film on the clock goes on, seen or unseen."""

    def resume(self, now_ns: int) -> None:
        """Do nothing: there is nothing to wake."""

    def close(self) -> None:
        """Forget the files."""
        self._cache = [None] * len(self._paths)

    def _grab(self, now_ns: int, exposed_ns: int) -> Grab:
        index = self._next
        shown = index - self._first_shown
        if not self._settings.loop and shown >= len(self._paths):
            return Ended()
        self._next += self._stride
        sequence = self._sequence
        self._sequence += 1
        # On the clock the time alone determines the image, so that two replays agree; without loop, the first image comes first.
        position = (index if self._settings.loop else shown) % len(self._paths)
        image, fault = self._cache[position] or self._load(position)
        if fault is not None:
            return Spoiled(sequence, fault)
        exposed = Stamp(exposed_ns, self._settings.clock)
        grabbed = Stamp(now_ns, self._settings.clock)
        return Frame(
            sequence=sequence,
            exposed=exposed,
            grabbed=grabbed,
            width_px=image.width_px,
            height_px=image.height_px,
            pixel_format=image.pixel_format,
            exposure_ns=None,
            payload=image.payload,
        )

    def _time_of(self, index: int) -> int:
        start = self._phase_ns if self._settings.pacing is Pacing.CLOCK else self._first_ns or 0
        if self._settings.pacing is Pacing.DEMAND and self.numbers:
            lap, position = divmod(index, len(self.numbers))
            if self.images.are_times:  # the same in each lap: the sequence tells the lap
                return start + self.numbers[position] % TIMES_RING
            span = self.numbers[-1] - self.numbers[0] + 1
            index = lap * span + self.numbers[position] - self.numbers[0]
        return start + (2 * index * self._step + self._rate) // (2 * self._rate)  # rounded to the nearest ns

    def _index_at(self, now_ns: int) -> int:
        # Rounding to ns may put an exposure just before or just after its exact time; adding half a ns decides as `_time_of` does.
        index = (2 * (now_ns - self._phase_ns) + 1) * self._rate // (2 * self._step)
        return index if self._time_of(index) <= now_ns else index - 1

    def _load(self, position: int) -> tuple[ImageFile, FrameFault | None]:
        image = load(self._paths[position])
        known = image, find_fault(image.pixel_format, image.payload)
        if self._cached_bytes + len(image.payload) <= _CACHE_BYTES:
            self._cache[position] = known
            self._cached_bytes += len(image.payload)
        return known

    def _check_alike(self) -> ImageFile:
        first, _ = self._load(0)
        for position, path in enumerate(self._paths[1:], start=1):
            other, _ = self._load(position)
            if (other.width_px, other.height_px) != (first.width_px, first.height_px):
                theirs, ours = f"{other.width_px}x{other.height_px}", f"{first.width_px}x{first.height_px}"
                raise DataError(
                    f"{path} is {theirs}, {self._paths[0].name} is {ours}",
                    "give images of one size: a camera has only one",
                )
            if other.pixel_format is not first.pixel_format:
                raise DataError(
                    f"{path} is {other.pixel_format.value}, {self._paths[0].name} is {first.pixel_format.value}",
                    "give images of one file format",
                )
        return first


_STRIDES: Final = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
"""Every how many-th image a slower mode shows. Each rate is a quarter to a half below the previous one."""

_BACKLOG: Final = 64
"""Most images read at once: two seconds of video, at least as much as any driver's ring could hold."""
