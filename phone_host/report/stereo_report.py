"""The report of `stereo`: what became of each pair of image files. Pure.

`stereo_json`, `stereo_lines` and `stereo_page` tell it to programs, on a terminal and on a page.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from common.diagnostic import Diagnostic
from common.errors import DataError
from common.words import counted
from phone_host.diagnostics.codes import Code
from phone_host.model import CutCounts, DepthLimits, Drift, MatchReport, Search, StereoGeometry
from phone_host.output.axes import Axes
from phone_host.output.pair_files import WrittenPair
from phone_host.report.match_words import searched_from_m
from phone_host.report.report_page import Headline
from phone_host.report.stereo_trust import PairTrust

ALWAYS: Final = ("report.json", "index.html")
"""Files that lie in every folder of results."""

_FIGURE: Final = re.compile(r"\d+(?:\.\d+)?")

Size = tuple[int, int]
"""Width and height, px."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairReport:
    """A pair that was computed.

    Attributes:
        name: of its folder; empty for the only pair, whose files lie in the results folder itself.
        left: the left image file, as it was named; `right` likewise.
        left_px: size of the left image as matched or rectified from; `right_px` likewise.
        rectified_px: size of the rectified images, and so of the disparity.
        match_report: what the matcher corrected before; None: not known.
        geometry: None: unknown, so there is no cloud.
        limits: of the cloud; None without one.
        cut: what became of the pixels; None: not counted.
        density: share of the pixels that have a disparity.
        stages_ms: how long each stage took, and `total`.
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
    trust: PairTrust
    remarks: tuple[Diagnostic, ...] = ()
    match_report: MatchReport | None = None

    @property
    def share(self) -> float:
        """Share of the pixels inside the crop that have a point; without a geometry, a disparity."""
        if self.written.points is None:
            return self.density
        outside = 0 if self.cut is None else self.cut.outside
        return self.written.points / max(1, self.rectified_px[0] * self.rectified_px[1] - outside)

    @property
    def searched_from_m(self) -> float:
        """Nothing nearer could be found, m; NaN: not known."""
        return searched_from_m(self.geometry, self.search)

    @property
    def remarks_beside_headline(self) -> tuple[Diagnostic, ...]:
        """The remarks without the one that the headline tells with its remedy."""
        told = {concern.message for concern in self.trust.concerns[:1]}
        return tuple(remark for remark in self.remarks if remark.message not in told)

    @property
    def has_depth(self) -> bool:
        """Whether it has depth; without a geometry, a disparity."""
        if any(concern.code == Code.NO_DEPTH for concern in self.trust.concerns):
            return False
        return self.density > 0 if self.written.points is None else self.written.points > 0


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedPair:
    """A pair that could not be computed: what its folder would have been called, its image files, and why."""

    name: str
    left: str
    right: str
    failure: Diagnostic

    def none_of(self, pairs: int) -> DataError:
        """Return the error if this is the first of so many pairs, and none could be computed."""
        which = (
            "the only pair cannot be computed"
            if pairs == 1
            else f"none of the {pairs} pairs can be computed; the first"
        )
        return DataError(
            f"{which}: {self.failure.message} ({self.failure.remedy})",
            "mend what this names, then try again",
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SetReport:
    """All pairs of a command.

    Attributes:
        pairs: in order; at least one of them was computed.
        by_number: whether the files were paired by the numbers in their names.
        by_name: whether they were paired by equal names; if neither, in name order.
        left_alone: left images without a partner; `right_alone` likewise.
        interrupted_of: how many pairs were to be computed when the command was interrupted; 0: it was not.
        drift: how their rig departs from its calibration, with pairs for seconds; None without a rig.
    """

    pairs: tuple[PairReport | FailedPair, ...]
    by_number: bool
    left_alone: tuple[str, ...] = ()
    right_alone: tuple[str, ...] = ()
    remarks: tuple[Diagnostic, ...] = ()
    interrupted_of: int = 0
    by_name: bool = False
    drift: Drift | None = None

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
        return any_depth and not self.failed and not any(remark.is_failure for remark in remarks)


@dataclass(frozen=True, slots=True)
class SharedRemark:
    """A remark that several pairs share, but perhaps for its figures.

    Attributes:
        remark: as the first of them has it.
        pairs: how many have it.
        alike: whether all have it word for word.
    """

    remark: Diagnostic
    pairs: int
    first: str
    alike: bool


def shared_remarks(report: SetReport) -> tuple[SharedRemark, ...]:
    """Gather what is said of the computed pairs, each thing once, in the order of the pairs."""
    names = told_names(report)
    kinds: dict[tuple[str, str], list[tuple[PairReport, Diagnostic]]] = {}
    for pair in report.computed:
        for remark in pair.remarks:
            kinds.setdefault((_FIGURE.sub("0", remark.message), remark.remedy), []).append((pair, remark))
    return tuple(
        SharedRemark(
            remark=found[0][1],
            pairs=len({pair.name for pair, _ in found}),
            first=names[found[0][0].name],
            alike=len({remark.message for _, remark in found}) == 1,
        )
        for found in kinds.values()
    )


def depth_png_words(missing: int) -> str:
    """Say that depth.png does not hold all depths; empty if it does."""
    return f"{counted(missing, 'depth')} beyond 65.5 m (or below 1 mm) missing from depth.png" if missing else ""


def told_names(report: SetReport) -> dict[str, str]:
    """Return the pairs' names on a terminal, by their folders: a folder, with its left file where that is no number of the user's."""
    files = distinct_names([pair.left for pair in report.pairs])
    return {pair.name: pair.name if report.by_number else f"{pair.name} {files[pair.left]}" for pair in report.pairs}


def distinct_names(paths: Sequence[str]) -> dict[str, str]:
    """Shorten paths to what tells them apart: the files' names, with as many folders before them as that needs."""
    parts = {path: path.split("/") for path in paths}
    for count in range(1, 1 + max(map(len, parts.values()), default=0)):
        names = {path: "/".join(each[-count:]) for path, each in parts.items()}
        if len(set(names.values())) == len(names):
            return names
    return {path: path for path in paths}


def pair_verdict(pair: PairReport) -> tuple[Headline, str]:
    """Return the verdict of one pair, and one sentence."""
    answer = pair.trust.answer
    return Headline(answer.grade.value), answer.sentence


def set_verdict(report: SetReport) -> tuple[Headline, str]:
    """Judge several pairs together."""
    if report.interrupted_of:
        verdict, sentence = set_verdict(replace(report, interrupted_of=0))
        stopped = f"Interrupted after {len(report.pairs)} of {counted(report.interrupted_of, 'pair')}. Of these: "
        return (
            Headline.WARNING if verdict is Headline.GOOD else verdict
        ), f"{stopped}{sentence[:1].lower()}{sentence[1:]}"
    verdicts = [pair_verdict(pair)[0] for pair in report.computed]
    count, good = len(report.pairs), verdicts.count(Headline.GOOD)
    bad = verdicts.count(Headline.BAD) + len(report.failed)
    if good == count:
        return (
            Headline.GOOD,
            f"Nothing speaks against the depth of {'the pair' if count == 1 else f'any of the {count} pairs'}.",
        )
    words = [f"{good} of {counted(count, 'pair')} {'looks' if good == 1 else 'look'} right"]
    if bad:
        words.append(f"{bad} gave no depth or cannot be right")
    if doubtful := count - good - bad:
        words.append(f"{doubtful} {'is' if doubtful == 1 else 'are'} in doubt")
    return (Headline.BAD if bad == count else Headline.WARNING), f"{', '.join(words)}."
