"""Whether a matcher's confidence is honest: what it is sure of must be right more often.

Pixels with a value and a known truth are sorted by confidence, the surest first. bad2 of the first 50, 70, 90 and 100 %
must not grow as fewer are kept. The curve of bad2 over the share kept lies between the oracle's (sorted by the true
error) and random order's (level); the area above the oracle's, relative to random order's, is 0 for an oracle and 1 for
dice (Hu and Mordohai, "A Quantitative Evaluation of Confidence Measures for Stereo Vision", PAMI 34(11), 2012). Pixels of
equal confidence come in no order: their errors are spread evenly over their places.

OpenCV has no confidence. Its uniqueness margin is had by matching at rising `uniquenessRatio`: a pixel's confidence is
the highest ratio at which it keeps its value.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, RectifiedPair
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import matcher_named
from phone_host.stereo.matcher_protocol import Matcher
from tests.bench.depth_accuracy import Case, by_three_way, grey, matching, padded, searched, three_way

KEPT: Final = (0.5, 0.7, 0.9, 1.0)
SHARES: Final = np.linspace(0.01, 1.0, 100)
TOLERANCE_POINTS: Final = 0.05
GREATEST_AREA: Final = 0.35

MARGINS: Final = (0, 2, 5, 10, 15, 20, 30, 45, 60, 80)
"""uniquenessRatio, %."""

Confidence = NDArray[np.uint8]


class Matched(Protocol):
    """A disparity map with the confidence of each pixel."""

    @property
    def disparity(self) -> Disparity:
        """(H, W) float32, px; NaN: none."""

    @property
    def confidence(self) -> Confidence | None:
        """(H, W) uint8; more is surer; None: this matcher has none."""


@runtime_checkable
class ReportsConfidence(Protocol):
    """A matcher that says how sure it is."""

    def matched(self, pair: RectifiedPair) -> Matched:
        """Match one pair."""


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """bad2 over the share of pixels kept, one case.

    Attributes:
        scene: the case's scene.
        kind: the case's kind.
        bad2: (100,) %, at SHARES.
        oracle: the same for the best order possible.
    """

    scene: str
    kind: str
    bad2: NDArray[np.float64]
    oracle: NDArray[np.float64]

    @property
    def area(self) -> float:
        """Area above the oracle's curve, relative to random order's; NaN where nothing is wrong."""
        return relative_area([self])

    def at(self, share: float) -> float:
        """bad2 of this share of the pixels, %."""
        return float(np.interp(share, SHARES, self.bad2))

    @property
    def falls(self) -> bool:
        """Whether bad2 falls, within TOLERANCE_POINTS, each time that fewer are kept."""
        values = [self.at(share) for share in KEPT]
        return all(less <= more + TOLERANCE_POINTS for less, more in pairwise(values))


def relative_area(curves: Sequence[Curve]) -> float:
    """The relative area of the mean of several curves."""
    mean, oracle = (np.mean([getattr(curve, name) for curve in curves], axis=0) for name in ("bad2", "oracle"))
    random = mean[-1]
    above = float(np.trapezoid(random - oracle, SHARES))
    return float(np.trapezoid(mean - oracle, SHARES)) / above if above > 0 else float("nan")


def curve(case: Case, found: Disparity, confidence: Confidence) -> Curve:
    """Sort one case's pixels by confidence.

    Args:
        case: with its truth.
        found: (H, W) float32, px; NaN or 0 and below: none.
        confidence: (H, W) uint8.

    Raises:
        ValueError: the confidence is not uint8 of the disparity's shape.
    """
    if confidence.shape != found.shape or confidence.dtype != np.uint8:
        raise ValueError(f"confidence is {confidence.dtype} of {confidence.shape}, disparity is {found.shape}")
    valued = np.isfinite(case.truth) & (np.nan_to_num(found) > 0)
    bad = (np.abs(found - case.truth)[valued] > 2).astype(np.float64)
    return Curve(
        case.scene, case.kind, _sorted_share(bad, confidence[valued]), _sorted_share(bad, (1 - bad).astype(np.uint8))
    )


def _sorted_share(bad: NDArray[np.float64], sureness: NDArray[np.uint8]) -> NDArray[np.float64]:
    """bad2 (%) of the surest share, at SHARES; ties contribute evenly."""
    if not bad.size:
        return np.zeros(len(SHARES))
    counts = np.bincount(sureness, minlength=256)[::-1].cumsum()
    wrong = np.bincount(sureness, weights=bad, minlength=256)[::-1].cumsum()
    kept = SHARES * bad.size
    among = np.interp(kept, np.concatenate([[0], counts]), np.concatenate([[0], wrong]))
    return np.asarray(100.0 * among / kept, np.float64)


def reporting(name: str, disparities: int) -> ReportsConfidence | None:
    """Make a matcher by name; None: it says nothing about its confidence."""
    matcher: Matcher = create_matcher(MatchSettings(matcher_named(name), disparities))
    return matcher if isinstance(matcher, ReportsConfidence) else None


def curves_of(name: str, cases: Sequence[Case]) -> list[Curve]:
    """The curves of a matcher that reports its confidence; empty: it does not."""
    found = []
    for case in cases:
        matcher = reporting(name, case.disparities)
        if matcher is None:
            return []
        result = matcher.matched(RectifiedPair(case.left, case.right))
        if result.confidence is None:
            return []
        found.append(curve(case, result.disparity, result.confidence))
    return found


def opencv_margin(case: Case) -> Confidence:
    """OpenCV's uniqueness margin of each pixel as a confidence: the rank of the highest ratio at which it keeps its value."""
    count = searched(case.disparities)
    views = [padded(grey(image), count) for image in (case.left, case.right)]
    confidence = np.zeros(case.truth.shape, np.uint8)
    for rank, margin in enumerate(MARGINS):
        # Speckles are judged together, so with that check a pixel's fate would not be its own margin's.
        steps = three_way(count, uniquenessRatio=margin, speckleWindowSize=0).compute(*views)[:, count:]
        confidence[steps > 0] = rank + 1
    return confidence


def opencv_curves(cases: Sequence[Case]) -> list[Curve]:
    """The curves of OpenCV's uniqueness margin on the values of its tuned recipe."""
    return [curve(case, by_three_way(case.left, case.right, case.disparities), opencv_margin(case)) for case in cases]


def curves_by_margin(cases: Sequence[Case], name: str) -> list[Curve]:
    """The curves of a matcher's values sorted by OpenCV's margin, as one would who has no confidence of his own."""
    match = matching(name)
    return [curve(case, match(case.left, case.right, case.disparities), opencv_margin(case)) for case in cases]
