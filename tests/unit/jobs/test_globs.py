"""Unquoted globs: what the shell expanded is sorted back into left and right, or the remedy is named."""

import pytest

from common.errors import SettingsError
from phone_host.jobs.picture_pairs import two_lists


@pytest.mark.parametrize(
    ("left", "right"),
    [
        (["left"], ["right"]),
        (["left/1.png", "left/2.png"], ["right/1.png", "right/2.png"]),
        (["cam0/1.png", "cam0/2.png", "cam0/3.png"], ["cam1/1.png", "cam1/3.png"]),
        (["left"], ["right/1.png", "right/2.png"]),
        (["left/*.png"], ["right/1.png", "right/2.png"]),
        (["v/left1.png", "v/left2.png", "v/left10.png"], ["v/right1.png", "v/right2.png"]),
        (["v/pair-0/left.png", "v/pair-1/left.png"], ["v/pair-0/right.png", "v/pair-1/right.png"]),
        (["1_L.png", "2_L.png"], ["1_R.png", "2_R.png"]),
        (["desk_a.png", "Door_a.png"], ["desk_b.png", "Door_b.png"]),
    ],
)
def test_expanded_globs_are_sides_again(left: list[str], right: list[str]) -> None:
    """By folder, by name, or by halves that are in order each."""
    assert two_lists([*left, *right]) == (tuple(left), tuple(right))


@pytest.mark.parametrize(
    "paths",
    [["a.png", "b.png", "c.png", "d.png"], ["v/1.png", "v/2.png", "v/3.png"], ["a/1.png", "b/1.png", "c/1.png"]],
)
def test_what_is_not_clear_is_refused_with_the_remedy(paths: list[str]) -> None:
    """One folder of like names, an odd number of them, and three folders."""
    with pytest.raises(SettingsError, match="quotes"):
        two_lists(paths)


@pytest.mark.parametrize("paths", [[], ["left"]])
def test_one_side_alone_is_refused(paths: list[str]) -> None:
    """LEFT and RIGHT are both needed."""
    with pytest.raises(SettingsError, match="LEFT and RIGHT"):
        two_lists(paths)
