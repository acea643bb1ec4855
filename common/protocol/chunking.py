"""Sends packets of both lanes over one byte stream: cuts them into chunks, puts control first, reassembles them. Sans-I/O, `now_ns` passed in.

A packet is u16 header length, u32 payload length, header, payload. Its chunks carry consecutive numbers. If one is missing, the packet is
dropped and never patched up. Only chunks on the frames lane are acknowledged, by the newest number received. That counter is absolute, so
the next acknowledgement makes up for a lost one. Control is neither held back nor acknowledged: there is little of it, and its own
protocol repeats it.
"""

import struct
from collections import deque
from dataclasses import dataclass, field
from typing import Final

from common.frame import Buffer
from common.protocol.framing import UNIT_OVERHEAD_BYTES, LinkEnd, Unit, UnitKind, unit_parts
from common.protocol.message import Lane
from common.protocol.pacing import MS, Window
from common.protocol.wire import MAX_HEADER_BYTES, MAX_PAYLOAD_BYTES

_LENGTHS: Final = struct.Struct("<HI")
_NUMBERS: Final = 1 << 16
_NEVER: Final = 2**63 - 1

_BATCH_BYTES: Final = 64 * 1024
"""Bytes returned at once: the most that a tty takes at once. Control that comes later waits behind them."""

_QUEUE_PACKETS: Final = 32
"""Packets that may wait on a lane: a wave of echoes and a few accounts."""

_ABANDON_NS: Final = 1000 * MS
"""A frame is given up when nothing of it was acknowledged for this long. A peer that comes back shall get a fresh one."""

_ATTENTION_NS: Final = 100 * MS
"""At most this much of the time between two calls counts as silence, because a process that slept did not listen (an emulated board slept for
seconds)."""

_KIND_OF: Final = {Lane.FRAMES: UnitKind.FRAMES, Lane.CONTROL: UnitKind.CONTROL}
_LANE_OF: Final = {kind: lane for lane, kind in _KIND_OF.items()}


@dataclass(frozen=True, slots=True)
class Whole:
    """A complete received packet."""

    lane: Lane
    header: Buffer
    payload: Buffer


@dataclass(slots=True)
class _Parcel:
    """A packet on its way out."""

    head: bytes
    payload: memoryview
    at: int = 0

    @property
    def size_bytes(self) -> int:
        return len(self.head) + len(self.payload)

    def take(self, count: int) -> tuple[Buffer, bool, bool]:
        """Return the next chunk's body, whether it is the first one, and whether it is the last one."""
        first, start = self.at == 0, self.at - len(self.head)
        self.at += count
        if start >= 0:
            body: Buffer = self.payload[start : start + count]
        else:
            body = self.head[start:][:count] + bytes(self.payload[: max(0, start + count)])
        return body, first, self.at >= self.size_bytes


class Cutter:
    """The sending half of one side: takes packets, returns bytes to write.

    Args:
        side: this side.
        frame_bytes: size of the frames in which the line carries bytes; 1 if it has none.
    """

    def __init__(self, side: LinkEnd, frame_bytes: int = 1) -> None:
        self._side = side
        self._frames: deque[_Parcel] = deque()
        self._control: deque[_Parcel] = deque()
        self._queues = {Lane.FRAMES: self._frames, Lane.CONTROL: self._control}
        self._numbers = dict.fromkeys(Lane, 0)
        self._acknowledge: int | None = None
        self._window = Window(frame_bytes)
        self._abandoned = 0
        self._looked_ns = 0
        self._silent_ns = 0

    @property
    def bytes_per_s(self) -> float:
        """The line's measured rate; 0 while unknown."""
        return self._window.bytes_per_s

    @property
    def abandoned(self) -> int:
        """Packets given up half sent, so far."""
        return self._abandoned

    @property
    def is_idle(self) -> bool:
        """Whether nothing waits to be written."""
        return self._acknowledge is None and not any(self._queues.values())

    @property
    def due_ns(self) -> int:
        """When `take` must be called next even if nothing has happened; 2^63 - 1: never."""
        queue = self._frames
        if not queue or not queue[0].at:
            return self._window.due_ns
        return min(self._window.due_ns, self._looked_ns + min(_ATTENTION_NS, _ABANDON_NS - self._silent_ns))

    def ready(self, lane: Lane) -> bool:
        """Whether a packet with a payload would be accepted now: no other is being sent on that lane, and its first chunk may leave at once."""
        if self._queues[lane]:
            return False
        return lane is Lane.CONTROL or self._window.has_room(self._window.chunk_bytes + UNIT_OVERHEAD_BYTES)

    def put(self, lane: Lane, header: bytes, payload: Buffer) -> bool:
        """Accept a packet for sending.

        Args:
            lane: the lane to send it on.
            header: at most MAX_HEADER_BYTES.
            payload: at most MAX_PAYLOAD_BYTES; kept until it has left, not copied.

        Returns:
            Whether it was accepted. A packet without a payload may wait in line; one with a payload must be able to leave at once.
        """
        assert len(header) <= MAX_HEADER_BYTES
        assert len(payload) <= MAX_PAYLOAD_BYTES
        queue = self._queues[lane]
        if len(queue) >= _QUEUE_PACKETS or (len(payload) and not self.ready(lane)):
            return False
        queue.append(_Parcel(_LENGTHS.pack(len(header), len(payload)) + header, memoryview(payload).cast("B")))
        return True

    def acknowledge(self, number: int) -> None:
        """Tell the peer, ahead of everything else, which of its FRAMES units is the newest that came."""
        self._acknowledge = number

    def acknowledged(self, number: int, now_ns: int) -> None:
        """Handle the peer's acknowledgement of the newest FRAMES unit it received."""
        if self._window.acknowledged(number, now_ns):
            self._silent_ns = 0

    def take(self, now_ns: int) -> bytes:
        """Return the next bytes to write. Write them before taking more.

        Args:
            now_ns: any steady clock, ns.

        Returns:
            At most about 64 KB; empty if nothing may be sent now.
        """
        self._window.tick(now_ns)
        frames, control = self._frames, self._control
        self._listen(now_ns)
        parts: list[Buffer] = []
        size = 0
        if self._acknowledge is not None:
            parts += unit_parts(
                self._side, Unit(kind=UnitKind.ACK, first=True, last=True, number=self._acknowledge, body=b"")
            )
            self._acknowledge = None
        while size < _BATCH_BYTES and control:
            size += self._cut(Lane.CONTROL, self._window.chunk_bytes, parts)
        while size < _BATCH_BYTES and frames:
            chunk = self._window.chunk_bytes
            if not self._window.has_room(chunk + UNIT_OVERHEAD_BYTES):
                return b"".join(parts)
            number = self._numbers[Lane.FRAMES]
            written = self._cut(Lane.FRAMES, chunk, parts)
            self._window.sent(number, written, now_ns)
            size += written
        if not frames:
            self._window.starved()
        return b"".join(parts)

    def _cut(self, lane: Lane, count: int, parts: list[Buffer]) -> int:
        """Append the next chunk of a lane to `parts`; return its size on the wire."""
        queue = self._queues[lane]
        body, first, last = queue[0].take(count)
        if last:
            queue.popleft()
        parts += unit_parts(
            self._side, Unit(kind=_KIND_OF[lane], first=first, last=last, number=self._numbers[lane], body=body)
        )
        self._numbers[lane] = (self._numbers[lane] + 1) % _NUMBERS
        return len(body) + UNIT_OVERHEAD_BYTES

    def _listen(self, now_ns: int) -> None:
        """Give up a frame that has begun to leave if nothing was heard about it for too long."""
        passed_ns = min(now_ns - self._looked_ns, _ATTENTION_NS)
        self._looked_ns = now_ns
        frames = self._frames
        if not frames or not frames[0].at:
            self._silent_ns = 0
            return
        self._silent_ns += passed_ns
        if self._silent_ns >= _ABANDON_NS:
            frames.popleft()
            self._abandoned += 1


@dataclass(slots=True)
class _Assembly:
    """A partly received packet. Its chunks are copied, because a view would keep the whole read buffer alive."""

    header_bytes: int
    size_bytes: int
    next_number: int
    data: bytearray = field(default_factory=bytearray)


class Joiner:
    """The receiving half of one side: takes units, returns whole packets. Keeps at most one packet per lane, and only the part that has come."""

    def __init__(self) -> None:
        self.under_way: dict[Lane, _Assembly] = {}
        self._broken = 0

    @property
    def broken(self) -> int:
        """Packets that had begun but lacked a chunk, so far."""
        return self._broken

    def add(self, unit: Unit) -> Whole | None:
        """Handle a FRAMES or CONTROL unit.

        Returns:
            The packet that it completes.
        """
        lane = _LANE_OF[unit.kind]
        assembly = self.under_way.pop(lane, None)
        if unit.first:
            self._broken += assembly is not None
            assembly = _begin(unit)
        elif assembly is not None and unit.number != assembly.next_number:
            self._broken += 1
            assembly = None
        if assembly is None:
            return None
        have_bytes = len(assembly.data) + len(unit.body)
        if have_bytes > assembly.size_bytes or unit.last != (have_bytes == assembly.size_bytes):
            self._broken += 1
            return None
        if not unit.last:
            assembly.data += unit.body
            assembly.next_number = (unit.number + 1) % _NUMBERS
            self.under_way[lane] = assembly
            return None
        if assembly.data:
            assembly.data += unit.body
        whole = memoryview(assembly.data or unit.body)
        split = _LENGTHS.size + assembly.header_bytes
        return Whole(lane, whole[_LENGTHS.size : split], whole[split:])


def _begin(unit: Unit) -> _Assembly | None:
    if len(unit.body) < _LENGTHS.size:
        return None
    header_bytes, payload_bytes = _LENGTHS.unpack_from(unit.body)
    if header_bytes > MAX_HEADER_BYTES or payload_bytes > MAX_PAYLOAD_BYTES:
        return None
    return _Assembly(header_bytes, _LENGTHS.size + header_bytes + payload_bytes, unit.number)
