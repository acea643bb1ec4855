"""What every matcher is: from a rectified pair to a disparity map."""

from typing import Protocol

from phone_host.model import Disparity, RectifiedPair


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
