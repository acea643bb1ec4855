"""The marks of a pair and the delays between them: integer nanoseconds that add up exactly.

Board marks are taken on the board's clock. Only `sent` is mapped to the host's clock, once, on receipt. The other board marks follow by their
differences on the board's own clock. So the delays add up to end-to-end to the nanosecond, however good the clock estimate was.
"""

import json
from dataclasses import asdict, dataclass
from typing import Any

from common.strict_json import strict_json, whole_number
from common.value import value


@dataclass(frozen=True, slots=True, kw_only=True)
class StageTimes:
    """How long each stage of processing took, ns, in the order in which they run. Their sum is at most the processing delay."""

    decode: int = 0
    interpolate: int = 0
    rectify: int = 0
    match: int = 0
    reproject: int = 0
    write: int = 0


@value(kw_only=True)
class BoardMarks:
    """A frame's marks on one clock (ns): exposure mid-point, dequeue from the driver, and the moment before its first byte was written."""

    exposed_ns: int
    grabbed_ns: int
    sent_ns: int

    def moved_to(self, sent_ns: int) -> "BoardMarks":
        """Move the marks to another clock on which `sent` is known; their differences stay the same."""
        shift = sent_ns - self.sent_ns
        return BoardMarks(exposed_ns=self.exposed_ns + shift, grabbed_ns=self.grabbed_ns + shift, sent_ns=sent_ns)


@value(kw_only=True)
class HostMarks:
    """The marks of the host's own frame, on its own clock: exposure mid-point and dequeue from the driver (ns)."""

    exposed_ns: int
    grabbed_ns: int


@value(kw_only=True)
class PairLedger:
    """Everything measured about one pair. All marks in ns on the host's clock; the delays are defined in DESIGN, section 4.

    Attributes:
        session: the session of the board process that sent the frame.
        sequence: the board frame's number.
        host_sequence: the host frame's number.
        bytes: size of the board frame's payload.
        link: the link's kind, for example `tcp`.
        board: exposed, grabbed and sent of the board's frame.
        received_ns: last byte arrived.
        paired_ns: the partner was found.
        queued_ns: the pair entered the FIFO.
        dequeued_ns: processing began.
        done_ns: the result was handed to the sinks.
        previous_done_ns: when the pair before this one was done; the first pair carries its own `queued_ns`.
        stages: shares of the processing delay.
        time_skew_ns: exposure of the board's frame minus that of the host's.
        offset_ns: host clock minus board clock as estimated for this frame.
        uncertainty_ns: uncertainty of that offset, with that of the host frame's stamp where it came from another clock.
        host: the marks of the host's own frame.
    """

    session: str
    sequence: int
    host_sequence: int
    bytes: int
    link: str
    board: BoardMarks
    received_ns: int
    paired_ns: int
    queued_ns: int
    dequeued_ns: int
    done_ns: int
    previous_done_ns: int
    stages: StageTimes
    time_skew_ns: int
    offset_ns: int
    uncertainty_ns: int
    host: HostMarks

    @property
    def capture_ns(self) -> int:
        """From exposure mid-point to dequeue."""
        return self.board.grabbed_ns - self.board.exposed_ns

    @property
    def outbox_ns(self) -> int:
        """Time spent waiting for the link."""
        return self.board.sent_ns - self.board.grabbed_ns

    @property
    def propagation_ns(self) -> int:
        """From the first byte written to the last byte received. Includes the error of the clock estimate."""
        return self.received_ns - self.board.sent_ns

    @property
    def pairing_ns(self) -> int:
        """Time spent waiting for the partner."""
        return self.queued_ns - self.received_ns

    @property
    def queuing_ns(self) -> int:
        """Time spent in the FIFO's backlog."""
        return self.dequeued_ns - self.queued_ns

    @property
    def processing_ns(self) -> int:
        """From dequeue to the hand-over of the result."""
        return self.done_ns - self.dequeued_ns

    @property
    def end_to_end_ns(self) -> int:
        """From exposure mid-point to the hand-over: the sum of the six delays above."""
        return self.done_ns - self.board.exposed_ns

    @property
    def starvation_ns(self) -> int:
        """How long the processor had nothing to do before this pair was queued."""
        return max(0, self.queued_ns - self.previous_done_ns)

    def to_json(self) -> str:
        """One line of delays.jsonl: the keys of DESIGN, section 4, followed by the marks of the host's own frame."""
        record = {
            "session": self.session,
            "sequence": self.sequence,
            "host_sequence": self.host_sequence,
            "bytes": self.bytes,
            "link": self.link,
            "exposed_ns": self.board.exposed_ns,
            "grabbed_ns": self.board.grabbed_ns,
            "sent_ns": self.board.sent_ns,
        }
        marks = ("received_ns", "paired_ns", "queued_ns", "dequeued_ns", "done_ns")
        delays = (
            "capture_ns",
            "outbox_ns",
            "propagation_ns",
            "pairing_ns",
            "queuing_ns",
            "processing_ns",
            "end_to_end_ns",
            "starvation_ns",
        )
        record |= {name: getattr(self, name) for name in marks + delays}
        record["stages_ns"] = asdict(self.stages)
        record |= {name: getattr(self, name) for name in ("time_skew_ns", "offset_ns", "uncertainty_ns")}
        record |= {"host_exposed_ns": self.host.exposed_ns, "host_grabbed_ns": self.host.grabbed_ns}
        return json.dumps(record, separators=(",", ":"))


def ledger_of(text: str) -> PairLedger:
    """Read a line of delays.jsonl.

    Raises:
        ValueError: it is none.
    """
    try:
        record = strict_json(text)
        texts: dict[str, Any] = {name: str(record[name]) for name in ("session", "link")}
        numbers: dict[str, Any] = {
            name: whole_number(each) for name, each in record.items() if name not in {*texts, "stages_ns"}
        }
        return PairLedger(
            **texts,
            **{name: numbers[name] for name in PairLedger.__dataclass_fields__ if name in numbers},
            board=BoardMarks(**{name: numbers[name] for name in ("exposed_ns", "grabbed_ns", "sent_ns")}),
            previous_done_ns=numbers["queued_ns"] - numbers["starvation_ns"],
            stages=StageTimes(**{name: whole_number(each) for name, each in record["stages_ns"].items()}),
            host=HostMarks(exposed_ns=numbers["host_exposed_ns"], grabbed_ns=numbers["host_grabbed_ns"]),
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"no line of delays.jsonl: {error}") from error
