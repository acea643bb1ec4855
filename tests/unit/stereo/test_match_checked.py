"""Another package's matcher: its mistakes are one line, and its infinities count as none."""

from collections.abc import Callable

import numpy as np
import pytest

from common.errors import DataError
from phone_host.model import Disparity, RectifiedPair
from phone_host.stereo.match import CheckedMatcher

_IMAGE = np.zeros((4, 6), np.uint8)
_PAIR = RectifiedPair(_IMAGE, _IMAGE)
_DISPARITIES = 16


class Foreign:
    """A matcher that gives whatever a test says."""

    def __init__(self, result: Callable[[], object]) -> None:
        self._result = result

    def match(self, pair: RectifiedPair) -> Disparity:  # noqa: ARG002 - the protocol has it
        """Ignore the pair."""
        return self._result()  # type: ignore[return-value]  # that is what is tested


def checked(result: Callable[[], object]) -> Disparity:
    """Run a matcher behind the check."""
    return CheckedMatcher(Foreign(result), "sad", _DISPARITIES).match(_PAIR)


def _broken() -> object:
    raise ZeroDivisionError("division by zero")


@pytest.mark.parametrize(
    ("result", "told"),
    [
        (lambda: np.zeros((3, 6), np.float32), r"matcher sad gave a map of shape \(3, 6\) for images of \(4, 6\)"),
        (lambda: None, r"gave a map of shape \(\)"),
        (lambda: "disparity", "failed .ValueError"),
        (lambda: np.full((4, 6), -1.0), "gave 24 disparities outside 0 to 15"),
        (lambda: np.full((4, 6), 16.0), "gave 24 disparities outside 0 to 15"),
        (_broken, "failed .ZeroDivisionError: division by zero"),
    ],
)
def test_a_mistake_is_one_line_with_a_remedy(result: Callable[[], object], told: str) -> None:
    """Wrong shapes, values and exceptions name the matcher and say whom to ask."""
    with pytest.raises(DataError, match=told) as caught:
        checked(result)
    assert "the package that registers it" in caught.value.remedy


def test_infinite_values_count_as_none() -> None:
    """Some matchers write +inf for no match; the map then has NaN there and keeps its other values as float32."""
    found = checked(lambda: np.where(np.arange(24).reshape(4, 6) % 2, np.inf, 3.0))
    assert found.dtype == np.float32
    assert np.isnan(found[:, 1::2]).all()
    assert (found[:, ::2] == 3).all()
