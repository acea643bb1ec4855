"""Checks the disparity maps of another package's matcher, so that a mistake in it is one line and never a wrong cloud."""

import numpy as np

from common.errors import DataError, TandemError
from common.words import counted
from phone_host.model import Disparity, RectifiedPair
from phone_host.stereo.matcher_protocol import Matcher

_REMEDY = "mend or uninstall the package that registers it"


class CheckedMatcher:
    """Another matcher, whose results are checked against the rules of every matcher.

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
            raise DataError(f"matcher {self._name} failed ({type(error).__name__}: {error})", _REMEDY) from error
        shape = pair.left.shape[:2]
        if found.shape != shape:
            raise DataError(f"matcher {self._name} gave a map of shape {found.shape} for images of {shape}", _REMEDY)
        found = np.where(np.isfinite(found), found, np.float32(np.nan))
        outside = int(np.count_nonzero((found < 0) | (found >= self._disparities)))
        if outside:
            raise DataError(
                f"matcher {self._name} gave {counted(outside, 'disparity', 'disparities')} outside 0 to {self._disparities - 1}",
                _REMEDY,
            )
        return found
