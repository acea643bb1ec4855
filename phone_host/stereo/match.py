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
from typing import assert_never

from common.errors import SettingsError
from common.program.extensions import make_registered
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.match_block import BlockMatcher
from phone_host.stereo.match_checked import CheckedMatcher
from phone_host.stereo.match_onnx import OnnxMatcher
from phone_host.stereo.match_sgbm import SgbmMatcher
from phone_host.stereo.match_tandem import TandemMatcher
from phone_host.stereo.matcher_names import MATCHERS, AnyMatcher, MatcherName, RegisteredMatcher, matcher_named
from phone_host.stereo.matcher_protocol import Matcher
from phone_host.stereo.native.library import native, required
from phone_host.stereo.network_name import NetworkMatcher


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

    Returns:
        The matcher.

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


def make_matcher(name: str, disparities: int) -> Matcher:
    """Build a matcher by the name that a user types; see `create_matcher`.

    Args:
        name: one of ours, or one that an installed package registers.
        disparities: N >= 1, px: 0 <= d < N is searched.

    Returns:
        The matcher.

    Raises:
        SettingsError: no matcher has that name, or disparities is below 1.
    """
    return create_matcher(MatchSettings(matcher_named(name), disparities))
