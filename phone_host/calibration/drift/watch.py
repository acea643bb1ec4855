"""Watches over a rig while it runs: how far it has turned, whether at once or little by little, and what corrects it. Pure.

The latest few sightings together give the estimate. One that does not fit them is set aside. If the next one agrees with
it, the rig was knocked: the estimate starts afresh from those two, and is unknown until it rests on enough. Whatever the estimate says, it counts only if it rests
on enough features that are well spread, and only what they prove is corrected.
"""

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.calibration.drift.fit import (
    PARAMETERS,
    Fit,
    RowModel,
    Sighting,
    Vector,
    departure_of,
    fit_rows,
    is_better,
    proven,
    values_of,
)
from phone_host.model import AS_CALIBRATED, Change, ChangeKind, Departure, Drift, DriftState, Trend, Turn

_LEAST_S: Final = 20.0
_FEWEST: Final = 8
"""A shorter line follows the noise."""

_MOST: Final = 256
"""Estimates that are kept; when there are more, every second one is forgotten and half as many are kept from then on."""

WINDOW: Final = 6
"""Sightings in the estimate: three seconds at two a second. What more would gain, the lens model's own error hides."""

FEWEST_FEATURES: Final = 60
FEWEST_CELLS: Final = 8
_LEAST_SHARE: Final = 0.6
_MOST_SIGMA_PX: Final = 0.15
"""An estimate rests on so many features, in so many of the 24 cells; they agree with each other; and they tell the rows of the
whole image so well."""

_FAIR_FEATURES: Final = 15
_FAIR_CELLS: Final = 5
"""The same of one sighting."""

_SIGMAS: Final = 4.0
"""What proves a turn or a scale. Given rigs depart from themselves, by scenes that fill other parts of the image, by 3.5 at most."""

START_PX: Final = 0.25
"""From this vertical error on (95th percentile over the image) a correction begins: what a calibration may leave and be good."""

_END_PX: Final = 0.15
_FOLLOW_PX: Final = 0.1
_FOLLOW_CHI2: Final = 25.0
"""A correction follows the estimate, or ends, in steps of at least this size, if that is proven: 4 sigmas in four dimensions."""

_START_SIGMAS: Final = 5.0
"""What proves that a correction is needed at all: more than what names its parts, or it would come and go."""

_AT_FIRST: Final = 3
"""Sightings before anything is said: one that is wrong must not be half of them."""

_STEP_PX: Final = 0.4
_STEP_CHI2: Final = 35.0
_STEP_SHARE: Final = 0.1
"""A sighting that departs from the estimate by so much is set aside: 5 sigmas in four dimensions, and more than a bar that trembles by 0.01 degrees. Of a rig that stands far away, the
linear model itself knows the rows to a tenth."""

_SMALL_STEP_PX: Final = 0.2
_SMALL_STEP_CHI2: Final = 18.5
_NEWEST: Final = 3
"""A smaller step shows when the newest sightings of the window are laid against the older ones together. One in a thousand departs so far by chance; that
costs nothing, for the newest alone must then prove what is corrected."""

MOST_TURN_RAD: Final = math.radians(1.0)
MOST_FOCUS: Final = 0.02
"""Beyond this the linear model, the filled window and the belief that only the right camera turned no longer hold."""

_MOST_CHANGES: Final = 40
_P95: Final = 95


class Trends:
    """The estimates since the last change at once.

    Args:
        every: of so many estimates one is kept: those that share sightings would agree better than they know.
        least: of time, s, or of whatever else counts; a shorter line follows the noise.
    """

    def __init__(self, every: int = 1, least: float = _LEAST_S) -> None:
        self._every, self._least, self._count = every, least, 0
        self._kept: list[tuple[float, Vector]] = []
        self._every_s = 0.0

    def restart(self) -> None:
        """Forget them."""
        self._kept.clear()
        self._count, self._every_s = 0, 0.0

    def add(self, at_s: float, values: Vector, rows_px: float) -> None:
        """Add an estimate at some time, s: its parameters (4,), and the vertical error that it makes, px."""
        self._count += 1
        if self._count % self._every or (self._kept and at_s - self._kept[-1][0] < self._every_s):
            return
        self._kept.append((at_s, np.array([*values[:3], rows_px])))
        if len(self._kept) > _MOST:
            self._kept = self._kept[::2]
            self._every_s = (self._kept[-1][0] - self._kept[0][0]) / len(self._kept)

    @property
    def trend(self) -> Trend:
        """The line; NaN where there are too few estimates, or over too short a time."""
        times = np.array([at_s for at_s, _ in self._kept])
        seconds = float(times[-1] - times[0]) if len(times) else 0.0
        if len(times) < _FEWEST or seconds < self._least:
            return Trend(seconds=seconds)
        values = np.array([each for _, each in self._kept])
        from_middle = times - times.mean()
        slopes = from_middle @ values / (from_middle @ from_middle)
        rest = values - values.mean(axis=0) - np.outer(from_middle, slopes)
        sigmas = np.sqrt((rest * rest).sum(axis=0) / (len(times) - 2) / (from_middle @ from_middle))
        return Trend(turn_rad_s=_turn(slopes), sigma_rad_s=_turn(sigmas), rows_px_s=float(slopes[3]), seconds=seconds)


def _turn(values: Vector) -> Turn:
    x, y, z = values[:3].tolist()
    return x, y, z


@dataclass(frozen=True, slots=True, eq=False)
class _Estimate:
    """What the window says: its fit, and what of it is proven, (4,)."""

    fit: Fit
    values: Vector


class DriftWatch:
    """Watches over one rig. Its times are seconds since the start of the run."""

    def __init__(self, *, corrects: bool = True, start: Departure = AS_CALIBRATED) -> None:
        self._corrects = corrects
        self._overlay = start
        self._model: RowModel | None = None
        self._everywhere: Vector = np.zeros((0, PARAMETERS))
        self._window: deque[Sighting] = deque(maxlen=WINDOW)
        self._aside: deque[Sighting] = deque(maxlen=2)
        self._known: Fit | None = None
        self._estimate: _Estimate | None = None
        self._is_beyond = False
        self._judged = 0
        self._trends = Trends(WINDOW)
        self._changes: list[Change] = []
        self._news: list[Change] = []

    @property
    def overlay(self) -> Departure:
        """The departure that the next pairs shall be corrected for."""
        return self._overlay

    @property
    def is_unsure(self) -> bool:
        """Whether the last sighting departs from the estimate, and another one would tell whether the rig was knocked."""
        return bool(self._aside)

    def take_news(self) -> tuple[Change, ...]:
        """Return the changes since the last call, in order."""
        news = tuple(self._news)
        self._news.clear()
        return news

    def returned(self, at_s: float, away_s: float) -> None:
        """Start afresh: a camera or the board was away, and may have been touched."""
        self._window.clear()
        self._aside.clear()
        self._trends.restart()
        self._note(Change(kind=ChangeKind.RETURNED, at_s=at_s, departure=self._departure, away_s=away_s))

    def add(self, model: RowModel, seen: Sighting, at_s: float) -> None:
        """Take a sighting into account."""
        self._judged += 1
        if self._model is None or self._model.rectification is not model.rectification:
            self._begin(model)
        single = fit_rows(model, [seen])
        if single.features < _FAIR_FEATURES or single.cells < _FAIR_CELLS or single.share < _LEAST_SHARE:
            return
        if self._known is None or not self._departs(single, self._known):
            self._aside.clear()
            self._window.append(seen)
            self._forget_before_a_small_step(model)
        elif not self._is_confirmed(model, seen):
            return
        else:
            self._step(model, at_s)
        fit = fit_rows(model, tuple(self._window))
        if len(self._window) < (_AT_FIRST if self._known is None else 2) or not self._is_sound(fit):
            return
        self._known = fit
        self._estimate = _Estimate(fit, self._proven(fit))
        self._trends.add(at_s, fit.values[:PARAMETERS], self._rows_px(fit.values[:PARAMETERS]))
        self._follow(self._estimate, at_s)

    @property
    def drift(self) -> Drift:
        """What is known so far."""
        found = Drift(state=self._state, overlay=self._overlay, judged=self._judged, changes=tuple(self._changes))
        if self._estimate is None or self._model is None:
            return found
        fit, values = self._estimate.fit, self._estimate.values
        x, y, z, focal, late_s = np.sqrt(np.diag(fit.covariance)).tolist()
        along = y if self._model.axis == 1 else x
        return replace(
            found,
            departure=departure_of(values),
            turn_sigma_rad=(x, y, z),
            focal_sigma=focal,
            rows_px=self._rows_px(values),
            rows_sigma_px=fit.rows_sigma_px(self._everywhere),
            left_px=self._rows_px(values - values_of(self._overlay)),
            zero_sigma_px=self._model.rectification.geometry.focal_px * along,
            features=fit.features,
            measurements=len(self._window),
            late_ns=float(fit.values[PARAMETERS]) * 1e9,
            late_sigma_ns=late_s * 1e9,
            late_px=abs(float(fit.values[PARAMETERS])) * fit.speed_px_s,
            trend=self._trends.trend,
        )

    @property
    def _state(self) -> DriftState:
        if self._estimate is None:
            return DriftState.UNKNOWN
        if self._is_beyond:
            return DriftState.BEYOND
        if self._overlay != AS_CALIBRATED:
            return DriftState.CORRECTED
        return DriftState.DEPARTED if self._rows_px(self._estimate.values) >= START_PX else DriftState.STEADY

    @property
    def _departure(self) -> Departure:
        return AS_CALIBRATED if self._estimate is None else departure_of(self._estimate.values)

    def _begin(self, model: RowModel) -> None:
        """Another size of images has another scale of its rows; what was known of the rig stays."""
        self._model, self._everywhere = model, model.everywhere()
        self._window.clear()
        self._aside.clear()

    def _rows_px(self, values: Vector) -> float:
        return float(np.percentile(np.abs(self._everywhere @ values), _P95))

    def _proven(self, fit: Fit) -> Vector:
        """Return what the window proves, and proves twice: by its uncertainty, and by what it does for sightings that it was not read from."""
        assert self._model is not None
        values = proven(fit, _SIGMAS)
        is_real = not values.any() or is_better(self._model, tuple(self._window), _SIGMAS)
        return values if is_real else np.zeros(PARAMETERS)

    def _forget_before_a_small_step(self, model: RowModel) -> None:
        """Drop what the window saw before a step that is too small for one sighting to prove: the estimate would lag behind by the window's length."""
        seen = tuple(self._window)
        older, newest = seen[:-_NEWEST], seen[-_NEWEST:]
        if len(older) < _NEWEST - 1:
            return
        if self._departs(fit_rows(model, newest), fit_rows(model, older), _SMALL_STEP_PX, _SMALL_STEP_CHI2):
            self._window = deque(newest, maxlen=WINDOW)

    def _departs(self, one: Fit, other: Fit, least_px: float = _STEP_PX, least_chi2: float = _STEP_CHI2) -> bool:
        off = (one.values - other.values)[:PARAMETERS]
        both = (one.covariance + other.covariance)[:PARAMETERS, :PARAMETERS]
        least_px = max(least_px, _STEP_SHARE * self._rows_px(other.values[:PARAMETERS]))
        return bool(off @ np.linalg.solve(both, off) > least_chi2) and self._rows_px(off) > least_px

    def _is_sound(self, fit: Fit) -> bool:
        return (
            fit.features >= FEWEST_FEATURES
            and fit.cells >= FEWEST_CELLS
            and fit.share >= _LEAST_SHARE
            and fit.rows_sigma_px(self._everywhere) <= _MOST_SIGMA_PX
        )

    def _is_confirmed(self, model: RowModel, seen: Sighting) -> bool:
        """Set a sighting aside; tell whether it and the last one that was set aside agree."""
        self._aside.append(seen)
        if len(self._aside) < 2:
            return False
        one, other = (fit_rows(model, [each]) for each in self._aside)
        return not self._departs(one, other)

    def _step(self, model: RowModel, at_s: float) -> None:
        """The rig was knocked: begin with what was set aside."""
        assert self._known is not None
        self._window = deque(self._aside, maxlen=WINDOW)
        self._aside.clear()
        self._trends.restart()
        now = fit_rows(model, tuple(self._window))
        off = (now.values - self._known.values)[:PARAMETERS]
        departure = departure_of(self._proven(now))
        self._note(Change(kind=ChangeKind.KNOCKED, at_s=at_s, departure=departure, step=departure_of(off)))
        # The next sightings belong here even where these two are not enough for an estimate: what was known before is over.
        self._known, self._estimate = now, None

    def _follow(self, found: _Estimate, at_s: float) -> None:
        """Let the correction follow the estimate, within bounds, and note what changes."""
        values, departure = found.values, departure_of(found.values)
        is_beyond = departure.angle_rad > MOST_TURN_RAD or abs(departure.focal - 1) > MOST_FOCUS
        if is_beyond and not self._is_beyond:
            self._note(Change(kind=ChangeKind.BEYOND, at_s=at_s, departure=departure))
        self._is_beyond = is_beyond
        if is_beyond or not self._corrects:
            return
        if self._overlay == AS_CALIBRATED:
            is_needed = self._rows_px(values) >= START_PX and proven(found.fit, _START_SIGMAS).any()
            wanted = departure if is_needed else AS_CALIBRATED
        elif self._is_off(found):
            wanted = AS_CALIBRATED if self._rows_px(values) < _END_PX else departure
        else:
            wanted = self._overlay
        if wanted != self._overlay:
            self._overlay = wanted
            self._note(Change(kind=ChangeKind.CORRECTED, at_s=at_s, departure=wanted))

    def _is_off(self, found: _Estimate) -> bool:
        """Tell whether the estimate has left the correction by more than noise."""
        off = found.fit.values[:PARAMETERS] - values_of(self._overlay)
        information = np.linalg.inv(found.fit.covariance[:PARAMETERS, :PARAMETERS])
        return self._rows_px(found.values - values_of(self._overlay)) >= _FOLLOW_PX and bool(
            off @ information @ off > _FOLLOW_CHI2
        )

    def _note(self, change: Change) -> None:
        if len(self._changes) >= _MOST_CHANGES:
            del self._changes[_MOST_CHANGES // 2]
        self._changes.append(change)
        self._news.append(change)
