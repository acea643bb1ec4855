"""The stereo core: rectify or pass, match, reproject. One class for files and for live streams: both give the same bits.

No I/O, and no clock of its own: the caller brings the one by which the stages are timed.
"""

from collections.abc import Callable

from common.ledger import StageTimes
from phone_host.model import Image, Processed, RectifiedPair, StereoGeometry
from phone_host.stereo.images import require_same_size, size_px
from phone_host.stereo.match import Matcher
from phone_host.stereo.rectify import Rectifier
from phone_host.stereo.reproject import reproject


class StereoCore:
    """From two images to a point cloud image.

    Attributes:
        rig: the cameras; None when the images come rectified.
        geometry: what turns disparity into metres; None when the images come rectified and nobody said.

    Args:
        matcher: finds the disparity.
        rectifier: for unrectified images; None when they come rectified.
        geometry: for images that come rectified; must be None with a rectifier, which knows its own.
    """

    def __init__(
        self, matcher: Matcher, rectifier: Rectifier | None = None, geometry: StereoGeometry | None = None
    ) -> None:
        if rectifier is not None and geometry is not None:
            raise ValueError("the rectifier brings its own geometry")
        self._matcher = matcher
        self.rig = None if rectifier is None else rectifier.rig
        self._rectifier = rectifier
        self.geometry = geometry if rectifier is None else rectifier.geometry

    def compute(self, left: Image, right: Image, clock: Callable[[], int]) -> Processed:
        """All stages, each timed: rectify or pass, match, and reproject where the geometry is known.

        Args:
            left: (H, W) grey or (H, W, 3) BGR, uint8.
            right: the same; another size is possible with a rectifier only.
            clock: monotonic, ns.

        Returns:
            The rectified pair, its disparity, its cloud (None without geometry), and the times of these three stages.

        Raises:
            DataError: a size that does not fit the rig, or two sizes without a rig.
        """
        start_ns = clock()
        pair = self._rectify(left, right)
        rectified_ns = clock()
        disparity = self._matcher.match(pair)
        matched_ns = clock()
        cloud = None if self.geometry is None else reproject(disparity, self.geometry)
        times = StageTimes(
            rectify=rectified_ns - start_ns, match=matched_ns - rectified_ns, reproject=clock() - matched_ns
        )
        return Processed(pair, disparity, cloud, times)

    def require_sizes(self, left_px: tuple[int, int], right_px: tuple[int, int]) -> None:
        """Check that images of these sizes can be rectified, before they are decoded.

        Args:
            left_px: width and height of the left image, px.
            right_px: width and height of the right image, px.

        Raises:
            DataError: a size that does not fit the rig, or two sizes without a rig.
        """
        if self._rectifier is not None:
            self._rectifier.require_sizes(left_px, right_px)
        else:
            require_same_size(left_px, right_px, "the left image", "the right image")

    def _rectify(self, left: Image, right: Image) -> RectifiedPair:
        if self._rectifier is not None:
            return self._rectifier.rectify(left, right)
        self.require_sizes(size_px(left), size_px(right))
        return RectifiedPair(left, right)
