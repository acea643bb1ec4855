"""Computes pairs of image files one after another; `stereo`, `quality` and `scan` take what comes of each. The loop of everything that reads files.

A pair that cannot be computed is named, and the others go on. Without a core no pair can be computed: that ends the work.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol, TypeVar

from common import now
from common.diagnostic import Diagnostic, Severity
from common.errors import DataError, SettingsError
from common.imagesize.head import MOST_PIXELS
from common.orientation import UPRIGHT, Orientation
from common.program.out_of_memory import noted_if_out_of_memory
from common.words import counted
from phone_host.diagnostics.codes import BLOCKING
from phone_host.model import Processed
from phone_host.report.stereo_report import FailedPair, Size
from phone_host.run.kept import keep_freed_memory, kept_if_interrupted, partial_words, tell_if_heard
from phone_host.run.stereo_remarks import files_remarks, judge_pair
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import EncodedFile, decode_files, open_image, require_same_size, size_px
from phone_host.stereo.view_files import ViewFiles

T = TypeVar("T")
R = TypeVar("R")

MATCHING: Final = ("matching",)
EACH_STAGE: Final = ("rectifying", "matching", "computing points")
"""What a watcher is told of the core's work: that it has begun, or each stage."""


class Watcher(Protocol):
    """Is told how far the work is."""

    def __call__(self, amount: int = 1) -> None:
        """So many more pairs are done."""

    def say(self, what: str) -> None:
        """This is being done from now on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Matching:
    """How pairs of image files are read and matched.

    Attributes:
        make_core: makes the stereo core for images of this size (width and height of the left one, px).
        most_pixels: an image that claims more is refused.
        mounted: by which turns the left and the right images become upright, after what their EXIF headers say.
    """

    make_core: Callable[[Size], StereoCore]
    most_pixels: int = MOST_PIXELS
    mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT)


@dataclass(frozen=True, slots=True, kw_only=True)
class FilePairs(Matching):
    """Pairs of image files, and where the results go.

    Attributes:
        files: the pairs.
        out: the results folder.
        matcher: its name, for the report.
        matcher_note: what is to be said of the choice of the matcher; empty: nothing.
        tell: takes a line that the user should know.
    """

    files: ViewFiles
    out: Path
    matcher: str
    matcher_note: str = ""
    tell: Callable[[str], None] = lambda _: None

    @property
    def remarks(self) -> tuple[Diagnostic, ...]:
        """What is to be said of all pairs together; see `files_remarks`."""
        return files_remarks(self.files, self.matcher_note)

    def tell_of_partial(self, place: Path, done: int) -> None:
        """Tell where the results of a part of the pairs are, and that the earlier results stay."""
        count = counted(len(self.files.pairs), "pair")
        tell_if_heard(self.tell, f"ended after {done} of {count}: {partial_words(place, self.out)}")


@dataclass(frozen=True, slots=True, eq=False)
class ComputedPair:
    """A pair that was matched.

    Attributes:
        number: how many pairs came before it.
        label: its name, as the watcher is told.
        opened: both files.
        sizes_px: of both images as they were decoded.
        core: what matched it.
        processed: its images and depth.
        stages_ns: how long each stage took.
        begun_ns: when it was begun, monotonic.
    """

    number: int
    label: str
    opened: tuple[EncodedFile, EncodedFile]
    sizes_px: tuple[Size, Size]
    core: StereoCore
    processed: Processed
    stages_ns: tuple[tuple[str, int], ...]
    begun_ns: int


class PairMatcher:
    """Reads and matches pairs with as few cores as possible.

    Attributes:
        has_no_core: whether no core can be made, so that no pair can be computed.

    Args:
        matching: how.
        watcher: is told how far it is.
        stages: MATCHING or EACH_STAGE.
        ready: called when both images of a pair are decoded.
    """

    def __init__(
        self,
        matching: Matching,
        watcher: Watcher,
        stages: tuple[str, ...] = MATCHING,
        ready: Callable[[], None] = lambda: None,
    ) -> None:
        self._matching, self._watcher, self._stages, self._ready = matching, watcher, stages, ready
        self._core: StereoCore | None = None
        self._size_px: Size = (0, 0)
        self.has_no_core = False

    def match(self, left: Path, right: Path, label: str = "", number: int = 0) -> ComputedPair:
        """Read and match a pair.

        Args:
            left: file of the left image.
            right: file of the right image.
            label: what the watcher is told it is; empty: nothing.
            number: how many pairs came before it.

        Raises:
            DataError: it cannot be computed.
            SettingsError: the core cannot be made so, or its crop lies outside of the images.
        """
        times, about = [now.monotonic_ns()], f" {label}" if label else ""
        self._watcher.say(f"reading{about}")
        limit, (of_left, of_right) = self._matching.most_pixels, self._matching.mounted
        opened = open_image(left, limit, of_left), open_image(right, limit, of_right)
        core = self._core_for(*opened)
        times.append(now.monotonic_ns())
        whole_px = opened[0].size_px, opened[1].size_px
        images = decode_files(*opened, core.reductions(*whole_px))
        self._ready()
        times.append(now.monotonic_ns())
        stages = iter(self._stages)

        def clock() -> int:
            """Tell the time to the core, which asks for it at the start of each stage."""
            if (stage := next(stages, None)) is not None:
                self._watcher.say(f"{stage}{about}")
            return now.monotonic_ns()

        processed = core.compute(*images, clock, whole_px=whole_px)
        laps = ("prepare", times[1] - times[0]), ("read", times[2] - times[1])
        of_core = ((stage, getattr(processed.stages, stage)) for stage in ("rectify", "match", "reproject"))
        sizes_px = size_px(images[0]), size_px(images[1])
        return ComputedPair(number, label, opened, sizes_px, core, processed, (*laps, *of_core), times[0])

    def _core_for(self, left: EncodedFile, right: EncodedFile) -> StereoCore:
        """Return the core for these images; refuse images that it cannot take, before they are decoded."""
        is_rectified = self._core is not None and self._core.rig is None
        if self._core is None or (is_rectified and left.size_px != self._size_px):
            try:
                made = self._matching.make_core(left.size_px)
            except (DataError, SettingsError):
                self.has_no_core = self._core is None
                raise
            self._core, self._size_px = made, left.size_px
        if self._core.rig is None:
            require_same_size(left.size_px, right.size_px, left.name, right.name)
        self._core.require_sizes(left.size_px, right.size_px)
        return self._core


def compute_pairs(
    pairs: FilePairs,
    watcher: Watcher,
    take: Callable[[ComputedPair], T],
    finish: Callable[[list[T | FailedPair]], R],
    keep: Callable[[list[T | FailedPair]], None],
    *,
    label: Callable[[int, str, Path], str] = lambda _number, name, _left: name,
    spared: type[DataError] | tuple[type[DataError], type[SettingsError]] = DataError,
    known: Mapping[str, T] | None = None,
    after: Callable[[], None] = lambda: None,
    stages: tuple[str, ...] = MATCHING,
    ready: Callable[[], None] = lambda: None,
) -> R:
    """Compute all pairs.

    Args:
        pairs: the files.
        watcher: is told how far it is.
        take: makes what comes of a matched pair.
        finish: makes what comes of all, in order.
        keep: writes what has come so far: Ctrl-C or a lack of memory ends the work before it is finished.
        label: gives a pair its name in messages, by its number, its name and its left file.
        spared: errors that cost only their own pair; with a single pair, all are raised.
        known: what came of pairs of an earlier run, by name: they are not computed again.
        after: called after each pair that was computed.
        stages: see `PairMatcher`.
        ready: likewise.

    Raises:
        DataError: none could be computed.
        SettingsError: the core cannot be made so.
    """
    keep_freed_memory()
    done, is_only = list[T | FailedPair](), len(pairs.files.pairs) == 1

    def compute() -> None:  # a frame of its own: when it ends, the core's memory is free
        matcher = PairMatcher(pairs, watcher, stages, ready)
        for number, (name, left, right) in enumerate(pairs.files.pairs):
            called = label(number, name, left)
            if known and name in known:
                done.append(known[name])
            else:
                try:
                    with noted_if_out_of_memory(f"{left} and {right}"):
                        done.append(take(matcher.match(left, right, called, number)))
                        after()  # an interrupt here finds the pair among those that are done
                except spared as error:
                    if matcher.has_no_core or is_only:
                        raise
                    failure = Diagnostic(error.problem, error.remedy, Severity.FAIL)
                    done.append(FailedPair(name=called, left=str(left), right=str(right), failure=failure))
            watcher()
        failed = [pair for pair in done if isinstance(pair, FailedPair)]
        if len(failed) == len(done):
            raise failed[0].none_of(len(done))

    with kept_if_interrupted(lambda: keep(done)):
        compute()
        return finish(done)


def sound_pair(
    matching: Matching, left: Path, right: Path, watcher: Watcher
) -> tuple[ComputedPair, tuple[Diagnostic, ...]]:
    """Match the only pair of a verb, and refuse one that cannot be right.

    Returns:
        The pair, with geometry; and the reasons not to trust it that do not rule it out.

    Raises:
        SettingsError: there is no focal length or no baseline.
        DataError: the pair cannot be computed, or cannot be right.
    """
    pair = PairMatcher(matching, watcher).match(left, right)
    if pair.processed.geometry is None:
        raise SettingsError("there are no millimetres without focal length and baseline", "give --calibration")
    watcher.say("checking")
    concerns = judge_pair(pair.core, pair.processed, matching.mounted).concerns
    blocking = next((concern for concern in concerns if concern.code in BLOCKING), None)
    if blocking is not None:
        why = f"these images cannot be measured, because {blocking.message} ({blocking.remedy})"
        raise DataError(why, "mend that, then try again")
    return pair, concerns
