"""Strangers at a board's tcp port, and a trusted host that sends nonsense: the stream goes on, the log stays short, memory stays bounded."""

import random
import resource
import socket
import struct
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import msgpack
import pytest
import zmq

from common.keys import KeyFolder
from common.link.curve import secure_dialler
from common.peers import Peer
from common.protocol.enrolment_wire import frame_word
from common.protocol.enrolment_words import Ask, Identity
from common.versions import PROTOCOL_VERSION
from tests.support.enrolment_rig import ports
from tests.support.numbered import write_film
from tests.support.programs import Program, board, host, lines, until
from tests.support.pulse import Pulse

_GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00"
_MOST_LINES = 12
"""A start takes six lines; strangers may add one every ten seconds."""

_MOST_KB = 24 * 1024
"""What a flood may cost: each of a thousand half-open connections takes about 10 KB in ZeroMQ."""


class Target:
    """A board with keys on every network, and a host that streams from it."""

    def __init__(self, agent: Program, port: int, folder: Path) -> None:
        self.agent, self.port, self.folder = agent, port, folder
        self.link = f"tcp://127.0.0.1:{port}"

    @property
    def memory_kb(self) -> int:
        """Resident memory of the board's process."""
        status = Path(f"/proc/{self.agent.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0])

    @property
    def descriptors(self) -> int:
        """Open files of the board's process."""
        return sum(1 for _ in Path(f"/proc/{self.agent.process.pid}/fd").iterdir())

    @property
    def log_lines(self) -> int:
        """Lines in the board's log."""
        return self.agent.stderr.count("\n")

    def dial(self) -> socket.socket:
        """Connect as a stranger."""
        return socket.create_connection(("127.0.0.1", self.port), timeout=10)

    @contextmanager
    def streaming(self) -> Iterator[Path]:
        """A host pairs frames during the block, and after it."""
        out = self.folder / "out"
        arguments = [
            "run",
            "--link",
            self.link,
            "--camera",
            f"replay:{self.folder / 'film'}?fps=30&loop=1",
            "--out",
            str(out),
        ]
        keys = ["--keys", str(self.folder / "h"), "--save-every", "0", "--log-level", "info"]
        with (
            host([*arguments, *keys], self.folder, "victim") as running,
            Pulse({"board": self.agent, "host": running}) as pulse,
        ):
            done = out / "delays.jsonl"
            until(lambda: lines(done) > 10 or running.process.poll() is not None, "frames come")
            yield done
            seen = lines(done)
            until(lambda: lines(done) > seen + 30 or running.process.poll() is not None, "frames still come")
            assert running.stop() == 0, running.stderr
            # Each side gives up the other after three seconds of silence; the pulse tells which of the two was silent.
            assert running.stderr.count("board_found") == 1, f"the stream was interrupted; {pulse.told}"


@pytest.fixture
def target(tmp_path: Path) -> Iterator[Target]:
    """A board that knows one host."""
    write_film(tmp_path / "film", 30)
    port = ports()
    board_keys, host_keys = KeyFolder(tmp_path / "b"), KeyFolder(tmp_path / "h")
    board_keys.add(Peer(name="victim", key=host_keys.own().public, added=""))
    host_keys.add(Peer(name="board", key=board_keys.own().public, added="", address=f"tcp://127.0.0.1:{port}"))
    camera = f"replay:{tmp_path / 'film'}?fps=30&loop=1"
    with board(
        ["run", "--camera", camera, "--link", f"tcp://*:{port}", "--keys", str(tmp_path / "b")], tmp_path
    ) as agent:
        until(lambda: " serving " in agent.stderr, "the board serves")
        made = Target(agent, port, tmp_path)
        yield made
        assert agent.process.poll() is None, agent.stderr
        assert "Traceback" not in agent.stderr
        assert agent.stop() == 0


def test_strangers_do_not_disturb_a_stream(target: Target) -> None:
    """Random bytes, HTTP, half a greeting, a greeting of another mechanism, silence and single bytes: none of it is heard."""
    chance = random.Random(1)
    null_greeting = _GREETING + b"NULL".ljust(20, b"\0") + bytes(32)
    curve_greeting = _GREETING + b"CURVE".ljust(20, b"\0") + bytes(32)
    words = (
        *(chance.randbytes(size) for size in (1, 9, 64, 4096, 200_000)),
        b"GET / HTTP/1.1\r\nHost: board\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(500),
        _GREETING,
        null_greeting + b"\x04\x19\x05READY" + bytes(19),
        curve_greeting + b"\x04\xc8\x05HELLO" + chance.randbytes(194),
        curve_greeting + b"\x06" + struct.pack(">Q", 2**62) + bytes(100),
        b"",
    )
    with target.streaming(), ExitStack() as held:
        before_kb = target.memory_kb
        for word in words * 3:
            stranger = held.enter_context(target.dial())
            with suppress(ConnectionError):
                stranger.sendall(word)
        slow = held.enter_context(target.dial())
        for byte in null_greeting:
            with suppress(ConnectionError):
                slow.sendall(bytes((byte,)))
        until(lambda: target.descriptors < 40, "those who say nothing sensible are hung up on")
        assert target.memory_kb - before_kb < _MOST_KB
    assert target.log_lines <= _MOST_LINES, target.agent.stderr


def test_thousands_of_connections(target: Target) -> None:
    """3000 short connections and 350 that stay open, more than the board may have: the stream goes on, and all descriptors are released."""
    with target.streaming():
        before_kb, before_files = target.memory_kb, target.descriptors
        for _ in range(3000):
            with suppress(OSError):
                target.dial().close()
        resource.prlimit(target.agent.process.pid, resource.RLIMIT_NOFILE, (256, 4096))
        with ExitStack() as held:
            for _ in range(350):
                with suppress(OSError):
                    held.enter_context(target.dial())
            assert target.memory_kb - before_kb < _MOST_KB
            until(lambda: target.descriptors <= before_files + 5, "the silent ones are hung up on")
        assert target.memory_kb - before_kb < _MOST_KB
    assert target.log_lines <= _MOST_LINES, target.agent.stderr


def test_unknown_keys_get_nothing(target: Target) -> None:
    """A hundred machines with keys of their own, which know the board's key: none is heard, and together they cost a line or two in the log."""
    peer = Peer(name="board", key=KeyFolder(target.folder / "b").own().public, added="", address=target.link)
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        with target.streaming():
            before_kb = target.memory_kb
            strangers, monitors = [], []
            for number in range(100):
                keys = KeyFolder(target.folder / f"stranger{number}")
                sock = context.socket(zmq.DEALER)
                monitors.append(sock.get_monitor_socket(zmq.EVENT_HANDSHAKE_FAILED_AUTH))
                secure_dialler(sock, keys.own(), peer)
                sock.connect(target.link)
                sock.send(b"let me in")
                strangers.append(sock)
            until(lambda: all(monitor.poll(0) for monitor in monitors), "all are sent away")
            assert target.memory_kb - before_kb < _MOST_KB
            for sock in strangers:
                assert not sock.poll(0)
    finally:
        context.destroy(linger=0)
    assert 1 <= target.agent.stderr.count("key_denied") <= 6
    assert target.log_lines <= _MOST_LINES + 5, target.agent.stderr
    assert "garbage" not in target.agent.stderr


def test_an_allowed_host_that_talks_nonsense(target: Target) -> None:
    """A peer with the right key can send anything: an oversized packet costs it its connection, an invalid message is counted, nothing is kept."""
    keys = KeyFolder(target.folder / "h")
    chance = random.Random(2)
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    nonsense = (
        [chance.randbytes(100)],
        [b"\x91" * 2000],
        [b"\xdd\xff\xff\xff\xff"],
        [b"\xc6\xff\xff\xff\xff"],
        [msgpack.packb([PROTOCOL_VERSION, 0, "x" * 500, 0])],
        [msgpack.packb([PROTOCOL_VERSION, 0])],
        [msgpack.packb([2**63, 0])],
        [msgpack.packb([PROTOCOL_VERSION + 1, 0])],
        [b""],
        [b"", b"", b"", b""],
        [msgpack.packb([PROTOCOL_VERSION, 5, "s", *range(9)]), b"image"],
    )
    try:
        with target.streaming():
            before_kb = target.memory_kb
            fool = context.socket(zmq.DEALER)
            fool.setsockopt(zmq.SNDHWM, 4)
            fool.setsockopt(zmq.RECONNECT_IVL, 1)
            secure_dialler(fool, keys.own(), keys.peers()[0])
            monitor = fool.get_monitor_socket(zmq.EVENT_DISCONNECTED)
            fool.connect(target.link)
            for _ in range(300):
                fool.send_multipart(list(chance.choice(nonsense)))
            for number in range(5):
                fool.send_multipart([b"header", bytes(16_000_000)])
                until(lambda: bool(monitor.poll(0)), f"oversize {number} costs the connection")
                monitor.recv_multipart()
            assert target.memory_kb - before_kb < _MOST_KB
    finally:
        context.destroy(linger=0)
    assert "garbage" in target.agent.stderr
    assert target.log_lines <= _MOST_LINES + 10, target.agent.stderr


def test_garbage_at_the_door(target: Target) -> None:
    """While the owner enrols a host: garbage, an endless ZeroMQ message, drops of bytes, endless questions, silence by the hundred.

    The door keeps only a few callers, for seconds, and their last words; the log gets a few lines; the stream goes on, and the owner's host is paired.
    """
    chance = random.Random(3)
    endless = _GREETING + b"NULL".ljust(20, b"\0") + bytes(32) + (b"\x01\xff" + bytes(255)) * 1000
    asks = b"".join(frame_word(Ask(Identity(chance.randbytes(32), f"host{number}"))) for number in range(1000))
    words = (*(chance.randbytes(size) for size in (1, 9, 300, 100_000)), endless, asks, b"\xff" * 100, b"\0", b"")
    with target.streaming(), ExitStack() as held:
        owner = held.enter_context(board(["pair", "--keys", str(target.folder / "b")], target.folder, "pair"))
        until(lambda: "type this code" in owner.out.read_text(), "the door is open")
        door = ("127.0.0.1", target.port + 1)
        before_kb, before_files = target.memory_kb, target.descriptors
        slow = held.enter_context(socket.create_connection(door, timeout=10))
        for word in words * 60:
            caller = held.enter_context(socket.create_connection(door, timeout=10))
            caller.settimeout(0)
            with suppress(OSError):
                caller.send(word)
            with suppress(OSError):
                slow.send(b"\xfe")
            assert target.descriptors <= before_files + 20, "a few callers at a time"
        assert target.memory_kb - before_kb < 1024, "what callers say is not kept"
        until(lambda: target.descriptors <= before_files, "the silent ones are hung up on")
        until(lambda: "pairing_garbage" in target.agent.stderr, "the log tells of it")
        code = owner.out.read_text().split()[-1]
        keys = ["--link", target.link, "--keys", str(target.folder / "new"), "--code", code]
        with host(["pair", *keys], target.folder, "new") as pairing:
            assert pairing.wait() == 0, pairing.stderr
    assert target.log_lines <= _MOST_LINES + 10, target.agent.stderr


def test_a_forgotten_host_gets_no_more_frames(target: Target) -> None:
    """A host that is forgotten while it streams is cut off, though its connection is alive; another key of the same name would be let in."""
    out = target.folder / "out"
    arguments = [
        "run",
        "--link",
        target.link,
        "--camera",
        f"replay:{target.folder / 'film'}?fps=30&loop=1",
        "--out",
        str(out),
    ]
    keys = ["--keys", str(target.folder / "h"), "--save-every", "0", "--log-level", "info"]
    with host([*arguments, *keys], target.folder, "victim") as running:
        until(lambda: lines(out / "delays.jsonl") > 10, "frames come")
        folder = KeyFolder(target.folder / "b")
        folder.forget("victim")
        folder.add(Peer(name="victim", key=KeyFolder(target.folder / "other").own().public, added=""))
        until(lambda: "host_gone" in target.agent.stderr, "the board hears it no longer")
        until(lambda: "board_gone" in running.stderr, "the host notices")
        assert running.stop() == 0, running.stderr
    assert target.agent.stderr.count("host_connected") == 1
