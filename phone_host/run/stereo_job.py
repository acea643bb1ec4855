"""Writes what comes of pairs of image files, each into a folder of its own. The root of `stereo`.

A pair that cannot be computed ends the work only if it is the only one. Wrong settings and a results folder that cannot be written to end it at once.
The folder holds the files of the only pair, or a folder for each of several. What an earlier run left there stays until all of what replaces it
is whole (decision 0088). Where there is nothing to replace, the folders of several pairs appear one by one.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from common import now
from common.errors import DataError, SettingsError
from common.program.out_of_memory import noted_if_out_of_memory
from phone_host.calibration.drift.see import StillsWatch
from phone_host.output.atomic import write_text
from phone_host.output.axes import Axes
from phone_host.output.json_text import json_text
from phone_host.output.listed import ListedFolder, RunAll
from phone_host.output.pair_files import STEREO_FILES, STEREO_NAMES, available, write_pair
from phone_host.report.page_links import NextCommand
from phone_host.report.report_page import Picture
from phone_host.report.stereo_json import pair_json, set_json
from phone_host.report.stereo_page import thumbnail
from phone_host.report.stereo_report import FailedPair, PairReport, SetReport
from phone_host.run.file_pairs import EACH_STAGE, ComputedPair, FilePairs, PairMatcher, Watcher, compute_pairs
from phone_host.run.freed_memory import keep_freed_memory
from phone_host.run.kept import kept_if_interrupted
from phone_host.run.stereo_pages import pair_page, set_page
from phone_host.run.stereo_remarks import drift_remarks, files_remarks, judge_pair, pair_remarks, turned_remarks
from phone_host.stereo.evidence import density, look_at, maps_of
from phone_host.stereo.images import size_px

NAMES: Final = rf"{STEREO_NAMES}|pair-[0-9]{{6,}}"
"""The names that `stereo` writes into its folder: of the only pair, or a folder for each of several."""

_WRITERS: Final = 2
"""Threads that write one pair's files. Packing and compressing release the interpreter; the disk is one."""

Commands = Callable[[Sequence[PairReport]], tuple[NextCommand, ...]]
"""Returns what to do next, for the page of these pairs."""


def run_stereo(
    pairs: FilePairs, watcher: Watcher, axes: Axes = Axes.CAMERA, commands: Commands = lambda _: ()
) -> SetReport:
    """Compute and write all pairs.

    Returns:
        The report. report.json holds it: that of the only pair, or that of all pairs together.

    Raises:
        DataError: the only pair, or all pairs, could not be computed.
        SettingsError: the core cannot be made so.
        UnavailableError: a file in the results folder was not written by this program.
        OSError: the results cannot be written.
    """
    count = len(pairs.files.pairs)
    with closing(ListedFolder(pairs.out, NAMES, command="stereo")) as results:

        def open_results() -> None:
            if results.descriptor < 0:
                results.open()
                if count == 1 or results.earlier:
                    results.stage()

        matcher = PairMatcher(pairs, watcher, EACH_STAGE, open_results)
        work = _Writing(pairs, results, watcher, axes, commands)
        if count == 1:
            keep_freed_memory()
            _, left, right = pairs.files.pairs[0]
            with noted_if_out_of_memory(f"{left} and {right}"):
                work.done.append(work.written(matcher.match(left, right)))
            results.publish()
            return work.report()

        def write_so_far() -> None:
            so_far = replace(work.report(), interrupted_of=count)
            if so_far.computed:
                work.write(so_far)
                if results.earlier:
                    pairs.tell_of_partial(results.keep_staged(), len(work.done))
                else:
                    results.publish()

        def label(number: int, name: str, _: Path) -> str:
            return f"pair-{int(name) if pairs.files.by_number else number:06d}"

        with kept_if_interrupted(write_so_far):
            spared = DataError, SettingsError  # such as a --crop that lies outside images of this size
            compute_pairs(pairs, matcher, work.done, work.written, label=label, spared=spared)
        report = work.report()
        work.write(report)
        results.publish()
        return report


class _Writing:
    """Writes one pair after the other."""

    def __init__(
        self, pairs: FilePairs, results: ListedFolder, watcher: Watcher, axes: Axes, commands: Commands
    ) -> None:
        self._pairs, self._results, self._watcher, self._axes, self._commands = pairs, results, watcher, axes, commands
        self._rig = StillsWatch()
        self._thumbnails: dict[str, Picture] = {}
        self.done: list[PairReport | FailedPair] = []

    def report(self) -> SetReport:
        """Return that of the pairs so far."""
        files, drift = self._pairs.files, None if len(self._pairs.files.pairs) == 1 else self._rig.drift
        remarks = (*files_remarks(files, self._pairs.matcher_note), *drift_remarks(drift))
        return SetReport(
            pairs=tuple(self.done),
            by_number=files.by_number,
            by_name=files.by_name,
            left_alone=tuple(map(str, files.left_alone)),
            right_alone=tuple(map(str, files.right_alone)),
            remarks=() if len(self.done) == 1 else remarks,
            drift=drift,
        )

    def write(self, report: SetReport) -> None:
        """Write what is told of all pairs together."""
        page = set_page(report, self._thumbnails, self._commands(report.computed))
        for name, text in ("report.json", json_text(set_json(report), indent=2) + "\n"), ("index.html", page):
            self._results.add(name)
            self._results.write_text(name, text)

    def written(self, pair: ComputedPair) -> PairReport:
        """Judge and write a pair. Its label is empty for the only one."""
        judging_ns, folder, about = now.monotonic_ns(), pair.label, f" {pair.label}" if pair.label else ""
        core, processed = pair.core, pair.processed
        self._watcher.say(f"checking{about}")
        look = look_at(processed, maps_of(core, processed))
        trust = judge_pair(core, processed, self._pairs.mounted, look)
        self._rig.add(core, processed, look)
        writing_ns = now.monotonic_ns()
        self._watcher.say(f"writing{about}")
        planned = available(
            STEREO_FILES,
            has_disparity=processed.disparity is not None,
            has_cloud=processed.cloud is not None,
        )
        names = [*(file.value for file in planned), "report.json", "index.html"]
        with (
            ThreadPoolExecutor(_WRITERS) as writers,
            self._place_of(folder, names, writers.map) as place,
        ):
            try:
                written = write_pair(place, processed, planned, self._axes, writers.map)
            except BaseException:
                writers.shutdown(cancel_futures=True)  # the other thread's file must be there when all are removed
                raise
            ended_ns = now.monotonic_ns()
            laps = (
                *pair.stages_ns,
                ("judge", writing_ns - judging_ns),
                ("write", ended_ns - writing_ns),
                ("total", ended_ns - pair.begun_ns),
            )
            remarks = [
                *turned_remarks(*pair.opened),
                *pair_remarks(processed, trust, core.wanted.search_from_m),
                *(() if folder else files_remarks(self._pairs.files, self._pairs.matcher_note)),
            ]
            report = PairReport(
                name=folder,
                left=pair.opened[0].name,
                right=pair.opened[1].name,
                left_px=pair.sizes_px[0],
                right_px=pair.sizes_px[1],
                rectified_px=size_px(processed.pair.left),
                matcher=self._pairs.matcher,
                search=processed.search,
                match_report=processed.match_report,
                geometry=processed.geometry,
                limits=processed.limits,
                cut=processed.cut,
                density=density(processed),
                axes=self._axes,
                written=written,
                stages_ms=tuple((stage, ns / 1e6) for stage, ns in laps),
                remarks=tuple(remarks),
                trust=trust,
            )
            write_text(place / "report.json", json_text(pair_json(report), indent=2) + "\n")
            write_text(place / "index.html", pair_page(report, processed, self._commands((report,))))
        if folder and (picture := thumbnail(processed)) is not None:
            self._thumbnails[folder] = picture
        return report

    @contextmanager
    def _place_of(self, folder: str, names: Sequence[str], run_all: RunAll) -> Iterator[Path]:
        """Give a pair a place for its files: a folder that appears when the block ends; that of all results for the only pair."""
        if folder:
            with self._results.new_folder(folder, run_all) as place:
                yield place
            self._results.spare_staged()
        else:
            self._results.add(*names)
            yield self._results.place
