"""A sink that judges a run's images, twice a second or stills one by one: are cameras swapped, turned, covered, and how does depth fare? What they make doubtful is logged.

The same thread keeps the rig corrected by what the judged pairs show, so it delays no pair; only `DriftKeeper.note` is called by the worker's.
"""

import logging
import math
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, assert_never

from common import now
from common.diagnostic import Diagnostic
from common.program.logs import event
from phone_host.calibration.drift.see import Timed, sighting_of
from phone_host.calibration.drift.watch import DriftWatch
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.image_judge import ImageJudge, ImageTrust
from phone_host.diagnostics.image_rules import image_doubts
from phone_host.model import (
    AS_CALIBRATED,
    Change,
    ChangeKind,
    Departure,
    DepthLimits,
    Drift,
    Image,
    Result,
    Side,
    StereoGeometry,
)
from phone_host.output.overlay_yaml import overlay_text
from phone_host.run.sinks import OneQueueSink, SinkQueue
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import Examined, has_depth, look_at, maps_of

_LEAST_GAP_NS: Final = 1_000_000_000
_GAP_PERIODS: Final = 5
"""A camera was away if no pair came for a second, and for five times what was usual: a slow machine is no loose plug."""

_MOST_BEFORE_NS: Final = 250_000_000
"""Between two pairs farther apart than this, features cannot be followed."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """A result, and what came before it.

    Attributes:
        result: the pair.
        timed: when it was exposed, and what the left camera saw before.
    """

    result: Result
    timed: Timed


class DriftKeeper:
    """Watches over the rig of one run.

    Args:
        core: the run's; one without a rig is left alone.
        board_side: which view the board's camera is.
        corrects: whether the user wants corrections.
        start: the correction of an earlier run, in use from the start.
        is_timeless: whether images are shown on demand: they have no moment, and nothing moves from one to the next.
        interpolates: whether the board's images are moved to the moment of the host's.
    """

    def __init__(
        self,
        core: StereoCore,
        board_side: Side,
        *,
        corrects: bool = True,
        start: Departure = AS_CALIBRATED,
        is_timeless: bool = False,
        interpolates: bool = False,
    ) -> None:
        self._core, self._side = core, board_side
        self._is_timeless, self._interpolates = is_timeless, interpolates
        self._watch = DriftWatch(corrects=corrects, start=start)
        self._lock = threading.Lock()
        self._session = ""
        self._before: tuple[Image, int] | None = None
        self._last_ns = self._usual_ns = 0
        if start != AS_CALIBRATED:
            core.correct(start)

    @property
    def drift(self) -> Drift:
        """What is known so far, as a copy."""
        with self._lock:
            return self._watch.drift

    @property
    def overlay(self) -> str:
        """The content of overlay.yaml; empty if nothing is corrected."""
        drift, rig = self.drift, self._core.rig
        return "" if rig is None or drift.overlay == AS_CALIBRATED else overlay_text(rig, drift)

    @property
    def is_unsure(self) -> bool:
        """Whether another judged pair would tell if the rig was knocked."""
        with self._lock:
            return self._watch.is_unsure

    def note(self, result: Result, at_s: float) -> Moment:
        """Remember a result, and tell if a camera or the board was away before it. Called with every one.

        Args:
            result: the newest.
            at_s: now, s since the start of the run.
        """
        exposed_ns = self._exposed_ns(result)
        timed = self._timed(result, exposed_ns)
        self._before = result.processed.pair.left, exposed_ns
        session, done_ns = result.pair.board.message.session, result.ledger.done_ns
        gap_ns = done_ns - self._last_ns if self._last_ns else 0
        is_gap = not self._is_timeless and gap_ns > max(_LEAST_GAP_NS, _GAP_PERIODS * self._usual_ns)
        if self._session and (session != self._session or is_gap):
            with self._lock:
                self._watch.returned(at_s, gap_ns / 1e9)
                self._tell()
        elif gap_ns:
            self._usual_ns = gap_ns
        self._session, self._last_ns = session, done_ns
        return Moment(result, timed)

    def judge(self, moment: Moment, look: Examined, at_s: float) -> None:
        """Take what was seen in a pair into account, `at_s` after the start of the run, and have the next pairs corrected."""
        if moment.timed.before is None and not self._is_timeless:
            return  # without its motion, what moves would be taken for a turn
        found = sighting_of(self._core, moment.result.processed, look, moment.timed)
        if found is None:
            return
        with self._lock:
            before = self._watch.overlay
            self._watch.add(*found, at_s)
            wanted = self._watch.overlay
            self._tell()
        if wanted != before:
            self._core.correct(wanted)  # makes the maps: some 50 ms, outside the lock

    def _timed(self, result: Result, exposed_ns: int) -> Timed:
        if self._is_timeless:
            return Timed()
        skew_ns = 0 if self._interpolates else result.pair.time_skew_ns
        late_s = (skew_ns if self._side is Side.LEFT else -skew_ns) / 1e9
        if self._before is None or not 0 < exposed_ns - self._before[1] <= _MOST_BEFORE_NS:
            return Timed(late_s)
        return Timed(late_s, self._before[0], (exposed_ns - self._before[1]) / 1e9)

    def _exposed_ns(self, result: Result) -> int:
        """Return when the left image shows its scene, on the host's clock."""
        is_boards = self._side is Side.LEFT and not self._interpolates
        return result.pair.board.marks.exposed_ns if is_boards else result.ledger.host.exposed_ns

    def _tell(self) -> None:
        """Log what has changed since it last looked."""
        for change in self._watch.take_news():
            log_change(change, self._watch.drift)


def log_change(change: Change, drift: Drift) -> None:
    """Log one change."""
    values = {"at_s": f"{change.at_s:.1f}"} | _turn_values(change.departure)
    match change.kind:
        case ChangeKind.RETURNED:
            _LOG.warning(
                event("rig_returned", at_s=values["at_s"], away_s=f"{change.away_s:.1f}", drift="measured afresh")
            )
        case ChangeKind.KNOCKED if _is_focus(change):
            step_percent = f"{100 * (change.step.focal - 1):+.2f}"
            remedy = "switch autofocus off, then calibrate again"
            _LOG.warning(event("focus_jumped", step_percent=step_percent, **values, remedy=remedy))
        case ChangeKind.KNOCKED:
            step_deg = f"{math.degrees(change.step.angle_rad):.2f}"
            remedy = "tighten the bar, then calibrate again, or calibrate --pose-only"
            _LOG.warning(event("rig_knocked", step_deg=step_deg, **values, remedy=remedy))
        case ChangeKind.BEYOND:
            remedy = "fix both cameras to one stiff bar, then calibrate again"
            if _is_focus(change):
                remedy = "switch autofocus off, then calibrate again"
            _LOG.warning(event("drift_beyond_correction", **values, remedy=remedy))
        case ChangeKind.CORRECTED:
            left_px, features = f"{drift.left_px:.2f}", drift.features
            _LOG.warning(
                event("drift_corrected", **values, rows_px=f"{drift.rows_px:.2f}", left_px=left_px, features=features)
            )
        case _:
            assert_never(change.kind)


def _is_focus(change: Change) -> bool:
    """Tell whether of the two, turn and focal length, only the latter is proven to have changed."""
    return change.departure.focal != 1 and not change.departure.angle_rad


def _turn_values(departure: Departure) -> dict[str, str]:
    pitch, yaw, roll = (f"{math.degrees(angle):+.3f}" for angle in departure.turn_rad)
    return {
        "pitch_deg": pitch,
        "yaw_deg": yaw,
        "roll_deg": roll,
        "focal_percent": f"{100 * (departure.focal - 1):+.2f}",
    }


_LOG = logging.getLogger(__name__)

PERIOD_NS: Final = 500_000_000
"""A mistake must be named within 2 s. Two of three judgements name it: 1 s, and at most one period until the first."""

_LOOK_NS: Final = 1_000_000_000
"""Nobody acts on a doubt within a second, and judging a run takes time from its pairs."""

_DEPTH: Final = 2
"""A judged pair may still hold its place in the queue when the next one comes. Never more than one waits to be judged."""


class TrustSink(OneQueueSink):
    """Judges the newest pair whenever one is due; the other pairs pass. It never delays a pair.

    Args:
        core: the run's stereo core; None: only brightness is judged.
        clock: monotonic, ns.
        period_ns: least time between the pairs that are judged, ns; 0 for stills, each of which may show another scene.
        keeper: is shown what the judged pairs show; None: nobody watches over the rig.
    """

    def __init__(
        self,
        core: StereoCore | None,
        clock: Callable[[], int] = now.monotonic_ns,
        *,
        period_ns: int = PERIOD_NS,
        keeper: DriftKeeper | None = None,
    ) -> None:
        super().__init__(SinkQueue[tuple[Result, Moment | None, int]]("trust", self._take, depth=_DEPTH))
        self._core, self._clock, self._period_ns, self._keeper = core, clock, period_ns, keeper
        self._judge = ImageJudge()
        self._lock = threading.Lock()
        self._due_ns = 0
        self._started_ns = clock()
        self._is_busy = False
        self._has_depth = False
        self._limits: DepthLimits | None = None
        self._geometry: StereoGeometry | None = None

    def offer(self, result: Result) -> None:
        """See Sink."""
        processed = result.processed
        self._has_depth = self._has_depth or has_depth(processed)
        # Not the core's: images of another size than the calibration's have another geometry.
        self._limits, self._geometry = processed.limits or self._limits, processed.geometry or self._geometry
        now_ns = self._clock()
        moment = None if self._keeper is None else self._keeper.note(result, (now_ns - self._started_ns) / 1e9)
        if now_ns < self._due_ns or self._is_busy:
            return
        self._due_ns = now_ns + self._period_ns
        self._is_busy = True  # before the offer: the thread may be done with it before this one goes on
        self._queue.offer((result, moment, now_ns))  # refused only if the sink has failed or ends

    @property
    def trust(self) -> ImageTrust:
        """What the images have said so far, as a copy."""
        with self._lock:
            return ImageTrust(
                judged=self._judge.judged,
                wants_depth=self._core is not None,
                has_depth=self._has_depth,
                start=self._judge.start,
                now=self._judge.now,
                concerns=self._judge.concerns,
                newest=self._judge.newest,
                history=self._judge.history,
                geometry=self._geometry,
                disparity_error_px=math.nan if self._limits is None else self._limits.disparity_error_px,
            )

    def _take(self, judged: tuple[Result, Moment | None, int]) -> None:
        result, moment, done_ns = judged
        processed, at_s = result.processed, (done_ns - self._started_ns) / 1e9
        maps = None if self._core is None else maps_of(self._core, processed)
        look = look_at(processed, maps)
        is_swapped = any(concern.code == Code.SWAPPED for concern in image_doubts(look.evidence))
        if (
            self._keeper is not None and moment is not None and not is_swapped
        ):  # exchanged cameras look like turned ones
            self._keeper.judge(moment, look, at_s)
            if self._keeper.is_unsure:
                self._due_ns = 0  # was the rig knocked? The next pair tells
        with self._lock:
            self._judge.add(look.evidence, at_s=at_s, pair=result.number)
            self._is_busy = False


class DoubtLog:
    """Logs each reason not to trust the depth of a run when it appears and when it has gone."""

    def __init__(self) -> None:
        self._known: frozenset[str] = frozenset()
        self._due_ns = 0

    def look(self, now_ns: int, judge: Callable[[], Iterable[Diagnostic]]) -> None:
        """Log what has changed, at most once a second."""
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + _LOOK_NS
        found = {concern.code: concern for concern in judge()}
        for doubt in found.keys() - self._known:
            concern = found[doubt]
            _LOG.warning(event("depth_doubtful", doubt=doubt, problem=concern.message, remedy=concern.remedy))
        for doubt in self._known - found.keys():
            _LOG.info(event("depth_trusted", doubt=doubt))
        self._known = frozenset(found)
