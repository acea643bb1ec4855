"""No correction of a camera's phase is lost, however the ordering threads and the executing threads interleave."""

import sys
import threading
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import pytest

from common import now
from common.camera.replay import ReplayCamera, ReplaySettings
from common.frame import Frame
from common.link.base import Packet
from common.link.factory import open_link, parse_link
from common.link.waiter import Waiter
from common.protocol.board_session import BoardSession
from common.protocol.message import BoardCounts, Pacing, Steer
from common.protocol.session import MS, connection_name
from common.protocol.wire import decode, encode_stamped
from phone_host.stream.corrections import Corrections
from phone_host.stream.demand_clock import DemandClock
from phone_host.stream.frame_sink import NoFrames
from phone_host.stream.own_camera import OwnCamera
from phone_host.stream.receiver import Receiver
from tests.support.pictures import jpeg
from tests.support.programs import until
from tests.support.samples import CAMERA

ORDERS = 2000
LAST_NS = 1_000_000
"""More than all other orders together, so that its arrival is seen; and less than the camera's period."""


@pytest.fixture(autouse=True)
def eager() -> Iterator[None]:
    """Make threads switch as often as they can."""
    usual_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual_s)


def hammer(order: Callable[[int], None], threads: int = 3) -> None:
    """Order 1 ns many times from several threads at once."""

    def many() -> None:
        for _ in range(ORDERS):
            order(1)

    running = [threading.Thread(target=many) for _ in range(threads)]
    for thread in running:
        thread.start()
    for thread in running:
        thread.join(60)


class Steered(threading.Thread):
    """A board that a host steers: it answers as a board does, and adds up the corrections it gets.

    Args:
        address: to listen at.
    """

    def __init__(self, address: str) -> None:
        super().__init__(daemon=True)
        self._link = open_link(parse_link(address, listens_by_default=True))
        self._session = BoardSession("session", "boot", CAMERA)
        self._stopping = False
        self.has_last = False
        self.later_ns = 0

    def run(self) -> None:
        """Answer until told to stop."""
        waiter = Waiter(list(self._link.pollables))
        while not self._stopping:
            waiter.wait(10)
            for incoming in self._link.receive():
                if isinstance(incoming, Packet):
                    self._take(incoming)

    def _take(self, packet: Packet) -> None:
        message = decode(packet.header, packet.payload)
        if isinstance(message, Steer):
            self.later_ns += message.later_ns
            self.has_last |= message.later_ns >= LAST_NS
            return
        name = connection_name(0, packet.connection)
        for outgoing in self._session.receive(name, message, now.monotonic_ns(), BoardCounts()):
            self._link.send(outgoing.connection[1:], *encode_stamped(outgoing.message, now.monotonic_ns))

    def close(self) -> None:
        """Stop answering."""
        self._stopping = True
        self.join(60)
        self._link.close()


def test_what_is_added_is_taken_once() -> None:
    """While three threads order and a fourth takes, the sum taken equals the sum ordered."""
    corrections, taken, done = Corrections(), [0], threading.Event()

    def take() -> None:
        while not done.is_set():
            taken[0] += corrections.take()

    taker = threading.Thread(target=take)
    taker.start()
    hammer(corrections.add)
    done.set()
    taker.join(60)
    assert taken[0] + corrections.take() == 3 * ORDERS


def test_no_order_to_the_board_is_lost(tmp_path: Path) -> None:
    """Everything that threads order of a running receiver reaches the board, each order once, in any number of messages."""
    address = f"ipc://{tmp_path}/board"
    board = Steered(address)
    receiver = Receiver([open_link(parse_link(address, listens_by_default=False))], "host", NoFrames())
    board.start()
    receiver.start()
    try:
        until(lambda: receiver.connected, "the host has met the board")
        hammer(receiver.steer)
        receiver.steer(LAST_NS)
        until(lambda: board.has_last, "the last order has come")
    finally:
        receiver.stop()
        board.close()
    assert board.later_ns == 3 * ORDERS + LAST_NS


def test_an_order_waits_for_a_link(tmp_path: Path) -> None:
    """An order given before a link carries frames is carried out once one does."""
    address = f"ipc://{tmp_path}/board"
    receiver = Receiver([open_link(parse_link(address, listens_by_default=False))], "host", NoFrames())
    receiver.steer(LAST_NS)
    receiver.start()
    board = Steered(address)
    board.start()
    try:
        until(lambda: board.has_last, "the order has come")
    finally:
        receiver.stop()
        board.close()
    assert board.later_ns == LAST_NS


def test_two_orders_in_a_row_are_one_of_their_sum(tmp_path: Path) -> None:
    """An order given before the previous one was carried out does not replace it: the host camera exposes later by both."""
    (tmp_path / "0.jpg").write_bytes(jpeg())
    start_ns, frames = now.monotonic_ns(), list[Frame]()
    camera = ReplayCamera(ReplaySettings(path=str(tmp_path), fps=Fraction(20), loop=True), start_ns)
    own = OwnCamera(camera, frames.append, DemandClock(Pacing.CLOCK))
    unmoved_ns = camera.due_ns(start_ns)
    own.steer(5 * MS)
    own.steer(7 * MS)
    own.start()
    until(lambda: len(frames) > 3, "frames have come")
    own.stop()
    assert own.failure is None
    period_ns = camera.description.period_ns
    assert {(frame.exposed.ns - unmoved_ns) % period_ns for frame in frames[1:]} == {12 * MS}
