"""Records the byte-exact messages between the two roles of a session as golden transcripts; `record_bytes.py` does the rest.

Transcripts go into this folder. Run once, against commit aa28bce (package 0.1, protocol 3): `CHECKOUT/.venv/bin/python
tests/golden/record.py tests/golden/v0_1`, where CHECKOUT is a worktree of that commit with its own environment, in
which the package is installed. For a later version, run it from a worktree of that version, into a new folder beside
`v0_1`, and add that folder to `tests/support/golden.py`. Never re-record a transcript: it stands for programs already
in use.

A transcript is one JSON object per line. The first describes the transcript. Every other is one step of one role: who,
at what time of its own clock (ns), its input, and what it then said: [connection, header, payload], all in hex. A
`receive` step names a message by its number in the order of sending, or holds the bytes of a stranger. Ticks that say
nothing are not recorded as steps: each role's own `due_ns` says when they happen.
"""

import hashlib
import heapq
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import common
from common.frame import Frame, PixelFormat
from common.protocol.board_session import BoardSession
from common.protocol.host_session import HostSession
from common.protocol.message import (
    BoardCounts,
    CameraDescription,
    DropReason,
    HostHello,
    Lane,
    Message,
    Pacing,
    Ping,
    Refusal,
    RefusalReason,
    Rung,
    Steering,
)
from common.protocol.session import Accepted, Counted, Outgoing, connection_name
from common.protocol.wire import decode, encode, encode_for_any_version, encode_stamped
from common.stamp import Stamp
from tests.support.sent_frames import frame_outgoing

MS: Final = 1_000_000
OFFSET_NS: Final = 5_000_000_000_000
"""The board's clock is ahead of the host's by this much at the host's zero, and gains one part in 50 000."""

START_NS: Final = 40_000_000_000
PERIOD_NS: Final = 33 * MS
TRAVEL_NS: Final = {("host", Lane.CONTROL): 15 * MS, ("board", Lane.CONTROL): 17 * MS, ("board", Lane.FRAMES): 22 * MS}
TRAVEL_HELLO_NS: Final = 15 * MS
SLOTS: Final = 3
CAMERA: Final = CameraDescription(
    name="Wébcam C270",
    width_px=640,
    height_px=480,
    pixel_format=PixelFormat.MJPEG,
    period_ns=PERIOD_NS,
    pacing=Pacing.CLOCK,
    steering=Steering.RESTART,
)
LOWERED: Final = Rung(index=1, last=4, changes=1, period_ns=2 * PERIOD_NS, quality=60, width_px=640, height_px=480)
STRANGER: Final = connection_name(0, b"S")


def board_ns(host_ns: int) -> int:
    """The board's clock when the host's shows `host_ns`."""
    return OFFSET_NS + host_ns + host_ns // 50_000


def host_ns_at(due_ns: int) -> int:
    """The first moment on the host's clock at which the board's clock shows `due_ns` or more."""
    at_ns = (due_ns - OFFSET_NS) * 50_000 // 50_001 - 2
    while board_ns(at_ns) < due_ns:
        at_ns += 1
    return at_ns


def tiny_jpeg(sequence: int) -> bytes:
    """Bytes that begin and end like a JPEG; every tenth is long enough to be split into chunks."""
    body = hashlib.sha256(sequence.to_bytes(4, "big")).digest()
    return b"\xff\xd8" + body[:20] * (60 if sequence % 10 == 9 else 1) + b"\xff\xd9"


def frame_at(now_ns: int, sequence: int) -> Frame:
    """The frame of the board's camera at that time of its clock."""
    clock = "board:golden-boot"
    return Frame(
        sequence=sequence,
        exposed=Stamp(now_ns - 9 * MS, clock),
        grabbed=Stamp(now_ns - 1 * MS, clock),
        width_px=640,
        height_px=480,
        pixel_format=PixelFormat.MJPEG,
        exposure_ns=8 * MS if sequence % 2 else None,
        payload=tiny_jpeg(sequence),
    )


@dataclass(frozen=True, slots=True)
class Said:
    """A message: by whom, on which lane, when (host's clock, ns)."""

    at_ns: int
    who: str
    connection: bytes
    header: bytes
    payload: bytes


def sessions(links: int, *, board_dials: bool) -> tuple[BoardSession, HostSession]:
    """The two roles with this many links, as recorded."""
    names = [{lane: connection_name(link, lane.name[:1].encode()) for lane in Lane} for link in range(links)]
    dialled = tuple((lane, name) for link in names for lane, name in link.items())
    board = BoardSession("golden-session", "golden-boot", CAMERA, dialled if board_dials else ())
    return board, HostSession("golden-host", [{} if board_dials else link for link in names])


class World:
    """An old board and an old host in simulated time; every step of both is recorded."""

    def __init__(self, *, links: int = 1, board_dials: bool = False) -> None:
        self.board, self.host = sessions(links, board_dials=board_dials)
        self.lanes = {connection_name(link, lane.name[:1].encode()): lane for link in range(links) for lane in Lane}
        self.about = {"links": links, "board_dials": board_dials}
        self.now_ns = START_NS
        self.steps: list[dict[str, Any]] = []
        self.said: list[Said] = []
        self.dead: set[bytes] = set()
        self.plans: list[tuple[int, int, Callable[[], None]]] = []
        self.grabbed = self.sent = self.replaced = 0
        self.ended = self.host_left = self.host_gone = self.board_left = False
        self._planned = 0

    @property
    def counts(self) -> BoardCounts:
        """The board's account."""
        dropped = ((DropReason.REPLACED, self.replaced),) if self.replaced else ()
        return BoardCounts(self.grabbed, self.sent, dropped)

    def plan(self, after_ns: int, what: Callable[[], None]) -> None:
        """Schedule something for later."""
        self._planned += 1  # actions scheduled for the same moment run in the order of scheduling
        heapq.heappush(self.plans, (self.now_ns + after_ns, self._planned, what))

    def run(self, duration_ns: int) -> None:
        """Let time pass."""
        end_ns = self.now_ns + duration_ns
        while True:
            due = {"plan": self.plans[0][0]} if self.plans else {}
            if not self.host_left:
                due["host"] = self.host.due_ns
            if not self.board_left and self.board.due_ns < 2**62:
                due["board"] = host_ns_at(self.board.due_ns)
            who = min(due, key=lambda name: due[name])
            if due[who] > end_ns:
                break
            self.now_ns = max(self.now_ns, due[who])
            if who == "plan":
                heapq.heappop(self.plans)[2]()
            elif who == "host":
                self.note("host", "tick", self.host.tick(self.now_ns))
            else:
                self.note("board", "tick", self.board.tick(board_ns(self.now_ns), self.counts), counts=True)
        self.now_ns = end_ns

    def note(self, who: str, do: str, outputs: list[Any], *, counts: bool = False, **told: Any) -> None:
        """Record a step and send what was said."""
        out = []
        ns = board_ns(self.now_ns) if who == "board" else self.now_ns
        for output in outputs:
            if isinstance(output, Outgoing):
                header, payload = encode_stamped(output.message, lambda: ns)
                out.append([output.connection.hex(), header.hex(), bytes(payload).hex()])
                self.send(Said(self.now_ns, who, output.connection, header, bytes(payload)))
        if do == "tick" and not out:
            return
        account = {"counts": [self.grabbed, self.sent, self.replaced]} if counts else {}
        self.steps.append({"who": who, "ns": ns, "do": do, **told, **account, "says": out})

    def send(self, said: Said) -> None:
        """Send a message if anybody is there to receive it."""
        number = len(self.said)
        self.said.append(said)
        lane = self.lanes.get(said.connection)
        if lane is None or said.connection in self.dead:
            return
        travel_ns = TRAVEL_NS.get((said.who, lane), TRAVEL_HELLO_NS)
        arrive = self.to_host if said.who == "board" else self.to_board
        self.plan(travel_ns, lambda: None if said.connection in self.dead else arrive(said, number))

    def to_board(self, said: Said, number: int | None) -> None:
        """Deliver something to the board."""
        message = decode(said.header, said.payload)
        outputs = self.board.receive(said.connection, message, board_ns(self.now_ns), self.counts)
        told = {"bytes": said.header.hex()} if number is None else {"number": number}
        self.note("board", "receive", outputs, counts=True, connection=said.connection.hex(), **told)

    def to_host(self, said: Said, number: int) -> None:
        """Deliver something to the host, which is gone once the board's last account has answered its goodbye."""
        if self.host_gone:
            return
        outputs: list[Any] = self.host.receive(said.connection, decode(said.header, said.payload), self.now_ns)
        self.note("host", "receive", outputs, connection=said.connection.hex(), number=number)
        ended = any(isinstance(output, Counted) and output.ended for output in outputs)
        self.host_gone = self.host_left and any(isinstance(output, Counted) and output.last for output in outputs)
        if not self.host_left and (said.payload or any(isinstance(output, Accepted) for output in outputs)):
            self.note("host", "grant", list(self.host.grant(SLOTS)), slots=SLOTS)
        if ended and not self.host_left:
            self.leave_host()

    def stranger(self, message: Message) -> None:
        """Let a stranger send something to the board."""
        self.to_board(Said(self.now_ns, "stranger", STRANGER, bytes(encode(message)[0]), b""), None)

    def show(self, frames: int) -> None:
        """Let the board's camera deliver frames."""
        if frames and not self.board_left:
            self.plan(PERIOD_NS, lambda: self.grab(frames))

    def grab(self, frames: int) -> None:
        """Deliver one frame: sent, or counted as replaced if there is no credit."""
        if self.board_left:
            return
        now_ns, sequence = board_ns(self.now_ns), self.grabbed
        self.grabbed += 1
        if self.board.has_credit:
            self.note("board", "send", [frame_outgoing(self.board, frame_at(now_ns, sequence))], sequence=sequence)
            self.board.sent(now_ns)
            self.sent += 1
        else:
            self.replaced += 1
        self.show(frames - 1)

    def steer(self, later_ns: int) -> None:
        """Let the host ask for a later exposure."""
        self.note("host", "steer", list(self.host.steer(later_ns)), later_ns=later_ns)

    def step_down(self) -> None:
        """Let the board's camera change what it delivers."""
        self.board.describe(CAMERA, LOWERED)
        self.note("board", "describe", [])

    def carry(self, link: int) -> None:
        """Let the host ask for its frames over another link."""
        self.note("host", "carry", list(self.host.carry(link, self.now_ns)), link=link)

    def cut(self, *connections: bytes) -> None:
        """Break connections: messages under way are lost; the board notices at once, the host 20 ms later, when they work again."""
        self.dead |= set(connections)
        for connection in connections:
            name = connection.hex()
            self.note("board", "unreachable", list(self.board.unreachable(connection)), connection=name)
        self.plan(20 * MS, lambda: self.mend(connections))

    def mend(self, connections: tuple[bytes, ...]) -> None:
        """Mend what `cut` broke."""
        self.dead -= set(connections)
        for connection in connections:
            outputs = list(self.host.interrupted(connection, self.now_ns))
            self.note("host", "interrupted", outputs, connection=connection.hex())

    def end(self) -> None:
        """Let the board's camera end."""
        self.ended = True
        self.note("board", "end", list(self.board.end(self.counts)), counts=True)

    def leave_host(self) -> None:
        """Let the host say goodbye."""
        self.note("host", "leave", list(self.host.leave()))
        self.host_left = True

    def leave_board(self) -> None:
        """Let the board say goodbye."""
        self.note("board", "leave", list(self.board.leave(self.counts)), counts=True)
        self.board_left = True


def goodbye_of_the_host() -> World:
    """A whole session: hello, waves, credit, frames, a correction, a lowered rate, a rejected stranger; then the host leaves."""
    world = World()
    world.show(60)
    world.plan(500 * MS, lambda: world.stranger(HostHello("another-host", Lane.CONTROL)))
    world.plan(510 * MS, lambda: world.stranger(Ping(7, 1)))
    world.plan(600 * MS, lambda: world.steer(12 * MS))
    world.plan(700 * MS, world.step_down)
    world.run(1200 * MS)
    world.leave_host()
    world.run(150 * MS)
    return world


def goodbye_of_the_board() -> World:
    """The board leaves in mid-session, and the host answers."""
    world = World()
    world.show(20)
    world.run(500 * MS)
    world.leave_board()
    world.run(150 * MS)
    return world


def the_board_dials() -> World:
    """The board knocks; its camera ends, and the host then leaves."""
    world = World(board_dials=True)
    world.show(8)
    world.plan(400 * MS, world.end)
    world.run(600 * MS)
    return world


def a_break() -> World:
    """The frames' lane breaks with a frame under way, and later the control lane; the session goes on each time."""
    world = World()
    world.show(40)
    world.plan(335 * MS, lambda: world.cut(connection_name(0, b"F")))
    world.plan(705 * MS, lambda: world.cut(connection_name(0, b"C")))
    world.run(1000 * MS)
    world.leave_host()
    world.run(150 * MS)
    return world


def busy() -> World:
    """The board serves another host until that one has been silent for a second."""
    world = World()
    world.stranger(HostHello("another-host", Lane.CONTROL))
    world.show(40)
    world.run(1300 * MS)
    world.leave_board()
    world.run(150 * MS)
    return world


def two_links() -> World:
    """Frames move to the second link, whose two lanes then break."""
    world = World(links=2)
    world.show(40)
    world.plan(300 * MS, lambda: world.carry(1))
    world.plan(600 * MS, lambda: world.cut(connection_name(1, b"F"), connection_name(1, b"C")))
    world.run(900 * MS)
    world.leave_host()
    world.run(150 * MS)
    return world


SCENES: Final = (goodbye_of_the_host, goodbye_of_the_board, the_board_dials, a_break, busy, two_links)


def write(path: Path, head: dict[str, Any], steps: list[dict[str, Any]]) -> None:
    """Write a transcript."""
    lines = [json.dumps(step, separators=(",", ":")) for step in [head, *steps]]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def main(out: Path) -> None:
    """Record all transcripts."""
    out.mkdir(parents=True, exist_ok=True)
    source = Path(str(common.__file__)).parent
    commit = subprocess.run(
        ["git", "-C", str(source), "rev-parse", "--short", "HEAD"], check=True, capture_output=True, text=True
    ).stdout.strip()
    head = {"commit": commit, "offset_ns": OFFSET_NS, "skew": "1/50000"}
    for scene in SCENES:
        world = scene()
        write(out / f"{scene.__name__}.jsonl", head | {"scene": scene.__doc__} | world.about, world.steps)
    refusals = {
        str(version): encode_for_any_version(version, Refusal(RefusalReason.VERSION)).hex() for version in (2, 3, 4)
    }
    write(out / "refusals.jsonl", head, [refusals])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
