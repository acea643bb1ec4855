"""Writes every pair's life as a trace for Perfetto or chrome://tracing. Pure: ledgers in, text out.

The format is Google's "Trace Event Format", JSON object form: complete events (`X`) for the delays, metadata (`M`) for
names, a flow (`s` to `f`, bound to the enclosing slice, `bp: e`) from the board's `sent` to the host's `received`.
Times are µs with three decimals, counted from the first exposure. Slices of one thread must not partly overlap: where
pairs overlap in a delay, further threads of that name hold them.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import accumulate, pairwise
from typing import Final

from common.ledger import PairLedger, StageTimes

_LANES: Final = 100
"""Thread ids of a kind of slice begin at (its number + 1) times this."""


@dataclass(frozen=True, slots=True)
class TracedRun:
    """A run to show."""

    name: str
    ledgers: tuple[PairLedger, ...]


@dataclass(frozen=True, slots=True)
class _Kind:
    """One of the delays, and whether it is shown on the board or on the host."""

    name: str
    on_board: bool


_KINDS: Final = (
    _Kind("capture", on_board=True),
    _Kind("outbox", on_board=True),
    _Kind("propagation", on_board=True),
    _Kind("pairing", on_board=False),
    _Kind("queuing", on_board=False),
    _Kind("processing", on_board=False),
)


def trace_json(runs: Sequence[TracedRun]) -> str:
    """Make the whole file.

    Returns:
        A JSON object with `traceEvents`: metadata first, then events by time.
    """
    exposed = [ledger.board.exposed_ns for run in runs for ledger in run.ledgers]
    zero_ns = min(exposed, default=0)
    names: list[dict[str, object]] = []
    events: list[dict[str, object]] = []
    flow = 0
    for number, run in enumerate(runs):
        board, host = 2 * number + 1, 2 * number + 2
        for pid, side in ((board, "board"), (host, "host")):
            names.append(_named("process_name", pid, 0, name=f"{run.name}: {side}"))
            names.append(_named("process_sort_index", pid, 0, sort_index=pid))
        lanes = _Lanes()
        for ledger in run.ledgers:
            flow += 1
            events += _pair(ledger, zero_ns, (host, board), lanes, flow)
        for kind_index, count in enumerate(lanes.counts):
            kind = _KINDS[kind_index]
            pid = board if kind.on_board else host
            for lane in range(count):
                tid = _tid(kind_index, lane)
                names.append(_named("thread_name", pid, tid, name=kind.name if not lane else f"{kind.name} {lane + 1}"))
                names.append(_named("thread_sort_index", pid, tid, sort_index=tid))
    events.sort(key=lambda event: float(str(event["ts"])))  # stable: a slice stays before what it encloses
    return json.dumps({"traceEvents": names + events, "displayTimeUnit": "ms"}, separators=(",", ":")) + "\n"


class _Lanes:
    """Threads for slices that may overlap: each slice goes to the first thread whose last slice has ended."""

    def __init__(self) -> None:
        self._ends_ns: list[list[int]] = [[] for _ in _KINDS]

    @property
    def counts(self) -> list[int]:
        """The number of threads in use for each kind."""
        return [len(ends) for ends in self._ends_ns]

    def place(self, kind: int, start_ns: int, end_ns: int) -> int:
        """Choose the thread for a slice; return its id."""
        ends = self._ends_ns[kind]
        lane = next((lane for lane, end in enumerate(ends) if end <= start_ns), len(ends))
        if lane == len(ends):
            ends.append(end_ns)
        ends[lane] = end_ns
        return _tid(kind, lane)


def _tid(kind: int, lane: int) -> int:
    return (kind + 1) * _LANES + lane


def _pair(
    ledger: PairLedger, zero_ns: int, pids: tuple[int, int], lanes: _Lanes, flow: int
) -> Iterator[dict[str, object]]:
    """Make all events of one pair; `pids` are those of host and board."""
    board = ledger.board
    marks = (
        board.exposed_ns,
        board.grabbed_ns,
        board.sent_ns,
        ledger.received_ns,
        ledger.queued_ns,
        ledger.dequeued_ns,
        ledger.done_ns,
    )
    about = {
        "sequence": ledger.sequence,
        "host_sequence": ledger.host_sequence,
        "bytes": ledger.bytes,
        "time_skew_us": ledger.time_skew_ns / 1e3,
        "clock_uncertainty_us": ledger.uncertainty_ns / 1e3,
    }
    # Propagation includes the clock estimate's error, which may exceed a delay of some µs. So correct marks to keep
    # received after sent.
    for index, (kind, (start_ns, end_ns)) in enumerate(zip(_KINDS, pairwise(accumulate(marks, max)), strict=True)):
        place = {"pid": pids[kind.on_board], "tid": lanes.place(index, start_ns, end_ns)}
        yield _slice(kind.name, start_ns=start_ns - zero_ns, length_ns=end_ns - start_ns, place=place, about=about)
        if kind.name == "propagation":
            yield _flow("s", flow, start_ns - zero_ns, place)
        if kind.name == "pairing":
            yield _flow("f", flow, start_ns - zero_ns, place)
    at_ns = ledger.dequeued_ns
    for stage in fields(StageTimes):
        length_ns = getattr(ledger.stages, stage.name)
        # The last stage, write, ends together with processing; hardly any time passes between the others.
        begin_ns = ledger.done_ns - length_ns if stage.name == "write" else at_ns
        place = {"pid": pids[0], "tid": _tid(len(_KINDS) - 1, 0)}
        yield _slice(
            stage.name,
            start_ns=begin_ns - zero_ns,
            length_ns=length_ns,
            place=place,
            about={"sequence": ledger.sequence},
        )
        at_ns += length_ns


def _slice(
    name: str, *, start_ns: int, length_ns: int, place: Mapping[str, int], about: Mapping[str, object]
) -> dict[str, object]:
    times = {"ts": start_ns / 1e3, "dur": length_ns / 1e3}
    return {"name": name, "cat": "delay", "ph": "X", **times, **place, "args": about}


def _flow(phase: str, number: int, at_ns: int, place: Mapping[str, int]) -> dict[str, object]:
    event: dict[str, object] = {"name": "frame", "cat": "link", "ph": phase, "id": number, "ts": at_ns / 1e3, **place}
    return event | {"bp": "e"} if phase == "f" else event


def _named(what: str, pid: int, tid: int, **about: str | int) -> dict[str, object]:
    return {"name": what, "ph": "M", "ts": 0, "pid": pid, "tid": tid, "args": about}
