"""One life of a V4L2 device: opened, format and controls set, streaming, until it is closed or lost. `v4l2.py` gives it further lives."""

import contextlib
import errno
import logging
from dataclasses import field
from fractions import Fraction
from pathlib import Path
from typing import Final

from common import now
from common.camera import v4l2_abi as abi
from common.camera.base import Grab, Skipped, Spoiled
from common.camera.v4l2_controls import ControlWishes
from common.camera.v4l2_device import Device, serial_number, taken
from common.camera.v4l2_formats import (
    Choice,
    Packing,
    PixelFormatSet,
    SendPart,
    Wanted,
    choose,
    choose_rate,
    has_rates,
    rate_text,
    slower_rates,
    smaller_sizes,
)
from common.camera.v4l2_open_controls import OpenControls
from common.camera.v4l2_ring import Filled, Ring
from common.camera.v4l2_stamps import (
    StampSource,
    Tally,
    Timing,
    estimated_readout_ns,
    exposure_midpoint_ns,
    is_trusted,
    stamp_clock,
    stamp_source,
)
from common.camera_identity import CameraIdentity, identity_of
from common.errors import UnavailableError
from common.frame import Frame, FrameFault, PixelFormat, find_fault
from common.program.logs import event
from common.stamp import Stamp
from common.value import value

_LOG = logging.getLogger(__name__)

_SEQUENCE_MASK: Final = 0xFFFFFFFF
_BACKWARDS: Final = 0x80000000


@value()
class V4l2Settings:
    """What is requested of a V4L2 camera.

    Attributes:
        path: node or link; empty: the first camera by its name in /dev/v4l/by-id.
        wanted: encoding, size and rate.
        wishes: controls.
        part: whether raw images are sent whole or as their luma.
        readout_ns: readout time of the sensor, ns; None: estimated.
        latency_ns: this camera's constant between the end of the readout and the stamp, ns.
        clock: name of the clock of the stamps.
    """

    path: str = ""
    wanted: Wanted = field(default_factory=Wanted)
    wishes: ControlWishes = field(default_factory=ControlWishes)
    part: SendPart = SendPart.WHOLE
    readout_ns: int | None = None
    latency_ns: int = 0
    clock: str = "host"


class Stream:
    """An open device that is ready to stream.

    Attributes:
        choice: encoding and size.
        period_ns: nominal time between frames, ns.
        slower_hz: rates to which it can be slowed down, Hz, the highest first.
        controls: its controls.
        started_ns: when the stream was last started, CLOCK_MONOTONIC, ns.

    Args:
        path: node or link.
        settings: what is requested.
        wishes: wishes for the controls; after a first life, with the values found then.
        tally: where to count.

    Raises:
        UnavailableError: the device cannot be had.
        SettingsError: it lacks what is requested.
        OSError: the driver failed.
    """

    def __init__(self, path: Path, settings: V4l2Settings, wishes: ControlWishes, tally: Tally) -> None:
        self._settings = settings
        self._tally = tally
        self._device = Device(path)
        try:
            self._device.require_capture()
            self._formats = self._device.formats()
            self.choice = choose(self._formats, settings.wanted, str(path))
            self._packing = Packing.of(self._set_format(self.choice), self.choice.pixel_format, settings.part)
            self.slower_hz: tuple[Fraction, ...] = ()
            self.period_ns, self._timing = self._set_rate()
            self.controls = OpenControls(self._device, wishes, tally)
            self._ring = Ring(self._device)
        except BaseException:
            self._device.close()
            raise
        self._last_sequence: int | None = None
        self._sound = False
        self.started_ns = 0
        self._taken = 0
        self._broken: OSError | None = None

    @property
    def fd(self) -> int:
        """The descriptor to wait on."""
        return self._device.fd

    @property
    def buffers(self) -> int:
        """Length of the ring."""
        return len(self._ring)

    @property
    def name(self) -> str:
        """The camera's name, for people."""
        return f"{self._device.identity.card} ({self._device.identity.driver})"

    @property
    def identity(self) -> CameraIdentity:
        """Which camera it is."""
        said = self._device.identity
        return identity_of(said.driver, said.card, serial_number(self._device.path))

    @property
    def driver(self) -> str:
        """The kernel driver's name."""
        return self._device.identity.driver

    @property
    def pixel_format(self) -> PixelFormat:
        """Encoding of the frames as they are sent."""
        return self._packing.sent_as

    @property
    def readout_ns(self) -> int:
        """The readout time that the stamps are corrected with, ns."""
        return self._timing.readout_ns

    def start(self) -> None:
        """Start streaming.

        Raises:
            OSError: the driver failed.
        """
        self._last_sequence, self._sound, self._taken = None, False, 0
        self._tally.rate.restart()
        self.started_ns = now.monotonic_ns()
        self._ring.start()

    def stop(self) -> None:
        """Stop streaming; the device stays open.

        Raises:
            OSError: the driver failed.
        """
        self._ring.stop()

    def close(self) -> None:
        """Release the device, whatever state it is in."""
        with contextlib.suppress(OSError):  # it may be gone
            self._ring.stop()
        self._ring.close()
        self._device.close()

    def take(self) -> list[Grab]:
        """Take all filled buffers. The newest is copied out, once; older ones are skipped.

        Raises:
            OSError: the camera is gone or the driver failed. Everything taken before has been returned.
        """
        if self._broken is not None:
            raise self._broken
        grabs: list[Grab] = []
        newest: Filled | None = None
        for _ in range(len(self._ring) + 1):  # a camera faster than this loop must not keep it here for ever
            try:
                filled = self._ring.take()
            except OSError as error:
                if newest is None:
                    raise
                self._broken = error
                break
            if filled is None:
                break
            self._note_sequence(filled.sequence)
            if newest is not None:
                self._give_back(newest)
                grabs.append(Skipped(self._tally.number()))
            newest = filled
        if newest is not None:
            grabs.append(self._grab(newest, now.monotonic_ns()))
            self._give_back(newest)
        return grabs

    def qualities(self) -> tuple[int, ...]:
        """The JPEG qualities, the current one first, then the lower ones; empty if it cannot be set.

        Raises:
            OSError: the camera is gone.
        """
        return self.controls.qualities() if self.choice.pixel_format is PixelFormat.MJPEG else ()

    def sizes_px(self) -> tuple[tuple[int, int], ...]:
        """The current size, and the smaller ones of the same shape that support the same rates, (width, height), px.

        Raises:
            OSError: the camera is gone.
        """
        letters, present = self.choice.letters, self.choice.size_px
        offer = next(offer for offer in self._formats if offer.letters == letters)
        wanted_hz = (self._rate_hz, *self.slower_hz)
        smaller = smaller_sizes(offer, present)
        return (present, *(size for size in smaller if has_rates(self._device.rates(letters, size), wanted_hz)))

    def _set_format(self, choice: Choice) -> PixelFormatSet:
        try:
            made = self._device.set_format(choice.letters, choice.size_px)
        except OSError as error:
            if error.errno == errno.EBUSY:
                raise taken(self._device.path) from None
            raise
        if (made.letters, made.size_px) != (choice.letters, choice.size_px):
            asked, got = f"{choice.letters} {_size(choice.size_px)}", f"{made.letters} {_size(made.size_px)}"
            raise UnavailableError(
                f"camera {self._device.path} gives {got} when asked for {asked}",
                f"ask for that size: size={_size(made.size_px)}",
            )
        return made

    def _set_rate(self) -> tuple[int, Timing]:
        """Set the rate; return the nominal period and the timing to use for the stamps."""
        path, choice = self._device.path, self.choice
        rates = self._device.rates(choice.letters, choice.size_px)
        rate_hz = choose_rate(rates, self._settings.wanted, str(path))
        self._rate_hz = rate_hz
        made_hz = self._device.set_rate(rate_hz)
        if made_hz is None:
            made_hz = rate_hz
        elif abs(made_hz - rate_hz) > rate_hz / 100:
            _LOG.warning(event("other_rate", camera=path, asked=rate_text(rate_hz), nominal=rate_text(made_hz)))
        self.slower_hz = slower_rates(rates, made_hz)
        period_ns = int(1_000_000_000 / made_hz)
        shortest_ns = min(period_ns, int(1_000_000_000 / (rates.highest_hz or Fraction(made_hz))))
        readout_ns = self._settings.readout_ns
        if readout_ns is None:
            readout_ns = estimated_readout_ns(shortest_ns)
        return period_ns, Timing(self._device.identity.driver, readout_ns, self._settings.latency_ns)

    def _give_back(self, filled: Filled) -> None:
        try:
            self._ring.give_back(filled.index)
        except OSError as error:
            self._broken = error  # raised by the next `take`, so that this grab is not lost with it

    def _note_sequence(self, sequence: int) -> None:
        """Count the frames missing between this one and the last. A number that goes back means that the driver has restarted."""
        if self._last_sequence is not None:
            gap = (sequence - self._last_sequence - 1) & _SEQUENCE_MASK
            if gap < _BACKWARDS:
                self._tally.missed += gap
        self._last_sequence = sequence

    def _grab(self, filled: Filled, grabbed_ns: int) -> Grab:
        sequence = self._tally.number()
        self._taken += 1
        with self._ring.view(filled) as view:
            fault = self._fault(filled, view)
            payload = b"" if fault else self._packing.pack(view)
        if fault is not None:
            self._tally.faults[fault] = self._tally.faults.get(fault, 0) + 1
            if not self._sound:
                self._last_sequence = None  # v4l2loopback: a first buffer without a frame, then numbers from anywhere
            return Spoiled(sequence, fault)
        self._sound = True
        clock = self._settings.clock
        exposed = Stamp(self._exposed_ns(filled, grabbed_ns), clock)
        width_px, height_px = self.choice.size_px
        return Frame(
            sequence=sequence,
            exposed=exposed,
            grabbed=Stamp(grabbed_ns, clock),
            width_px=width_px,
            height_px=height_px,
            pixel_format=self._packing.sent_as,
            exposure_ns=self.controls.exposure_ns,
            payload=payload,
        )

    def _fault(self, filled: Filled, view: memoryview) -> FrameFault | None:
        if filled.flags & abi.BUF_FLAG_ERROR:
            return FrameFault.FLAGGED
        if not self._sound and self._taken <= len(self._ring) and filled.stamp_ns < self.started_ns:
            return FrameFault.STALE
        return find_fault(self.choice.pixel_format, view, self._packing.least_bytes)

    def _exposed_ns(self, filled: Filled, grabbed_ns: int) -> int:
        self._tally.stamps = stamp_clock(filled.flags)
        if is_trusted(filled.stamp_ns, self._tally.stamps, grabbed_ns):
            stamp_ns, source = filled.stamp_ns, stamp_source(filled.flags, self._timing.driver)
        else:
            self._tally.distrusted += 1
            stamp_ns, source = grabbed_ns, StampSource.END_OF_FRAME
        self._tally.rate.add(stamp_ns, filled.sequence)
        return min(grabbed_ns, exposure_midpoint_ns(stamp_ns, source, self._timing, self.controls.exposure_ns))


def _size(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]}x{size_px[1]}"
