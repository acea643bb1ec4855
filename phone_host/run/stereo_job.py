"""Writes what comes of pairs of image files, each into a folder of its own. The root of `stereo`, with its pages.

A pair that cannot be computed ends the work only if it is the only one. Wrong settings and a results folder that cannot be written to end it at once.
The folder holds the files of the only pair, or a folder for each of several. What an earlier run left there stays until all of what replaces it
is whole (decision 0088). Where there is nothing to replace, the folders of several pairs appear one by one.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path, PurePath
from typing import Final

from common import now
from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from common.words import distance_text
from phone_host.calibration.drift.see import StillsWatch
from phone_host.model import Processed
from phone_host.output.atomic import write_text
from phone_host.output.axes import Axes
from phone_host.output.json_text import json_text
from phone_host.output.listed import ListedFolder, RunAll
from phone_host.output.pair_files import STEREO_FILES, STEREO_NAMES, available, write_pair
from phone_host.report.page_links import FileLink, NextCommand
from phone_host.report.report_page import Headline, Picture
from phone_host.report.stereo_json import pair_json, set_json
from phone_host.report.stereo_page import (
    PairEntry,
    StereoIndexData,
    StereoPageData,
    stereo_index,
    stereo_page,
    thumbnail,
)
from phone_host.report.stereo_report import (
    FailedPair,
    PairReport,
    SetReport,
    depth_png_words,
    distinct_names,
    pair_verdict,
    set_verdict,
)
from phone_host.run.file_pairs import EACH_STAGE, ComputedPair, FilePairs, Watcher, compute_pairs
from phone_host.run.stereo_remarks import drift_remarks, judge_pair, pair_remarks, turned_remarks
from phone_host.stereo.evidence import density, look_at, maps_of
from phone_host.stereo.images import size_px

_WORDS: Final = {
    "cloud.ply": "coloured points in metres: {axes}; opens in MeshLab, CloudCompare and Blender",
    "xyz.pfm": "X, Y and Z of each pixel in metres, NaN = none: {axes}",
    "depth.png": "depth in mm, 16 bit, 0 = none",
    "depth_view.png": "depth as a picture with its scale",
    "disparity.png": "disparity as a picture with its scale",
    "disparity.pfm": "disparity in px, +inf = none, not cut by limits",
    "report.json": "all figures",
}


def pair_page(report: PairReport, processed: Processed, commands: Sequence[NextCommand]) -> str:
    """Make the page of one pair."""
    verdict, sentence = pair_verdict(report)
    names = [PurePath(path).name for path in (report.left, report.right)]
    data = StereoPageData(
        title=" and ".join(names),
        subtitle=f"{report.left} ({size_text(report.left_px)}), {report.right} ({size_text(report.right_px)})",
        verdict=verdict,
        sentence=sentence,
        processed=processed,
        settings=_settings(report),
        times=tuple((stage, round(ms * 1e6)) for stage, ms in report.stages_ms),
        files=_files(
            [*report.written.files, "report.json"], report.axes.text, depth_png_words(report.written.not_in_depth_png)
        ),
        commands=tuple(commands),
        notes=tuple(remark.text for remark in report.remarks_beside_headline),
        back="../index.html" if report.name else "",
    )
    return stereo_page(data)


def set_page(report: SetReport, thumbnails: Mapping[str, Picture], commands: Sequence[NextCommand]) -> str:
    """Make the page that leads to the pairs."""
    verdict, sentence = set_verdict(report)
    lefts, rights = (
        distinct_names(side) for side in zip(*((pair.left, pair.right) for pair in report.pairs), strict=True)
    )
    return stereo_index(
        StereoIndexData(
            title="Pairs of images",
            subtitle="",
            verdict=verdict,
            sentence=sentence,
            pairs=tuple(
                _entry(pair, f"{lefts[pair.left]}, {rights[pair.right]}", thumbnails.get(pair.name))
                for pair in report.pairs
            ),
            files=_files(["report.json"], ""),
            commands=tuple(commands),
            notes=tuple(remark.text for remark in report.remarks),
        )
    )


def _entry(pair: PairReport | FailedPair, both: str, picture: Picture | None) -> PairEntry:
    if isinstance(pair, FailedPair):
        sentence = f"{pair.failure.text}."
        return PairEntry(
            folder="", name=both, thumbnail=None, density=float("nan"), verdict=Headline.BAD, sentence=sentence
        )
    verdict, sentence = pair_verdict(pair)
    return PairEntry(
        folder=pair.name, name=both, thumbnail=picture, density=pair.share, verdict=verdict, sentence=sentence
    )


def _files(names: Sequence[str], axes: str, not_in_depth_png: str = "") -> tuple[FileLink, ...]:
    words = {name: _WORDS[name].format(axes=axes) for name in names}
    if not_in_depth_png and "depth.png" in words:
        words["depth.png"] += f"; {not_in_depth_png}"
    return tuple(FileLink(name, said) for name, said in words.items())


def _settings(report: PairReport) -> tuple[tuple[str, str], ...]:
    rows = [("matcher", report.matcher), ("rectified size", f"{size_text(report.rectified_px)} px")]
    if report.search is not None:
        if report.search.disparities:
            rows.append(("disparities", f"0 to {report.search.disparities - 1} px"))
        if not math.isnan(report.searched_from_m):
            rows.append(("searched from", distance_text(report.searched_from_m)))
        rows.append(("matched at", f"{report.search.scale:.0%} of the size"))
    if report.geometry is not None:
        rows += [
            ("focal length", f"{report.geometry.focal_px:.1f} px"),
            ("baseline", f"{report.geometry.baseline_m * 1e3:.2f} mm"),
            ("axes", report.axes.text),
        ]
    return tuple(rows)


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
        work = _Writing(pairs, results, watcher, axes, commands)

        def open_results() -> None:
            if results.descriptor < 0:
                results.open()
                if count == 1 or results.earlier:
                    results.stage()

        def keep(done: Sequence[PairReport | FailedPair]) -> None:
            if count > 1 and (so_far := replace(work.report(done), interrupted_of=count)).computed:
                work.write(so_far)
                if results.earlier:
                    pairs.tell_of_partial(results.keep_staged(), len(done))
                else:
                    results.publish()

        def label(number: int, name: str, _: Path) -> str:
            return "" if count == 1 else f"pair-{int(name) if pairs.files.by_number else number:06d}"

        report = compute_pairs(
            pairs,
            watcher,
            work.written,
            work.report,
            keep,
            label=label,
            spared=(DataError, SettingsError),  # such as a --crop that lies outside images of this size
            stages=EACH_STAGE,
            ready=open_results,
        )
        if count > 1:
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

    def report(self, done: Sequence[PairReport | FailedPair]) -> SetReport:
        """Return that of the pairs so far."""
        files, drift = self._pairs.files, None if len(self._pairs.files.pairs) == 1 else self._rig.drift
        return SetReport(
            pairs=tuple(done),
            by_number=files.by_number,
            by_name=files.by_name,
            left_alone=tuple(map(str, files.left_alone)),
            right_alone=tuple(map(str, files.right_alone)),
            remarks=() if len(done) == 1 else (*self._pairs.remarks, *drift_remarks(drift)),
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
                *(() if folder else self._pairs.remarks),
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
