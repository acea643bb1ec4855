"""What a run's images say of its depth: figures and doubts of many judgements, taken together. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from phone_host.measure.doubt_history import Episode
from phone_host.measure.trust import Concern
from phone_host.model import Evidence, StereoGeometry


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageFigures:
    """Medians over some judgements; NaN = not measured.

    Attributes:
        density: share of the left image's pixels that have a disparity.
        consistency: share of sampled disparities that are confirmed from right to left.
        vertical_px: distance of features from their rows, px.
        vertical_offset_px: how far too low the right image lies, px.
        disparity_px: the middle one of the disparities between the limits of depth, px.
        scattered_share: share of the disparities that lie in pieces too small for a surface.
        matched_scale: size of the images that were matched, as a share of the full size in whose px all this is.
    """

    density: float = math.nan
    consistency: float = math.nan
    vertical_px: float = math.nan
    vertical_offset_px: float = math.nan
    disparity_px: float = math.nan
    scattered_share: float = math.nan
    matched_scale: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageTrust:
    """What a run's images say about its depth.

    Attributes:
        judged: number of judged pairs.
        wants_depth: whether a rig or rectified images were given.
        has_depth: whether any pair had depth.
        start: figures over the first judgements.
        now: figures over those of the latest ones that have exactly the standing doubts.
        concerns: the standing doubts, gravest first.
        newest: the doubts of the newest judged pair, gravest first.
        history: what stood for a while, and what stands.
        geometry: converts disparity to metres; None if it is not known.
        disparity_error_px: error of a disparity, px; NaN if the core states none.
    """

    judged: int = 0
    wants_depth: bool = False
    has_depth: bool = False
    start: ImageFigures = ImageFigures()
    now: ImageFigures = ImageFigures()
    concerns: tuple[Concern, ...] = ()
    newest: tuple[Concern, ...] = ()
    history: tuple[Episode, ...] = ()
    geometry: StereoGeometry | None = None
    disparity_error_px: float = math.nan

    @property
    def is_settled(self) -> bool:
        """Whether the newest judged pair has exactly the standing doubts."""
        return {concern.doubt for concern in self.newest} == {concern.doubt for concern in self.concerns}


def median_figures(found: Sequence[Evidence]) -> ImageFigures:
    """Return the medians of what was measured."""

    def median(name: str) -> float:
        values = [value for value in (getattr(item, name) for item in found) if not math.isnan(value)]
        return float(np.median(values)) if values else math.nan

    return ImageFigures(
        density=median("density"),
        consistency=median("consistency"),
        vertical_px=median("vertical_px"),
        vertical_offset_px=median("vertical_offset_px"),
        disparity_px=median("disparity_px"),
        scattered_share=median("scattered_share"),
        matched_scale=median("matched_scale") if found else 1.0,
    )
