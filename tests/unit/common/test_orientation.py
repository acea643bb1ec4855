"""Orientation of cameras: what a URI says, and what it does to an image."""

import numpy as np
import pytest

from common.errors import SettingsError
from common.orientation import UPRIGHT, Flip, Orientation, orientation_of
from phone_host.stereo.eight_bit import upright

IMAGE = np.array([[1, 2, 3], [4, 5, 6]], np.uint8)


@pytest.mark.parametrize(
    ("orientation", "expected"),
    [
        (UPRIGHT, [[1, 2, 3], [4, 5, 6]]),
        (Orientation(90), [[4, 1], [5, 2], [6, 3]]),
        (Orientation(180), [[6, 5, 4], [3, 2, 1]]),
        (Orientation(270), [[3, 6], [2, 5], [1, 4]]),
        (Orientation(0, Flip.H), [[3, 2, 1], [6, 5, 4]]),
        (Orientation(0, Flip.V), [[4, 5, 6], [1, 2, 3]]),
        (Orientation(90, Flip.H), [[1, 4], [2, 5], [3, 6]]),
    ],
)
def test_an_image_is_turned_clockwise_and_then_mirrored(orientation: Orientation, expected: list[list[int]]) -> None:
    turned = upright(IMAGE, orientation)
    assert turned.tolist() == expected
    assert orientation.turned_size((3, 2)) == turned.shape[::-1]


def test_a_uri_without_either_option_leaves_images_as_they_are() -> None:
    assert orientation_of({"fps": "30"}, "replay:x") == UPRIGHT
    assert orientation_of({"rotate": "270", "flip": "v"}, "replay:x") == Orientation(270, Flip.V)


@pytest.mark.parametrize("options", [{"rotate": "45"}, {"rotate": "-90"}, {"flip": "both"}, {"flip": ""}])
def test_other_values_are_refused_with_those_allowed(options: dict[str, str]) -> None:
    with pytest.raises(SettingsError, match=r"rotate=|flip="):
        orientation_of(options, "replay:x")
