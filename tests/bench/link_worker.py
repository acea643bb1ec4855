"""One end of one transport in its own process: `python -m tests.bench.link_worker ROLE TRANSPORT ADDRESS FOLDER FPS WARM_UP FRAMES`.

Serves bench_link. Every sender sends the frames of a folder at a steady rate (FPS 0: as fast as it goes) and stamps
each just before its send call. Every receiver stamps a frame when its bytes are usable. Both read CLOCK_MONOTONIC on
one machine. The first frames (WARM_UP) count neither towards the delays nor towards the CPU time. Prints one JSON
object.
"""

import importlib
import socket
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path

import msgpack
import zmq

from tests.bench.link_job import SILENCE_S, Job, Tally, pace
from tests.bench.machine import be_quiet

_TCP_HEAD = struct.Struct("<qqI")
"""Number, send time and size of a frame on the bare TCP connection."""


def send_null(job: Job) -> Tally:
    """Pace and send nothing: the cost of a sender before it sends."""
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
        connection.settimeout(SILENCE_S)
        while _fill(connection, buffer[: _TCP_HEAD.size]):
            number, sent_ns, size = _TCP_HEAD.unpack_from(buffer)
            if not _fill(connection, buffer[:size]):
                break
            tally.arrived(number, sent_ns, size)
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
        sock.setsockopt(zmq.RCVTIMEO, round(SILENCE_S * 1000))
        sock.bind(job.address)
        number = -1
        while number < job.frames - 1:
            try:
                header, payload = sock.recv_multipart(copy=False)
            except zmq.Again:
                break
            number, sent_ns, _, _ = msgpack.unpackb(header.buffer)
            tally.arrived(number, sent_ns, len(payload.buffer))
    return tally


Worker = Callable[[Job], Tally]

_OURS = ("tests.bench.link_ours", "send_tandemscan", "receive_tandemscan")
_WORKERS: dict[str, tuple[str, str, str]] = {
    "nothing": (__name__, "send_null", ""),
    "tcp": (__name__, "send_tcp", "receive_tcp"),
    "pyzmq": (__name__, "send_pyzmq", "receive_pyzmq"),
    "imagezmq": ("tests.bench.link_rivals", "send_imagezmq", "receive_imagezmq"),
    "imagezmq-pub": ("tests.bench.link_rivals", "send_imagezmq_pub", "receive_imagezmq_sub"),
    "netgear": ("tests.bench.link_rivals", "send_netgear", "receive_netgear"),
    "tandemscan": _OURS,
    "tandemscan-curve": _OURS,
    "tandemscan-ipc": _OURS,
    "tandemscan-serial": _OURS,
}
"""Module, sender and receiver of each transport; loaded by name, so that none pays for another's imports."""


def receives(transport: str) -> bool:
    """Whether a transport has a receiver."""
    return bool(_WORKERS[transport][2])


def main(arguments: list[str]) -> None:
    """Do one job."""
    role, transport, address, folder, *numbers = arguments
    fps, warm_up, frames = (int(number) for number in numbers)
    module, send, receive = _WORKERS[transport]
    worker: Worker = getattr(importlib.import_module(module), send if role == "send" else receive)
    be_quiet(0 if role == "send" else 1)
    print(worker(Job(address=address, folder=Path(folder), fps=fps, warm_up=warm_up, frames=frames)).report())


if __name__ == "__main__":
    main(sys.argv[1:])
