"""The report of `stereo`: what became of each pair of image files, as JSON and as lines for people. Pure.

One pair's object and lines are the same whether it was computed alone or as one of several.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from common.imagesize.head import size_text
from common.versions import REPORT_FORMAT
from phone_host.model import CutCounts, DepthLimits, Search, StereoGeometry
from phone_host.output.axes import Axes
from phone_host.output.pair_files import WrittenPair

Size = tuple[int, int]
"""Width and height, px."""


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that the user must know about a result.

    Attributes:
        text: one sentence, with the remedy.
        is_blocking: whether the result must not be taken for right; the command then ends with exit code 4.
    """

    text: str
    is_blocking: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PairReport:
    """A pair that was computed.

    Attributes:
        name: of its folder; empty for the only pair, whose files lie in the results folder itself.
        left: the left image file, as it was named.
        right: the right image file.
        left_px: size of the left image as matched or rectified from.
        right_px: the same for the right image.
        rectified_px: size of the rectified images, and so of the disparity.
        matcher: its name.
        search: how the pair was matched.
        geometry: None: unknown, so there is no cloud.
        limits: of the cloud; None without one.
        cut: what became of the pixels; None: not counted.
        density: share of the pixels that have a disparity.
        axes: of cloud.ply and xyz.pfm.
        written: the files.
        stages_ms: how long each stage took, and `total`.
        remarks: what the user must know.
    """

    name: str
    left: str
    right: str
    left_px: Size
    right_px: Size
    rectified_px: Size
    matcher: str
    search: Search | None
    geometry: StereoGeometry | None
    limits: DepthLimits | None
    cut: CutCounts | None
    density: float
    axes: Axes
    written: WrittenPair
    stages_ms: tuple[tuple[str, float], ...]
    remarks: tuple[Remark, ...] = ()

    @property
    def has_depth(self) -> bool:
        """Whether any pixel has a depth; without a geometry, a disparity."""
        return self.density > 0 if self.written.points is None else self.written.points > 0


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedPair:
    """A pair that could not be computed.

    Attributes:
        name: its folder would have been called so.
        left: the left image file.
        right: the right image file.
        problem: what is wrong.
        remedy: what to do about it.
    """

    name: str
    left: str
    right: str
    problem: str
    remedy: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SetReport:
    """All pairs of a command.

    Attributes:
        pairs: in order; at least one of them was computed.
        by_number: whether the files were paired by the numbers in their names; else in name order.
        left_alone: left images without a partner.
        right_alone: right images without a partner.
        remarks: what the user must know about all of them.
    """

    pairs: tuple[PairReport | FailedPair, ...]
    by_number: bool
    left_alone: tuple[str, ...] = ()
    right_alone: tuple[str, ...] = ()
    remarks: tuple[Remark, ...] = ()

    @property
    def computed(self) -> tuple[PairReport, ...]:
        """The pairs that were computed."""
        return tuple(pair for pair in self.pairs if isinstance(pair, PairReport))

    @property
    def failed(self) -> tuple[FailedPair, ...]:
        """The pairs that were not."""
        return tuple(pair for pair in self.pairs if isinstance(pair, FailedPair))

    @property
    def is_sound(self) -> bool:
        """Whether nothing failed, nothing blocks and some pixel has a depth. Everything that makes the exit code 4 is here."""
        remarks = [*self.remarks, *(remark for pair in self.computed for remark in pair.remarks)]
        any_depth = any(pair.has_depth for pair in self.computed)
        return any_depth and not self.failed and not any(remark.is_blocking for remark in remarks)


def pair_json(report: PairReport) -> dict[str, Any]:
    """Make the object of report.json for one pair."""
    search, written = report.search, report.written
    return {
        "format_version": REPORT_FORMAT,
        "left": {"file": report.left, "size": size_text(report.left_px)},
        "right": {"file": report.right, "size": size_text(report.right_px)},
        "size": size_text(report.rectified_px),
        "matcher": report.matcher,
        "disparities": search.disparities or None if search else None,
        "scale": round(search.scale, 4) if search else None,
        "geometry": None if report.geometry is None else asdict(report.geometry),
        "limits": None if report.limits is None else asdict(report.limits),
        "cut": None if report.cut is None else asdict(report.cut),
        "density": round(report.density, 5),
        "points": written.points,
        "unit": "metre" if written.points is not None else None,
        "axes": report.axes.text if written.points is not None else None,
        "not_in_depth_png": written.not_in_depth_png,
        "warnings": [remark.text for remark in report.remarks],
        "times_ms": {stage: round(ms, 3) for stage, ms in report.stages_ms},
        "files": [*written.files, "report.json"],
    }


def set_json(report: SetReport) -> dict[str, Any]:
    """Make the object of report.json for several pairs."""
    return {
        "format_version": REPORT_FORMAT,
        "paired_by": "number" if report.by_number else "name order",
        "left_alone": list(report.left_alone),
        "right_alone": list(report.right_alone),
        "computed": len(report.computed),
        "failed": len(report.failed),
        "warnings": [remark.text for remark in report.remarks],
        "pairs": [_entry(pair) for pair in report.pairs],
        "files": [*(pair.name for pair in report.computed), "report.json"],
    }


def _entry(pair: PairReport | FailedPair) -> dict[str, Any]:
    """Make the object of one of several pairs; its folder's report.json has the rest."""
    both = {"name": pair.name, "left": pair.left, "right": pair.right}
    if isinstance(pair, FailedPair):
        return {**both, "problem": pair.problem, "remedy": pair.remedy}
    return {
        **both,
        "density": round(pair.density, 5),
        "points": pair.written.points,
        "warnings": [remark.text for remark in pair.remarks],
        "files": [*pair.written.files, "report.json"],
    }


def pair_lines(report: PairReport, out: str) -> list[str]:
    """Say what came of one pair.

    Args:
        report: the pair.
        out: its folder, as the user named it.
    """
    search, written, total_ms = report.search, report.written, dict(report.stages_ms)["total"]
    how = [f"{size_text(report.rectified_px)} px", report.matcher]
    if search is not None and search.disparities:
        how.append(f"{search.disparities} disparities")
    if search is not None and search.scale < 1:
        how.append(f"matched at {search.scale:.0%} of the size")
    lines = [f"{', '.join(how)}: {report.density:.1%} of the pixels have one ({total_ms:.0f} ms)"]
    if report.geometry is not None and written.points is not None:
        share = written.points / (report.rectified_px[0] * report.rectified_px[1])
        lines += [
            f"{written.points} points, {share:.1%} of the pixels; {report.axes.text}, in metres",
            f"f = {report.geometry.focal_px:.1f} px, b = {report.geometry.baseline_m * 1e3:.2f} mm",
            *cut_lines(report),
        ]
    lines += [f"warning: {remark.text}" for remark in report.remarks]
    return [*lines, f"written to {out}: {', '.join([*written.files, 'report.json'])}"]


def set_lines(report: SetReport, out: str) -> list[str]:
    """Say what came of several pairs.

    Args:
        report: all pairs.
        out: the results folder, as the user named it.
    """
    lines = []
    for pair in report.pairs:
        if isinstance(pair, FailedPair):
            lines.append(f"{pair.name}  failed: {pair.problem}: {pair.remedy}")
            continue
        points = "" if pair.written.points is None else f", {pair.written.points} points"
        lines.append(f"{pair.name}  density {pair.density:.1%}{points}")
        lines += [f"  warning: {remark.text}" for remark in pair.remarks]
    lines += [f"warning: {remark.text}" for remark in report.remarks]
    told = f"{len(report.computed)} of {len(report.pairs)} pairs computed"
    failed = f", {len(report.failed)} failed" if report.failed else ""
    return [*lines, f"{told}{failed}; written to {out}: one folder per pair, and report.json"]


def cut_lines(report: PairReport) -> list[str]:
    """Say what was cut from the cloud, and where its limits lie."""
    cut, limits, geometry = report.cut, report.limits, report.geometry
    if cut is None or limits is None or geometry is None:
        return []
    # From z = f b / d: an error of e px makes z wrong by e z / (f b).
    wrong = limits.disparity_error_px * limits.far_m / (geometry.focal_px * geometry.baseline_m)
    far = f"farther than {distance_text(limits.far_m)}"
    if limits.from_rig:
        far += f", where depth is wrong by more than {wrong:.0%}"
    parts = (
        (cut.too_far, far),
        (cut.too_near, f"nearer than {distance_text(limits.near_m)}"),
        (cut.at_zero, "no nearer than infinity within the error of a disparity"),
        (cut.outside, "outside the crop"),
    )
    total = report.rectified_px[0] * report.rectified_px[1]
    said = [f"{share_text(count, total)} {words}" for count, words in parts if count]
    kept = f"the cloud ends at {distance_text(limits.far_m)}"
    return [f"cut: {'; '.join(said)}"] if said else [kept]


def share_text(count: int, total: int) -> str:
    """Write a share in percent; a small one is never called 0 %."""
    percent = 100 * count / max(1, total)
    return "under 0.1 %" if 0 < percent < 0.1 else f"{percent:.1f} %" if percent < 10 else f"{percent:.0f} %"


def distance_text(metres: float) -> str:
    """Write a distance with about three digits: 38 m, 1.25 m, 300 mm."""
    return f"{metres * 1e3:.3g} mm" if metres < 1 else f"{metres:.3g} m" if metres < 1000 else f"{metres:.0f} m"


def alone_remarks(left: Sequence[str], right: Sequence[str], *, by_number: bool, pairs: int) -> tuple[Remark, ...]:
    """Say which images have no partner, and if pairs were guessed.

    Args:
        left: left images without a partner.
        right: right images without a partner.
        by_number: whether the files were paired by the numbers in their names.
        pairs: how many pairs there are.
    """
    remarks = []
    for side, alone in (("left", left), ("right", right)):
        if alone:
            named = ", ".join(alone[:_MOST_NAMES]) + (", …" if len(alone) > _MOST_NAMES else "")
            were = "image has" if len(alone) == 1 else "images have"
            remarks.append(Remark(f"{len(alone)} {side} {were} no partner and were left out: {named}"))
    if not by_number and pairs > 1:
        unequal = " though the counts differ" if left or right else ""
        remarks.append(
            Remark(
                f"the images were paired in the order of their names{unequal}, because the names share no numbers: check that each"
                " pair shows one moment"
            )
        )
    return tuple(remarks)


_MOST_NAMES = 5
