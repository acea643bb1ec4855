"""The limit on branches that no test takes: beyond it CI's unit part fails."""

import pytest

from tests.support.branches import judge


@pytest.mark.parametrize(
    ("taken", "every", "told", "enough"),
    [
        (2066, 2100, "98.3 % (2066 of 2100); at least 98", True),
        (2058, 2100, "98.0 % (2058 of 2100); at least 98", True),
        (2057, 2100, "97.9 % (2057 of 2100); at least 98", False),  # 97.95
        (1997, 2100, "95.0 % (1997 of 2100); at least 98", False),
        (0, 0, "0.0 % (0 of 0); at least 98", False),
    ],
)
def test_less_than_98_percent_is_not_enough(taken: int, every: int, told: str, *, enough: bool) -> None:
    """The line gives the share, truncated to a tenth, and both counts. 98 % of the branches are enough; one fewer is not, nor is none measured."""
    assert judge({"covered_branches": taken, "num_branches": every}) == (
        f"branches of the pure modules: {told}",
        enough,
    )
