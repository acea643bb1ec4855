"""Watches over the rig of a sequence of stills: the same judgement as of a run, over the order of the pairs. Pure.

A pair's number takes the place of its moment: a `Trend` is per pair. Nothing is corrected.
"""

from dataclasses import replace
from typing import Final

from phone_host.calibration.drift.fit import fit_rows
from phone_host.calibration.drift.rows import PARAMETERS
from phone_host.calibration.drift.see import Timed, sighting_of
from phone_host.calibration.drift.trend import Trends
from phone_host.calibration.drift.watch import FEWEST_CELLS, FEWEST_FEATURES, DriftWatch
from phone_host.model import Drift, Processed
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import Examined

_LEAST_PAIRS: Final = 7
"""From the first to the last of a line."""


class StillsWatch:
    """Watches over the rig of some pairs, in their order."""

    def __init__(self) -> None:
        self._watch: DriftWatch | None = None
        self._trends = Trends(least=_LEAST_PAIRS)
        self._number = 0

    def add(self, core: StereoCore, processed: Processed, look: Examined) -> None:
        """Take the next pair into account. Images that came rectified have no rig.

        Args:
            core: that has processed it.
            processed: the pair.
            look: what was seen in it.
        """
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
