"""A sink that judges a run's images, twice a second or stills one by one: are cameras swapped, turned, covered, and how does depth fare? What they make doubtful is logged."""

import logging
import math
import threading
from collections.abc import Callable, Iterable
from typing import Final

from common import now
from common.diagnostic import Diagnostic
from common.program.logs import event
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.image_judge import ImageJudge, ImageTrust
from phone_host.diagnostics.image_rules import image_doubts
from phone_host.model import DepthLimits, Result, StereoGeometry
from phone_host.run.drift_keeper import DriftKeeper, Moment
from phone_host.run.sinks import OneQueueSink, SinkQueue
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import has_depth, look_at, maps_of

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
