"""Judges a camera from readings: does it exist, offer what is requested, fit the bus, and deliver sound frames and stamps? Pure."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from common.camera.v4l2_formats import FormatOffer, Rates, Wanted, choose, choose_rate, rate_text
from common.camera.v4l2_stamps import StampClock, rate_remedy
from common.diagnostic import Diagnostic
from common.doctor.access import Holder
from common.doctor.finding import fail, ok, warn
from common.errors import TandemError
from common.frame import raw_bytes
from common.words import counted

_MB: Final = 1e6

_BUS_BYTES: Final = ((12.0, 1_023_000), (480.0, 24_576_000))
"""Maximum for one video endpoint, bytes a second, by the bus's speed in Mbit/s: 1023 bytes a ms at full speed, three times 1024 bytes a
microframe at high speed (USB 2.0, 5.6.3). Above that speed no webcam fills the bus."""

_SLOW: Final = Fraction(9, 10)
_FEW: Final = 8
"""With fewer frames, no rate is known (RateMeter)."""

_MANY_MISSED: Final = Fraction(1, 50)


@dataclass(frozen=True, slots=True)
class UsbCamera:
    """A USB device with a video interface.

    Attributes:
        name: product.
        has_driver: whether a kernel driver has claimed the interface.
    """

    name: str
    has_driver: bool


@dataclass(frozen=True, slots=True)
class UsbBus:
    """How a camera is plugged in.

    Attributes:
        port: port name such as 1-1.2.
        megabits: speed of the connection, Mbit/s.
        cameras: cameras on the same bus, including this one.
    """

    port: str
    megabits: float
    cameras: int


@dataclass(frozen=True, slots=True)
class Offered:
    """What a camera's driver offers for a request.

    Attributes:
        formats: encodings and sizes.
        rates: by encoding (four letters) and size, px.
    """

    formats: tuple[FormatOffer, ...]
    rates: dict[tuple[str, tuple[int, int]], Rates]


@dataclass(frozen=True, slots=True)
class Sample:
    """The result of streaming for a while.

    Attributes:
        frames: sound frames.
        spoiled: spoiled frames, by fault.
        missed: frames that the driver lost (gaps in its numbers).
        distrusted: frames whose stamp could not be true.
        nominal_ns: set time between frames, ns.
        period_ns: measured time between frames, ns; None with too few frames.
        frame_bytes: mean length of a frame; 0 without one.
        first_ns: from the start to the first sound frame, ns; 0 without one.
        stamps: clock named by the stamps' flags; None without a frame.
        driver: the kernel driver's name.
        refused: controls that the driver would not set.
        exposure_ns: exposure time at the end, ns; None if the camera does not report it.
    """

    frames: int
    spoiled: tuple[tuple[str, int], ...]
    missed: int
    distrusted: int
    nominal_ns: int
    period_ns: int | None
    frame_bytes: int
    first_ns: int
    stamps: StampClock | None
    driver: str
    refused: int = 0
    exposure_ns: int | None = None


def check_absence(nodes: int, cameras: tuple[UsbCamera, ...]) -> Diagnostic:
    """Explain why no camera was found.

    Args:
        nodes: number of video nodes of any kind.
        cameras: video devices seen on the USB bus.
    """
    without = [camera.name for camera in cameras if not camera.has_driver]
    if without:
        return fail("camera", f"USB camera {without[0]!r} has no driver", "modprobe uvcvideo; then look at dmesg")
    if nodes:
        return fail(
            "camera",
            f"none of {counted(nodes, 'video node')} gives images",
            "see the next lines; unplug and plug it again",
        )
    return fail("camera", "none is plugged in", "plug one in; lsusb lists what the USB bus sees")


def check_format(camera: str, offered: Offered, wanted: Wanted) -> Diagnostic:
    """Judge the request against what the driver offers."""
    try:
        choice = choose(offered.formats, wanted, camera)
        rate_hz = choose_rate(offered.rates.get((choice.letters, choice.size_px), Rates()), wanted, camera)
    except TandemError as error:
        return fail("format", error.problem, error.remedy)
    width_px, height_px = choice.size_px
    offer = f"{choice.letters} {width_px}x{height_px} at {rate_text(rate_hz)} frames/s is offered"
    return ok("format", f"{offer} by the driver; the line `stream` says what the camera gives")


def check_bus(bus: UsbBus, frame_bytes: int, rate_hz: float) -> Diagnostic:
    """Judge whether the USB bus can carry a stream."""
    needed = frame_bytes * rate_hz
    shares = f", shared with {counted(bus.cameras - 1, 'more camera')}" if bus.cameras > 1 else ""
    room = next((room for megabits, room in _BUS_BYTES if bus.megabits <= megabits), 0)
    if not room:
        return ok("usb", f"port {bus.port}, {bus.megabits:g} Mbit/s{shares}: {needed / _MB:.1f} MB/s is no burden")
    text = f"port {bus.port}, {bus.megabits:g} Mbit/s{shares}: {needed / _MB:.1f} MB/s needed of {room / _MB:.1f}"
    if needed > room:
        return fail("usb", text, "ask for format=mjpeg, a smaller size or fewer frames")
    if bus.megabits < 480:
        return warn("usb", text, "the port or a hub is slow (USB 1): use a USB 2 port")
    if needed * bus.cameras > room:
        return warn(
            "usb", text, "put the cameras on ports of different controllers, or ask for fewer or smaller frames"
        )
    return ok("usb", text)


def raw_frame_bytes(offered: Offered, wanted: Wanted) -> int:
    """Length of a frame if the format alone determines it; 0 for compressed formats and for requests that cannot be met."""
    try:
        choice = choose(offered.formats, wanted, "")
    except TandemError:
        return 0
    return raw_bytes(choice.pixel_format, *choice.size_px) or 0


def check_stream(sample: Sample) -> list[Diagnostic]:
    """Judge the result of streaming: frames, rate, stamps."""
    spoiled = sum(count for _, count in sample.spoiled)
    faults = ", ".join(f"{count} {fault}" for fault, count in sample.spoiled)
    if not sample.frames:
        text = f"no sound frame ({faults})" if spoiled else "no frame at all"
        return [
            fail("stream", text, "another cable, port or hub; unplug it and plug it in again; see power and usb-log")
        ]
    nominal_hz = 1e9 / sample.nominal_ns
    rate = f"{1e9 / sample.period_ns:.1f}" if sample.period_ns else "too few to tell"
    text = (
        f"{counted(sample.frames, 'sound frame')}, {rate} of {nominal_hz:.3g} a second, {sample.frame_bytes / 1000:.0f} KB each, "
        f"the first after {sample.first_ns / 1e9:.2f} s"
    )
    if spoiled:
        finding = warn("stream", f"{text}; spoiled: {faults}", "a better cable or port: frames are cut on the USB bus")
    elif sample.period_ns and sample.nominal_ns < _SLOW * sample.period_ns:
        slow = f"{text}; the camera is slower than the driver offers"
        finding = warn("stream", slow, rate_remedy(sample.period_ns, sample.nominal_ns, sample.exposure_ns))
    elif sample.frames >= _FEW and sample.missed > _MANY_MISSED * sample.frames:
        finding = warn(
            "stream", f"{text}; {sample.missed} missed", "the machine is busy, or the bus full: smaller frames"
        )
    else:
        finding = ok("stream", text)
    return [finding, _check_stamps(sample), *_check_controls(sample)]


def check_taken(holders: tuple[Holder, ...], service_pid: int, status: str, *, all_seen: bool) -> Diagnostic:
    """Judge a camera from which another process streams.

    Args:
        holders: processes that have its node open.
        service_pid: main process of our own service; 0: it is not running.
        status: the service's own status text.
        all_seen: whether every process could be inspected.
    """
    if service_pid and any(holder.pid == service_pid for holder in holders):
        if "is it plugged in?" in status:
            return fail(
                "stream", f"our own service has it and says: {status}", "cable, hub or supply; plug it in again"
            )
        return ok("stream", f"our own service has it (pid {service_pid}) and says: {status or 'nothing'}")
    if holders:
        return fail("stream", f"in use by {', '.join(map(str, holders))}", "end that program, or use another camera")
    if not all_seen:
        return warn("stream", "in use; by whom, only root may see", "ask again as root: sudo")
    return fail("stream", "in use by a program that cannot be seen", "end it (a container?), or use another camera")


def _check_stamps(sample: Sample) -> Diagnostic:
    meaning = "first packet of a frame" if sample.driver == "uvcvideo" else "as its flags say"
    match sample.stamps:
        case StampClock.MONOTONIC:
            named = "CLOCK_MONOTONIC"
        case StampClock.COPY:
            named = "a copied clock"
        case _:
            named = "an unnamed clock"
    if sample.distrusted:
        return warn(
            "stamps",
            f"{sample.distrusted} of {counted(sample.frames, 'stamp')} of driver {sample.driver} ({named}) cannot be true",
            "the moment of dequeuing stands for them, some ms late and less even; a UVC webcam has better ones",
        )
    return ok("stamps", f"driver {sample.driver} stamps {named}, {meaning}; all plausible")


def _check_controls(sample: Sample) -> list[Diagnostic]:
    if not sample.refused:
        return []
    return [
        warn("controls", f"the driver refused {sample.refused} settings", "see board-agent cameras for their ranges")
    ]
