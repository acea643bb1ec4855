"""Crowds at a board's port, a host camera that sends bombs, programs that are stopped and killed, and noise on a wire."""

import os
import random
import resource
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Final

from tests.support.mjpeg_server import MjpegServer
from tests.support.numbered import saved_numbers
from tests.support.programs import Program, board, free_port, until
from tests.support.pty_line import PtyLine
from tests.system.hostile.attack import Attack, Outcome, Rounds
from tests.system.hostile.scene import FPS, Watched, board_and_host, board_arguments, film, scene
from tests.system.hostile.shim import stopped

_LIMIT: Final = 256
_CALLERS: Final = 400
_MEASURED_S: Final = 5.0
_MOST_CPU: Final = 0.1
"""Share of a core, at the limit of file descriptors."""

_BOMBS_COME: Final = 120
"""Pairs from the first one to those after the bombs, which the server sends as numbers 120 to 129."""

_GREETING: Final = b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32)
_READY: Final = b"\x05READY\x0bSocket-Type\x00\x00\x00\x06DEALER"
_PEER: Final = _GREETING + b"\x04" + bytes((len(_READY),)) + _READY
"""All that ZeroMQ requires of a peer (ZMTP 3.1): after this it keeps the connection as long as the peer likes."""


def cpu_s(program: Program) -> float:
    """Processor time that a process has used, proc_stat(5)."""
    fields = Path(f"/proc/{program.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _dial(port: int) -> socket.socket:
    caller = socket.socket()
    caller.settimeout(0)
    with suppress(BlockingIOError):
        caller.connect(("127.0.0.1", port))
    return caller


def _descriptors(folder: Path, rounds: Rounds) -> Outcome:
    """More callers than the board has descriptors, each a valid peer that stays: the board stays nearly idle, and frames keep flowing."""
    outcome = Outcome()
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    with board_and_host(folder, addresses=(address, address)) as (agent, watched):
        resource.prlimit(agent.process.pid, resource.RLIMIT_NOFILE, (_LIMIT, 4096))
        for _ in rounds:
            with ExitStack() as held:
                for caller in [held.enter_context(_dial(port)) for _ in range(_CALLERS)]:
                    with suppress(OSError):
                        caller.send(_PEER)
                time.sleep(0.5)
                before_s, began = cpu_s(agent), time.monotonic()
                time.sleep(_MEASURED_S)
                share = (cpu_s(agent) - before_s) / (time.monotonic() - began)
                outcome.figures.append(f"{100 * share:.1f} % of a core")
                if share > _MOST_CPU:
                    outcome.slow.append(f"the board takes {100 * share:.0f} % of a core")
                watched.cause_gone(outcome, "more callers than descriptors")
            watched.cause_gone(outcome, "callers that left")
        report = watched.stop(outcome)
        outcome.expect(bool(report) and report["connects"] == 1, "the stream was interrupted")
        Watched(agent).judge_log(outcome)
        outcome.expect(agent.stop() == 0, "the board did not end with 0")
    return outcome


def _http(folder: Path, rounds: Rounds) -> Outcome:
    """The host's own camera is an HTTP server that sends bombs."""
    outcome = Outcome()
    for number in rounds:
        within = folder / str(number)
        within.mkdir()
        server = MjpegServer(film(), FPS, "bomb_burst")
        try:
            with board_and_host(within, own=f"{server.uri}?latency_ms=0") as (_, watched):
                resource.prlimit(watched.receiver.process.pid, resource.RLIMIT_AS, (6 * 2**30, 6 * 2**30))
                watched.more(_BOMBS_COME)
                watched.cause_gone(outcome, "bombs from the own camera")
                watched.stop(outcome)
        finally:
            server.stop()
    return outcome


def _both_stopped(folder: Path, rounds: Rounds) -> Outcome:
    """Both programs stand still for longer than the silence timeout; the link never broke, and nobody says hello again."""
    outcome = Outcome()
    with board_and_host(folder) as (agent, watched):
        for _ in rounds:
            with stopped(agent, watched.receiver):
                time.sleep(3.3)
            watched.cause_gone(outcome, "both stood still")
        report = watched.stop(outcome)
        if report:
            outcome.expect(report["connects"] == 1, f"greeted {report['connects']} times over a link that never broke")
            lost = report["links"][0]["lost"]
            outcome.expect(not lost, f"a link that never broke was lost {lost} times")
        said = agent.stderr.count("host_connected")
        outcome.expect(said == 1, f"the board met its host {said} times")
    return outcome


def _stop_storm(folder: Path, rounds: Rounds) -> Outcome:
    """Either program, or both, stops and continues again and again, for moments and for seconds."""
    outcome, chance = Outcome(), random.Random(4)
    with board_and_host(folder) as (agent, watched):
        for _ in rounds:
            for _ in range(8):
                programs = chance.choice(((agent,), (watched.receiver,), (agent, watched.receiver)))
                with stopped(*programs):
                    time.sleep(chance.choice((0.01, 0.05, 0.2, 0.6)))
                time.sleep(chance.uniform(0, 0.2))
            watched.cause_gone(outcome, "a storm of stops")
        watched.stop(outcome)
        outcome.expect(agent.stop() == 0, "the board did not end with 0")
    return outcome


def _board_killed(folder: Path, rounds: Rounds) -> Outcome:
    """The board is killed and started again, three times a round."""
    outcome = Outcome()
    address = f"tcp://127.0.0.1:{free_port()}"
    lives = 0
    with ExitStack() as held:
        watched = held.enter_context(scene(folder, address=address))
        for _ in rounds:
            for _ in range(3):
                lives += 1
                with board(board_arguments(address), folder, f"board{lives}") as agent:
                    until(lambda: " serving " in agent.stderr, "the board serves")
                    watched.cause_gone(outcome, "the board's death")
                    if lives == 1:
                        watched.watched.now_is_normal()
                    agent.send(signal.SIGKILL)
                    agent.wait()
        watched.stop(outcome)
    return outcome


def _host_killed(folder: Path, rounds: Rounds) -> Outcome:
    """The host is killed and started again; the board gives the next host fresh frames."""
    outcome = Outcome()
    address = f"tcp://127.0.0.1:{free_port()}"
    with board(board_arguments(address), folder) as agent:
        until(lambda: " serving " in agent.stderr, "the board serves")
        for number in rounds:
            for life in range(3):
                within = folder / f"{number}-{life}"
                within.mkdir()
                with scene(within, address=address) as watched:
                    watched.settle()
                    if life < 2:
                        watched.receiver.send(signal.SIGKILL)
                        watched.receiver.wait()
                        watched.judge_pairs(outcome)
                    else:
                        watched.stop(outcome)
        outcome.expect(agent.stop() == 0, "the board did not end with 0")
    return outcome


def _noise(chance: random.Random) -> Callable[[bytes], bytes]:
    """Now and then a byte is flipped, lost or inserted."""

    def spoil(data: bytes) -> bytes:
        if chance.random() > 0.05:
            return data
        at = chance.randrange(len(data))
        middle = chance.choice(
            (bytes((data[at] ^ 1 << chance.randrange(8),)), b"", data[at : at + 1] + chance.randbytes(3))
        )
        return data[:at] + middle + data[at + 1 :]

    return spoil


@contextmanager
def _noisy(cable: PtyLine, seed: int) -> Iterator[None]:
    for number, way in enumerate(cable.ways):
        way.spoil = _noise(random.Random(2 * seed + number))
    try:
        yield
    finally:
        for way in cable.ways:
            way.spoil = bytes


def _wire(folder: Path, rounds: Rounds) -> Outcome:
    """A serial cable that spoils bytes in both directions; pairs are judged by image content as well."""
    outcome = Outcome()
    with PtyLine(folder, bytes_per_s=3e6, delay_ns=300_000) as cable:
        options = ("--save-every", "1")
        with board_and_host(folder, addresses=cable.uris, options=options) as (agent, watched):
            for number in rounds:
                with _noisy(cable, number):
                    time.sleep(4)
                watched.cause_gone(outcome, "noise on the wire")
            report = watched.stop(outcome)
            outcome.expect(agent.stop() == 0, "the board did not end with 0")
            lost = sum(session["lost"] for session in report["sessions"]) if report else 0
            outcome.figures.append(f"{lost} frames lost")
        numbers = saved_numbers(folder / "out")
        outcome.wrong += sum(left != right for left, right in numbers)
    return outcome


DESCRIPTORS: Final = Attack(
    "callers beyond the descriptors", f"{_CALLERS} peers that stay, {_LIMIT} descriptors", _descriptors
)
HTTP: Final = Attack("bombs over HTTP", "ten JPEGs that claim 30000x30000 from the own camera", _http)
BOTH_STOPPED: Final = Attack("both stopped", "SIGSTOP for 3.3 s on both at once", _both_stopped)
STORM: Final = Attack("stop storm", "SIGSTOP and SIGCONT on either or both, 8 a round", _stop_storm)
BOARD_KILLED: Final = Attack("kill -9: board", "killed and started again, 3 a round", _board_killed)
HOST_KILLED: Final = Attack("kill -9: host", "killed and started again, 3 a round", _host_killed)
WIRE: Final = Attack("noise on a serial line", "5 % of all pieces with a byte flipped, lost or put in", _wire)

SHORT: Final = (DESCRIPTORS, BOTH_STOPPED, STORM, BOARD_KILLED, WIRE)
LONG: Final = (*SHORT, HTTP, HOST_KILLED)
