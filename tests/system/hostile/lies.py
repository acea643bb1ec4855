"""The lies that a lying board tells a real host, one after the other; after each, the stream must go on as if nothing had been said."""

import resource
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import msgpack

from common.frame import PixelFormat
from common.protocol.message import (
    BoardCounts,
    FrameMessage,
    Lane,
    Message,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    Status,
)
from common.protocol.wire_fields import MAX_SIZE_PX
from common.versions import PROTOCOL_VERSION
from tests.support.bombs import LARGE_PX, jpeg_bomb, png_bomb, torn_jpeg
from tests.support.programs import free_port
from tests.system.hostile.attack import Attack, Outcome, Rounds
from tests.system.hostile.lying_board import LyingBoard
from tests.system.hostile.scene import PERIOD_NS, scene

_S: Final = 1_000_000_000
_HOUR_NS: Final = 3600 * _S
_END_NS: Final = 2**62
_MOST: Final = 2**53
_FLOOD_S: Final = 2.0
_WAVE: Final = 3
_KNOWN_S: Final = 11.0
"""Longer than the clock counts as young (waves.py)."""

_MOST_BYTES: Final = 6 * 2**30
"""The host gets no more address space than this, so that a bomb that goes off spoils a test and not the machine."""


@dataclass(frozen=True, slots=True)
class Lie:
    """One lie.

    Attributes:
        name: for people.
        tell: tells it.
    """

    name: str
    tell: Callable[[LyingBoard], None]


def _frames(name: str, change: Callable[[FrameMessage], FrameMessage], times: int = 1) -> Lie:
    """Change the next frames."""

    def changed(message: Message) -> Iterable[Message]:
        assert isinstance(message, FrameMessage)
        return (change(message),)

    return Lie(name, lambda board: board.lie(FrameMessage, times, changed, spoils=True))


def _moved(frame: FrameMessage, exposed_ns: int, grabbed_ns: int, sent_ns: int) -> FrameMessage:
    marks = frame.marks
    moved = replace(
        marks,
        exposed_ns=marks.exposed_ns + exposed_ns,
        grabbed_ns=marks.grabbed_ns + grabbed_ns,
        sent_ns=marks.sent_ns + sent_ns,
    )
    return replace(frame, marks=moved)


def _set(frame: FrameMessage, exposed_ns: int, grabbed_ns: int, sent_ns: int) -> FrameMessage:
    marks = replace(frame.marks, exposed_ns=exposed_ns, grabbed_ns=grabbed_ns, sent_ns=sent_ns)
    return replace(frame, marks=marks)


def _echoes(name: str, times: int, by_ns: int) -> Lie:
    """Falsify the next echoes."""

    def changed(message: Message) -> Iterable[Message]:
        assert isinstance(message, Pong)
        return (replace(message, t1_ns=message.t1_ns + by_ns, t2_ns=message.t2_ns + by_ns),)

    return Lie(name, lambda board: board.lie(Pong, times, changed))


STAMPS: Final = (
    _frames("a frame an hour ahead", lambda frame: _moved(frame, _HOUR_NS, _HOUR_NS, _HOUR_NS)),
    _frames("a frame an hour back", lambda frame: _moved(frame, -_HOUR_NS, -_HOUR_NS, -_HOUR_NS)),
    _frames("an exposure an hour ahead", lambda frame: _moved(frame, _HOUR_NS, 0, 0)),
    _echoes("a wave of echoes an hour ahead", _WAVE, _HOUR_NS),
    _echoes("a wave of echoes an hour back", _WAVE, -_HOUR_NS),
    _echoes("one echo an hour ahead", 1, _HOUR_NS),
    _echoes("one echo an hour back", 1, -_HOUR_NS),
    _frames("exposed at -2^62, sent at 2^62", lambda frame: _set(frame, -_END_NS, -_END_NS, _END_NS)),
    _frames("exposed at 2^62, sent at -2^62", lambda frame: _set(frame, _END_NS, _END_NS, -_END_NS)),
    _frames("exposed at -2^62, sent now", lambda frame: _set(frame, -_END_NS, -_END_NS, frame.marks.sent_ns)),
    _frames("exposed after grabbed after sent", lambda frame: _moved(frame, _S, _S // 2, 0), 3),
    _frames("ten frames of ten seconds ago", lambda frame: _moved(frame, -10 * _S, -10 * _S, 0), 10),
)


def _index_beyond(board: LyingBoard, index: int) -> None:
    board.do(lambda: board.say(Lane.FRAMES, board.a_frame(torn_jpeg(), index)))


def _flood(board: LyingBoard) -> None:
    """Send frames of one byte for two seconds, as fast as the socket takes them."""
    until = time.monotonic() + _FLOOD_S
    index = board.counts.sent + 1000

    def burst() -> None:
        nonlocal index
        for _ in range(200):
            index += 1
            board.say(Lane.FRAMES, board.a_frame(b"\xff", index))

    while time.monotonic() < until:
        board.do(burst)


def _accounts(board: LyingBoard) -> None:
    counts = BoardCounts(_MOST, _MOST)
    rung = Rung(period_ns=PERIOD_NS)
    for lane in (Lane.CONTROL, Lane.FRAMES):
        board.do(partial(board.say, lane, Status(board.session.session, counts, rung)))


def _twice(board: LyingBoard) -> None:
    board.lie(FrameMessage, 10, lambda message: (message, message, message))


def _refuses(board: LyingBoard) -> None:
    for reason in RefusalReason:
        board.do(partial(board.say, Lane.FRAMES, Refusal(reason)))
    board.do(partial(board.say_bytes, Lane.FRAMES, msgpack.packb([PROTOCOL_VERSION + 1, 0])))


def _many_parts(board: LyingBoard) -> None:
    for count in (3, 50, 2000):
        board.do(partial(board.say_parts, Lane.CONTROL, [b"x"] * count))


ORDER: Final = (
    Lie("a number far beyond the credit", lambda board: _index_beyond(board, board.counts.sent + 1_000_000)),
    Lie("the greatest number", lambda board: _index_beyond(board, _MOST)),
    Lie("frames of one byte beyond credit", _flood),
    Lie("accounts of 2^53 frames", _accounts),
    Lie("every frame three times", _twice),
    Lie("refusals in a running session", _refuses),
    Lie("words of many parts", _many_parts),
)


def _camera(name: str, **claims: int) -> Lie:
    """For a second, be a board with another camera."""

    def tell(board: LyingBoard) -> None:
        board.do(lambda: board.begin_session(replace(board.camera, **claims)))  # type: ignore[arg-type]  # all of them are int
        time.sleep(1)
        board.do(lambda: board.begin_session(board.camera))

    return Lie(name, tell)


HELLOS: Final = (
    _camera("a camera with a period of 1 ns", period_ns=1),
    _camera("a camera with a period of 2^62 ns", period_ns=_END_NS),
    _camera("a camera of 16384x16384", width_px=MAX_SIZE_PX, height_px=MAX_SIZE_PX),
)


def _bombs(name: str, payload: Callable[[], bytes], pixel_format: PixelFormat, size_px: int = 0) -> Lie:
    """Make the next ten frames bombs; if a size is given, their headers claim it too."""

    def changed(frame: FrameMessage) -> FrameMessage:
        bomb = replace(frame, payload=payload(), pixel_format=pixel_format)
        return replace(bomb, width_px=size_px, height_px=size_px) if size_px else bomb

    return _frames(name, changed, 10)


BOMBS: Final = (
    _bombs("JPEGs that claim 30000x30000", jpeg_bomb, PixelFormat.MJPEG),
    _bombs("PNGs of 16000x16000", png_bomb, PixelFormat.PNG),
    _bombs("PNGs of 16000x16000 that say so", png_bomb, PixelFormat.PNG, LARGE_PX),
    _bombs("JPEGs of 16000x16000 that say so", partial(jpeg_bomb, LARGE_PX), PixelFormat.MJPEG, LARGE_PX),
    _bombs("a raw image of one byte", lambda: b"\0", PixelFormat.GREY),
    _bombs("JPEGs with nonsense inside", torn_jpeg, PixelFormat.MJPEG),
)


def _run(lies: Sequence[Lie], folder: Path, rounds: Rounds) -> Outcome:
    outcome = Outcome()
    address = f"tcp://127.0.0.1:{free_port()}"
    png_bomb()  # made before anything is measured
    with (
        LyingBoard(address) as board,
        scene(folder, address=address, options=("--tolerance", "16.6"), true_board_ns=board.true_ns) as watched,
    ):
        watched.settle()
        resource.prlimit(watched.receiver.process.pid, resource.RLIMIT_AS, (_MOST_BYTES, _MOST_BYTES))
        goes_on = True
        for _ in rounds:
            for lie in lies:
                if goes_on:
                    lie.tell(board)
                    goes_on = watched.cause_gone(outcome, lie.name)
        report = watched.stop(outcome)
        used = sum(pair.sequence in board.spoilt for pair in watched.pairs)
        outcome.expect(not used, f"{used} pairs with a frame that cannot be used")
        if board.spoilt:
            outcome.expect(bool(report) and bool(report["warnings"]), "frames were dropped, and nothing is doubted")
    return outcome


def _end_without_end(folder: Path, rounds: Rounds) -> Outcome:
    """Say that no frame follows, and continue: the run may end with that message, in order, or go on."""
    outcome = Outcome()
    for number in rounds:
        within = folder / str(number)
        within.mkdir()
        address = f"tcp://127.0.0.1:{free_port()}"
        with LyingBoard(address) as board, scene(within, address=address, true_board_ns=board.true_ns) as watched:
            watched.settle()
            for _ in range(20):
                board.do(board.end)
                time.sleep(0.1)
            watched.stop(outcome)
    return outcome


def attack(name: str, lies: Sequence[Lie]) -> Attack:
    """An attack of several lies, one after the other."""
    return Attack(f"board: {name}", "; ".join(lie.name for lie in lies), partial(_run, lies))


def _settled(lie: Lie) -> Lie:
    """The same lie when the clock is well known and echoes have become rare."""

    def tell(board: LyingBoard) -> None:
        time.sleep(_KNOWN_S)
        lie.tell(board)

    return Lie(f"{lie.name}, late", tell)


_LATE: Final = tuple(_settled(lie) for lie in STAMPS if "echo" in lie.name)

_NO_END: Final = Attack("board: an end that is none", "twenty times `End`, and frames go on", _end_without_end)

SHORT: Final = (
    attack("stamps", STAMPS),
    attack("order", ORDER),
    attack("hellos", HELLOS),
    _NO_END,
)
"""These run in CI: many lies to one host."""

SHORT_BOMBS: Final = (attack("bombs", BOMBS),)

SINGLE: Final = (*(attack(lie.name, (lie,)) for lie in STAMPS + _LATE + ORDER + HELLOS + BOMBS), _NO_END)
"""Each is told to a host of its own, again and again."""
