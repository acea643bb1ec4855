"""The stereo core: rectify (or pass through), match, reproject, cut. Files and live streams use the same class and so get the same bits.

No I/O and no clock of its own: the caller passes the clock that times the stages.

Image sizes are known only with the first pair. What depends on them (maps, search range, working size, limits) is made
then, and kept for the next pair of the same sizes.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from common.ledger import StageTimes
from phone_host.model import (
    AS_CALIBRATED,
    CloudImage,
    CutCounts,
    Departure,
    DepthLimits,
    Disparity,
    Epipolar,
    Image,
    Matched,
    Processed,
    RectifiedPair,
    Search,
    StereoGeometry,
)
from phone_host.native.library import native
from phone_host.stereo.budget import Choice, Extent
from phone_host.stereo.depth_limits import (
    DepthWanted,
    above_zero,
    crop_inside,
    depth_limits,
    disparity_error_px,
)
from phone_host.stereo.images import WHOLE, require_same_size, size_px
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.match_tandem import without_untold
from phone_host.stereo.matcher_names import FASTEST
from phone_host.stereo.matcher_protocol import Matcher, matched_by
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import disparities_for_near, points_of
from phone_host.stereo.scaled_rig import scaled_rig
from phone_host.stereo.working import (
    MARGIN_PX,
    Part,
    chosen_scale,
    confidence_of_known,
    confidence_to_full_size,
    lying_pair,
    part_for,
    reduced,
    to_full_size,
    upright_again,
)

_Sizes = tuple[tuple[int, int], tuple[int, int]]
_Key = tuple[tuple[int, int], tuple[int, int], Choice | None]
_MOST_KEPT: Final = 4
"""Pairs of image sizes and choices that are kept ready. Cameras change their size rarely, a time budget its choice every few seconds."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Ready:
    """What is made once for a pair of image sizes."""

    rectifier: Rectifier | None
    geometry: StereoGeometry | None
    width_px: int
    height_px: int
    matcher: Matcher
    search: Search
    part: Part | None
    error_px: float
    limits: DepthLimits | None


class _InUse:
    """A correction, and the rectifiers that have it."""

    def __init__(self, departure: Departure, made: dict[Rectifier, Rectifier]) -> None:
        self.overlay, self._made = departure, made

    def of(self, rectifier: Rectifier) -> Rectifier:
        """Return the corrected rectifier of a calibrated one; make it if it is new."""
        found = self._made.get(rectifier)
        if found is None:
            found = self._made[rectifier] = rectifier.corrected(self.overlay)
        return found


class StereoCore:
    """Computes a point cloud image from two images.

    Attributes:
        rig: the cameras, at the size of their calibration; None when the images are already rectified.
        rectification: of the rig, at that size; None when the images are already rectified.
        geometry: converts disparity to metres at that size; None when the images are already rectified and no geometry was
            given. `Processed.geometry` is that of a result.
        wanted: limits, crop and working size as asked for.

    Args:
        matcher: finds the disparity: a matcher as it is, or the settings from which one is made for each image size.
        rectifier: for unrectified images; None when they are already rectified.
        geometry: for images that are already rectified; must be None with a rectifier, which has its own.
        wanted: limits, crop and working size.
    """

    def __init__(
        self,
        matcher: Matcher | MatchSettings,
        rectifier: Rectifier | None = None,
        geometry: StereoGeometry | None = None,
        wanted: DepthWanted = DepthWanted(),  # noqa: B008  # frozen
    ) -> None:
        if rectifier is not None and geometry is not None:
            raise ValueError("the rectifier brings its own geometry")
        self._matcher = matcher
        self.rig = None if rectifier is None else rectifier.rig
        self._rectifier = rectifier
        self.rectification = None if rectifier is None else rectifier.rectification
        self.geometry = geometry if rectifier is None else rectifier.geometry
        self.wanted = wanted
        self._kept: dict[_Key, _Ready] = {}
        self._in_use = _InUse(AS_CALIBRATED, {})
        native()  # a wrong TANDEMSCAN_SIMD is told before the first pair comes
        if isinstance(matcher, MatchSettings):
            create_matcher(matcher)  # so is a name or a number that is wrong is told before the first pair comes

    @property
    def matcher_is_fastest(self) -> bool:
        """Whether none of our matchers is faster than the one that the core was built with."""
        return isinstance(self._matcher, MatchSettings) and self._matcher.matcher is FASTEST

    def compute(
        self,
        left: Image,
        right: Image,
        clock: Callable[[], int],
        *,
        whole_px: _Sizes | None = None,
        choice: Choice | None = None,
    ) -> Processed:
        """Run and time all stages: rectify or pass through, match, and reproject if the geometry is known.

        Args:
            left: (H, W) grey or (H, W, 3) BGR, uint8.
            right: the same; it may have another size only with a rectifier.
            clock: monotonic, ns.
            whole_px: width and height of left and right image before they were decoded smaller by `reductions`, px;
                None: they were not.
            choice: how to match this pair; None: as the core was built. Only for a core that was built from settings.

        Returns:
            The rectified pair, its disparity, its cloud (None without geometry), how they were found, and the times of
            these three stages.

        Raises:
            DataError: a size does not fit the rig, the sizes differ and there is no rig, or the crop lies outside.
        """
        start_ns = clock()
        ready = self._ready(*(whole_px or (size_px(left), size_px(right))), choice)
        rectifier = None if ready.rectifier is None else self._in_use.of(ready.rectifier)
        pair = RectifiedPair(left, right) if rectifier is None else rectifier.rectify(left, right)
        rectified_ns = clock()
        matched = _match(pair, ready)
        matched_ns = clock()
        disparity, cloud, cut = _reproject(matched.disparity, ready)
        confidence = matched.confidence
        if confidence is not None:
            confidence = confidence_of_known(confidence, disparity)
        times = StageTimes(
            rectify=rectified_ns - start_ns, match=matched_ns - rectified_ns, reproject=clock() - matched_ns
        )
        return Processed(
            pair,
            disparity,
            cloud,
            times,
            geometry=ready.geometry,
            limits=ready.limits,
            cut=cut,
            search=ready.search,
            confidence=confidence,
            match_report=matched.report,
            overlay=AS_CALIBRATED if rectifier is None else rectifier.overlay,
        )

    def correct(self, departure: Departure) -> None:
        """Rectify the next pairs with a corrected rig. Any thread may call it: the maps are made first, in this thread."""
        known = {ready.rectifier for ready in list(self._kept.values()) if ready.rectifier is not None}
        self._in_use = _InUse(departure, {rectifier: rectifier.corrected(departure) for rectifier in known})

    def reductions(self, left_px: tuple[int, int], right_px: tuple[int, int]) -> tuple[int, int]:
        """Return by how much images of these sizes may be decoded smaller, left and right; see `Rectifier.reductions`.

        Args:
            left_px: width and height of the left image, px.
            right_px: width and height of the right image, px.

        Raises:
            DataError: as `require_sizes`.
        """
        if self._rectifier is None:
            self.require_sizes(left_px, right_px)
            return WHOLE
        rectifier = self._ready(left_px, right_px).rectifier
        return WHOLE if rectifier is None else rectifier.reductions

    def extent(self, left_px: tuple[int, int], right_px: tuple[int, int]) -> Extent:
        """Return what is matched of images of these sizes if nothing is chosen.

        Args:
            left_px: width and height of the left image, px.
            right_px: width and height of the right image, px.

        Raises:
            DataError: as `compute`.
        """
        ready = self._ready(left_px, right_px)
        width_px, height_px = (ready.width_px, ready.height_px) if ready.part is None else ready.part.size_px
        return Extent(width_px=width_px, height_px=height_px, search=ready.search, geometry=ready.geometry)

    def require_sizes(self, left_px: tuple[int, int], right_px: tuple[int, int]) -> None:
        """Check that images of these sizes can be rectified and hold the crop, before they are decoded.

        Args:
            left_px: width and height of the left image, px.
            right_px: width and height of the right image, px.

        Raises:
            DataError: a size does not fit the rig, the sizes differ and there is no rig, or the crop lies outside.
        """
        if self.wanted.crop is None:
            self._require_fit(left_px, right_px)
        else:
            self._ready(left_px, right_px)

    def _require_fit(self, left_px: tuple[int, int], right_px: tuple[int, int]) -> None:
        if self.rig is None:
            require_same_size(left_px, right_px, "the left image", "the right image")
        else:
            scaled_rig(self.rig, left_px, right_px)

    def rectifier_for(self, size_px: tuple[int, int]) -> Rectifier | None:
        """Return what rectifies images to a size, as the rig was calibrated; None if they came rectified.

        Args:
            size_px: width and height of the rectified images, px.
        """
        made = [ready.rectifier for ready in list(self._kept.values()) if (ready.width_px, ready.height_px) == size_px]
        return made[-1] if made else self._rectifier

    def _ready(self, left_px: tuple[int, int], right_px: tuple[int, int], choice: Choice | None = None) -> _Ready:
        """Return what these image sizes need; make it if they are new."""
        ready = self._kept.get((left_px, right_px, choice))
        if ready is None:
            self._require_fit(left_px, right_px)
            ready = self._made_for(left_px, right_px, choice)
            while len(self._kept) >= _MOST_KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[left_px, right_px, choice] = ready
        return ready

    def _fitting(self, rectifier: Rectifier, left_px: tuple[int, int], right_px: tuple[int, int]) -> Rectifier:
        """Return the rectifier for images of these sizes. Its maps are dear: another choice may have made it."""
        for (left, right, _), ready in self._kept.items():
            if (left, right) == (left_px, right_px) and ready.rectifier is not None:
                return ready.rectifier
        rig = scaled_rig(rectifier.rig, left_px, right_px)
        return rectifier if rig is rectifier.rig else Rectifier(rig)

    def _made_for(self, left_px: tuple[int, int], right_px: tuple[int, int], choice: Choice | None = None) -> _Ready:
        rectifier, geometry, wanted = self._rectifier, self.geometry, self.wanted
        size, epipolar, zero_sigma_px = left_px, Epipolar.LEFT, math.nan
        if rectifier is not None:
            rectifier = self._fitting(rectifier, left_px, right_px)
            geometry, made = rectifier.geometry, rectifier.rectification
            size, epipolar = (made.width_px, made.height_px), made.epipolar
            zero_sigma_px = rectifier.rig.zero_sigma_px
        disparities = self._disparities(geometry, size[1] if epipolar.is_vertical else size[0])
        crop = None if wanted.crop is None else crop_inside(wanted.crop, *size)
        part = None if crop is None else part_for(crop, size, disparities, epipolar=epipolar)
        scale = wanted.scale
        if choice is not None:
            scale, disparities = choice.scale, min(choice.disparities, disparities)
        elif math.isnan(scale):
            matched = size if part is None else part.size_px
            along, across = matched[::-1] if epipolar.is_vertical else matched
            scale = chosen_scale(along, across, disparities) if disparities else 1.0
        if crop is not None:
            margin_px = math.ceil(MARGIN_PX / scale)
            part = part_for(crop, size, disparities, epipolar=epipolar, margin_px=margin_px)
        error_px = disparity_error_px(scale, zero_sigma_px)
        return _Ready(
            rectifier=rectifier,
            geometry=geometry,
            width_px=size[0],
            height_px=size[1],
            matcher=self._matcher_for(max(1, math.ceil(disparities * scale)), choice),
            search=Search(scale=scale, disparities=disparities),
            part=part,
            error_px=error_px,
            limits=None if geometry is None else depth_limits(geometry, error_px, wanted),
        )

    def _disparities(self, geometry: StereoGeometry | None, along_px: int) -> int:
        """Return N, px of the rectified images; 0 if the matcher has its own."""
        if not isinstance(self._matcher, MatchSettings):
            return 0
        if geometry is None or math.isnan(self.wanted.search_from_m):
            return min(self._matcher.disparities, along_px)  # no point lies farther left than the image's edge
        return disparities_for_near(geometry, self.wanted.search_from_m, along_px)

    def _matcher_for(self, disparities: int, choice: Choice | None) -> Matcher:
        if isinstance(self._matcher, MatchSettings):
            name = self._matcher.matcher if choice is None else choice.matcher
            return create_matcher(replace(self._matcher, matcher=name, disparities=disparities))
        return self._matcher


def _match(pair: RectifiedPair, ready: _Ready) -> Matched:
    """Match the part that is wanted, at the working size, turned if need be; the result has the rectified images' size."""
    part, scale, epipolar = ready.part, ready.search.scale, pair.epipolar
    seen = pair if part is None else part.of(pair)
    small = RectifiedPair(reduced(seen.left, scale), reduced(seen.right, scale), epipolar)
    lying = lying_pair(small)
    found = matched_by(ready.matcher, lying)
    if scale < 1:  # less noise: on a bare wall, both views agree on what is nearest
        found = without_untold(lying, found)
    height, width = seen.left.shape[:2]
    disparity = to_full_size(upright_again(found.disparity, epipolar), width, height, epipolar)
    if scale < 1 and ready.search.disparities:
        # N was rounded up to whole pixels of the working size.
        disparity[disparity >= ready.search.disparities] = np.nan
    confidence = found.confidence
    if confidence is not None:
        confidence = confidence_to_full_size(upright_again(confidence, epipolar), width, height)
    if part is not None:
        disparity = part.placed(disparity, ready.width_px, ready.height_px)
        if confidence is not None:
            confidence = part.placed(confidence, ready.width_px, ready.height_px)
    report = replace(found.report, vertical_px=found.report.vertical_px / scale)
    return Matched(disparity=disparity, confidence=confidence, report=report)


def _reproject(matched: Disparity, ready: _Ready) -> tuple[Disparity, CloudImage | None, CutCounts]:
    """Drop what is no measurement, compute the points, cut them, and count."""
    geometry, limits = ready.geometry, ready.limits
    crop = None if ready.part is None else ready.part.crop
    inside = matched.size if crop is None else crop.width_px * crop.height_px
    if geometry is not None and limits is not None:
        points = points_of(matched, geometry, limits)
        disparity, cloud, found, counts = points.disparity, points.cloud, points.found, points.counts
    else:
        cloud, found = None, int(np.count_nonzero(np.isfinite(matched)))
        disparity, at_zero = above_zero(matched, 0.0, ready.error_px)
        counts = CutCounts(kept=found - at_zero, at_zero=at_zero)
    return disparity, cloud, replace(counts, outside=matched.size - inside, unmatched=inside - found)
