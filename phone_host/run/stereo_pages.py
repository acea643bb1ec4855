"""Makes the pages of `stereo` from its reports: one for each pair, and one that leads to several."""

import math
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Final

from common.imagesize.head import size_text
from common.words import distance_text
from phone_host.model import Processed
from phone_host.report.page_links import FileLink, NextCommand
from phone_host.report.report_page import Headline, Picture
from phone_host.report.stereo_page import (
    PairEntry,
    StereoIndexData,
    StereoPageData,
    stereo_index,
    stereo_page,
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
