"""What every matcher is: from a rectified pair to a disparity map. What some matchers tell beside it."""

from typing import Protocol, runtime_checkable

from phone_host.model import Disparity, Matched, MatchReport, RectifiedPair


class Matcher(Protocol):
    """Finds, for each pixel of the left image, where the same point appears in the right one."""

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair.

        Args:
            pair: two uint8 images of one size, grey (H, W) or BGR (H, W, 3), rectified.

        Returns:
            (H, W) float32, px, left x - right x, in [0, N); NaN = not trusted.

        Raises:
            DataError: the two images differ in size, or are not uint8 images.
        """
        ...


@runtime_checkable
class ReportingMatcher(Matcher, Protocol):
    """A matcher that also tells how certain its values are and what it corrected."""

    def matched(self, pair: RectifiedPair) -> Matched:
        """Match one pair as `match` does, and tell more of it.

        Returns:
            The same disparity as `match` gives, and what is known beside it.

        Raises:
            DataError: as `match` does.
        """
        ...


def matched_by(matcher: Matcher, pair: RectifiedPair) -> Matched:
    """Match one pair, with all that this matcher tells.

    Args:
        matcher: one that reports, or one that does not.
        pair: rectified.

    Returns:
        The matched pair; without confidence and with an empty report if the matcher has none.
    """
    if isinstance(matcher, ReportingMatcher):
        return matcher.matched(pair)
    return Matched(disparity=matcher.match(pair), report=MatchReport())
