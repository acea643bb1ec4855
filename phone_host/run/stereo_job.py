"""Computes pairs of image files, one at a time, and writes what comes of each. The root of `stereo`.

A pair that cannot be computed ends the work only if it is the only one; of several, it is named and the others go on.
Wrong settings and a results folder that cannot be written to end the work at once.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Protocol

from common import now
from common.errors import DataError, SettingsError
from common.imagesize.head import MOST_PIXELS
from common.ledger import StageTimes
from common.orientation import UPRIGHT, Orientation
from common.program.out_of_memory import noted_if_out_of_memory
from phone_host.calibration.drift.see import StillsWatch
from phone_host.model import Drift
from phone_host.output.atomic import write_text
from phone_host.output.axes import Axes
from phone_host.output.json_text import json_text
from phone_host.output.pair_files import STEREO_FILES, available, write_pair
from phone_host.report.page_links import NextCommand
from phone_host.report.report_page import Picture
from phone_host.report.stereo_json import pair_json, set_json
from phone_host.report.stereo_report import (
    FailedPair,
    PairReport,
    SetReport,
    Size,
)
from phone_host.run.cores import Cores
from phone_host.run.file_remarks import files_remarks
from phone_host.run.freed_memory import keep_freed_memory
from phone_host.run.kept import kept_if_interrupted, tell_of_partial
from phone_host.run.stereo_pages import pair_page, pair_thumbnail, set_page
from phone_host.run.stereo_remarks import drift_remarks, pair_remarks, turned_remarks
from phone_host.run.stereo_results import StereoResults
from phone_host.run.stereo_trust import judge_pair
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import density, look_at, maps_of
from phone_host.stereo.images import decode_files, open_image, size_px
from phone_host.stereo.view_files import ViewFiles

_WRITERS: Final = 2
"""Threads that write one pair's files. Packing and compressing release the interpreter; the disk is one."""

_CORE_STAGES: Final = ("rectifying", "matching", "computing points")


class Watcher(Protocol):
    """Is told how far the work is."""

    def __call__(self, amount: int = 1) -> None:
        """So many more pairs are done."""

    def say(self, what: str) -> None:
        """This is being done from now on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoJob:
    """What to compute, and where to.

    Attributes:
        files: the pairs.
        out: the results folder.
        make_core: makes the stereo core for images of this size (width and height of the left one, px).
        matcher: its name, for the report.
        matcher_note: what is to be said of the choice of the matcher; empty: nothing.
        axes: of cloud.ply and xyz.pfm.
        most_pixels: an image that claims more is refused.
        mounted: by which turns the left and the right images become upright, after what their EXIF headers say.
        commands: returns what to do next, for the page of these pairs.
        tell: takes a line that the user should know.
    """

    files: ViewFiles
    out: Path
    make_core: Callable[[Size], StereoCore]
    matcher: str
    matcher_note: str = ""
    axes: Axes = Axes.CAMERA
    most_pixels: int = MOST_PIXELS
    mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT)
    commands: Callable[[Sequence[PairReport]], tuple[NextCommand, ...]] = lambda _: ()
    tell: Callable[[str], None] = lambda _: None


def run_stereo(job: StereoJob, watcher: Watcher) -> SetReport:
    """Compute and write all pairs.

    Args:
        job: what to do.
        watcher: is told how far it is.

    Returns:
        The report. report.json holds it: that of the only pair, or that of all pairs together.

    Raises:
        DataError: the only pair, or all pairs, could not be computed.
        SettingsError: the core cannot be made so.
        UnavailableError: a file in the results folder was not written by this program.
        OSError: the results cannot be written.
    """
    keep_freed_memory()
    is_one = len(job.files.pairs) == 1
    with StereoResults(job.out, is_one=is_one) as results:
        work = _Work(job, results, watcher)
        if is_one:
            _, left, right = job.files.pairs[0]
            with noted_if_out_of_memory(f"{left} and {right}"):
                done = _set(job, (work.computed("", left, right),))
            results.publish()
            return done
        pairs: list[PairReport | FailedPair] = []

        def write_so_far() -> None:
            so_far = replace(_set(job, tuple(pairs), work.drift), interrupted_of=len(job.files.pairs))
            if so_far.computed:
                _write_set(job, results, work, so_far)
                if (partial := results.publish_partial()) is not None:
                    tell_of_partial(job.tell, partial, job.out, len(pairs), len(job.files.pairs))

        with kept_if_interrupted(write_so_far):
            for number, (name, left, right) in enumerate(job.files.pairs):
                folder = f"pair-{int(name) if job.files.by_number else number:06d}"
                pairs.append(work.tried(folder, left, right))
                watcher()
        report = _set(job, tuple(pairs), work.drift)
        if not report.computed:
            raise report.failed[0].none_of(len(pairs))
        _write_set(job, results, work, report)
        results.publish()
        return report


def _write_set(job: StereoJob, results: StereoResults, work: "_Work", report: SetReport) -> None:
    results.write_text("report.json", json_text(set_json(report), indent=2) + "\n")
    results.write_text("index.html", set_page(report, work.thumbnails, job.commands(report.computed)))


def _set(job: StereoJob, pairs: tuple[PairReport | FailedPair, ...], drift: Drift | None = None) -> SetReport:
    left, right = (tuple(map(str, alone)) for alone in (job.files.left_alone, job.files.right_alone))
    return SetReport(
        pairs=pairs,
        by_number=job.files.by_number,
        by_name=job.files.by_name,
        left_alone=left,
        right_alone=right,
        remarks=() if len(pairs) == 1 else (*files_remarks(job.files, job.matcher_note), *drift_remarks(drift)),
        drift=drift,
    )


class _StopWatch:
    """Times the stages of one pair, one after the other."""

    def __init__(self) -> None:
        self._laps_ns: list[tuple[str, int]] = []
        self._start_ns = self._last_ns = now.monotonic_ns()

    def lap(self, stage: str) -> None:
        at_ns = now.monotonic_ns()
        self._laps_ns.append((stage, at_ns - self._last_ns))
        self._last_ns = at_ns

    def take_over(self, stages: StageTimes) -> None:
        """Add the stages that the core has timed meanwhile."""
        self._laps_ns += [(stage, getattr(stages, stage)) for stage in ("rectify", "match", "reproject")]
        self._last_ns = now.monotonic_ns()

    def times_ms(self) -> tuple[tuple[str, float], ...]:
        laps = [*self._laps_ns, ("total", self._last_ns - self._start_ns)]
        return tuple((stage, ns / 1e6) for stage, ns in laps)


class _StageClock:
    """The core's clock. The core asks for the time at the start of each stage, so this also tells which one begins."""

    def __init__(self, watcher: Watcher, about: str) -> None:
        self._watcher, self._about = watcher, about
        self._stages = iter(_CORE_STAGES)

    def __call__(self) -> int:
        if (stage := next(self._stages, None)) is not None:
            self._watcher.say(f"{stage}{self._about}")
        return now.monotonic_ns()


class _Work:
    """Computes one pair after the other with as few cores as possible."""

    def __init__(self, job: StereoJob, results: StereoResults, watcher: Watcher) -> None:
        self._job, self._results, self._watcher = job, results, watcher
        self._cores = Cores(job.make_core)
        self._rig = StillsWatch()
        self.thumbnails: dict[str, Picture] = {}

    @property
    def drift(self) -> Drift | None:
        """How the rig has stood over the pairs so far; None without a rig."""
        return self._rig.drift

    def tried(self, folder: str, left: Path, right: Path) -> PairReport | FailedPair:
        """Compute and write a pair, or say why not."""
        try:
            with noted_if_out_of_memory(f"{left} and {right}"):
                return self.computed(folder, left, right)
        except (DataError, SettingsError) as error:  # or a --crop that lies outside images of this size
            if self._cores.has_none:  # no pair can be computed without one
                raise
            return FailedPair.because(error, folder, str(left), str(right))

    def computed(self, folder: str, left: Path, right: Path) -> PairReport:
        """Compute and write a pair. `folder` is empty for the only one."""
        watch, about = _StopWatch(), f" {folder}" if folder else ""
        self._watcher.say(f"reading{about}")
        limit, (of_left, of_right) = self._job.most_pixels, self._job.mounted
        opened = open_image(left, limit, of_left), open_image(right, limit, of_right)
        core = self._cores.for_pair(*opened)
        watch.lap("prepare")
        sizes_px = opened[0].size_px, opened[1].size_px
        images = decode_files(*opened, core.reductions(*sizes_px))
        self._results.open()
        watch.lap("read")
        processed = core.compute(*images, _StageClock(self._watcher, about), whole_px=sizes_px)
        watch.take_over(processed.stages)
        self._watcher.say(f"checking{about}")
        look = look_at(processed, maps_of(core, processed))
        trust = judge_pair(core, processed, self._job.mounted, look)
        self._rig.add(core, processed, look)
        watch.lap("judge")
        self._watcher.say(f"writing{about}")
        planned = available(
            STEREO_FILES,
            has_disparity=processed.disparity is not None,
            has_cloud=processed.cloud is not None,
        )
        names = [*(file.value for file in planned), "report.json", "index.html"]
        with (
            ThreadPoolExecutor(_WRITERS) as writers,
            self._results.folder_of(folder, names, writers.map) as place,
        ):
            try:
                written = write_pair(place, processed, planned, self._job.axes, writers.map)
            except BaseException:
                writers.shutdown(cancel_futures=True)  # the other thread's file must be there when all are removed
                raise
            watch.lap("write")
            remarks = [
                *turned_remarks(*opened),
                *pair_remarks(processed, trust, core.wanted.search_from_m),
                *(() if folder else files_remarks(self._job.files, self._job.matcher_note)),
            ]
            report = PairReport(
                name=folder,
                left=str(left),
                right=str(right),
                left_px=size_px(images[0]),
                right_px=size_px(images[1]),
                rectified_px=size_px(processed.pair.left),
                matcher=self._job.matcher,
                search=processed.search,
                match_report=processed.match_report,
                geometry=processed.geometry,
                limits=processed.limits,
                cut=processed.cut,
                density=density(processed),
                axes=self._job.axes,
                written=written,
                stages_ms=watch.times_ms(),
                remarks=tuple(remarks),
                trust=trust,
            )
            write_text(place / "report.json", json_text(pair_json(report), indent=2) + "\n")
            write_text(place / "index.html", pair_page(report, processed, self._job.commands((report,))))
        if folder and (picture := pair_thumbnail(processed)) is not None:
            self.thumbnails[folder] = picture
        return report
