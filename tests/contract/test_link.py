"""What every transport must do. A new transport adds itself to TRANSPORTS."""

import random
import re
import socket
import stat
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest
import zmq

from common.errors import ProtocolError, UnavailableError
from common.keys import KeyFolder
from common.link.base import Link, SendResult
from common.link.factory import open_link, parse_link
from common.link.waiter import Waiter
from common.protocol.message import Lane
from common.protocol.wire import MAX_PAYLOAD_BYTES, decode
from tests.support.devices import MissingError, gadget_uris, rfcomm_uri
from tests.support.keys import acquainted
from tests.support.links import End, free_port, meet, send_until_sent, wait_until
from tests.support.pty_line import PtyLine

TRANSPORTS = ("tcp", "curve", "ipc", "serial", "gadget", "rfcomm")
MB = 2**20


@dataclass(slots=True)
class Ends:
    """Open both ends of one address repeatedly, and close what is left over.

    Attributes:
        address: of both ends, or of the board's.
        board_listens: whether the board binds (the default) or the host.
    """

    address: str
    board_listens: bool
    opened: list[Link] = field(default_factory=list)
    uris: tuple[str, str] | None = None
    """A cable's two ends have different names."""
    keys: tuple[KeyFolder, KeyFolder] | None = None

    def _open(self, *, listens: bool) -> End:
        uri = self.listening if listens else self.address
        if self.uris is not None:
            uri = self.uris[0 if listens else 1]
        if not self.board_listens:  # the options that swap the roles
            uri += "&" if "?" in uri else "?"
            uri += "bind=1" if listens else "connect=1"
        board_asks = listens == self.board_listens
        keys = self.keys[0 if listens else 1] if self.keys is not None else None
        end = End(open_link(parse_link(uri, listens_by_default=board_asks), keys))
        self.opened.append(end.link)
        return end

    @property
    def listening(self) -> str:
        """The address for the listener: with keys on every network, since loopback alone needs none."""
        return self.address if self.keys is None else self.address.replace("127.0.0.1", "*")

    def listen(self) -> End:
        """The listening end."""
        return self._open(listens=True)

    def dial(self) -> End:
        """The dialling end."""
        return self._open(listens=False)

    def close(self, end: End) -> None:
        """Close an end."""
        self.opened.remove(end.link)
        end.link.close()


@pytest.fixture(params=TRANSPORTS)
def address(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """A free address for each transport that this machine has."""
    try:
        match request.param:
            case "tcp" | "curve":
                return f"tcp://127.0.0.1:{free_port()}"
            case "ipc":
                return f"ipc://{tmp_path}/link"
            case "serial":
                return f"serial:{tmp_path}/ttyBoard"
            case "gadget":
                return gadget_uris()[0]
            case _:
                return rfcomm_uri()
    except MissingError as missing:
        pytest.skip(str(missing))


@pytest.fixture(params=["board listens", "host listens"])
def ends(request: pytest.FixtureRequest, address: str, tmp_path: Path) -> Iterator[Ends]:
    """Both ends of each transport, with either side as the listener."""
    made = Ends(address, request.param == "board listens")
    if request.node.callspec.params["address"] == "curve":
        made.keys = acquainted(tmp_path, address)
    with ExitStack() as stack:
        if address.startswith(f"serial:{tmp_path}"):
            made.uris = stack.enter_context(PtyLine(tmp_path)).uris
        elif address.startswith("serial:"):
            made.uris = gadget_uris()
        yield made
        for link in made.opened:
            link.close()


@pytest.fixture
def _sockets(address: str) -> None:
    """Only for transports that strangers can connect to."""
    if address.startswith("serial:"):
        pytest.skip("nobody else can connect to a serial line; test_serial.py lets garbage appear on one")
    if address.startswith("rfcomm:"):
        pytest.skip("a stranger would need a third Bluetooth adapter")


@pytest.fixture
def _open_to_all(ends: Ends) -> None:
    """Only for transports on which strangers are heard."""
    if ends.keys is not None:
        pytest.skip("strangers are not heard where keys are asked for; tests/system/test_hostile_peers.py shows it")


@pytest.fixture
def pair(ends: Ends) -> tuple[End, End, dict[Lane, bytes]]:
    """A listener and a dialler that are connected, and the listener's names of the connections."""
    listener, dialler = ends.listen(), ends.dial()
    return listener, dialler, meet(listener, dialler)


def test_who_dials_has_the_lanes(ends: Ends) -> None:
    """The dialler has a connection for each lane, the listener none of its own; both know the name of their transport."""
    listener, dialler = ends.listen(), ends.dial()
    assert set(dialler.link.dialled) == set(Lane)
    assert listener.link.dialled == {}
    assert listener.link.kind == dialler.link.kind == ends.address.partition(":")[0]


def test_packets_arrive_whole_and_in_order(pair: tuple[End, End, dict[Lane, bytes]]) -> None:
    """Headers with payloads of any size arrive unaltered and in order, on both lanes and in both directions."""
    listener, dialler, names = pair
    chance = random.Random(1)
    sizes = [0, 1, 0, 255, 256, 65535, 65536, 65537, 300_000, 2 * MB + 1, 0, 7]
    for sender, receiver, lanes in ((listener, dialler, names), (dialler, listener, dialler.link.dialled)):
        for lane, connection in lanes.items():
            receiver.packets.clear()
            sent = [(f"{lane.name} {i}".encode(), chance.randbytes(size)) for i, size in enumerate(sizes)]
            for header, payload in sent:
                send_until_sent(sender, connection, header, payload, receiver)
            wait_until(lambda: len(receiver.packets) == len(sizes), receiver, sender)  # noqa: B023 - used at once
            assert [(header, payload) for _, header, payload in receiver.packets] == sent
            expected = dialler.link.dialled[lane] if receiver is dialler else names[lane]
            assert {connection for connection, _, _ in receiver.packets} == {expected}


def test_the_greatest_payload_passes(pair: tuple[End, End, dict[Lane, bytes]]) -> None:
    """A payload of exactly the maximum size arrives unaltered."""
    listener, dialler, names = pair
    payload = random.Random(2).randbytes(MB) * (MAX_PAYLOAD_BYTES // MB)
    send_until_sent(listener, names[Lane.FRAMES], b"great", payload, dialler)
    wait_until(lambda: bool(dialler.packets), dialler, listener)
    assert dialler.packets[0][2] == payload


@pytest.mark.parametrize("size", [0, 100_000])
def test_a_reader_that_does_not_read_makes_the_link_full(pair: tuple[End, End, dict[Lane, bytes]], size: int) -> None:
    """When nobody reads, sends end in FULL without waiting; accepted packets arrive whole and in order once somebody reads."""
    listener, dialler, names = pair
    connection = names[Lane.FRAMES]
    taken: list[bytes] = []
    refusals = 0
    # A link that paces itself gives up a frame after ten looks of 100 ms, however long the machine sleeps between two.
    enough = 8 if listener.link.self_paced else 200
    fill = size or (0 if listener.link.self_paced else 100_000)
    while refusals < enough:
        header = b"%d" % len(taken)
        result = listener.link.send(connection, header, header.rjust(fill) if fill else b"")
        if result is SendResult.SENT:
            taken.append(header)
        else:
            assert result is SendResult.FULL
            refusals += 1
            # Small packets go on once large ones have filled all buffers on the way. By themselves they would take fifty thousand sends, each of
            # which yields its core: beside busy programs that is longer than the 30 s after which a reader that does not read is given up.
            fill = fill if refusals < enough / 2 else size
            for pollable in listener.link.pollables:
                zmq.zmq_poll([(pollable, zmq.POLLIN)], 1)  # lets the transport move data
    assert len(taken) * max(size, 1) < 64 * MB
    wait_until(lambda: len(dialler.packets) >= len(taken), dialler, listener)
    assert dialler.headers == taken
    assert all(payload.strip() == header for _, header, payload in dialler.packets if payload)
    send_until_sent(listener, connection, b"after", b"", dialler)
    wait_until(lambda: dialler.headers[-1] == b"after", dialler, listener)


def test_one_full_lane_does_not_stop_the_other(pair: tuple[End, End, dict[Lane, bytes]]) -> None:
    """While frames are stuck, control still gets through in both directions."""
    listener, dialler, names = pair
    refusals = 0
    while refusals < 50:
        refusals += listener.link.send(names[Lane.FRAMES], b"frame", bytes(MB)) is SendResult.FULL
    assert listener.link.send(names[Lane.CONTROL], b"control", b"") is SendResult.SENT
    wait_until(lambda: b"control" in dialler.headers, dialler, listener)
    send_until_sent(dialler, dialler.link.dialled[Lane.CONTROL], b"answer", b"", listener)
    wait_until(lambda: b"answer" in listener.headers, listener, dialler)


def test_before_the_peer_is_there_a_dialler_is_full(ends: Ends) -> None:
    """Nothing is queued for a listener that has not come; once it comes, only packets accepted from then on arrive."""
    dialler = ends.dial()
    for connection in dialler.link.dialled.values():
        assert dialler.link.send(connection, b"too early", b"") is SendResult.FULL
    listener = ends.listen()
    meet(listener, dialler)
    assert b"too early" not in listener.headers


def test_a_listener_that_restarts_is_found_again(ends: Ends) -> None:
    """The dialler is told of the break on every lane and reconnects on its own when the listener returns; twice."""
    listener, dialler = ends.listen(), ends.dial()
    meet(listener, dialler)
    for life in range(2):
        dialler.broken.clear()
        ends.close(listener)
        wait_until(lambda: set(dialler.broken) == set(dialler.link.dialled.values()), dialler)
        listener = ends.listen()
        names = meet(listener, dialler, b"life %d " % life)
        send_until_sent(listener, names[Lane.FRAMES], b"back", b"again", dialler)
        wait_until(lambda: b"back" in dialler.headers, dialler, listener)
        dialler.packets.clear()


def test_a_dialler_that_restarts_is_a_new_connection(pair: tuple[End, End, dict[Lane, bytes]], ends: Ends) -> None:
    """A dialler that left is unreachable; the next one has connections with other names."""
    listener, dialler, names = pair
    ends.close(dialler)
    for name in names.values():
        wait_until(lambda name=name: listener.link.send(name, b"?", b"") is SendResult.UNREACHABLE, listener)  # type: ignore[misc]
    later = ends.dial()
    renewed = meet(listener, later, b"later ")
    assert not set(renewed.values()) & set(names.values())
    send_until_sent(listener, renewed[Lane.CONTROL], b"welcome", b"", later)
    wait_until(lambda: b"welcome" in later.headers, later, listener)
    assert later.headers == [b"welcome"]


@pytest.mark.parametrize("leaver", ["listener", "dialler"])
def test_who_left_much_unread_is_met_again(pair: tuple[End, End, dict[Lane, bytes]], ends: Ends, leaver: str) -> None:
    """An end that closes with much unread data can come back and reconnect, and packets flow."""
    listener, dialler, names = pair
    talker, connections = (dialler, dialler.link.dialled) if leaver == "listener" else (listener, names)
    refusals = 0
    for _ in range(500):
        refusals += talker.link.send(connections[Lane.CONTROL], b"unread", bytes(100_000)) is not SendResult.SENT
        if refusals >= 50:
            break
        zmq.zmq_poll([(pollable, zmq.POLLIN) for pollable in talker.link.pollables], 1)
    if leaver == "listener":
        ends.close(listener)
        wait_until(lambda: set(dialler.broken) == set(dialler.link.dialled.values()), dialler)
        listener = ends.listen()
    else:
        ends.close(dialler)
        dialler = ends.dial()
    names = meet(listener, dialler, b"again ")
    send_until_sent(listener, names[Lane.FRAMES], b"welcome", b"back", dialler)
    wait_until(lambda: b"welcome" in dialler.headers, dialler, listener)


def test_what_was_received_before_the_break_comes_before_its_news(
    pair: tuple[End, End, dict[Lane, bytes]], ends: Ends
) -> None:
    """If a listener's words on a connection are still delivered after the break, they come before that connection's `Broken`."""
    listener, dialler, names = pair
    order: list[tuple[str, bytes]] = []
    waiter = Waiter(dialler.link.pollables)
    for connection in names.values():
        send_until_sent(listener, connection, b"bye", b"")
    ends.close(listener)

    def both_broke() -> bool:
        waiter.wait(20)
        order.extend((type(incoming).__name__, incoming.connection) for incoming in dialler.link.receive())
        return sum(kind == "Broken" for kind, _ in order) == 2

    wait_until(both_broke)
    for connection in dialler.link.dialled.values():
        assert [kind for kind, told in order if told == connection] in (["Broken"], ["Packet", "Broken"])


def test_closing_in_the_middle_is_clean(pair: tuple[End, End, dict[Lane, bytes]], ends: Ends) -> None:
    """A sender that closes with packets under way neither hangs nor harms the reader: what arrives is an unbroken prefix of what was sent."""
    listener, dialler, names = pair
    sent = 0
    while listener.link.send(names[Lane.FRAMES], b"%d" % sent, bytes(200_000)) is SendResult.SENT:
        sent += 1
    ends.close(listener)
    wait_until(lambda: dialler.link.dialled[Lane.FRAMES] in dialler.broken, dialler)
    assert dialler.headers == [b"%d" % i for i in range(len(dialler.packets))]
    assert all(len(payload) == 200_000 for _, _, payload in dialler.packets)
    assert len(dialler.packets) <= sent


def test_a_taken_address_is_told_at_once(ends: Ends) -> None:
    """A second listener on the same address is refused by an error that names it, and the first one keeps working."""
    listener = ends.listen()
    with pytest.raises(UnavailableError, match=re.escape(ends.listening.partition("?")[0])) as caught:
        ends.listen()
    assert caught.value.exit_code == 3
    meet(listener, ends.dial())


def test_an_unknown_connection_is_unreachable(ends: Ends) -> None:
    """A packet to a peer that never came is UNREACHABLE."""
    assert ends.listen().link.send(b"nobody", b"x", b"y") is SendResult.UNREACHABLE


def test_an_oversize_packet_is_not_delivered(pair: tuple[End, End, dict[Lane, bytes]]) -> None:
    """A packet above the limit costs its sender the connection, which comes back; the listener and the other lane stay up."""
    listener, dialler, _ = pair
    frames = dialler.link.dialled[Lane.FRAMES]
    send_until_sent(dialler, frames, b"huge", bytes(MAX_PAYLOAD_BYTES + 1), listener)
    wait_until(lambda: frames in dialler.broken, dialler, listener)
    meet(listener, dialler, b"still here ")
    assert b"huge" not in listener.headers


@pytest.mark.usefixtures("_sockets", "_open_to_all")
def test_foreign_packets_are_garbage(pair: tuple[End, End, dict[Lane, bytes]], ends: Ends) -> None:
    """A ZeroMQ stranger's packets of three or more parts are reported as garbage, its short ones as packets; the link stays up."""
    listener, dialler, _ = pair
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    stranger = context.socket(zmq.DEALER)
    try:
        stranger.connect(ends.address)
        stranger.send_multipart([b"a", b"b", b"c"])
        stranger.send_multipart([b""] * 50)
        stranger.send_multipart([b"", b""])
        stranger.send(b"\xc1" * 5000)
        wait_until(lambda: listener.garbage == 2 and b"\xc1" * 5000 in listener.headers, listener, dialler)
    finally:
        context.destroy(linger=0)
    meet(listener, dialler, b"still here ")


@pytest.mark.usefixtures("_sockets")
def test_strangers_without_zeromq_cost_nothing(pair: tuple[End, End, dict[Lane, bytes]], ends: Ends) -> None:
    """Random bytes, half a greeting or silence from plain sockets never yield a message, and the link stays up."""
    listener, dialler, names = pair
    kind, _, where = ends.address.partition("://")
    listener.packets.clear()
    strangers = []
    chance = random.Random(3)
    for words in (chance.randbytes(5000), b"\xff" + bytes(8) + b"\x7f\x03", b"GET / HTTP/1.1\r\n\r\n", b""):
        if kind == "tcp":
            stranger = socket.create_connection(("127.0.0.1", int(where.rpartition(":")[2])))
        else:
            stranger = socket.socket(socket.AF_UNIX)
            stranger.connect(where)
        strangers.append(stranger)
        with suppress(ConnectionError):  # the listener may hang up on such words
            stranger.sendall(words)
    meet(listener, dialler, b"still here ")
    for stranger in strangers:
        stranger.close()
    meet(listener, dialler, b"and now ")
    assert len([name for name, _, _ in listener.packets if name in names.values()]) == 4
    for name, header, payload in listener.packets:
        if name not in names.values():  # ZeroMQ takes what it can as packets of an old protocol version of its own
            with pytest.raises(ProtocolError):
                decode(header, payload)


def test_ipc_is_for_its_owner_only_and_takes_over_a_dead_socket(tmp_path: Path) -> None:
    """An ipc path has mode 0600, and the socket file left by a killed listener is reused."""
    path = tmp_path / "link"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    assert path.exists()
    ends = Ends(f"ipc://{path}", board_listens=True)
    listener, dialler = ends.listen(), ends.dial()
    mode = path.stat().st_mode
    assert stat.S_ISSOCK(mode)
    assert stat.S_IMODE(mode) == 0o600
    meet(listener, dialler)
    ends.close(listener)
    ends.close(dialler)


def test_ipc_never_removes_a_file_of_another_kind(tmp_path: Path) -> None:
    """A path that holds one of the user's files is refused, and the file stays unchanged."""
    path = tmp_path / "notes.txt"
    path.write_text("precious")
    with pytest.raises(UnavailableError, match=r"notes\.txt"):
        Ends(f"ipc://{path}", board_listens=True).listen()
    assert path.read_text() == "precious"
    with pytest.raises(UnavailableError, match="nowhere"):
        Ends(f"ipc://{tmp_path}/nowhere/link", board_listens=True).listen()
