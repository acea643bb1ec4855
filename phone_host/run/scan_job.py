"""Scans pairs of image files, one after another. The root of `scan` for files.

A pair that cannot be computed is named, and the others go on. After Ctrl-C or SIGTERM the model of the pairs so far is written.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from common import now
from common.errors import DataError
from common.imagesize.head import MOST_PIXELS
from common.orientation import UPRIGHT, Orientation
from common.program.out_of_memory import noted_if_out_of_memory
from common.words import counted
from phone_host.measure.trust import Doubt
from phone_host.model import Processed
from phone_host.output.axes import Axes
from phone_host.report.page_links import NextCommand
from phone_host.report.scan_report import ScanReport
from phone_host.report.stereo_report import FailedPair, Remark, Size
from phone_host.run.cores import Cores
from phone_host.run.file_remarks import files_remarks
from phone_host.run.freed_memory import keep_freed_memory
from phone_host.run.kept import kept_if_interrupted, tell_if_heard, tell_of_partial
from phone_host.run.kept_submaps import KeptSubmaps
from phone_host.run.scan_files import FinishedScan, write_scan
from phone_host.run.scan_result import report_of, require_something
from phone_host.run.stereo_job import Watcher
from phone_host.run.stereo_trust import judge_pair
from phone_host.run.turn_remarks import field_of_turn, turn_remarks
from phone_host.run.unused_mat import unused_mat
from phone_host.scan.factory import scan_for
from phone_host.scan.mat import MatInView
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair, Submap
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import decode_files, open_image
from phone_host.stereo.view_files import ViewFiles


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanJob:
    """What to scan, and where to.

    Attributes:
        files: the pairs.
        out: the results folder.
        make_core: makes the stereo core, with geometry, for images of this size (width and height of the left one, px).
        matcher: its name, for the report.
        matcher_note: what is to be said of the choice of the matcher; empty: nothing.
        wanted: how the model is made.
        axes: of model.ply and trajectory.txt.
        most_pixels: an image that claims more is refused.
        mounted: by which turns the left and the right images become upright, after what their EXIF headers say.
        commands: what to do next, for the page.
        resumed: submaps of a scan that was killed, to go on from; their pairs are not computed again.
        tell: takes a line that the user should know.
    """

    files: ViewFiles
    out: Path
    make_core: Callable[[Size], StereoCore]
    matcher: str
    wanted: ScanWanted
    matcher_note: str = ""
    axes: Axes = Axes.CAMERA
    most_pixels: int = MOST_PIXELS
    mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT)
    commands: tuple[NextCommand, ...] = ()
    resumed: tuple[Submap, ...] = ()
    tell: Callable[[str], None] = lambda _: None


def run_scan(job: ScanJob, watcher: Watcher) -> ScanReport:
    """Scan all pairs, and write what came of them; after Ctrl-C or SIGTERM that of the pairs so far.

    Args:
        job: what to do.
        watcher: is told how far it is.

    Returns:
        The report.

    Raises:
        DataError: there are fewer than two pairs, none can be computed, or none has depth.
        SettingsError: the core cannot be made so.
        UnavailableError: a file in the results folder was not written by this program.
        OSError: the results cannot be written.
    """
    count = len(job.files.pairs)
    if count < 2:
        raise DataError(
            "there is only one pair: a scan puts views from several places together",
            "take more of them, each sharing most of what the last one shows; for one pair there is `phone-host stereo`",
        )
    keep_freed_memory()
    work = _Work(job, watcher)

    def write_so_far() -> None:
        if work.scan.fused:
            goes_on = "" if job.wanted.turntable else f"; --resume {job.out} goes on with it"
            tell_if_heard(
                job.tell, f"stopped after {work.taken} of {counted(count, 'pair')}: writing their model{goes_on}"
            )
            finished = work.finished()  # first, for it makes the field whole where a loop was just moving it
            work.kept.before_end()
            write_scan(
                job.out,
                replace(finished, report=replace(finished.report, interrupted_of=count)),
                lambda place: tell_of_partial(job.tell, place, job.out, work.taken, count),
            )

    with kept_if_interrupted(write_so_far):
        for name, left, right in job.files.pairs:
            if not work.is_known(name):
                work.tried(name, left, right)
            watcher()
        watcher.say("making the surface")
        finished = work.finished()
    require_something(finished.report)
    write_scan(job.out, finished)
    work.kept.done()
    return finished.report


class _Work:
    """Takes one pair after another."""

    def __init__(self, job: ScanJob, watcher: Watcher) -> None:
        self._job, self._watcher = job, watcher
        self._cores = Cores(job.make_core)
        self.scan = scan_for(job.wanted, self._tell_of_mat)
        self.kept = KeptSubmaps(job.out, self.scan, job.resumed)
        self._known = {pair.name: pair for pair in self.scan.pairs}
        self._is_judged = False
        self._pairs: list[ScannedPair | FailedPair] = []
        self._doubts: dict[str, Remark] = {}

    @property
    def taken(self) -> int:
        """Pairs that were tried so far."""
        return len(self._pairs)

    def is_known(self, name: str) -> bool:
        """Note a pair that is in the submaps; return whether it is."""
        known = self._known.get(name)
        if known is not None:
            self._pairs.append(known)
        return known is not None

    def tried(self, name: str, left: Path, right: Path) -> None:
        """Take a pair; one that cannot be computed is noted.

        Raises:
            DataError: no pair can be computed.
            SettingsError: the core cannot be made so.
        """
        try:
            with noted_if_out_of_memory(f"{left} and {right}"):
                self._pairs.append(self._taken(name, left, right))
                self.kept.after_pair()  # an interrupt here finds the pair in the report, too
        except DataError as error:
            if self._cores.has_none:  # no pair can be computed without one
                raise
            self._pairs.append(FailedPair.because(error, name, str(left), str(right)))

    def _taken(self, name: str, left: Path, right: Path) -> ScannedPair:
        index, limit, (of_left, of_right) = len(self._pairs), self._job.most_pixels, self._job.mounted
        self._watcher.say(f"reading {name}")
        opened = open_image(left, limit, of_left), open_image(right, limit, of_right)
        core = self._cores.for_pair(*opened)
        sizes_px = opened[0].size_px, opened[1].size_px
        images = decode_files(*opened, core.reductions(*sizes_px))
        self._watcher.say(f"matching {name}")
        processed = core.compute(*images, now.monotonic_ns, whole_px=sizes_px)
        if (
            index & (index - 1) == 0 or not self._is_judged
        ):  # 0, 1, 2, 4, 8 ...: what is wrong with a rig is wrong with all of its pairs
            self._judge(core, processed)
        pair = self.scan.take(name, float(name) if self._job.files.by_number else float(index), processed)
        if pair.weakness.advice:
            self._watcher.say(f"{name}: {pair.weakness.advice}")
        return pair

    def _tell_of_mat(self, _: MatInView) -> None:
        if remark := unused_mat(self.scan):
            self._job.tell(remark.line)

    def _judge(self, core: StereoCore, processed: Processed) -> None:
        self._is_judged = True
        for concern in judge_pair(core, processed, self._job.mounted).concerns:
            blocks = concern.is_certain and concern.doubt is not Doubt.NO_DEPTH
            self._doubts.setdefault(concern.doubt.value, Remark(concern.sentence, concern.remedy, is_blocking=blocks))

    def finished(self) -> FinishedScan:
        """Make the surface and the report of the pairs so far."""
        model = self.scan.model()
        remarks = (
            *self._doubts.values(),
            *files_remarks(self._job.files, self._job.matcher_note),
            *self.kept.remarks,
            *turn_remarks(self.scan),
        )
        pairs = [pair if isinstance(pair, FailedPair) else self.scan.final(pair) for pair in self._pairs]
        report = report_of(self.scan, model, pairs, remarks, matcher=self._job.matcher, axes=self._job.axes)
        return FinishedScan(report, model, self._job.commands, field_of_turn(self.scan))
