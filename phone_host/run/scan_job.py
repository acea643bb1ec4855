"""A scan at work, from files or live: its submaps are kept on the disk, and it ends in one way: the model first, because it is what took the time.

`run_scan` is the root of `scan` for files. After Ctrl-C or SIGTERM the model of the pairs so far is written.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as default
from pathlib import Path
from typing import Any, Final

from common.diagnostic import Diagnostic, Severity
from common.errors import DataError
from common.words import counted
from phone_host.diagnostics.codes import as_remark
from phone_host.output.atomic import write_bytes, write_text
from phone_host.output.axes import Axes
from phone_host.output.json_text import json_text
from phone_host.output.ply import PointCloud, write_surface
from phone_host.output.result_files import replacing_results
from phone_host.output.trajectory_text import Station, tum_text
from phone_host.report.model_view import ShownModel
from phone_host.report.page_links import NextCommand
from phone_host.report.scan_json import scan_json
from phone_host.report.scan_next import next_commands
from phone_host.report.scan_page import scan_page
from phone_host.report.scan_report import MODEL, TRAJECTORY, ScanReport
from phone_host.report.stereo_report import ALWAYS, FailedPair
from phone_host.run.file_pairs import ComputedPair, FilePairs, Watcher, compute_pairs
from phone_host.run.kept import tell_if_heard
from phone_host.run.kept_submaps import KeptSubmaps
from phone_host.run.scan_result import field_of_turn, report_of, require_something, turn_remarks, unused_mat
from phone_host.run.stereo_remarks import judge_pair
from phone_host.scan.field_bytes import KeptField, field_of
from phone_host.scan.mat import MatInView
from phone_host.scan.scan import Scan, scan_for
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import PoseOrigin, ScannedPair, Submap

FIELD: Final = "field.bin"
"""The field of a turn, to which another pass is added."""

NAMES: Final = r"model\.ply|trajectory\.txt|report\.json|index\.html|field\.bin"
"""The names that `scan` writes into its folder."""


@dataclass(frozen=True, slots=True, eq=False)
class FinishedScan:
    """What is written of a scan.

    Attributes:
        report: of it.
        model: its whole surface; the files hold it as `report.unseen` says.
        commands: what else to do next, for the page.
        field: its field as bytes, for another pass; empty: it takes none.
        command: the verb that made it.
        told: what that verb adds to report.json.
    """

    report: ScanReport
    model: ScanModel
    commands: tuple[NextCommand, ...] = ()
    field: bytes = b""
    command: str = "scan"
    told: Mapping[str, object] = default(default_factory=dict)


def write_scan(out: Path, scan: FinishedScan, partial: Callable[[Path], None] | None = None) -> None:
    """Write model.ply, trajectory.txt, report.json and index.html; when all are whole they take the place of an earlier run's.

    Where there is no earlier run, a model that is whole stays even if the others have no room.

    Args:
        out: the folder.
        scan: what is written.
        partial: see `replacing_results`; None: the scan is whole.

    Raises:
        UnavailableError: a file there was not written by this program.
        OSError: as the operating system reports it.
    """
    report, model = scan.report, scan.model.with_unseen(scan.report.unseen)
    mesh = model.mesh
    files = MODEL, TRAJECTORY, *ALWAYS, *([FIELD] if scan.field else [])
    with replacing_results(out, NAMES, files, first=MODEL, command=scan.command, partial=partial) as place:
        seen = model.seen if model.is_closed else None
        write_surface(place / MODEL, PointCloud(mesh.points_m, mesh.colours), mesh.triangles, report.axes, seen)
        write_text(place / TRAJECTORY, trajectory_of(report))
        write_text(
            place / "report.json",
            json_text(report_values(scan), indent=2) + "\n",
        )
        if scan.field:
            write_bytes(place / FIELD, scan.field)
        voxel_m = report.settings.voxel_m if report.settings else 1.0
        upright = report.axes if report.axes.is_upright else None
        shown = ShownModel(mesh, model.noise_m, voxel_m, upright=upright, seen=model.seen)
        write_text(place / "index.html", scan_page(report, shown, (*next_commands(report, out), *scan.commands)))


def report_values(scan: FinishedScan) -> dict[str, Any]:
    """Return the content of report.json."""
    return scan_json(scan.report) | {"command": scan.command, **scan.told}


def trajectory_of(report: ScanReport) -> str:
    """Return the content of trajectory.txt: the pairs whose pose is known, in the model or not, in the axes of model.ply."""
    stations = []
    for pair in report.scanned:
        if pair.pose_origin is not PoseOrigin.NONE:
            pose = pair.world_camera
            signs = report.axes.signs.astype(float)
            stations.append(Station(pair.stamp_s, signs[:, None] * pose.R, signs * pose.t_m))
    return tum_text(stations)


def read_field(folder: Path) -> KeptField:
    """Read the field that a scan has left.

    Raises:
        DataError: there is none, or it is damaged.
        OSError: as the operating system reports it.
    """
    path = folder / FIELD
    if not path.is_file():
        raise DataError(
            f"{folder} holds no {FIELD}", "give the --out folder of the first pass, scanned with --turntable"
        )
    return field_of(path.read_bytes(), str(path))


class ScanWork:
    """One scan, and the folder that it is written to.

    Attributes:
        scan: what has become of the pairs.
        kept: its submaps on the disk.

    Args:
        wanted: how the model is made.
        out: the results folder.
        resumed: submaps of a scan that was killed, to go on from.
        tell: takes a line that the user should know at once.
    """

    def __init__(
        self,
        wanted: ScanWanted,
        out: Path,
        resumed: Sequence[Submap] = (),
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.scan, self._out, self._tell = scan_for(wanted, self._tell_of_mat), out, tell
        self.kept = KeptSubmaps(out, self.scan, resumed)

    def _tell_of_mat(self, _: MatInView) -> None:
        if remark := unused_mat(self.scan):
            self._tell(remark.line)

    def finished(
        self,
        remarks: Sequence[Diagnostic],
        pairs: Sequence[ScannedPair | FailedPair] | None = None,
        *,
        matcher: str,
        axes: Axes,
    ) -> FinishedScan:
        """Make the surface and the report of the pairs so far; see `finished_scan`."""
        told = (*remarks, *self.kept.remarks)
        return finished_scan(self.scan, told, pairs, matcher=matcher, axes=axes)

    def write(self, finished: FinishedScan, partial: Callable[[Path], None] | None = None) -> None:
        """Write a scan that is over. Its submaps go when it is on the disk.

        Raises:
            DataError: there is nothing of it; see `require_something`.
            UnavailableError: a file in the folder was not written by this program.
            OSError: the results cannot be written.
        """
        require_something(finished.report)
        write_scan(self._out, finished, partial)
        self.kept.done()


def finished_scan(
    scan: Scan,
    remarks: Sequence[Diagnostic] = (),
    pairs: Sequence[ScannedPair | FailedPair] | None = None,
    *,
    matcher: str,
    axes: Axes,
) -> FinishedScan:
    """Make the surface and the report of a scan.

    Args:
        scan: that took the pairs.
        remarks: what must be said besides what the scan itself tells.
        pairs: all, with those that could not be computed; None: those of the scan.
        matcher: its name.
        axes: of the files.
    """
    model = scan.model()
    final = scan.pairs if pairs is None else [p if isinstance(p, FailedPair) else scan.final(p) for p in pairs]
    told = (*remarks, *turn_remarks(scan))
    report = report_of(scan, model, final, told, matcher=matcher, axes=axes)
    return FinishedScan(report, model, field=field_of_turn(scan))


def _of_model(of_pairs: Sequence[tuple[str, Diagnostic]], fused: Collection[str]) -> Diagnostic:
    """Return a doubt about the images of pairs as one about the model: it is no failure, and names a pair, where other judged pairs are in the model and none of these.

    Args:
        of_pairs: names of pairs, and the doubt; at least one.
        fused: names of the judged pairs in the model.
    """
    name, doubt = next((each for each in of_pairs if each[0] in fused), of_pairs[0])
    if name in fused or not fused:
        return doubt
    return replace(
        doubt, message=f"pair {name}: {doubt.message}", severity=Severity.WARN if doubt.is_failure else doubt.severity
    )


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
    work = ScanWork(wanted, pairs.out, resumed, pairs.tell)
    doubts: dict[str, list[tuple[str, Diagnostic]]] = {}
    judged: set[str] = set()

    def take(pair: ComputedPair) -> ScannedPair:
        number, name = pair.number, pair.label
        # 0, 1, 2, 4, 8 ...: what is wrong with a rig is wrong with all of its pairs
        if number & (number - 1) == 0 or not judged:
            judged.add(name)
            for concern in judge_pair(pair.core, pair.processed, pairs.mounted).concerns:
                doubts.setdefault(concern.code, []).append((name, as_remark(concern)))
        scanned = work.scan.take(name, float(name) if pairs.files.by_number else float(number), pair.processed)
        if scanned.weakness.advice:
            watcher.say(f"{name}: {scanned.weakness.advice}")
        return scanned

    def finished(done: Sequence[ScannedPair | FailedPair]) -> FinishedScan:
        fused = {pair.name for pair in work.scan.pairs if pair.is_fused} & judged
        remarks = (*(_of_model(of_pairs, fused) for of_pairs in doubts.values()), *pairs.remarks)
        return work.finished(remarks, done, matcher=pairs.matcher, axes=axes)

    def keep(done: Sequence[ScannedPair | FailedPair]) -> None:
        if work.scan.fused:
            goes_on = "" if wanted.turntable else f"; --resume {pairs.out} goes on with it"
            tell_if_heard(
                pairs.tell, f"stopped after {len(done)} of {counted(count, 'pair')}: writing their model{goes_on}"
            )
            so_far = finished(done)  # first, for it makes the field whole where a loop was just moving it
            work.kept.before_end()
            write_scan(
                pairs.out,
                replace(so_far, report=replace(so_far.report, interrupted_of=count)),
                lambda place: pairs.tell_of_partial(place, len(done)),
            )

    def finish(done: Sequence[ScannedPair | FailedPair]) -> FinishedScan:
        watcher.say("making the surface")
        return finished(done)

    known = {pair.name: pair for pair in work.scan.pairs}
    whole = compute_pairs(pairs, watcher, take, finish, keep, known=known, after=work.kept.after_pair)
    work.write(whole)
    return whole.report
