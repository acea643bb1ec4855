"""Scans pairs of image files, one after another. The root of `scan` for files. After Ctrl-C or SIGTERM the model of the pairs so far is written."""

from dataclasses import replace

from common.errors import DataError
from common.words import counted
from phone_host.output.axes import Axes
from phone_host.report.scan_report import ScanReport
from phone_host.report.stereo_report import FailedPair, Remark
from phone_host.run.file_pairs import ComputedPair, FilePairs, PairMatcher, Watcher, compute_pairs
from phone_host.run.kept import kept_if_interrupted, tell_if_heard
from phone_host.run.kept_submaps import KeptSubmaps
from phone_host.run.scan_files import FinishedScan, write_scan
from phone_host.run.scan_result import report_of, require_something
from phone_host.run.stereo_remarks import files_remarks, judge_pair, remark_of
from phone_host.run.turn_remarks import field_of_turn, turn_remarks
from phone_host.run.unused_mat import unused_mat
from phone_host.scan.factory import scan_for
from phone_host.scan.mat import MatInView
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair, Submap


def run_scan(
    pairs: FilePairs, wanted: ScanWanted, watcher: Watcher, axes: Axes = Axes.CAMERA, resumed: tuple[Submap, ...] = ()
) -> ScanReport:
    """Scan all pairs, and write what came of them; after Ctrl-C or SIGTERM that of the pairs so far.

    Args:
        pairs: the files, and where the results go; their core has geometry.
        wanted: how the model is made.
        watcher: is told how far it is.
        axes: of model.ply and trajectory.txt.
        resumed: submaps of a scan that was killed, to go on from; their pairs are not computed again.

    Returns:
        The report.

    Raises:
        DataError: there are fewer than two pairs, none can be computed, or none has depth.
        SettingsError: the core cannot be made so.
        UnavailableError: a file in the results folder was not written by this program.
        OSError: the results cannot be written.
    """
    count = len(pairs.files.pairs)
    if count < 2:
        raise DataError(
            "there is only one pair: a scan puts views from several places together",
            "take more of them, each sharing most of what the last one shows; for one pair there is `phone-host stereo`",
        )
    work = _Work(pairs, wanted, watcher, axes, resumed)

    def write_so_far() -> None:
        if work.scan.fused:
            goes_on = "" if wanted.turntable else f"; --resume {pairs.out} goes on with it"
            tell_if_heard(
                pairs.tell, f"stopped after {len(work.done)} of {counted(count, 'pair')}: writing their model{goes_on}"
            )
            finished = work.finished()  # first, for it makes the field whole where a loop was just moving it
            work.kept.before_end()
            write_scan(
                pairs.out,
                replace(finished, report=replace(finished.report, interrupted_of=count)),
                lambda place: pairs.tell_of_partial(place, len(work.done)),
            )

    with kept_if_interrupted(write_so_far):
        compute_pairs(
            pairs,
            PairMatcher(pairs, watcher),
            work.done,
            work.take,
            label=lambda _number, name, _left: name,
            known={pair.name: pair for pair in work.scan.pairs},
            after=work.kept.after_pair,
        )
        watcher.say("making the surface")
        finished = work.finished()
    require_something(finished.report)
    write_scan(pairs.out, finished)
    work.kept.done()
    return finished.report


class _Work:
    """Takes one pair after another."""

    def __init__(
        self, pairs: FilePairs, wanted: ScanWanted, watcher: Watcher, axes: Axes, resumed: tuple[Submap, ...]
    ) -> None:
        self._files, self._watcher, self._axes = pairs, watcher, axes
        self.scan = scan_for(wanted, self._tell_of_mat)
        self.kept = KeptSubmaps(pairs.out, self.scan, resumed)
        self._is_judged = False
        self.done: list[ScannedPair | FailedPair] = []
        self._doubts: dict[str, Remark] = {}

    def take(self, pair: ComputedPair) -> ScannedPair:
        """Take a pair into the model."""
        number, name = pair.number, pair.label
        # 0, 1, 2, 4, 8 ...: what is wrong with a rig is wrong with all of its pairs
        if number & (number - 1) == 0 or not self._is_judged:
            self._is_judged = True
            for concern in judge_pair(pair.core, pair.processed, self._files.mounted).concerns:
                self._doubts.setdefault(concern.doubt.value, remark_of(concern))
        stamp_s = float(name) if self._files.files.by_number else float(number)
        scanned = self.scan.take(name, stamp_s, pair.processed)
        if scanned.weakness.advice:
            self._watcher.say(f"{name}: {scanned.weakness.advice}")
        return scanned

    def _tell_of_mat(self, _: MatInView) -> None:
        if remark := unused_mat(self.scan):
            self._files.tell(remark.line)

    def finished(self) -> FinishedScan:
        """Make the surface and the report of the pairs so far."""
        model = self.scan.model()
        remarks = (
            *self._doubts.values(),
            *files_remarks(self._files.files, self._files.matcher_note),
            *self.kept.remarks,
            *turn_remarks(self.scan),
        )
        pairs = [pair if isinstance(pair, FailedPair) else self.scan.final(pair) for pair in self.done]
        report = report_of(
            self.scan,
            model,
            pairs,
            remarks,
            matcher=self._files.matcher,
            axes=self._axes,
        )
        return FinishedScan(report, model, field=field_of_turn(self.scan))
