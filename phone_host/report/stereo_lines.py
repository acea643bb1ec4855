"""What `stereo` says on a terminal: of a pair first whether its depth is right, of several pairs last. Pure."""

import math

from common.imagesize.head import size_text
from common.words import counted, distance_text
from phone_host.diagnostics.headline import pixels_text
from phone_host.report.match_words import share_text
from phone_host.report.stereo_report import (
    ALWAYS,
    FailedPair,
    PairReport,
    SetReport,
    SharedRemark,
    depth_png_words,
    pair_verdict,
    set_verdict,
    shared_remarks,
    told_names,
)


def pair_lines(report: PairReport, out: str) -> list[str]:
    """Say what came of one pair."""
    search, written, total_ms = report.search, report.written, dict(report.stages_ms)["total"]
    how = [f"{size_text(report.rectified_px)} px", report.matcher]
    if search is not None and search.disparities:
        how.append(counted(search.disparities, "disparity", "disparities"))
    if search is not None and search.scale < 1:
        how.append(f"matched at {search.scale:.0%} of the size")
    if not math.isnan(report.searched_from_m):
        how.append(f"searched from {distance_text(report.searched_from_m)}")
    lines = [
        pair_verdict(report)[1],
        f"{', '.join(how)}: {report.density:.1%} {pixels_text(report.cut)} matched ({total_ms:.0f} ms)",
    ]
    if report.geometry is not None and written.points is not None:
        lines += [
            f"{counted(written.points, 'point')}, {report.share:.1%} {pixels_text(report.cut)}; {report.axes.text}, in metres",
            f"f = {report.geometry.focal_px:.1f} px, b = {report.geometry.baseline_m * 1e3:.2f} mm",
            *cut_lines(report),
        ]
    lines += [remark.line for remark in report.remarks_beside_headline]
    if missing := depth_png_words(written.not_in_depth_png):
        lines.append(f"note: {missing}")
    return [*lines, f"written to {out}: {', '.join([*written.files, *ALWAYS])}"]


def set_lines(report: SetReport, out: str) -> list[str]:
    """Say what came of several pairs."""
    names = told_names(report)
    lines = [_pair_line(pair, names[pair.name]) for pair in report.pairs]
    lines += [_shared_line(shared, report) for shared in shared_remarks(report)]
    lines += [remark.line for remark in report.remarks]
    told = f"{len(report.computed)} of {counted(len(report.pairs), 'pair')} computed"
    failed = f", {len(report.failed)} failed" if report.failed else ""
    lines.append(f"{told}{failed}; written to {out}: one folder per pair, report.json and index.html")
    # Last, where it is still on the screen: the list of the pairs may be longer.
    return [*lines, set_verdict(report)[1]]


def _pair_line(pair: PairReport | FailedPair, name: str) -> str:
    if isinstance(pair, FailedPair):
        return f"{name}  failed: {pair.failure.text}"
    points = "matched" if pair.written.points is None else f"have depth, {counted(pair.written.points, 'point')}"
    return f"{name}  {pair_verdict(pair)[0].value}, {pair.share:.0%} {points}"


def _shared_line(shared: SharedRemark, report: SetReport) -> str:
    """Say how many pairs a remark is about, then the remark."""
    such = "" if shared.alike else f", such as {shared.first}"
    kind = "note" if shared.remark.is_note else "warning"
    return f"{kind}: in {shared.pairs} of {len(report.pairs)} pairs{such}: {shared.remark.text}"


def cut_lines(report: PairReport) -> list[str]:
    """Say what was cut from the cloud, and where its limits lie."""
    cut, limits, geometry = report.cut, report.limits, report.geometry
    if cut is None or limits is None or geometry is None:
        return []
    # From z = f b / d: an error of e px makes z wrong by e z / (f b).
    wrong = limits.disparity_error_px * limits.far_m / (geometry.focal_px * geometry.baseline_m)
    why = f", where depth is wrong by more than {wrong:.0%}" if limits.from_rig else ""
    parts = (
        (cut.too_far, f"farther than {distance_text(limits.far_m)}{why}"),
        (cut.too_near, f"nearer than {distance_text(limits.near_m)}"),
        (cut.at_zero, "too far to measure"),
    )
    said = [f"{share_text(count, cut.inside)} {words}" for count, words in parts if count]
    kept = f"points up to {distance_text(limits.far_m)} are kept"
    return [f"cut: {'; '.join(said)}"] if said else [kept]
