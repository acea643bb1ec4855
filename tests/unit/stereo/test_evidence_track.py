"""Features are followed from the left image to the right one and from the pair before, and left out where they do not lead back."""

import cv2
import numpy as np
import pytest

from phone_host.model import Image
from phone_host.stereo.evidence_features import Matches
from phone_host.stereo.evidence_track import follow, tracked


def painted(shift: tuple[float, float], width: int = 320) -> Image:
    """A random pattern, moved by x, y px."""
    coarse = np.random.default_rng(4).integers(0, 255, (60, 80)).astype(np.float32)
    image = cv2.resize(coarse, (width, width * 3 // 4), interpolation=cv2.INTER_CUBIC)
    moved = cv2.warpAffine(
        image, np.array([[1.0, 0, shift[0]], [0, 1, shift[1]]]), (width, width * 3 // 4), borderMode=4
    )
    return np.asarray(np.clip(moved, 0, 255), np.uint8)


def grid(width: int = 320, count: int = 6) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Places amid the image."""
    x, y = np.meshgrid(np.linspace(0.25, 0.75, count) * width, np.linspace(0.25, 0.5, count) * width)
    return np.column_stack([x.ravel(), y.ravel()])


@pytest.mark.parametrize("width", [320, 1600])
def test_features_are_followed_across_and_back_in_time(width: int) -> None:
    """Rough matches become exact to 0.1 px, on wide images to 0.2 px, and speeds are the image's."""
    left, right, before = painted((0, 0), width), painted((-6.0, 0.4), width), painted((-2.0, -3.0), width)
    points = grid(width)
    rough = Matches(points, points + np.array([-5.0, 1.0]), np.zeros(len(points), np.float32))
    matches = tracked(left, right, rough)
    found = follow(left, right, matches, before, 0.1)
    assert len(found.left_px) > 0.8 * len(points)
    tolerance = 0.1 if width == 320 else 0.25
    assert np.abs(np.median(found.right_px - found.left_px, axis=0) - (-6.0, 0.4)).max() < tolerance
    assert np.abs(np.nanmedian(found.velocity_px_s, axis=0) - (20.0, 30.0)).max() < 10 * tolerance


def test_wrong_matches_do_not_lead_back() -> None:
    """Matches to a place 30 px off are not kept, and without an earlier image no speed is known."""
    left, right = painted((0, 0)), painted((-6.0, 0.4))
    points = grid()
    right_px = points + np.array([-6.0, 0.4])
    right_px[::2] += 30.0
    found = follow(left, right, Matches(points, right_px, np.zeros(len(points), np.float32)), None, 0.1)
    assert 0.7 * len(points) / 2 < len(found.left_px) < 0.65 * len(points)
    assert np.isnan(found.velocity_px_s).all()


def test_without_matches_there_is_nothing_to_follow() -> None:
    """An empty set stays empty; an earlier image of another size, or of the same moment, tells no speed."""
    left, none = painted((0, 0)), np.zeros((0, 2))
    empty = Matches(none, none, np.zeros(0, np.float32))
    assert tracked(left, left, empty) is empty
    assert len(follow(left, left, empty, left, 0.1).left_px) == 0
    points = grid()
    same = Matches(points, points, np.zeros(len(points), np.float32))
    for before, seconds in ((painted((0, 0), 160), 0.1), (left, 0.0)):
        assert np.isnan(follow(left, left, same, before, seconds).velocity_px_s).all()
