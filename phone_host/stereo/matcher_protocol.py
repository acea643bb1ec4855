"""What every matcher is: from a rectified pair to a disparity map. What some matchers tell beside it. What all of them check in their input."""

from typing import Protocol, runtime_checkable

import cv2
import numpy as np

from common.errors import DataError
from phone_host.model import Disparity, Image, Matched, MatchReport, RectifiedPair


def check_pair(pair: RectifiedPair) -> None:
    """Refuse a pair that no matcher can work on.

    Args:
        pair: two uint8 images, (H, W) or (H, W, 3), each grey or BGR on its own.

    Raises:
        DataError: the sizes differ, an image is empty, or it is neither grey nor BGR of 8 bits.
    """
    for side, image in (("left", pair.left), ("right", pair.right)):
        grey_or_bgr = image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)
        if image.dtype != np.uint8 or not grey_or_bgr or image.size == 0:
            raise DataError(
                f"the {side} image is {image.dtype} of shape {image.shape}",
                "matchers take uint8 images, grey (H, W) or BGR (H, W, 3), of at least one pixel",
            )
    left, right = pair.left.shape[:2], pair.right.shape[:2]
    if left != right:
        raise DataError(
            f"left image is {left[1]}x{left[0]}, right image is {right[1]}x{right[0]}",
            "rectify the pair to one size first (--calibration rig.yaml)",
        )


def grey(image: Image) -> Image:
    """Return the image as (H, W) uint8 grey; a grey one is returned as it is, or as a copy if its rows overlap in memory.

    Args:
        image: (H, W) grey or (H, W, 3) BGR, uint8.
    """
    if image.shape[0] > 1 and image.strides[0] < image[0].nbytes:  # OpenCV refuses such rows
        image = np.ascontiguousarray(image)
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


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
