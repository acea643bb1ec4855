"""One end of one transport in a process of its own, for bench_link: `python -m tests.bench.link_worker ROLE TRANSPORT ADDRESS FOLDER FPS WARM_UP FRAMES`.

Every sender shows the frames of a folder at a steady rate and stamps each just before its send call; every receiver stamps a frame when its
bytes are usable. Both read CLOCK_MONOTONIC of one machine. The first frames (WARM_UP) are left out, of the delays as of the CPU time.
Prints one JSON object.
"""

import json
import resource
import socket
import struct
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgpack
import zmq

from tests.bench.machine import be_quiet
from tests.support.unheard import Unheard

_SILENCE_S = 3.0
_TCP_HEAD = struct.Struct("<qqI")
"""Number, send time and size of a frame on the bare TCP connection."""


@dataclass(slots=True)
class Tally:
    """What one end saw.

    Attributes:
        warm_up: frames before the measurement.
        frames: frames in all.
    """

    warm_up: int
    frames: int
    delays_ns: list[int] = field(default_factory=list)
    _cpu: list[tuple[int, float]] = field(default_factory=list)

    def passed(self, number: int) -> None:
        """Take note that a frame has gone through this end; CPU time counts from the end of the warm-up to the last frame."""
        if number >= self.warm_up - 1 and (not self._cpu or number == self.frames - 1):
            usage = resource.getrusage(resource.RUSAGE_SELF)
            self._cpu.append((number, usage.ru_utime + usage.ru_stime))

    def arrived(self, number: int, sent_ns: int) -> None:
        """Take note that a frame's bytes are usable."""
        now_ns = time.monotonic_ns()
        if number >= self.warm_up:
            self.delays_ns.append(now_ns - sent_ns)
        self.passed(number)

    def report(self) -> str:
        """The JSON object."""
        per_frame = float("nan")
        if len(self._cpu) == 2:
            (first, before_s), (last, after_s) = self._cpu
            per_frame = (after_s - before_s) / (last - first) * 1e6
        return json.dumps({"cpu_us_per_frame": per_frame, "delays_ns": self.delays_ns})


@dataclass(frozen=True, slots=True)
class Job:
    """What a worker is asked for."""

    address: str
    folder: Path
    fps: int
    warm_up: int
    frames: int

    def tally(self) -> Tally:
        """An empty tally for it."""
        return Tally(self.warm_up, self.frames)

    def payloads(self) -> list[bytes]:
        """The folder's images."""
        return [path.read_bytes() for path in sorted(self.folder.iterdir())]

    @property
    def endpoint(self) -> tuple[str, int]:
        """Host and port."""
        host, _, port = self.address.removeprefix("tcp://").rpartition(":")
        return host, int(port)


def pace(job: Job, send: Callable[[int, bytes], object]) -> Tally:
    """Show frames at a steady rate, as every sender but ours does."""
    payloads, tally = job.payloads(), job.tally()
    start_s = time.monotonic()
    for number in range(job.frames):
        wait_s = start_s + number / job.fps - time.monotonic()
        if wait_s > 0:
            time.sleep(wait_s)
        send(number, payloads[number % len(payloads)])
        tally.passed(number)
    return tally


def send_null(job: Job) -> Tally:
    """Pace and send nothing: what a sender costs before it sends."""
    return pace(job, lambda _number, _payload: None)


def send_tcp(job: Job) -> Tally:
    """Bare TCP: one sendmsg for header and payload."""
    with _dial(job) as sock:

        def send(number: int, payload: bytes) -> None:
            parts = [_TCP_HEAD.pack(number, time.monotonic_ns(), len(payload)), payload]
            sent = sock.sendmsg(parts)
            if sent < len(parts[0]) + len(payload):
                sock.sendall(memoryview(payload)[sent - len(parts[0]) :])

        return pace(job, send)


def receive_tcp(job: Job) -> Tally:
    """Bare TCP: recv_into one buffer."""
    tally, buffer = job.tally(), memoryview(bytearray(2 << 20))
    with socket.create_server(job.endpoint) as server:
        connection, _ = server.accept()
    with connection:
        connection.settimeout(_SILENCE_S)
        while _fill(connection, buffer[: _TCP_HEAD.size]):
            number, sent_ns, size = _TCP_HEAD.unpack_from(buffer)
            if not _fill(connection, buffer[:size]):
                break
            tally.arrived(number, sent_ns)
    return tally


def _dial(job: Job) -> socket.socket:
    deadline_s = time.monotonic() + 10
    while True:
        try:
            sock = socket.create_connection(job.endpoint)
        except ConnectionRefusedError:
            if time.monotonic() > deadline_s:
                raise
            time.sleep(0.02)
        else:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return sock


def _fill(connection: socket.socket, view: memoryview) -> bool:
    done = 0
    while done < len(view):
        got = connection.recv_into(view[done:])
        if not got:
            return False
        done += got
    return True


def send_pyzmq(job: Job) -> Tally:
    """Bare pyzmq: PUSH, msgpack header, copy=False."""
    with zmq.Context() as context, context.socket(zmq.PUSH) as sock:
        sock.connect(job.address)

        def send(number: int, payload: bytes) -> None:
            sock.send_multipart([msgpack.packb([number, time.monotonic_ns(), 640, 480]), payload], copy=False)

        return pace(job, send)


def receive_pyzmq(job: Job) -> Tally:
    """Bare pyzmq: PULL, copy=False."""
    tally = job.tally()
    with zmq.Context() as context, context.socket(zmq.PULL) as sock:
        sock.setsockopt(zmq.RCVTIMEO, round(_SILENCE_S * 1000))
        sock.bind(job.address)
        number = -1
        while number < job.frames - 1:
            try:
                header, payload = sock.recv_multipart(copy=False)
            except zmq.Again:
                break
            number, sent_ns, _, _ = msgpack.unpackb(header.buffer)
            assert len(payload.buffer)
            tally.arrived(number, sent_ns)
    return tally


def send_imagezmq(job: Job) -> Tally:
    """Rival imagezmq as its examples use it: REQ/REP."""
    import imagezmq  # noqa: PLC0415 - an extra that need not be there

    sender = imagezmq.ImageSender(connect_to=job.address)
    return pace(job, lambda number, payload: sender.send_jpg(f"{number} {time.monotonic_ns()}", payload))


def receive_imagezmq(job: Job) -> Tally:
    """Rival imagezmq: hub with replies."""
    import imagezmq  # noqa: PLC0415 - an extra that need not be there

    tally = job.tally()
    hub = imagezmq.ImageHub(open_port=job.address)
    hub.zmq_socket.setsockopt(zmq.RCVTIMEO, round(_SILENCE_S * 1000))
    number = -1
    while number < job.frames - 1:
        try:
            text, payload = hub.recv_jpg()
        except zmq.Again:
            break
        number, sent_ns = (int(part) for part in text.split())
        assert len(payload)
        tally.arrived(number, sent_ns)
        hub.send_reply()
    return tally


def send_tandemscan(job: Job) -> Tally:
    """Our board: the whole agent with a replay camera, as `board-agent run` puts it together."""
    from fractions import Fraction  # noqa: PLC0415 - the other transports shall not pay for our imports

    from board_agent.agent import Agent  # noqa: PLC0415
    from common import now  # noqa: PLC0415
    from common.camera.base import Ended, Grab  # noqa: PLC0415
    from common.camera.replay import ReplayCamera, ReplaySettings  # noqa: PLC0415
    from common.link.factory import open_link, parse_link  # noqa: PLC0415

    tally = job.tally()

    class Metered(ReplayCamera):
        """Reads the meter where the other senders do, and ends after the last frame."""

        _shown = -1

        def read(self, now_ns: int) -> list[Grab]:
            if self._shown >= job.frames - 1:
                tally.passed(self._shown)
                return [Ended()]
            grabs = super().read(now_ns)
            for _ in grabs:
                tally.passed(self._shown)
                self._shown += 1
            return grabs

    camera = Metered(ReplaySettings(str(job.folder), Fraction(job.fps), loop=True), now.monotonic_ns())
    link = open_link(parse_link(job.address, listens_by_default=True))
    reader, writer = socket.socketpair()
    with reader, writer:
        Agent(camera, [link], now.random_id(), now.boot_id(), reader).run()
    link.close()
    return tally


def receive_tandemscan(job: Job) -> Tally:
    """Our host: the receiver with session, clock and credit."""
    from common import now  # noqa: PLC0415 - the other transports shall not pay for our imports
    from common.link.factory import open_link, parse_link  # noqa: PLC0415
    from common.protocol.message import FrameMessage  # noqa: PLC0415
    from phone_host.model import BoardFrame  # noqa: PLC0415
    from phone_host.pairqueue import PairQueue  # noqa: PLC0415
    from phone_host.receiver import Receiver  # noqa: PLC0415
    from phone_host.sync.fifo import FifoSettings  # noqa: PLC0415

    tally = job.tally()

    class Stamping(Receiver):
        """Stamps frames when they are decoded and the session has taken them."""

        def _accept_frame(self, frame: FrameMessage, lost: int, now_ns: int) -> None:
            assert len(frame.payload)
            tally.arrived(frame.sequence, frame.marks.sent_ns)
            super()._accept_frame(frame, lost, now_ns)

    class NoPairing(PairQueue):
        """Ends the frames' way: pairing is no part of a link."""

        def add_board(self, frame: BoardFrame) -> None:
            pass

    queue = NoPairing(FifoSettings(), None, 1_000_000_000 // job.fps)
    link = open_link(parse_link(job.address, listens_by_default=False))
    receiver = Stamping(link, now.random_id(), queue, Unheard())
    receiver.start()
    while not receiver.ended and receiver.failure is None:
        time.sleep(0.1)
    receiver.stop()
    return tally


SENDERS: dict[str, Callable[[Job], Tally]] = {
    "nothing": send_null,
    "tcp": send_tcp,
    "pyzmq": send_pyzmq,
    "imagezmq": send_imagezmq,
    "tandemscan": send_tandemscan,
}
RECEIVERS: dict[str, Callable[[Job], Tally]] = {
    "tcp": receive_tcp,
    "pyzmq": receive_pyzmq,
    "imagezmq": receive_imagezmq,
    "tandemscan": receive_tandemscan,
}


def main(arguments: list[str]) -> None:
    """Do one job."""
    role, transport, address, folder, *numbers = arguments
    fps, warm_up, frames = (int(number) for number in numbers)
    job = Job(address, Path(folder), fps, warm_up, frames)
    be_quiet(0 if role == "send" else 1)
    workers: dict[str, Any] = SENDERS if role == "send" else RECEIVERS
    print(workers[transport](job).report())


if __name__ == "__main__":
    main(sys.argv[1:])
