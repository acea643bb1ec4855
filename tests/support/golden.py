"""Golden transcripts (tests/golden): reads them, and replays them with one of today's roles in place of the recorded one.

The other role stays as recorded: its messages come at the recorded times, whatever today's role says.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from common.protocol.board_session import BoardSession
from common.protocol.host_session import HostSession
from common.protocol.message import BoardCounts, DropReason, Message
from common.protocol.session import Outgoing, Output
from common.protocol.wire import decode, encode_stamped
from tests.golden.record import CAMERA, LOWERED, frame_at, sessions
from tests.support.sent_frames import frame_outgoing

FOLDER = Path(__file__).resolve().parents[1] / "golden"
RECORDED = ("v0_1",)
"""Folders of transcripts, one for each recorded version."""

SCENES = ("goodbye_of_the_host", "goodbye_of_the_board", "the_board_dials", "a_break", "busy", "two_links")
_NEVER = 2**62


def read(version: str, name: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Read a transcript: its description of itself, and its steps."""
    lines = (FOLDER / version / f"{name}.jsonl").read_text(encoding="utf-8").splitlines()
    head, *steps = map(json.loads, lines)
    return head, steps


@dataclass(frozen=True, slots=True)
class Words:
    """A message as it travels: when it was sent (its sender's clock, ns), and where."""

    ns: int
    connection: bytes
    header: bytes
    payload: bytes

    @property
    def message(self) -> Message:
        """The message as today's decoder reads it."""
        return decode(self.header, self.payload)


def words_of(step: dict[str, Any]) -> list[Words]:
    """What was said in one step."""
    return [Words(step["ns"], *map(bytes.fromhex, said)) for said in step["says"]]


def all_words(steps: list[dict[str, Any]]) -> list[Words]:
    """Everything that both said; a `receive` step names an item by its index here."""
    return [words for step in steps for words in words_of(step)]


@dataclass(slots=True)
class Replay:
    """What today's role said in place of the recorded one, and what it noticed."""

    said: list[Words] = field(default_factory=list)
    noticed: list[Output] = field(default_factory=list)

    def note(self, outputs: list[Outgoing] | list[Output], ns: int) -> None:
        """Add a role's outputs."""
        for output in outputs:
            if isinstance(output, Outgoing):
                header, payload = encode_stamped(output.message, lambda: ns)
                self.said.append(Words(ns, output.connection, header, bytes(payload)))
            else:
                self.noticed.append(output)


def recorded(steps: list[dict[str, Any]], who: str) -> list[Words]:
    """What the recorded role said."""
    return [words for step in steps if step["who"] == who for words in words_of(step)]


def received(step: dict[str, Any], words: list[Words]) -> Message:
    """What was received in a step."""
    return decode(bytes.fromhex(step["bytes"])) if "bytes" in step else words[step["number"]].message


class Ticking(Protocol):
    """Something that wants to be called at certain times."""

    @property
    def due_ns(self) -> int:
        """The time of the next call, ns."""


def steps_and_ticks(
    role: Ticking, steps: list[dict[str, Any]], who: str
) -> Iterator[tuple[dict[str, Any], int | None]]:
    """The role's steps, and the times in between at which it wants to be called: it ticks as it likes, not as recorded.

    After its goodbye it only listens, as the programs do.
    """
    own = [step for step in steps if step["who"] == who]
    now_ns, left = own[0]["ns"], False
    for step in own:
        while not left and role.due_ns < _NEVER and max(now_ns, role.due_ns) <= step["ns"]:
            now_ns = max(now_ns, role.due_ns)
            yield step, now_ns
        now_ns, left = step["ns"], left or step["do"] == "leave"
        if step["do"] != "tick":
            yield step, None


def replay_board(head: dict[str, Any], steps: list[dict[str, Any]]) -> Replay:
    """Let today's board take the place of the recorded one."""
    board, _ = sessions(head["links"], board_dials=head["board_dials"])
    words, replay = all_words(steps), Replay()
    counts = BoardCounts()
    for step, due_ns in steps_and_ticks(board, steps, "board"):
        if "counts" in step:
            grabbed, sent, replaced = step["counts"]
            counts = BoardCounts(grabbed, sent, ((DropReason.REPLACED, replaced),) if replaced else ())
        if due_ns is None:
            replay.note(_board_step(board, step, words, counts), step["ns"])
        else:
            replay.note(board.tick(due_ns, counts), due_ns)
    return replay


def _board_step(board: BoardSession, step: dict[str, Any], words: list[Words], counts: BoardCounts) -> list[Outgoing]:
    ns: int = step["ns"]
    match step["do"]:
        case "receive":
            return board.receive(bytes.fromhex(step["connection"]), received(step, words), ns, counts)
        case "send":
            sent = frame_outgoing(board, frame_at(ns, step["sequence"]))
            board.sent(ns)
            return [sent]
        case "unreachable":
            return board.unreachable(bytes.fromhex(step["connection"]))
        case "describe":
            board.describe(CAMERA, LOWERED)
            return []
        case "end":
            return board.end(counts)
        case "leave":
            return board.leave(counts)
        case other:
            raise AssertionError(other)


def replay_host(head: dict[str, Any], steps: list[dict[str, Any]]) -> Replay:
    """Let today's host take the place of the recorded one."""
    _, host = sessions(head["links"], board_dials=head["board_dials"])
    words, replay = all_words(steps), Replay()
    for step, due_ns in steps_and_ticks(host, steps, "host"):
        if due_ns is None:
            replay.note(_host_step(host, step, words), step["ns"])
        else:
            replay.note(host.tick(due_ns), due_ns)
    return replay


def _host_step(host: HostSession, step: dict[str, Any], words: list[Words]) -> list[Output]:
    ns: int = step["ns"]
    match step["do"]:
        case "receive":
            return host.receive(bytes.fromhex(step["connection"]), received(step, words), ns)
        case "interrupted":
            return host.interrupted(bytes.fromhex(step["connection"]), ns)
        case "grant":
            return host.grant(step["slots"])
        case "steer":
            return host.steer(step["later_ns"])
        case "carry":
            return host.carry(step["link"], ns)
        case "leave":
            return host.leave()
        case other:
            raise AssertionError(other)
