"""Matchers: from a rectified pair to a disparity map. One protocol, one factory; each algorithm has its own module.

Rules that every matcher keeps (tests/contract/test_matcher.py, test_matcher_inputs.py):

- disparity d = left x - right x, px, float32, the left image's size; NaN where it cannot be trusted; every value in [0,
  N);
- any N >= 1 and any image size, down to 1 x 1 and narrower than N;
- the result depends on the pair alone: not on earlier pairs, not on the number of OpenCV's threads.

This module is the registry of matchers: it knows them, they do not know it.

Other packages register matchers as entry points of the group `tandemscan.matchers`; the entry point's name is what a
user types. The entry point is a callable that takes the number of disparities (an int, 1 or more) and returns a
`Matcher`, which keeps the rules above.
"""

from dataclasses import dataclass, field
from typing import Final, assert_never

import numpy as np

from common.errors import DataError, SettingsError, TandemError
from common.program.extensions import make_registered
from common.words import counted
from phone_host.model import Disparity, RectifiedPair
from phone_host.native.library import native, required
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.match_block import BlockMatcher
from phone_host.stereo.match_onnx import OnnxMatcher
from phone_host.stereo.match_sgbm import SgbmMatcher
from phone_host.stereo.match_tandem import TandemMatcher
from phone_host.stereo.matcher_names import (
    MATCHERS,
    AnyMatcher,
    MatcherName,
    NetworkMatcher,
    RegisteredMatcher,
)
from phone_host.stereo.matcher_protocol import Matcher

_MEND: Final = "mend or uninstall the package that registers it"


@dataclass(frozen=True, slots=True)
class MatchSettings:
    """Settings from which a matcher is built.

    Attributes:
        matcher: the algorithm; by default that of this machine.
        disparities: N, px: 0 <= d < N is searched. Any number from 1; far above the image's width it costs no more.

    Raises:
        SettingsError: disparities below 1.
    """

    matcher: AnyMatcher = field(default_factory=default_matcher)
    disparities: int = 64

    def __post_init__(self) -> None:
        if self.disparities < 1:
            raise SettingsError(
                f"--disparities {self.disparities} leaves nothing to search",
                "give the number of disparities, 1 or more (64 suits most 640 px wide pairs)",
            )


def create_matcher(settings: MatchSettings) -> Matcher:
    """Build the matcher that the settings name. It can match any number of pairs of any sizes, in one thread at a time.

    Args:
        settings: the algorithm and its search range.

    Raises:
        SettingsError: another package's matcher cannot be loaded or does not fit, or a network's file is not there.
        UnavailableError: onnxruntime, which a network needs, is not installed; or the native library, which tandem needs,
            is not built.
        DataError: the file is no network that matches two images.
    """
    match settings.matcher:
        case MatcherName.BLOCK:
            return BlockMatcher(settings.disparities)
        case MatcherName.SGBM:
            return SgbmMatcher(settings.disparities)
        case MatcherName.TANDEM:
            return TandemMatcher(settings.disparities, required(native()))
        case RegisteredMatcher(name):
            registered: Matcher = make_registered(MATCHERS, name, Matcher, settings.disparities)
            return CheckedMatcher(registered, name, settings.disparities)
        case NetworkMatcher():
            return OnnxMatcher(settings.matcher, settings.disparities)
        case _:
            assert_never(settings.matcher)


class CheckedMatcher:
    """A matcher of another package, whose results are checked against the rules: a mistake in it is one line and never a wrong cloud.

    Args:
        matcher: computes the disparities.
        name: what the user calls it.
        disparities: N; every value must be in [0, N).
    """

    def __init__(self, matcher: Matcher, name: str, disparities: int) -> None:
        self._matcher, self._name, self._disparities = matcher, name, disparities

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair.

        Returns:
            (H, W) float32, px, in [0, N); NaN = none. An infinite value counts as none.

        Raises:
            DataError: the matcher failed, or its result breaks the rules.
        """
        try:
            found = np.asarray(self._matcher.match(pair), np.float32)
        except TandemError:
            raise
        except Exception as error:
            raise DataError(f"matcher {self._name} failed ({type(error).__name__}: {error})", _MEND) from error
        shape = pair.left.shape[:2]
        if found.shape != shape:
            raise DataError(f"matcher {self._name} gave a map of shape {found.shape} for images of {shape}", _MEND)
        found = np.where(np.isfinite(found), found, np.float32(np.nan))
        outside = int(np.count_nonzero((found < 0) | (found >= self._disparities)))
        if outside:
            raise DataError(
                f"matcher {self._name} gave {counted(outside, 'disparity', 'disparities')} outside 0 to {self._disparities - 1}",
                _MEND,
            )
        return found
