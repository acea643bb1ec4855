"""Holds the time budget of a run: chooses how each pair is matched, follows the machine, and keeps the account.

The worker's thread calls it; any thread may read the account.
"""

import logging
import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from common import now
from common.errors import TandemError
from common.program.logs import event
from phone_host.model import BudgetAccount, BudgetChange, BudgetReason, BudgetStep, StereoGeometry
from phone_host.stereo.budget import BudgetController, BudgetWanted, Choice, Step, ladder
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import BEST_FIRST, AnyMatcher
from phone_host.stereo.reproject import nearest_depth_m

_LOG = logging.getLogger(__name__)

_MOST_CHANGES: Final = 100
"""The newest changes that the account lists: a day of throttling must not fill the memory."""

_TRIED_DISPARITIES: Final = 16

_Sizes = tuple[tuple[int, int], tuple[int, int]]


def usable_matchers() -> tuple[AnyMatcher, ...]:
    """Return our matchers that work on this machine, best first."""
    return tuple(name for name in BEST_FIRST if _works(name))


def _works(name: AnyMatcher) -> bool:
    try:
        create_matcher(MatchSettings(name, _TRIED_DISPARITIES))
    except TandemError:
        return False
    return True


@dataclass(frozen=True, slots=True)
class _Held:
    """What belongs to one pair of image sizes."""

    sizes: _Sizes
    controller: BudgetController
    best: Step
    geometry: StereoGeometry | None


class PairBudget:
    """The time budget of a run.

    Args:
        wanted: the budget, and what may change to hold it.
        core: matches the pairs; built from settings.
    """

    def __init__(self, wanted: BudgetWanted, core: StereoCore) -> None:
        self._wanted, self._core = wanted, core
        self._held: _Held | None = None
        self._first_ns = 0
        self._pairs = self._within = self._narrowed = self._changed = 0
        self._changes: deque[BudgetChange] = deque(maxlen=_MOST_CHANGES)
        self.account: BudgetAccount | None = None
        """The account so far; None before the first pair."""

    def choice(self, left_px: tuple[int, int], right_px: tuple[int, int]) -> Choice:
        """Return how the next pair is to be matched.

        Args:
            left_px: width and height of the left image, px.
            right_px: width and height of the right image, px.

        Raises:
            DataError: the core cannot take images of these sizes.
        """
        held = self._held
        if held is None or held.sizes != (left_px, right_px):
            before, held = held, self._made((left_px, right_px))
            self._held = held
            if before is not None:
                self._note_change(held, BudgetReason.OTHER_SIZE, now.monotonic_ns())
            _LOG.info(_told("budget_chosen", held.controller.step))
        return held.controller.step.choice

    def add(self, total_ns: int, match_ns: int, now_ns: int) -> None:
        """Take the times of the pair that was matched as `choice` said.

        Args:
            total_ns: from the beginning of decoding to the cloud, ns.
            match_ns: the part of it that matching took, ns.
            now_ns: monotonic, ns.
        """
        held = self._held
        assert held is not None, "a pair comes after its choice"
        controller, step = held.controller, held.controller.step
        self._first_ns = self._first_ns or now_ns
        self._pairs += 1
        self._within += total_ns <= self._wanted.budget_ns
        self._narrowed += step.choice.disparities < held.best.choice.disparities
        reason = controller.add(total_ns, match_ns, now_ns)
        if reason is not None:
            self._note_change(held, reason, now_ns)
            _LOG.info(_told("budget_changed", controller.step, reason=reason.value))
        self.account = self._accounted(held)

    def _made(self, sizes: _Sizes) -> _Held:
        extent = self._core.extent(*sizes)
        steps = ladder(extent, self._wanted)
        controller = BudgetController(self._wanted.budget_ns, steps, now.monotonic_ns())
        return _Held(sizes, controller, steps[0], extent.geometry)

    def _note_change(self, held: _Held, reason: BudgetReason, now_ns: int) -> None:
        self._changed += 1
        self._changes.append(
            BudgetChange(
                pair=self._pairs,
                at_s=(now_ns - self._first_ns) / 1e9 if self._first_ns else 0.0,
                reason=reason,
                processing_ns=held.controller.processing_ns,
                step=_shown(held.controller.step, held.geometry),
            )
        )

    def _accounted(self, held: _Held) -> BudgetAccount:
        return BudgetAccount(
            budget_ns=self._wanted.budget_ns,
            now=_shown(held.controller.step, held.geometry),
            best=_shown(held.best, held.geometry),
            processing_ns=held.controller.processing_ns,
            match_ns=held.controller.match_ns,
            pairs=self._pairs,
            held=self._within,
            narrowed=self._narrowed,
            changed=self._changed,
            changes=tuple(self._changes),
            is_missed=held.controller.is_missed,
        )


def _shown(step: Step, geometry: StereoGeometry | None) -> BudgetStep:
    choice = step.choice
    return BudgetStep(
        matcher=choice.matcher.value,
        scale=choice.scale,
        width_px=step.width_px,
        height_px=step.height_px,
        disparities=choice.disparities,
        nearest_m=math.nan if geometry is None else nearest_depth_m(geometry, choice.disparities),
    )


def _told(name: str, step: Step, **fields: object) -> str:
    choice = step.choice
    size = f"{step.width_px}x{step.height_px}"
    return event(name, matcher=choice.matcher.value, size=size, disparities=choice.disparities, **fields)
