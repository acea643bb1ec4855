"""Scans pairs of image files, one after another. The root of `scan` for files. After Ctrl-C or SIGTERM the model of the pairs so far is written."""

from dataclasses import replace

from common.diagnostic import Diagnostic
from common.errors import DataError
from common.words import counted
from phone_host.diagnostics.codes import as_remark
from phone_host.output.axes import Axes
from phone_host.report.scan_report import ScanReport
from phone_host.report.stereo_report import FailedPair
from phone_host.run.file_pairs import ComputedPair, FilePairs, PairMatcher, Watcher, compute_pairs
from phone_host.run.kept import kept_if_interrupted, tell_if_heard
from phone_host.run.scan_files import FinishedScan, write_scan
from phone_host.run.scan_work import ScanWork
from phone_host.run.stereo_remarks import files_remarks, judge_pair
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
    work, done = ScanWork(wanted, pairs.out, resumed, pairs.tell), list[ScannedPair | FailedPair]()
    doubts: dict[str, Diagnostic] = {}
    is_judged = False

    def take(pair: ComputedPair) -> ScannedPair:
        nonlocal is_judged
        number, name = pair.number, pair.label
        # 0, 1, 2, 4, 8 ...: what is wrong with a rig is wrong with all of its pairs
        if number & (number - 1) == 0 or not is_judged:
            is_judged = True
            for concern in judge_pair(pair.core, pair.processed, pairs.mounted).concerns:
                doubts.setdefault(concern.code, as_remark(concern))
        scanned = work.scan.take(name, float(name) if pairs.files.by_number else float(number), pair.processed)
        if scanned.weakness.advice:
            watcher.say(f"{name}: {scanned.weakness.advice}")
        return scanned

    def finished() -> FinishedScan:
        remarks = (*doubts.values(), *files_remarks(pairs.files, pairs.matcher_note))
        return work.finished(remarks, done, matcher=pairs.matcher, axes=axes)

    def write_so_far() -> None:
        if work.scan.fused:
            goes_on = "" if wanted.turntable else f"; --resume {pairs.out} goes on with it"
            tell_if_heard(
                pairs.tell, f"stopped after {len(done)} of {counted(count, 'pair')}: writing their model{goes_on}"
            )
            so_far = finished()  # first, for it makes the field whole where a loop was just moving it
            work.kept.before_end()
            write_scan(
                pairs.out,
                replace(so_far, report=replace(so_far.report, interrupted_of=count)),
                lambda place: pairs.tell_of_partial(place, len(done)),
            )

    with kept_if_interrupted(write_so_far):
        compute_pairs(
            pairs,
            PairMatcher(pairs, watcher),
            done,
            take,
            label=lambda _number, name, _left: name,
            known={pair.name: pair for pair in work.scan.pairs},
            after=work.kept.after_pair,
        )
        watcher.say("making the surface")
        whole = finished()
    work.write(whole)
    return whole.report
