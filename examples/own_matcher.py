"""Use your own matching algorithm: `python examples/own_matcher.py LINK CAMERA RIG [PAIRS]`.

This example uses OpenCV's block matcher. Pass the object to `open_scanner`. Or publish it under a name, so that
`phone-host run --matcher opencv-bm` finds it, with an entry point in your package's pyproject.toml:

    [project.entry-points."tandemscan.matchers"]
    opencv-bm = "your_package:BlockMatcher"
"""

import sys

import cv2
import numpy as np

from phone_host.api import Disparity, Image, RectifiedPair, open_scanner


class BlockMatcher:
    """OpenCV's block matcher behind the matcher protocol.

    Args:
        disparities: 0 <= d < this is searched, px.
    """

    def __init__(self, disparities: int) -> None:
        self._matcher = cv2.StereoBM.create(numDisparities=-(-disparities // 16) * 16, blockSize=15)

    def match(self, pair: RectifiedPair) -> Disparity:
        """Return (H, W) float32, px; NaN = none. OpenCV gives sixteenths of a pixel, and negative values for none."""
        found = self._matcher.compute(_grey(pair.left), _grey(pair.right)).astype(np.float32)
        found /= np.float32(16)
        found[found < 0] = np.nan
        return found


def _grey(image: Image) -> Image:
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


def main(link: str, camera: str, rig: str, pairs: str = "20") -> None:
    """Scan with this matcher."""
    with open_scanner(
        link=link, camera=camera, rig=rig, matcher=BlockMatcher(128), pairs=int(pairs), lossless=True
    ) as scanner:
        for result in scanner:
            disparity = result.processed.disparity
            assert disparity is not None
            share = np.isfinite(disparity).mean()
            print(f"pair {result.number}: {share:.0%} matched in {result.ledger.stages.match / 1e6:.1f} ms")


if __name__ == "__main__":
    main(*sys.argv[1:])
