"""Emulates what an interface does to bytes: rate, delay, jitter, stalls, lost bytes. Pure, `now_ns` passed in; `relay` moves the bytes.

Order is kept, as on any byte stream. All connections of a link share one direction's rate, as they share one cable or
one radio. A direction holds a bounded number of bytes. When it is full, the relay stops reading from the
sender, which notices this as it would notice a full driver queue.
"""

import random
from collections import deque
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from common.errors import SettingsError

K = TypeVar("K")

_MS: Final = 1_000_000
_S: Final = 1_000_000_000
_NEVER: Final = 2**63 - 1

SEGMENT_BYTES: Final = 1448
"""Payload of a TCP segment with time stamps in an Ethernet frame of 1500 bytes; this is what one lost packet holds up."""

_LEAST_GRAIN_BYTES: Final = 32
_GRAIN_NS: Final = 200_000
"""A direction passes its bytes on in pieces of this duration: finer than anything measured here, coarse enough to be cheap."""

_QUEUE_NS: Final = 5 * _MS
"""A sender's queue holds this much time of the rate, as fq_codel aims for (RFC 8290, section 5.2.2, target 5 ms) ..."""

_LEAST_QUEUE_BYTES: Final = 2 * SEGMENT_BYTES
"""... but no less than two packets, or the line would run dry."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """How an interface behaves, the same in both directions.

    Attributes:
        name: the name by which users ask for it.
        carrier: the kind of link that stands in for it when none is named.
        bytes_per_s: rate of payload; 0: unlimited.
        delay_ns: least time from leaving one end to arriving at the other.
        jitter_ns: added to the delay, evenly spread from 0 to this; order is kept.
        stall_share: probability that a segment is lost and has to be sent again, 0 to 1.
        stall_ns: how long nothing arrives after such a loss, as with TCP, whose receiver waits for the missing segment.
        byte_loss: probability that a byte vanishes silently, 0 to 1; only on serial lines.
        source: where the figures come from.
    """

    name: str
    carrier: str
    bytes_per_s: float
    delay_ns: int
    jitter_ns: int = 0
    stall_share: float = 0.0
    stall_ns: int = 0
    byte_loss: float = 0.0
    source: str = ""

    @property
    def held_bytes(self) -> int:
        """The most bytes that one direction holds: its queue, and what is under way meanwhile."""
        if not self.bytes_per_s:
            return 64 * 1024
        on_the_way = self.bytes_per_s * (self.delay_ns + self.jitter_ns) / _S
        return int(max(_LEAST_QUEUE_BYTES, self.bytes_per_s * _QUEUE_NS / _S) + on_the_way)


NOTHING: Final = Profile(name="none", carrier="serial", bytes_per_s=0.0, delay_ns=0)
"""A line that adds nothing; it joins two pseudo terminals."""

# The figures are those of the study of transports where it has any (section 2 and goal 7, its sources in brackets);
# other sources are stated.
PROFILES: Final = (
    Profile(
        name="usb-serial",
        carrier="serial",
        bytes_per_s=1_000_000,  # 1 to 1.1 MB/s of a BeagleBone and a CDC device (raspberrypi/firmware#223); 8 Mbit/s in the study's goal 7
        delay_ns=1 * _MS,  # a full-speed frame of USB is 1 ms long (USB 2.0, 5.3.3)
        jitter_ns=1 * _MS,
        source="1 MB/s measured on a BeagleBone's CDC device; USB frames of 1 ms",
    ),
    Profile(
        name="usb-serial-lossy",
        carrier="serial",
        bytes_per_s=1_000_000,
        delay_ns=1 * _MS,
        jitter_ns=1 * _MS,
        byte_loss=1.2e-6,  # 3 % of 25 KB frames spoiled, as gadget serial did in a full-speed run (docs/decisions/0005)
        source="as usb-serial, with 3 % of 25 KB frames spoiled",
    ),
    Profile(
        name="usb-ethernet",
        carrier="tcp",
        bytes_per_s=4_800_000,  # SCP over a USB-Ethernet gadget of a comparable processor (sdmay23-47)
        delay_ns=250_000,  # two micro-frames of high-speed USB, 125 us each (USB 2.0, 5.3.3)
        jitter_ns=250_000,
        source="4.8 MB/s over a gadget of a comparable processor; USB micro-frames of 125 us",
    ),
    Profile(
        name="bluetooth",
        carrier="serial",
        bytes_per_s=80_000,  # RFCOMM between a phone and a small board (flutter_bluetooth_serial#102)
        delay_ns=3_750_000,  # a five-slot packet and its answer take six slots of 0.625 ms (osted.dk/tinyblue)
        jitter_ns=7_500_000,  # sending one of them again costs as much once more, twice for two
        source="RFCOMM between a phone and a small board, 80 kB/s; slots of 0.625 ms",
    ),
    Profile(
        name="bluetooth-fast",
        carrier="serial",
        bytes_per_s=187_500,  # 1.5 Mbit/s: RFCOMM of 200 kB/s and more between embedded devices (btstack#147), 3-DH5 before its own losses 2178 kbit/s
        delay_ns=3_750_000,
        jitter_ns=7_500_000,
        source="RFCOMM at 1.5 Mbit/s, between embedded devices; slots of 0.625 ms",
    ),
    Profile(
        name="uart",
        carrier="serial",
        bytes_per_s=11_520,  # 115200 baud, ten bits for a byte (8N1)
        delay_ns=1 * _MS,  # an adapter's packets, one each ms
        source="115200 baud, 8N1",
    ),
    Profile(
        name="ethernet",
        carrier="tcp",
        bytes_per_s=11_760_000,  # 100BASE-TX, the board's socket: 1448 of the 1538 bytes that a frame takes on the wire
        delay_ns=120_000,  # a full frame of 1538 bytes takes 123 us at 100 Mbit/s
        source="100BASE-TX with full frames",
    ),
    Profile(
        name="wifi",
        carrier="tcp",
        bytes_per_s=4_000_000,  # half of 65 Mbit/s, the highest rate of one stream in 20 MHz (IEEE 802.11n, MCS 7): contention and acknowledgements take the rest
        delay_ns=1 * _MS,
        jitter_ns=9
        * _MS,  # 2 to 10 ms of jitter, as libsoftwaresync's setting is assumed to have (study, goal 7; issue of the clocks)
        stall_share=1e-4,  # a guess: what 802.11's own retries leave over
        stall_ns=200 * _MS,  # TCP's least retransmission timeout in Linux (TCP_RTO_MIN, include/net/tcp.h)
        source="802.11n, one stream of 20 MHz; jitter of 9 ms; one segment in 10 000 comes 200 ms late",
    ),
)
"""The paper's interfaces (USB, Bluetooth, Wi-Fi) and those of its board."""


def parse_profiles(text: str) -> tuple[Profile, ...]:
    """Read names of profiles, for example `bluetooth,wifi`.

    Raises:
        SettingsError: a name is unknown.
    """
    known = {profile.name: profile for profile in PROFILES}
    names = tuple(dict.fromkeys(part.strip() for part in text.split(",")))
    for name in names:
        if name not in known:
            raise SettingsError(f"--emulate {name!r} is unknown", f"give {', '.join(known)}, or list")
    return tuple(known[name] for name in names)


class Way(Generic[K]):
    """One direction of a link: bytes of any number of connections go in, and come out when they are due.

    Args:
        profile: how it behaves.
        seed: seed of jitter and loss; the same seed gives the same run.
    """

    def __init__(self, profile: Profile, seed: int = 0) -> None:
        self._profile = profile
        self._random = random.Random(seed)
        self._held: deque[tuple[int, K, bytes]] = deque()
        self._held_bytes = 0
        self._free_ns = 0
        self._last_ns = 0
        self.lost_bytes = 0
        self.stalls = 0

    @property
    def room_bytes(self) -> int:
        """How many more bytes it takes now; 0 while it is full."""
        return max(0, self._profile.held_bytes - self._held_bytes)

    @property
    def due_ns(self) -> int:
        """When the next bytes arrive; 2^63 - 1 if there are none."""
        return self._held[0][0] if self._held else _NEVER

    def put(self, key: K, data: bytes, now_ns: int) -> None:
        """Send bytes of a connection.

        Args:
            key: the connection.
            data: its bytes; an empty value (end of stream) also arrives in its turn.
            now_ns: any steady clock, ns.
        """
        profile = self._profile
        self._free_ns = max(self._free_ns, now_ns)
        if not profile.bytes_per_s or not data:
            self._hold(self._free_ns + profile.delay_ns, key, data)
            return
        step = min(SEGMENT_BYTES, max(_LEAST_GRAIN_BYTES, int(profile.bytes_per_s * _GRAIN_NS / _S)))
        for at in range(0, len(data), step):
            grain = data[at : at + step]
            self._free_ns += round(len(grain) / profile.bytes_per_s * _S)
            jitter_ns = self._random.randrange(profile.jitter_ns + 1)
            self._hold(self._free_ns + profile.delay_ns + jitter_ns + self._stall(len(grain)), key, self._spoil(grain))

    def take(self, now_ns: int) -> list[tuple[K, bytes]]:
        """Return what has arrived, in order."""
        came: list[tuple[K, bytes]] = []
        while self._held and self._held[0][0] <= now_ns:
            _, key, data = self._held.popleft()
            self._held_bytes -= len(data)
            came.append((key, data))
        return came

    def _hold(self, due_ns: int, key: K, data: bytes) -> None:
        # Order is kept: bytes that would arrive early wait for those before them.
        self._last_ns = max(self._last_ns, due_ns)
        self._held.append((self._last_ns, key, data))
        self._held_bytes += len(data)

    def _stall(self, size_bytes: int) -> int:
        """Return how much later than usual these bytes arrive because their segment was lost, ns."""
        share = self._profile.stall_share * size_bytes / SEGMENT_BYTES
        if not share or self._random.random() >= share:
            return 0
        self.stalls += 1
        return self._profile.stall_ns

    def _spoil(self, data: bytes) -> bytes:
        """Return the bytes that survive."""
        share = self._profile.byte_loss
        if not share or self._random.random() >= share * len(data):  # at most one byte of a grain: the share is tiny
            return data
        self.lost_bytes += 1
        at = self._random.randrange(len(data))
        return data[:at] + data[at + 1 :]
