"""One end of a serial line in its own process, for bench_serial. Prints one JSON object.

`python -m tests.bench.serial_worker send FRAMING DEVICE FRAMES FRAME_BYTES`, `… receive FRAMING DESCRIPTOR FRAMES
FRAME_BYTES`, and `… host DEVICE SECONDS`: the host's role of the protocol against a real board-agent; it records every
echo and every frame.
"""

import json
import os
import random
import resource
import select
import struct
import sys
import time
import tty
from collections.abc import Iterator
from zlib import crc32

import zmq

from common import now
from common.frame import PixelFormat
from common.ledger import BoardMarks
from common.link.base import Packet, SendResult
from common.link.factory import open_link, parse_link
from common.link.stream import StreamLink
from common.protocol.framing import LinkEnd
from common.protocol.host_session import HostSession
from common.protocol.message import FrameMessage, Lane
from common.protocol.session import Arrived, Echo, Outgoing, Output, connection_name
from common.protocol.wire import decode, encode_stamped
from tests.bench.link_ours import OpenLine
from tests.bench.machine import be_quiet

_CRC = struct.Struct("<I")
_LENGTHS = struct.Struct("<II")


def cpu_s() -> float:
    """CPU time of this process so far."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def write_all(descriptor: int, data: bytes) -> None:
    """Write all data to a blocking descriptor."""
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]


def send_bare(framing: str, device: str, frames: int, frame: bytes) -> dict[str, float]:
    """Send in a bare loop: each frame with its CRC-32, as one COBS packet or after its length."""
    descriptor = os.open(device, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(descriptor)
    write_all(descriptor, b"\0")
    os.read(descriptor, 1)  # the receiver is ready
    before = cpu_s()
    if framing == "cobs":
        from cobs import cobs  # noqa: PLC0415 - only where it is asked for

        for _ in range(frames):
            write_all(descriptor, cobs.encode(frame + _CRC.pack(crc32(frame))) + b"\0")
    else:
        for _ in range(frames):
            lengths = _LENGTHS.pack(len(frame), crc32(_CRC.pack(len(frame))))
            write_all(descriptor, b"".join((lengths, frame, _CRC.pack(crc32(frame)))))
    used = cpu_s() - before
    os.read(descriptor, 1)  # everything has arrived; closing earlier would discard it
    return {"cpu_us_per_frame": used / frames * 1e6}


def receive_bare(framing: str, descriptor: int, frames: int) -> dict[str, float]:
    """Receive what `send_bare` sends."""
    os.read(descriptor, 1)
    os.write(descriptor, b"\0")
    packets = _cobs_packets(descriptor) if framing == "cobs" else _length_packets(descriptor)
    begun, before = 0, cpu_s()
    size = 0
    for count, (size, sound) in enumerate(packets, 1):  # noqa: B007 - the last one is used
        assert sound
        begun = begun or time.monotonic_ns()
        if count == frames:
            break
    took_s = (time.monotonic_ns() - begun) / 1e9
    used = cpu_s() - before
    os.write(descriptor, b"\0")
    return {"mb_per_s": (frames - 1) * size / took_s / 1e6, "cpu_us_per_frame": used / frames * 1e6}


def _cobs_packets(descriptor: int) -> Iterator[tuple[int, bool]]:
    from cobs import cobs  # noqa: PLC0415 - only where it is asked for

    parts: list[bytes] = []
    while True:
        data = os.read(descriptor, 65536)
        while (end := data.find(b"\0")) >= 0:
            parts.append(data[:end])
            packet = cobs.decode(b"".join(parts))
            yield len(packet) - 4, crc32(memoryview(packet)[:-4]) == _CRC.unpack_from(packet, len(packet) - 4)[0]
            parts, data = [], data[end + 1 :]
        if data:
            parts.append(data)


def _length_packets(descriptor: int) -> Iterator[tuple[int, bool]]:
    buffer = bytearray()
    while True:
        while len(buffer) < _LENGTHS.size:
            buffer += os.read(descriptor, 65536)
        size, check = _LENGTHS.unpack_from(buffer)
        assert check == crc32(_CRC.pack(size))
        end = _LENGTHS.size + size + 4
        while len(buffer) < end:
            buffer += os.read(descriptor, 65536)
        yield size, crc32(memoryview(buffer)[8 : end - 4]) == _CRC.unpack_from(buffer, end - 4)[0]
        buffer = buffer[end:]


def send_ours(device: str, frames: int, payload: bytes) -> dict[str, float]:
    """Send over our link with our messages, as the board does."""
    link = open_link(parse_link(f"serial:{device}", listens_by_default=True))
    poller = zmq.Poller()
    poller.register(link.pollables[0], zmq.POLLIN)
    connection, sent, ended, before = b"", 0, False, 0.0
    marks = BoardMarks(exposed_ns=0, grabbed_ns=0, sent_ns=0)
    while not ended:
        wait_ns = link.due_ns - now.monotonic_ns()
        poller.poll(min(1000, max(0, -(-wait_ns // 1_000_000))))
        for incoming in link.receive():
            if isinstance(incoming, Packet) and bytes(incoming.header) == b"hello":
                connection, before = incoming.connection, cpu_s()
            elif isinstance(incoming, Packet):
                ended = True
        while connection and sent < frames and link.ready(connection):
            message = FrameMessage(
                session="session",
                sent_index=sent,
                sequence=sent,
                width_px=640,
                height_px=480,
                pixel_format=PixelFormat.MJPEG,
                exposure_ns=None,
                marks=marks,
                payload=payload,
            )
            header, body = encode_stamped(message, now.monotonic_ns)
            if link.send(connection, header, body) is SendResult.SENT:
                sent += 1
    used = cpu_s() - before
    link.close()
    return {"cpu_us_per_frame": used / frames * 1e6}


def receive_ours(descriptor: int, frames: int) -> dict[str, float]:
    """Receive what `send_ours` sends."""
    link = StreamLink("serial", LinkEnd.DIALLER, lambda: OpenLine(descriptor))
    poller = zmq.Poller()
    poller.register(link.pollables[0], zmq.POLLIN)
    greeted, count, begun, size, before = False, 0, 0, 0, 0.0
    while count < frames:
        wait_ns = link.due_ns - now.monotonic_ns()
        poller.poll(min(1000, max(0, -(-wait_ns // 1_000_000))))
        for incoming in link.receive():
            if isinstance(incoming, Packet):
                message = decode(incoming.header, incoming.payload)
                assert isinstance(message, FrameMessage)
                assert message.sent_index == count
                begun = begun or time.monotonic_ns()
                before = before or cpu_s()
                count, size = count + 1, len(message.payload)
        if not greeted:
            greeted = link.send(link.dialled[Lane.FRAMES], b"hello", b"") is SendResult.SENT
    took_s = (time.monotonic_ns() - begun) / 1e9
    used = cpu_s() - before
    link.send(link.dialled[Lane.CONTROL], b"done", b"")
    select.select([descriptor], [], [], 0.2)
    link.close()
    return {"mb_per_s": (frames - 1) * size / took_s / 1e6, "cpu_us_per_frame": used / frames * 1e6}


def play_host(uri: str, seconds: float) -> dict[str, object]:
    """Play the host's role: two frames of credit, as `phone-host` grants on such a link; record every echo and frame."""
    link = open_link(parse_link(uri, listens_by_default=False))
    session = HostSession("bench", [{lane: connection_name(0, path) for lane, path in link.dialled.items()}])
    poller = zmq.Poller()
    poller.register(link.pollables[0], zmq.POLLIN)
    echoes: list[tuple[int, int]] = []
    frames: list[tuple[int, int]] = []
    lost = 0
    end_ns = now.monotonic_ns() + round(seconds * 1e9)

    def handle(outputs: list[Output]) -> None:
        nonlocal lost
        for output in outputs:
            match output:
                case Outgoing(connection, message):
                    header, payload = encode_stamped(message, now.monotonic_ns)
                    link.send(connection[1:], header, payload)
                case Echo():
                    echoes.append((output.t3_ns, output.t3_ns - output.t0_ns - (output.t2_ns - output.t1_ns)))
                case Arrived(frame, missed):
                    lost += missed
                    frames.append((now.monotonic_ns(), len(frame.payload)))
                case _:
                    pass

    while (now_ns := now.monotonic_ns()) < end_ns:
        poller.poll(min(50, max(0, -((now_ns - min(session.due_ns, link.due_ns)) // 1_000_000))))
        for incoming in link.receive():
            if isinstance(incoming, Packet):
                handle(
                    session.receive(
                        connection_name(0, incoming.connection),
                        decode(incoming.header, incoming.payload),
                        now.monotonic_ns(),
                    )
                )
        if now.monotonic_ns() >= session.due_ns:
            handle(session.tick(now.monotonic_ns()))
        if session.is_open and session.outstanding < 2:
            handle(session.grant(2))
    handle(session.leave())
    link.close()
    return {"echoes": echoes, "frames": frames, "lost": lost}


def main(arguments: list[str]) -> None:
    """Do one job."""
    if arguments[0] == "host":
        print(json.dumps(play_host(arguments[1], float(arguments[2]))))
        return
    role, framing, where, frames, size = arguments
    be_quiet(0 if role == "send" else 1)
    frame = random.Random(1).randbytes(int(size))
    if role == "send":
        result = (
            send_ours(where, int(frames), frame) if framing == "ours" else send_bare(framing, where, int(frames), frame)
        )
    else:
        result = (
            receive_ours(int(where), int(frames))
            if framing == "ours"
            else receive_bare(framing, int(where), int(frames))
        )
    print(json.dumps(result))


if __name__ == "__main__":
    main(sys.argv[1:])
