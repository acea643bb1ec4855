"""A core and the watch over its rig, as a run has them, for bench_drift; and what is noted of a film."""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from phone_host.calibration.drift.fit import PARAMETERS, RowModel, Sighting, fit_rows, values_of
from phone_host.calibration.drift.see import Timed, sighting_of
from phone_host.calibration.drift.watch import WINDOW, DriftWatch
from phone_host.model import Change, Departure, Drift
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import look_at, maps_of
from tests.bench.depth_scenes import Image


@dataclass(frozen=True, slots=True)
class Row:
    """One film or sequence.

    Attributes:
        name: of the film.
        told_s: from the change until it was told, s; NaN: not told, or nothing to tell.
        left_px: true vertical error that is left at the end, 95th percentile over the image.
        worst_px: of the estimate that was used, at any moment after it was told.
        settled_px: the same, at any moment from 2 s after a step until the next.
        alarms: what was told: changes and concerns.
        features: the last estimate rests on.
        cpu_ms: CPU time of a sighting and its estimate, median.
    """

    name: str
    told_s: float
    left_px: float
    worst_px: float
    settled_px: float
    alarms: tuple[str, ...]
    features: int
    cpu_ms: float


class Watched:
    """A core and the watch over its rig, as a run has them.

    Args:
        core: of the rig.
    """

    def __init__(self, core: StereoCore) -> None:
        self.core, self.watch = core, DriftWatch()
        self.model: RowModel | None = None
        self.seen: list[Sighting] = []
        self.cpu_ms: list[float] = []

    def look(self, t_s: float, left: Image, right: Image, before: Image | None, seconds: float) -> Drift:
        """Judge a pair.

        Args:
            t_s: when.
            left: as the camera sent it.
            right: the same.
            before: what the left camera sent before; None: nothing.
            seconds: how much earlier, s.
        """
        processed = self.core.compute(left, right, time.monotonic_ns)
        look = look_at(processed, maps_of(self.core, processed))
        earlier = None
        if before is not None:
            rectifier = self.core.rectifier_for((processed.pair.left.shape[1], processed.pair.left.shape[0]))
            assert rectifier is not None
            earlier = rectifier.rectify(before, right).left
        began = time.process_time()
        found = sighting_of(self.core, processed, look, Timed(0.0, earlier, seconds))
        assert found is not None
        self.watch.add(*found, t_s)
        self.cpu_ms.append((time.process_time() - began) * 1e3)
        self.model, self.seen = found[0], [*self.seen, found[1]][-WINDOW:]
        drift = self.watch.drift
        if drift.overlay != processed.overlay:
            self.core.correct(drift.overlay)
        return drift

    def left_px(self, true: Departure) -> float:
        """Return the vertical error that the correction in use leaves, 95th percentile over the image, px."""
        assert self.model is not None
        off = values_of(true) - values_of(self.watch.overlay)
        return float(np.percentile(np.abs(self.model.everywhere() @ off), 95))

    def raw_rows_px(self) -> tuple[np.ndarray[tuple[int], np.dtype[np.float64]], float]:
        """Return the rows that the latest sightings say, all over the image, proven or not, and how well they are known, px."""
        assert self.model is not None
        fit, everywhere = fit_rows(self.model, self.seen), self.model.everywhere()
        return np.asarray(everywhere @ fit.values[:PARAMETERS], np.float64), fit.rows_sigma_px(everywhere)


def told(changes: Iterable[Change]) -> Iterator[str]:
    """Return what a run says of changes, a word and the moment each."""
    return (f"{change.kind.value} {change.at_s:.1f} s" for change in changes)
