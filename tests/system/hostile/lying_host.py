"""Hosts that lie to a real board, beside its own host or in its place; and strangers at a host that waits for its board to dial."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import msgpack
import zmq

from common import now
from common.camera_identity import Lock
from common.link.base import SendResult
from common.link.waiter import Waiter
from common.link.zeromq import ZeroMqDialer
from common.protocol.message import (
    BoardCounts,
    Bye,
    Credit,
    HostHello,
    Lane,
    Message,
    Ping,
    Refusal,
    RefusalReason,
    SetLocks,
    Steer,
)
from common.protocol.wire import encode
from common.versions import PROTOCOL_VERSION
from tests.support.programs import Program, board, free_port, until
from tests.system.hostile.attack import Attack, Outcome, Rounds
from tests.system.hostile.scene import Watched, board_and_host, board_arguments, scene

_FLOOD_S: Final = 1.5
_QUIET_S: Final = 0.3
_MOST: Final = 2**53
_END_NS: Final = 2**62


class LyingHost:
    """A peer at a board's address, with both lanes.

    Args:
        address: the board's.
    """

    def __init__(self, address: str) -> None:
        self._link = ZeroMqDialer(address)
        self._waiter = Waiter(self._link.pollables)
        self._host_id = now.random_id()
        self._gone = False

    def say(self, message: Message, lane: Lane = Lane.CONTROL) -> bool:
        """Send a message; return whether the link took it."""
        header, payload = encode(message)
        return self._link.send(self._link.dialled[lane], header, payload) is SendResult.SENT

    def greet(self) -> None:
        """Become the board's host: say hello on both lanes."""
        for lane in Lane:
            until(lambda lane=lane: self.say(HostHello(self._host_id, lane), lane), "the board is there")  # type: ignore[misc]  # bound now

    def read(self) -> int:
        """Read everything that has come and discard it; return how much it was."""
        self._waiter.wait(0)
        return sum(1 for _ in self._link.receive())

    def hush(self) -> None:
        """Wait until the board has answered everything: what is under way when a connection closes is lost, even a goodbye."""
        quiet_s = time.monotonic()
        while time.monotonic() - quiet_s < _QUIET_S:
            if self.read():
                quiet_s = time.monotonic()
            time.sleep(0.01)

    def flood(self, messages: Callable[[int], Sequence[tuple[Message, Lane]]], *, reads: bool) -> None:
        """Send messages for a while, as fast as the link takes them.

        Args:
            messages: to send in round k.
            reads: whether the answers are read.
        """
        until_s, number = time.monotonic() + _FLOOD_S, 0
        while time.monotonic() < until_s:
            number += 1
            for message, lane in messages(number):
                if not self.say(message, lane):
                    time.sleep(0.001)
            if reads:
                self.read()

    def close(self) -> None:
        """Disconnect; a second call does nothing."""
        if not self._gone:
            self._gone = True
            self._link.close()


@contextmanager
def lying_host(address: str) -> Iterator[LyingHost]:
    """Be connected for the length of a block."""
    liar = LyingHost(address)
    try:
        yield liar
    finally:
        liar.close()


@dataclass(frozen=True, slots=True)
class Talk:
    """What a lying host says to a board endlessly.

    Attributes:
        name: for people.
        messages: to send in round k.
        reads: whether it reads the answers.
    """

    name: str
    messages: Callable[[int], Sequence[tuple[Message, Lane]]]
    reads: bool = True


def _strange_hellos(number: int) -> Sequence[tuple[Message, Lane]]:
    return [(HostHello(f"{number:016x}", lane), lane) for lane in Lane]


def _strange_orders(number: int) -> Sequence[tuple[Message, Lane]]:
    return [(Steer(_END_NS - number), Lane.CONTROL), (SetLocks(((Lock.FOCUS, -number),)), Lane.CONTROL)]


TALKS: Final = (
    Talk("hellos with ever new ids", _strange_hellos),
    Talk("hellos, and answers are not read", _strange_hellos, reads=False),
    Talk("credit of 2^53 frames", lambda _: [(Credit(_MOST), lane) for lane in Lane]),
    Talk("steering by 146 years, and ever new locks", _strange_orders),
    Talk("echoes without end", lambda number: [(Ping(number, -_END_NS), lane) for lane in Lane]),
    Talk("echoes, and answers are not read", lambda number: [(Ping(number, number), Lane.CONTROL)], reads=False),
    Talk("goodbyes", lambda _: [(Bye(BoardCounts(_MOST, _MOST)), lane) for lane in Lane]),
)


def _beside(talk: Talk, folder: Path, rounds: Rounds) -> Outcome:
    """A stranger talks to a board that streams to its own host."""
    outcome = Outcome()
    address = f"tcp://127.0.0.1:{free_port()}"
    with board_and_host(folder, addresses=(address, address)) as (agent, watched):
        beside = Watched(agent)
        beside.now_is_normal()
        for _ in rounds:
            with lying_host(address) as liar:
                liar.flood(talk.messages, reads=talk.reads)
            watched.cause_gone(outcome, talk.name)
        _judge_board(beside, agent, outcome)
        report = watched.stop(outcome)
        outcome.expect(bool(report) and report["connects"] == 1, "the stream was interrupted")
        outcome.expect(agent.stop() == 0, "the board did not end with 0")
    return outcome


def _instead(talk: Talk, folder: Path, rounds: Rounds) -> Outcome:
    """The liar is the board's host, with unlimited credit and unread frames; when it leaves, the next host gets its frames."""
    outcome = Outcome()
    address = f"tcp://127.0.0.1:{free_port()}"
    with board(board_arguments(address), folder) as agent:
        until(lambda: " serving " in agent.stderr, "the board serves")
        beside = Watched(agent)
        for number in rounds:
            within = folder / str(number)
            within.mkdir()
            with lying_host(address) as liar:
                liar.greet()
                if not number:
                    beside.now_is_normal()
                with scene(within, address=address, options=("--wait", "60")) as watched:
                    liar.say(Credit(_MOST))
                    liar.flood(lambda k: [*talk.messages(k), (Credit(_MOST), Lane.CONTROL)], reads=talk.reads)
                    if talk.reads:
                        liar.hush()
                    until(lambda: all(liar.say(Bye(), lane) for lane in Lane) or not talk.reads, "the liar leaves")
                    liar.close()
                    watched.cause_gone(outcome, f"{talk.name} from its own host")
                    watched.stop(outcome)
        _judge_board(beside, agent, outcome)
        outcome.memory = beside.memory
        outcome.expect(agent.stop() == 0, "the board did not end with 0")
    return outcome


def _judge_board(beside: Watched, agent: Program, outcome: Outcome) -> None:
    outcome.expect(agent.process.poll() is None, "the board has ended")
    if agent.process.poll() is None:
        outcome.expect(beside.memory <= 1.3, f"memory of the board {beside.memory:.2f} x normal")
    beside.judge_log(outcome)


def _strangers(folder: Path, rounds: Rounds) -> Outcome:
    """A host waits for its board to dial; strangers dial and claim other versions, refuse, and send three bytes. The board comes later."""
    outcome = Outcome()
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    words = [
        *(msgpack.packb([PROTOCOL_VERSION + 1, kind]) for kind in range(4)),
        *(encode(Refusal(reason))[0] for reason in RefusalReason),
    ]
    try:
        for number in rounds:
            within = folder / str(number)
            within.mkdir()
            port = free_port()
            with scene(within, address=f"tcp://127.0.0.1:{port}?bind=1") as watched:
                stranger = context.socket(zmq.DEALER)
                stranger.connect(f"tcp://127.0.0.1:{port}")
                for word in words * 3:
                    stranger.send(word)
                    time.sleep(0.1)
                outcome.expect(watched.receiver.process.poll() is None, "a stranger's words end a host that waits")
                with board(board_arguments(f"tcp://127.0.0.1:{port}?connect=1"), within) as agent:
                    until(lambda: " serving " in agent.stderr, "the board has started")
                    watched.cause_gone(outcome, "strangers at a host that waits")
                    for word in words:
                        stranger.send(word)
                    watched.cause_gone(outcome, "strangers at a host that streams")
                    watched.stop(outcome)
                stranger.close(0)
    finally:
        context.destroy(linger=0)
    return outcome


def _attack(where: str, run: Callable[[Talk, Path, Rounds], Outcome], talk: Talk) -> Attack:
    return Attack(
        f"host, {where}: {talk.name}",
        f"{talk.name} for {_FLOOD_S:g} s, as fast as the board takes it",
        partial(run, talk),
    )


BESIDE: Final = tuple(_attack("a stranger", _beside, talk) for talk in TALKS)
INSTEAD: Final = tuple(_attack("its own", _instead, talk) for talk in TALKS)
STRANGERS: Final = Attack("strangers at ?bind=1", "other versions, refusals, three bytes", _strangers)
SHORT: Final = (BESIDE[1], BESIDE[5], INSTEAD[3], INSTEAD[5], STRANGERS)
LONG: Final = (*BESIDE, *INSTEAD, STRANGERS)
