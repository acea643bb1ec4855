"""Turns judged pairs into sightings, their features followed and taken back to the rig as it was calibrated; watches stills so. Pure."""

from dataclasses import dataclass, replace
from typing import Final

from phone_host.calibration.drift.fit import PARAMETERS, RowModel, Sighting, fit_rows
from phone_host.calibration.drift.watch import FEWEST_CELLS, FEWEST_FEATURES, DriftWatch, Trends
from phone_host.model import Drift, Image, Processed
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import Examined, maps_of
from phone_host.stereo.evidence_points import ThroughRig
from phone_host.stereo.evidence_track import Followed, follow
from phone_host.stereo.images import to_grey
from phone_host.stereo.working import lying, upright_points, upright_steps

_LEAST_PAIRS: Final = 7
"""From the first to the last of a line."""


@dataclass(frozen=True, slots=True, eq=False)
class Timed:
    """When a pair's images were exposed, and what the left camera saw before.

    Attributes:
        late_s: by how much later the left image was exposed than the right one, by their stamps, s; 0 for stills.
        before: left image of an earlier pair, rectified; None: there is none, or it is not known when it was taken.
        seconds: how much earlier that was, s; 0: not known.
    """

    late_s: float = 0.0
    before: Image | None = None
    seconds: float = 0.0


def sighting_of(
    core: StereoCore, processed: Processed, look: Examined, timed: Timed
) -> tuple[RowModel, Sighting] | None:
    """Follow the features of a judged pair.

    Returns:
        The rig's model at this size, the same object as long as the size stays, and what was seen; None if no rig has
        rectified the pair.
    """
    height_px, width_px = processed.pair.left.shape[:2]
    rectifier = core.rectifier_for((width_px, height_px))
    if rectifier is None:
        return None
    epipolar = processed.pair.epipolar
    before = None if timed.before is None else lying(to_grey(timed.before), epipolar)
    seen = follow(look.left, look.right, look.matches, before, timed.seconds)
    size_px = (width_px, height_px)
    upright = Followed(
        upright_points(seen.left_px, epipolar, size_px),
        upright_points(seen.right_px, epipolar, size_px),
        upright_steps(seen.velocity_px_s, epipolar),
    )
    model = RowModel(rectifier.rig, rectifier.rectification)
    calibrated = ThroughRig(rectifier.rig, rectifier.rectification)
    return model, model.sighting(upright, maps_of(core, processed), calibrated, timed.late_s)


class StillsWatch:
    """Watches over the rig of some stills as over that of a run: a pair's number takes the place of its moment; nothing is corrected."""

    def __init__(self) -> None:
        self._watch: DriftWatch | None = None
        self._trends = Trends(least=_LEAST_PAIRS)
        self._number = 0

    def add(self, core: StereoCore, processed: Processed, look: Examined) -> None:
        """Take the next pair into account. Images that came rectified have no rig."""
        self._number += 1
        found = sighting_of(core, processed, look, Timed())
        if found is None:
            return
        model, seen = found
        self._watch = self._watch or DriftWatch(corrects=False, start=processed.overlay)
        self._watch.add(model, seen, self._number)
        fit = fit_rows(model, [seen])
        if fit.features >= FEWEST_FEATURES and fit.cells >= FEWEST_CELLS:
            values = fit.values[:PARAMETERS]
            self._trends.add(self._number, values, model.rows_px(values))

    @property
    def drift(self) -> Drift | None:
        """What is known so far, with pairs for seconds; None without a rig."""
        return None if self._watch is None else replace(self._watch.drift, trend=self._trends.trend)
