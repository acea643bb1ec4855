"""Models a pair's way as a chain of queues, simulated forward in time: rate, delays and losses that follow from a setting. Pure.

No distribution is assumed. Cameras are clocks, so arrivals are periodic (D), not Poisson. A frame's cost on the link
follows from its bytes. Its cost in processing is drawn from measurements (G), neighbours together, because a busy
machine is slow for a while at a time. There is one link, one worker, and a bounded queue before each: D/G/1 queues with
loss, in tandem. Their exact recursion, event by event, is Lindley's (D. V. Lindley, "The theory of queues with a single
server", Mathematical Proceedings of the Cambridge Philosophical Society 48, 1952), with the outbox's and the FIFO's
rules for which frame or pair is dropped. All times in ns; draws come from a generator that is passed in.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.bench.delay_fit import neighbours
from phone_host.sync.fifo import FifoSettings, Overflow

Values = NDArray[np.float64]

_MOST_UNDER_WAY: Final = 4
_SWIFT: Final = 4
"""The receiver's rules for credit (docs/decisions/0003): one frame under way, plus one for each period of the round
trip; four while a frame takes less than a quarter of a period."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LinkModel:
    """What the link does to a frame.

    Attributes:
        latency_ns: delay of a frame without bytes.
        ns_per_byte: time that a byte takes on the line.
        spread_ns: (N,) measured delay beyond these two, to draw from; at least one.
        self_paced: whether the board gives it a frame only when the one before has left (serial lines).
    """

    latency_ns: float
    ns_per_byte: float
    spread_ns: Values
    self_paced: bool


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Setting:
    """Everything that decides what happens to the frames.

    Attributes:
        period_ns: period of the board's camera.
        size_bytes: (N,) sizes of its frames, repeated in this order.
        capture_ns: (N,) capture delays to draw from.
        link: between board and host.
        pairing_ns: (N,) pairing delays to draw from.
        wake_ns: (N,) times that an idle worker takes until it has the pair, to draw from.
        service_ns: (N,) processing delays to draw from.
        fifo: depth and policy before the worker.
    """

    period_ns: float
    size_bytes: Values
    capture_ns: Values
    link: LinkModel
    pairing_ns: Values
    wake_ns: Values
    service_ns: Values
    fifo: FifoSettings


@dataclass(frozen=True, slots=True, eq=False)
class Served:
    """What a FIFO and its worker did.

    Attributes:
        start_ns: (N,) when each arrival was taken; NaN: it was dropped.
        done_ns: (N,) when it was done; NaN: it was dropped.
    """

    start_ns: Values
    done_ns: Values

    @property
    def dropped(self) -> int:
        """Number of arrivals that were dropped."""
        return int(np.isnan(self.start_ns).sum())


@dataclass(frozen=True, slots=True, eq=False)
class Predicted:
    """What follows from a setting; delays of the pairs that were done, (M,) each, ns.

    Attributes:
        pairs_per_s: rate of results.
        replaced_share: share of the grabbed frames that a newer one replaced in the outbox.
        dropped_share: share of the pairs that the FIFO dropped.
        capture_ns: delays as DESIGN, section 4, defines them.
        outbox_ns: waiting for the link.
        propagation_ns: on the link.
        pairing_ns: waiting for the partner.
        queuing_ns: waiting for the worker.
        starvation_ns: how long the worker had nothing to do before each.
        processing_ns: from dequeued to done.
        end_to_end_ns: the sum of all but starvation.
    """

    pairs_per_s: float
    replaced_share: float
    dropped_share: float
    capture_ns: Values
    outbox_ns: Values
    propagation_ns: Values
    pairing_ns: Values
    queuing_ns: Values
    starvation_ns: Values
    processing_ns: Values
    end_to_end_ns: Values


def serve(
    *, queued_ns: Values, service_ns: Values, depth: int, overflow: Overflow, wake_ns: Values | None = None
) -> Served:
    """Run one worker behind one bounded FIFO.

    Args:
        queued_ns: (N,) when each arrives, ascending.
        service_ns: (M,) processing time of the 1st, 2nd, ... arrival that is taken; M >= N.
        depth: how many may wait.
        overflow: what is dropped; `block`, whose source would not have sent, counts as drop-newest.
        wake_ns: (M,) time until an idle worker has the 1st, 2nd, ... arrival; None: no time.
    """
    start_ns, done_ns = np.full(queued_ns.size, np.nan), np.full(queued_ns.size, np.nan)
    waiting: deque[int] = deque()
    free_ns, taken = -np.inf, 0

    def take(index: int, at_ns: float) -> None:
        nonlocal free_ns, taken
        start_ns[index] = at_ns
        done_ns[index] = free_ns = at_ns + service_ns[taken]
        taken += 1

    for index, now_ns in enumerate(queued_ns):
        while waiting and free_ns <= now_ns:
            take(waiting.popleft(), free_ns)
        if not waiting and free_ns <= now_ns:
            take(index, now_ns if wake_ns is None else now_ns + wake_ns[taken])
            continue
        if len(waiting) == depth:
            if overflow is not Overflow.DROP_OLDEST:
                continue
            waiting.popleft()
        waiting.append(index)
    while waiting:
        take(waiting.popleft(), free_ns)
    return Served(start_ns, done_ns)


def predict(setting: Setting, frames: int, random: np.random.Generator) -> Predicted:
    """Simulate the frames' way.

    Args:
        setting: the setting.
        frames: how many the camera gives.
        random: for the draws.
    """

    def drawn(values: Values) -> Values:
        return np.take(values, neighbours(values.size, frames, random))

    exposed_ns = np.arange(frames) * setting.period_ns
    # A driver gives frames in order: none overtakes the one before.
    grabbed_ns = np.maximum.accumulate(exposed_ns + drawn(setting.capture_ns))
    sizes = np.resize(setting.size_bytes, frames)
    on_line_ns, spread_ns = setting.link.ns_per_byte * sizes, drawn(setting.link.spread_ns)
    pairing_ns, service_ns, wake_ns = drawn(setting.pairing_ns), drawn(setting.service_ns), drawn(setting.wake_ns)

    way = _Way(setting)
    sent: list[int] = []
    sent_ns, received_ns, queued_ns = (np.full(frames, np.nan) for _ in range(3))
    index = 0
    while index < frames:
        free_ns = way.may_send_ns()
        if free_ns > grabbed_ns[-1]:
            break  # later frames would have replaced it
        if grabbed_ns[index] < free_ns:  # take the newest of those that came meanwhile
            index = int(np.searchsorted(grabbed_ns, free_ns, side="right")) - 1
        sent_ns[index] = max(grabbed_ns[index], free_ns)
        received_ns[index] = way.send(sent_ns[index], on_line_ns[index], spread_ns[index])
        queued_ns[index] = max(received_ns[index] + pairing_ns[index], queued_ns[sent[-1]] if sent else 0.0)
        way.queue(queued_ns[index], service_ns[len(sent)], wake_ns[len(sent)])
        sent.append(index)
        index += 1
    chosen = np.array(sent)
    fifo = setting.fifo
    served = serve(
        queued_ns=queued_ns[chosen], service_ns=service_ns, depth=fifo.depth, overflow=fifo.overflow, wake_ns=wake_ns
    )
    # A pair taken after the last arrival escaped being pushed out only because nothing followed; in truth the stream
    # goes on.
    done = np.flatnonzero(served.start_ns <= queued_ns[chosen[-1]])
    pair = chosen[done]
    finished_ns, started_ns = served.done_ns[done], served.start_ns[done]
    before_ns = np.append(queued_ns[pair[:1]], finished_ns[:-1])
    return Predicted(
        pairs_per_s=(pair.size - 1) / (finished_ns[-1] - finished_ns[0]) * 1e9 if pair.size > 1 else float("nan"),
        replaced_share=1.0 - chosen.size / (chosen[-1] + 1.0),
        dropped_share=served.dropped / max(1, chosen.size),
        capture_ns=grabbed_ns[pair] - exposed_ns[pair],
        outbox_ns=sent_ns[pair] - grabbed_ns[pair],
        propagation_ns=received_ns[pair] - sent_ns[pair],
        pairing_ns=queued_ns[pair] - received_ns[pair],
        queuing_ns=started_ns - queued_ns[pair],
        starvation_ns=np.maximum(0.0, queued_ns[pair] - before_ns),
        processing_ns=finished_ns - started_ns,
        end_to_end_ns=finished_ns - exposed_ns[pair],
    )


class _Way:
    """The link, and the rules that make the board wait for it."""

    def __init__(self, setting: Setting) -> None:
        self._link = setting.link
        self._period_ns = setting.period_ns
        self._blocking_depth = setting.fifo.depth if setting.fifo.overflow is Overflow.BLOCK else 0
        self._received_ns: list[float] = []
        self._started_ns: list[float] = []
        self._line_free_ns = -np.inf
        self._worker_free_ns = -np.inf
        self._transit_ns = np.inf

    def may_send_ns(self) -> float:
        """Return the time from which the next frame may leave."""
        credit_ns = -np.inf
        if self._blocking_depth:
            # With `block`, credit follows the FIFO's free places: one more than was taken out of it.
            if len(self._started_ns) >= self._blocking_depth:
                credit_ns = self._started_ns[-self._blocking_depth] + self._link.latency_ns
        elif len(self._received_ns) >= (under_way := self._under_way()):
            credit_ns = self._received_ns[-under_way] + self._link.latency_ns
        return max(credit_ns, self._line_free_ns) if self._link.self_paced else credit_ns

    def send(self, sent_ns: float, on_line_ns: float, spread_ns: float) -> float:
        """Send a frame; return when it arrives."""
        self._line_free_ns = max(sent_ns, self._line_free_ns) + on_line_ns
        came_ns = max(sent_ns, self._line_free_ns + self._link.latency_ns + spread_ns)
        came_ns = max(came_ns, self._received_ns[-1]) if self._received_ns else came_ns
        self._received_ns.append(came_ns)
        self._transit_ns = came_ns - sent_ns
        return came_ns

    def queue(self, queued_ns: float, service_ns: float, wake_ns: float) -> None:
        """Queue its pair. With `block`, where nothing is dropped, this determines when it is taken."""
        idle = self._worker_free_ns <= queued_ns
        start_ns = queued_ns + wake_ns if idle else self._worker_free_ns
        self._started_ns.append(start_ns)
        self._worker_free_ns = start_ns + service_ns

    def _under_way(self) -> int:
        if self._transit_ns * _SWIFT < self._period_ns:
            return _MOST_UNDER_WAY
        periods = int(2.0 * self._link.latency_ns / self._period_ns)
        return min(_MOST_UNDER_WAY, 1 + max(periods, int(self._link.self_paced)))
