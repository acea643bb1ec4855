"""What `stereo` says on a terminal: first whether the depth is right. Pure."""

from common.imagesize.head import size_text
from common.words import counted, distance_text
from phone_host.report.cut_words import pixels_text, share_text
from phone_host.report.stereo_report import ALWAYS, FailedPair, PairReport, SetReport
from phone_host.report.stereo_verdict import pair_verdict, set_verdict


def pair_lines(report: PairReport, out: str) -> list[str]:
    """Say what came of one pair.

    Args:
        report: the pair.
        out: its folder, as the user named it.
    """
    search, written, total_ms = report.search, report.written, dict(report.stages_ms)["total"]
    how = [f"{size_text(report.rectified_px)} px", report.matcher]
    if search is not None and search.disparities:
        how.append(counted(search.disparities, "disparity", "disparities"))
    if search is not None and search.scale < 1:
        how.append(f"matched at {search.scale:.0%} of the size")
    lines = [
        pair_verdict(report)[1],
        f"{', '.join(how)}: {report.density:.1%} {pixels_text(report.cut)} have one ({total_ms:.0f} ms)",
    ]
    if report.geometry is not None and written.points is not None:
        inside = report.rectified_px[0] * report.rectified_px[1] if report.cut is None else report.cut.inside
        share = written.points / max(1, inside)
        lines += [
            f"{counted(written.points, 'point')}, {share:.1%} {pixels_text(report.cut)}; {report.axes.text}, in metres",
            f"f = {report.geometry.focal_px:.1f} px, b = {report.geometry.baseline_m * 1e3:.2f} mm",
            *cut_lines(report),
        ]
    lines += [f"warning: {remark.text}" for remark in report.remarks]
    return [*lines, f"written to {out}: {', '.join([*written.files, *ALWAYS])}"]


def set_lines(report: SetReport, out: str) -> list[str]:
    """Say what came of several pairs.

    Args:
        report: all pairs.
        out: the results folder, as the user named it.
    """
    lines = [set_verdict(report)[1]]
    for pair in report.pairs:
        if isinstance(pair, FailedPair):
            lines.append(f"{pair.name}  failed: {pair.problem}: {pair.remedy}")
            continue
        points = "" if pair.written.points is None else f", {counted(pair.written.points, 'point')}"
        lines.append(f"{pair.name}  density {pair.density:.1%}{points}")
        lines += [f"  warning: {remark.problem}" for remark in pair.remarks]
    remedies = dict.fromkeys(remark.remedy for pair in report.computed for remark in pair.remarks if remark.remedy)
    lines += [f"remedy: {remedy}" for remedy in remedies]
    lines += [f"warning: {remark.text}" for remark in report.remarks]
    told = f"{len(report.computed)} of {counted(len(report.pairs), 'pair')} computed"
    failed = f", {len(report.failed)} failed" if report.failed else ""
    return [*lines, f"{told}{failed}; written to {out}: one folder per pair, report.json and index.html"]


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
        (cut.at_zero, "with a disparity no larger than the noise of zero"),
        (cut.outside, "outside the crop"),
    )
    total = report.rectified_px[0] * report.rectified_px[1]
    said = [f"{share_text(count, total)} {words}" for count, words in parts if count]
    kept = f"the cloud ends at {distance_text(limits.far_m)}"
    return [f"cut: {'; '.join(said)}"] if said else [kept]
