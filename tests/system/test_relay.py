"""The emulated line as a process, measured with plain sockets and terminals: our protocol is not involved."""

import os
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from phone_host.bench.emulate import NOTHING, PROFILES, Profile
from phone_host.bench.relay import RelayProcess, relay_process

PATIENCE_S = 60.0
NAMED = {profile.name: profile for profile in PROFILES}


@contextmanager
def line(kind: str, profile: Profile, folder: Path) -> Iterator[tuple[RelayProcess, int, int]]:
    """A relay with both ends open: its process and the descriptors of the board's and the host's end."""
    if kind == "serial":
        with relay_process(kind, "-", folder, profile) as relay:
            ends = [os.open(uri.removeprefix("serial:"), os.O_RDWR | os.O_NOCTTY) for uri in (relay.board, relay.host)]
            for end in ends:
                tty.setraw(end)
            try:
                yield relay, ends[0], ends[1]
            finally:
                for end in ends:
                    os.close(end)
        return
    family = socket.AF_INET if kind == "tcp" else socket.AF_UNIX
    with socket.socket(family) as board:
        board.bind(("127.0.0.1", 0) if kind == "tcp" else str(folder / "board"))
        board.listen()
        name = f"tcp://127.0.0.1:{board.getsockname()[1]}" if kind == "tcp" else f"ipc://{folder / 'board'}"
        with relay_process(kind, name, folder, profile) as relay, socket.socket(family) as host:
            address = relay.host.partition("://")[2]
            place, _, port = address.rpartition(":")
            host.connect((place, int(port)) if kind == "tcp" else address)
            board_end, _ = board.accept()
            with board_end:
                yield relay, board_end.fileno(), host.fileno()


def sent_all(descriptor: int, data: bytes) -> threading.Thread:
    """Write all of it in a thread."""

    def write() -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(descriptor, rest) :]

    thread = threading.Thread(target=write, daemon=True)
    thread.start()
    return thread


def read_all(descriptor: int, count: int, came: Callable[[int], None] = lambda _: None) -> bytes:
    """Read this many bytes; `came` is told how many there are so far."""
    data = bytearray()
    while len(data) < count:
        block = os.read(descriptor, 65536)
        assert block, "the line ended"
        data += block
        came(len(data))
    return bytes(data)


@pytest.mark.parametrize("kind", ["tcp", "ipc", "serial"])
def test_a_line_that_adds_nothing_gives_every_byte_both_ways(kind: str, tmp_path: Path) -> None:
    """A megabyte of all byte values comes out unaltered in both directions, and the account says so."""
    data = bytes(range(256)) * 4096
    with line(kind, NOTHING, tmp_path) as (relay, board, host):
        for source, target in ((board, host), (host, board)):
            writer = sent_all(source, data)
            assert read_all(target, len(data)) == data
            writer.join()
        account = relay.stop()
    assert (account.to_host_bytes, account.to_board_bytes, account.lost_bytes) == (len(data), len(data), 0)


@pytest.mark.parametrize("name", ["bluetooth", "usb-serial", "usb-ethernet", "ethernet"])
def test_the_rate_is_the_profiles(name: str, tmp_path: Path) -> None:
    """Bytes never arrive faster than the profile allows (beyond what the line holds), and somewhere in the run as fast as it allows.

    The second half waits for a stretch of half a second that reaches 85 % of the rate: a busy machine may take longer, but is never faster; a wrong rate is wrong by
    the share of a start bit, 20 %, or more.
    """
    profile = NAMED[name]
    stretch_bytes = int(profile.bytes_per_s / 2)
    with line(profile.carrier, profile, tmp_path) as (_, board, host):
        deadline = time.monotonic() + PATIENCE_S
        rates: list[float] = []
        while not rates or max(rates) < 0.85 * profile.bytes_per_s:
            assert time.monotonic() < deadline, f"{max(rates):.0f} bytes/s at most, {profile.bytes_per_s:.0f} asked for"
            writer = sent_all(board, bytes(stretch_bytes + profile.held_bytes))
            marks: list[tuple[float, int]] = []
            read_all(
                host,
                stretch_bytes + profile.held_bytes,
                lambda count, marks=marks: marks.append((time.monotonic(), count)),  # type: ignore[misc]
            )
            writer.join()
            # Count from the first bytes on: whatever came with them had waited in the line.
            (begun, before), (ended, after) = marks[0], marks[-1]
            rates.append((after - before) / (ended - begun))
            # A late reader finds at most what the line and the sockets behind it hold at once.
            assert after - before <= profile.bytes_per_s * (ended - begun) * 1.01 + profile.held_bytes + 128 * 1024


@pytest.mark.parametrize("name", ["bluetooth", "usb-serial", "usb-ethernet", "wifi"])
def test_the_delay_is_the_profiles(name: str, tmp_path: Path) -> None:
    """A single byte never arrives before the profile's delay, and some arrive within that delay plus jitter and 1 ms."""
    profile = replace(NAMED[name], stall_share=0.0)
    byte_s = 1 / profile.bytes_per_s
    late_s: list[float] = []
    with line(profile.carrier, profile, tmp_path) as (_, board, host):
        deadline = time.monotonic() + PATIENCE_S
        while len(late_s) < 50 or min(late_s) > (profile.delay_ns + 0.25 * profile.jitter_ns) / 1e9 + byte_s + 1e-3:
            assert time.monotonic() < deadline, f"least delay {min(late_s) * 1e3:.2f} ms"
            begun = time.monotonic()
            os.write(board, b"x")
            assert os.read(host, 1) == b"x"
            late_s.append(time.monotonic() - begun)
    assert min(late_s) >= profile.delay_ns / 1e9


def test_a_reader_that_does_not_read_is_felt_by_the_writer(tmp_path: Path) -> None:
    """The line holds little: if its peer does not read, a writer can put in no more than queue and buffers hold."""
    profile = NAMED["bluetooth"]
    with line("tcp", profile, tmp_path) as (_, board, host):
        with socket.socket(fileno=os.dup(board)) as board_socket:
            board_socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16 * 1024)
        os.set_blocking(board, False)
        taken = 0
        quiet_since = time.monotonic()
        while time.monotonic() - quiet_since < 1.0:
            try:
                taken += os.write(board, bytes(4096))
                quiet_since = time.monotonic()
            except BlockingIOError:
                time.sleep(0.01)
            # The limit: its own buffer, three of the relay's and the reader's (the latter as the system sizes it), and the line.
            assert taken < 1_000_000
        assert host >= 0


def test_the_end_of_one_side_is_told_to_the_other_behind_the_last_byte(tmp_path: Path) -> None:
    """If one side writes and closes, the other reads all of it and then the end, as over a cable."""
    profile = NAMED["wifi"]
    with line("tcp", profile, tmp_path) as (_, board, host):
        os.write(board, b"goodbye" * 1000)
        with socket.socket(fileno=os.dup(board)) as board_socket:
            board_socket.shutdown(socket.SHUT_WR)
        data = b""
        while block := os.read(host, 65536):
            data += block
        assert data == b"goodbye" * 1000


@pytest.mark.parametrize("kind", ["tcp", "ipc"])
def test_a_host_that_comes_before_the_board_is_kept_waiting(kind: str, tmp_path: Path) -> None:
    """While nobody listens at the board's end, a connection stays open, so that the host sees no peer hang up; it carries data once the board is there."""
    family = socket.AF_INET if kind == "tcp" else socket.AF_UNIX
    with socket.socket(family) as board, socket.socket(family) as host:
        board.bind(("127.0.0.1", 0) if kind == "tcp" else str(tmp_path / "board"))
        name = f"tcp://127.0.0.1:{board.getsockname()[1]}" if kind == "tcp" else f"ipc://{tmp_path / 'board'}"
        with relay_process(kind, name, tmp_path, NOTHING) as relay:
            address = relay.host.partition("://")[2]
            place, _, port = address.rpartition(":")
            host.connect((place, int(port)) if kind == "tcp" else address)
            host.settimeout(1.0)
            with pytest.raises(TimeoutError):  # bound, but nobody listens yet: ten attempts fail
                host.recv(1)
            board.listen()
            board.settimeout(PATIENCE_S)
            board_end, _ = board.accept()
            host.settimeout(PATIENCE_S)
            with board_end:
                board_end.sendall(b"x")
                assert host.recv(1) == b"x"
