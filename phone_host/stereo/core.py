"""The stereo core: rectify (or pass through), match, reproject. Files and live streams use the same class and so get the same bits.

No I/O and no clock of its own: the caller passes the clock that times the stages.
"""

from collections.abc import Callable

from common.ledger import StageTimes
from phone_host.model import Image, Processed, RectifiedPair, StereoGeometry
from phone_host.stereo.images import require_same_size, size_px
from phone_host.stereo.matcher_protocol import Matcher
from phone_host.stereo.rectify import Rectifier
from phone_host.stereo.reproject import reproject


class StereoCore:
    """Computes a point cloud image from two images.

    Attributes:
        rig: the cameras; None when the images are already rectified.
        rectification: of the rig; None when the images are already rectified.
        geometry: converts disparity to metres; None when the images are already rectified and no geometry was given.

    Args:
        matcher: finds the disparity.
        rectifier: for unrectified images; None when they are already rectified.
        geometry: for images that are already rectified; must be None with a rectifier, which has its own.
    """

    def __init__(
        self, matcher: Matcher, rectifier: Rectifier | None = None, geometry: StereoGeometry | None = None
    ) -> None:
        if rectifier is not None and geometry is not None:
            raise ValueError("the rectifier brings its own geometry")
        self._matcher = matcher
        self.rig = None if rectifier is None else rectifier.rig
        self._rectifier = rectifier
        self.rectification = None if rectifier is None else rectifier.rectification
        self.geometry = geometry if rectifier is None else rectifier.geometry

    def compute(self, left: Image, right: Image, clock: Callable[[], int]) -> Processed:
        """Run and time all stages: rectify or pass through, match, and reproject if the geometry is known.

        Args:
            left: (H, W) grey or (H, W, 3) BGR, uint8.
            right: the same; it may have another size only with a rectifier.
            clock: monotonic, ns.

        Returns:
            The rectified pair, its disparity, its cloud (None without geometry), and the times of these three stages.

        Raises:
            DataError: a size does not fit the rig, or the sizes differ and there is no rig.
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
            DataError: a size does not fit the rig, or the sizes differ and there is no rig.
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
