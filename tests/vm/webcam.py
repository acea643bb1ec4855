"""A webcam on the guest's USB bus, emulated on this machine: the guest kernel's own uvcvideo driver finds a camera on vhci_hcd; the device is here.

The guest connects and hands the connection to its kernel, which from then on speaks USB/IP over it (the kernel's
Documentation/usb/usbip_protocol.rst). The device runs outside the guest, so that it does not use the board's processor time.
"""

import math
import select
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from typing import Final

from tests.support.programs import until
from tests.vm import uvc
from tests.vm.guest import Guest

_SUBMIT, _UNLINK, _RET_SUBMIT, _RET_UNLINK = 1, 2, 3, 4
_HEADER_BYTES: Final = 48
_STALLED, _UNLINKED = -32, -104  # -EPIPE, -ECONNRESET
_HIGH_SPEED: Final = 3
_DEVICE_ID: Final = 0x10001

_PLUG: Final = (
    "import socket; s = socket.create_connection(('10.0.2.2', {port})); s.setsockopt(6, 1, 1); "
    "open('/sys/devices/platform/vhci_hcd.0/attach', 'w').write(f'{usb_port} {{s.fileno()}} {device} {speed}')"
)


def with_comment(jpeg: bytes, text: str) -> bytes:
    """Put a COM segment (ITU-T T.81, B.2.4.5) behind a JPEG's start marker."""
    body = text.encode()
    return jpeg[:2] + b"\xff\xfe" + struct.pack(">H", len(body) + 2) + body + jpeg[2:]


class Webcam:
    """A camera that can be plugged into a guest.

    It shows image number floor(t * fps) of this machine's CLOCK_MONOTONIC, as a replay does, with the middle of its exposure at k / fps:
    the first byte leaves half the exposure time and half the readout later. After `start_with_phase` its sensor runs like that of most webcams:
    only while it streams, first exposed a fixed time after the start, so that each start gives it another phase.

    Args:
        frames: JPEGs, shown in turn.
        fps: native rate; a driver that asks for less gets less.
        readout_ns: of its sensor.
        model: the make of webcam.
        smaller: the same JPEGs for a driver that asks for the model's second size; empty: the same for both.
    """

    def __init__(
        self,
        frames: Sequence[bytes],
        fps: int,
        readout_ns: int,
        model: uvc.Model | None = None,
        smaller: Sequence[bytes] = (),
    ) -> None:
        self.late_ns: dict[int, tuple[int, int]] = {}
        """By image number in `frames`, for its last showing: how much later than due its first bytes left, and how much later the guest's
        driver had taken them. The driver stamped them in between; on a busy machine that may be long."""
        self.truncate_every = 0
        """Every n-th frame loses its second half; 0: none."""
        self.truncated = 0
        self.hung = False
        """Whether its firmware has hung: it answers nothing, but stays on the bus."""
        self.starts = 0
        """How often a driver has started the stream."""
        self.streaming = False
        self.start_phase_ns: int | None = None
        self.start_latency_ns: int | None = None
        self.phase_ns = 0
        """How much later than k / fps it exposes since the latest start."""
        self.settings: dict[tuple[int, int], int] = {}
        """Its current controls, by (unit, selector)."""
        self.found: dict[tuple[int, int], int] = {}
        """What automatic modes find, if it differs from the original values."""
        self.set_requests: list[tuple[tuple[int, int], int]] = []
        """Every control that a driver has set, with the value, in order."""
        self.frames, self.fps, self.readout_ns = frames, fps, readout_ns
        self.smaller = smaller or frames
        self.model = model or uvc.Model()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._connection: socket.socket | None = None
        self._thread: threading.Thread | None = None

    @property
    def plugged(self) -> bool:
        """Whether it is plugged into a guest."""
        return self._thread is not None and self._thread.is_alive()

    def start_with_phase(self, phase_ns: int) -> None:
        """Make the next start expose this much later than k / fps; every later start has the same delay after its own command."""
        self.start_phase_ns = phase_ns

    def find(self, where: tuple[int, int], value: int) -> None:
        """Change the light: an active automatic mode finds another value, and the camera uses it at once."""
        self.found[where] = self.settings[where] = value

    def plug(self, guest: Guest, usb_port: int = 0) -> None:
        """Plug it into a guest's USB port, and wait until the port accepts it."""
        guest.sh("modprobe -a vhci_hcd uvcvideo")
        port = self._listener.getsockname()[1]
        attach = _PLUG.format(port=port, usb_port=usb_port, device=_DEVICE_ID + usb_port, speed=_HIGH_SPEED)
        # The port of a camera that was just pulled stays busy for a moment.
        until(lambda: guest.code(f'python3 -c "{attach}"') == 0, "the USB port takes the camera")
        self._listener.settimeout(10)
        while True:  # the newest connection is the one that was handed over; failed attempts were closed
            self._connection, _ = self._listener.accept()
            self._listener.settimeout(0)
            if not select.select([self._listener], [], [], 0)[0]:
                break
            self._connection.close()
        self._connection.setblocking(True)  # noqa: FBT003 - the standard library's own signature
        self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._thread = threading.Thread(target=self._serve, args=(self._connection,), daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Pull it."""
        if self._connection is not None:
            with suppress(OSError):
                self._connection.shutdown(socket.SHUT_RDWR)
            assert self._thread is not None
            self._thread.join(10)
            self._connection.close()
            self._connection = None

    def close(self) -> None:
        """Pull it and shut it down."""
        self.unplug()
        self._listener.close()

    def _serve(self, connection: socket.socket) -> None:
        with suppress(OSError, EOFError):
            _Device(self, connection).run()


class _Device:
    """One plugged-in period: its requests, its controls, its stream."""

    def __init__(self, camera: Webcam, connection: socket.socket) -> None:
        self._camera, self._socket = camera, connection
        self._waiting: deque[tuple[int, int]] = deque()  # (sequence number, bytes) of transfers that want image data
        self._controls = camera.settings = {where: control.default for where, control in uvc.CONTROLS.items()}
        self._probe = self._commit = camera.model.probe(1, 333333)
        self._streaming = False
        self._odd = False
        self._number = 0
        self._newest = -1  # image number, counted over all laps of the film
        self._rest = b""
        self._ignored: set[int] = set()  # sequence numbers of requests that were never answered
        self._submitted = 0  # sequence number of the newest request
        self._revoked: set[int] = set()  # sequence numbers of requests that were unlinked before they came
        self._taken: deque[tuple[int, int] | None] = (
            deque()
        )  # (image, due_ns) of each transfer that the driver has not yet resubmitted
        self._first: tuple[int, int] | None = None
        self._phase_ns = 0

    def run(self) -> None:
        """Serve until the connection ends."""
        try:
            while True:
                wait_s = self._feed()
                if select.select([self._socket], [], [], wait_s)[0]:
                    self._request()
        finally:
            self._stop()

    def _request(self) -> None:
        header = self._read(_HEADER_BYTES)
        command, sequence, _, is_in, endpoint = struct.unpack_from(">5I", header)
        if command == _UNLINK:
            (unlinked,) = struct.unpack_from(">I", header, 20)
            found = [item for item in self._waiting if item[0] == unlinked]
            for item in found:
                self._waiting.remove(item)
            # The kernel's sender looks for requests first and for unlinks second: one of each that come in between overtake each other.
            is_early = unlinked > self._submitted
            if is_early:
                self._revoked.add(unlinked)
            known = bool(found) or unlinked in self._ignored or is_early
            self._ignored.discard(unlinked)
            self._socket.sendall(struct.pack(">5Ii24x", _RET_UNLINK, sequence, 0, 0, 0, _UNLINKED if known else 0))
            return
        assert command == _SUBMIT, command
        (length,) = struct.unpack_from(">i", header, 24)
        out = self._read(length) if not is_in and length else b""
        self._submitted = sequence
        if sequence in self._revoked:
            self._revoked.discard(sequence)
            return
        if endpoint:
            self._waiting.append((sequence, length))
            self._note_taken()
            return
        if self._camera.hung:
            self._ignored.add(sequence)
            return
        answer = self._control(header[40:48], out)
        if answer is None:
            self._return(sequence, b"", _STALLED)
        elif is_in:
            self._return(sequence, answer)
        else:
            self._return(sequence, b"", 0, length)

    def _control(self, setup: bytes, out: bytes) -> bytes | None:
        """Answer a control request; None: stalled."""
        kind, request, value, index, length = struct.unpack("<BBHHH", setup)
        if kind & 0x60 == 0:
            return self._standard(request, value, length)
        unit, selector = index >> 8, value >> 8
        if unit == 0 and index & 0xFF == 1 and selector in {uvc.PROBE, uvc.COMMIT}:
            return self._negotiate(request, selector, out, length)
        control = uvc.CONTROLS.get((unit, selector))
        if control is None:
            return None
        if control.automatism is not None and self._controls[control.automatism] in control.automatic:
            self._controls[unit, selector] = self._camera.found.get((unit, selector), control.found)
        if request == uvc.SET_CUR:
            self._controls[unit, selector] = int.from_bytes(out, "little")
            self._camera.set_requests.append(((unit, selector), self._controls[unit, selector]))
            return b""
        return control.answer(request, self._controls[unit, selector])[:length]

    def _standard(self, request: int, value: int, length: int) -> bytes | None:
        model = self._camera.model
        if request == 6:  # GET_DESCRIPTOR
            kind, index = value >> 8, value & 0xFF
            known = {1: model.device, 2: model.configuration, 6: model.qualifier}
            if kind == 3:
                return model.string(index)[:length]
            return known[kind][:length] if kind in known else None
        if request == 1:  # CLEAR_FEATURE of the endpoint: how a bulk camera is told to stop
            self._stop()
        # GET_STATUS, GET_CONFIGURATION, GET_INTERFACE; settings are accepted unchanged
        return {0: b"\0\0", 8: b"\1", 10: b"\0"}.get(request, b"")[:length]

    def _negotiate(self, request: int, selector: int, out: bytes, length: int) -> bytes:
        if request == uvc.SET_CUR:
            _, _, frame, interval = struct.unpack_from("<HBBI", out)
            self._probe = self._camera.model.probe(frame, interval)
            if selector == uvc.COMMIT:
                self._commit = self._probe
                self._start()
            return b""
        if request == uvc.GET_LEN:
            return struct.pack("<H", len(self._probe))
        if request == uvc.GET_INFO:
            return b"\x03"
        return (self._commit if selector == uvc.COMMIT else self._probe)[:length]

    def _note_taken(self) -> None:
        """The driver resubmits a transfer as soon as it has taken its data, in the same order."""
        if self._taken and (first := self._taken.popleft()) is not None:
            image, due_ns = first
            self._camera.late_ns[image] = (self._camera.late_ns[image][0], time.monotonic_ns() - due_ns)

    def _start(self) -> None:
        self._streaming = self._camera.streaming = True
        self._camera.starts += 1
        self._rest = b""
        self._taken.clear()
        now_ns = time.monotonic_ns()
        self._set_phase(now_ns)
        self._number = math.floor((now_ns - self._phase_ns - self._delay_ns()) * self._rate_hz() / 1e9) + 1
        # No image twice, though a restart with a later phase could show one: an image's number identifies one moment.
        while self._image() <= self._newest:
            self._number += 1

    def _set_phase(self, now_ns: int) -> None:
        camera, period_ns = self._camera, 10**9 // self._rate_hz()
        if camera.start_phase_ns is not None:
            self._phase_ns, camera.start_phase_ns = camera.start_phase_ns, None
            camera.start_latency_ns = (self._phase_ns - now_ns) % period_ns
        elif camera.start_latency_ns is not None:
            self._phase_ns = (now_ns + camera.start_latency_ns) % period_ns
        camera.phase_ns = self._phase_ns

    def _stop(self) -> None:
        self._streaming = self._camera.streaming = False

    def _rate_hz(self) -> int:
        interval: int = struct.unpack_from("<I", self._commit, 4)[0]
        return min(self._camera.fps, round(1e7 / interval))

    def _image(self) -> int:
        """The image for the next number: at half the rate every other image is shown."""
        return self._number * self._camera.fps // self._rate_hz()

    def _delay_ns(self) -> int:
        """Time from the middle of an exposure to the first byte."""
        return (self._controls[uvc.EXPOSURE] * 100_000 + self._camera.readout_ns) // 2

    def _feed(self) -> float:
        """Give image data to the waiting transfers; return how long there is nothing to do, s."""
        while self._streaming and self._waiting and not self._camera.hung:
            now_ns = time.monotonic_ns()
            if not self._rest:
                due_ns = round(self._number * 1e9 / self._rate_hz()) + self._phase_ns + self._delay_ns()
                if now_ns < due_ns:
                    return (due_ns - now_ns) / 1e9
                self._begin_frame(now_ns, due_ns)
            sequence, length = self._waiting.popleft()
            room = min(length, uvc.PAYLOAD_BYTES) - 2
            data, self._rest = self._rest[:room], self._rest[room:]
            self._taken.append(self._first)
            self._first = None
            self._return(sequence, uvc.payload(data, odd=self._odd, last=not self._rest))
            if not self._rest:
                self._odd = not self._odd
        return 1.0

    def _begin_frame(self, now_ns: int, due_ns: int) -> None:
        camera = self._camera
        skipped = int(
            (now_ns - due_ns) * self._rate_hz() / 1e9
        )  # stalled for whole periods: those images were never taken
        self._number += skipped
        number, self._newest = self._number, self._image()
        self._number += 1
        due_ns += round(skipped * 1e9 / self._rate_hz())
        due_ns -= self._phase_ns  # image k belongs to k / fps: any later exposure is reported as lateness
        image = self._newest % len(camera.frames)
        camera.late_ns[image] = (now_ns - due_ns, now_ns - due_ns)
        self._first = (image, due_ns)
        frames = camera.smaller if self._commit[3] == 2 else camera.frames  # bFrameIndex
        frame = with_comment(frames[image], f"number={number}")
        if camera.truncate_every and number % camera.truncate_every == 0:
            camera.truncated += 1
            frame = frame[: len(frame) // 2]
        self._rest = frame

    def _return(self, sequence: int, data: bytes, status: int = 0, length: int | None = None) -> None:
        taken = len(data) if length is None else length
        self._socket.sendall(struct.pack(">5Iiiiii8x", _RET_SUBMIT, sequence, 0, 0, 0, status, taken, 0, 0, 0) + data)

    def _read(self, length: int) -> bytes:
        data = b""
        while len(data) < length:
            more = self._socket.recv(length - len(data))
            if not more:
                raise EOFError
            data += more
        return data
