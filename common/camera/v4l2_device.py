"""One open V4L2 node: its identity, format, rate and controls. A thin shell over ioctls; decisions are made elsewhere.

Methods raise the kernel's OSError, except for opening, which explains in words what is wrong.
"""

import ctypes
import errno
import fcntl
import os
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Final, Self

from common.camera import v4l2_abi as abi
from common.camera.v4l2_controls import Control
from common.camera.v4l2_formats import FormatOffer, PixelFormatSet, Rates, SizeRange
from common.errors import TakenError, UnavailableError
from common.value import value

_CLASS: Final = Path("/sys/class/video4linux")
_MOST_BYTES: Final = 1024
"""A USB string has at most 126 letters (USB 2.0, 9.6.7)."""


def serial_number(node: Path, folder: Path = _CLASS) -> str:
    """Return the serial number of the USB device behind a video node; empty if it has none, or is no USB device.

    Many cameras have none, and some models have the same in every camera.

    Args:
        node: the node or a link to it.
        folder: the class folder of video devices in sysfs; `NAME/device` in it is the USB interface, whose parent is the device.
    """
    try:
        device = (folder / node.resolve().name / "device").resolve().parent
        if not (device / "idVendor").exists():
            return ""
        with (device / "serial").open("rb") as file:
            return file.read(_MOST_BYTES).decode("utf-8", "replace").strip()
    except OSError:
        return ""


_BY_ID: Final = Path("/dev/v4l/by-id")
_BY_PATH: Final = Path("/dev/v4l/by-path")
_MOST_ITEMS: Final = 256
"""An enumeration that continues beyond this is a driver's endless loop."""


@value(kw_only=True)
class Identity:
    """What a node says about itself.

    Attributes:
        driver: kernel driver, such as uvcvideo.
        card: the camera's name.
        bus: where it is plugged in.
        capabilities: V4L2_CAP bits of this particular node.
    """

    driver: str
    card: str
    bus: str
    capabilities: int

    @property
    def captures(self) -> bool:
        """Whether the node delivers images that can be streamed (a webcam's second node delivers metadata)."""
        wanted = abi.CAP_VIDEO_CAPTURE | abi.CAP_STREAMING
        return self.capabilities & wanted == wanted


def ioctl(fd: int, request: int, argument: ctypes.Structure | ctypes.c_int) -> None:
    """Call an ioctl; repeat it if a signal interrupts it."""
    while True:
        try:
            fcntl.ioctl(fd, request, argument)
        except InterruptedError:
            continue
        return


def taken(path: Path) -> TakenError:
    """The error for a camera that another program streams from (EBUSY)."""
    return TakenError(f"camera {path} is in use by another program", "end that program, or use another camera")


def video_nodes() -> list[Path]:
    """All nodes of the kernel's V4L2 devices by number, whatever they deliver and whoever may open them."""
    return sorted(
        (path for path in _listed(Path("/dev"), "video") if path.name[5:].isdigit()),
        key=lambda path: int(path.name[5:]),
    )


def capture_nodes() -> list[Path]:
    """All capture nodes in name order, those with a name in /dev/v4l/by-id first. Metadata and output nodes are left out."""
    nodes: dict[Path, Path] = {}
    for path in (*_listed(_BY_ID), *video_nodes()):
        nodes.setdefault(path.resolve(), path)
    return [path for path in nodes.values() if _captures(path)]


def lasting_name(path: Path) -> Path:
    """The name that a camera keeps when it is plugged in again: its link in by-id, otherwise in by-path, otherwise the node itself."""
    if path.parent in {_BY_ID, _BY_PATH}:
        return path
    target = path.resolve()
    for folder in (_BY_ID, _BY_PATH):
        for link in _listed(folder):
            if link.resolve() == target:
                return link
    return path


def find_camera(path: str) -> Path:
    """The requested camera, or the first one if none is, by a name that survives unplugging.

    Raises:
        UnavailableError: this machine has no camera.
    """
    if path:
        return lasting_name(Path(path))
    nodes = capture_nodes()
    if not nodes:
        raise UnavailableError("no camera was found", "plug one in, or check that the user is in the group video")
    return lasting_name(nodes[0])


def _listed(folder: Path, prefix: str = "") -> list[Path]:
    """The entries of a folder in name order; none if it does not exist. A board that waits for its camera asks four times a second."""
    try:
        names = os.listdir(folder)  # noqa: PTH208 - makes paths only of matching names: a third of the time of `glob`
    except OSError:
        return []
    return [folder / name for name in sorted(names) if name.startswith(prefix)]


def _captures(path: Path) -> bool:
    try:
        with Device(path) as device:
            return device.identity.captures
    except (UnavailableError, OSError):
        return False


class Device:
    """An open, non-blocking V4L2 node.

    Raises:
        UnavailableError: it is missing, not permitted, or not a V4L2 node.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.fd = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
        except PermissionError:
            raise UnavailableError(
                f"camera {path} may not be opened by this user",
                "add the user to the group video: sudo usermod -aG video $USER, then log in again",
            ) from None
        except OSError as error:
            raise UnavailableError(
                f"camera {path} cannot be opened ({error.strerror})",
                "plug it in, or give one of those that `board-agent cameras` lists",
            ) from None
        try:
            self.identity = self._identify()
        except OSError as error:
            self.close()
            raise UnavailableError(
                f"{path} is not a V4L2 device ({error.strerror})", "give a node such as /dev/video0"
            ) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the node. Repeating the call is harmless."""
        if self.fd >= 0:
            fd, self.fd = self.fd, -1
            os.close(fd)

    def require_capture(self) -> None:
        """Check that this node delivers images.

        Raises:
            UnavailableError: it delivers something else. The remedy names the node to use, if there is one.
        """
        capabilities = self.identity.capabilities
        if self.identity.captures:
            return
        if capabilities & abi.CAP_META_CAPTURE:
            raise UnavailableError(
                f"camera {self.path} gives metadata, not images",
                "use the camera's other device, the one whose name ends in index0",
            )
        if capabilities & abi.CAP_VIDEO_CAPTURE_MPLANE:
            raise UnavailableError(
                f"camera {self.path} stores its images in several buffers, which is not supported", "use a USB camera"
            )
        raise UnavailableError(f"camera {self.path} gives no images", "use a camera that `board-agent cameras` lists")

    def formats(self) -> tuple[FormatOffer, ...]:
        """The encodings and sizes on offer."""
        offers = []
        for index in range(_MOST_ITEMS):
            item = abi.FormatDescription(index=index, type=abi.BUF_TYPE_VIDEO_CAPTURE)
            if not self._enumerate(abi.ENUM_FMT, item):
                break
            sizes, size_range = self._sizes(item.pixelformat)
            offers.append(
                FormatOffer(
                    letters=abi.fourcc_name(item.pixelformat),
                    text=_text(item.description),
                    sizes_px=sizes,
                    size_range=size_range,
                )
            )
        return tuple(offers)

    def rates(self, letters: str, size_px: tuple[int, int]) -> Rates:
        """The frame rates of an encoding and size."""
        named, between = set(), None
        for index in range(_MOST_ITEMS):
            item = abi.FrameInterval(index=index, pixel_format=abi.fourcc(letters), width=size_px[0], height=size_px[1])
            if not self._enumerate(abi.ENUM_FRAMEINTERVALS, item):
                break
            shortest, longest = item.values[0], item.values[1]
            if item.type == abi.FRMIVAL_TYPE_DISCRETE:
                if shortest.numerator and shortest.denominator:
                    named.add(Fraction(shortest.denominator, shortest.numerator))
            else:
                if all((shortest.numerator, shortest.denominator, longest.numerator, longest.denominator)):
                    between = (
                        Fraction(longest.denominator, longest.numerator),
                        Fraction(shortest.denominator, shortest.numerator),
                    )
                break
        return Rates(tuple(sorted(named, reverse=True)), between)

    def set_format(self, letters: str, size_px: tuple[int, int]) -> PixelFormatSet:
        """Set encoding and size; return what the driver actually set."""
        shape = abi.LAYOUTS[0]
        item = shape.format(type=abi.BUF_TYPE_VIDEO_CAPTURE)
        item.pix = abi.PixelLayout(
            width=size_px[0], height=size_px[1], pixelformat=abi.fourcc(letters), field=abi.FIELD_NONE
        )
        ioctl(self.fd, shape.s_fmt, item)
        pix = item.pix
        row_bytes, size_px = int(pix.bytesperline), (int(pix.width), int(pix.height))
        return PixelFormatSet(
            letters=abi.fourcc_name(pix.pixelformat),
            size_px=size_px,
            row_bytes=row_bytes,
            image_bytes=int(pix.sizeimage),
        )

    def set_rate(self, rate_hz: Fraction) -> Fraction | None:
        """Set the frame rate, Hz; return the rate that the driver actually set, or None if it does not say."""
        item = abi.StreamParameters(type=abi.BUF_TYPE_VIDEO_CAPTURE)
        try:
            ioctl(self.fd, abi.G_PARM, item)
            if item.capability & abi.CAP_TIMEPERFRAME:
                item.timeperframe = abi.Fraction(rate_hz.denominator, rate_hz.numerator)
                ioctl(self.fd, abi.S_PARM, item)
        except OSError as error:
            if error.errno in {errno.ENOTTY, errno.EINVAL}:
                return None
            raise
        period = item.timeperframe
        return Fraction(period.denominator, period.numerator) if period.numerator and period.denominator else None

    def controls(self) -> tuple[Control, ...]:
        """The controls, in the driver's order."""
        found: list[Control] = []
        query = abi.ControlQuery(id=abi.CTRL_FLAG_NEXT_CTRL)
        while len(found) < _MOST_ITEMS and self._enumerate(abi.QUERY_EXT_CTRL, query):
            if query.type != abi.CTRL_TYPE_CTRL_CLASS and not query.flags & abi.CTRL_FLAG_DISABLED:
                menu = tuple(self._menu(query)) if query.type == abi.CTRL_TYPE_MENU else ()
                found.append(
                    Control(
                        id=query.id,
                        name=_text(query.name),
                        kind=query.type,
                        minimum=query.minimum,
                        maximum=query.maximum,
                        step=query.step,
                        default=query.default_value,
                        flags=query.flags,
                        menu=menu,
                    )
                )
            query.id |= abi.CTRL_FLAG_NEXT_CTRL
        return tuple(found)

    def control(self, control_id: int) -> int:
        """Read a control."""
        item = abi.ControlValue(id=control_id)
        ioctl(self.fd, abi.G_CTRL, item)
        return int(item.value)

    def set_control(self, control_id: int, value: int) -> None:
        """Set a control."""
        ioctl(self.fd, abi.S_CTRL, abi.ControlValue(id=control_id, value=value))

    def watch_control(self, control_id: int) -> bool:
        """Have the driver report changes of a control as events (EPOLLPRI). Return False if it cannot."""
        item = abi.EventSubscription(type=abi.EVENT_CTRL, id=control_id, flags=abi.EVENT_SUB_FL_ALLOW_FEEDBACK)
        try:
            ioctl(self.fd, abi.SUBSCRIBE_EVENT, item)
        except OSError:
            return False
        return True

    def take_events(self) -> int:
        """Take all waiting events and return their number. Their content is not needed."""
        for shape in abi.LAYOUTS:
            count = 0
            try:
                while count < _MOST_ITEMS:
                    ioctl(self.fd, shape.dqevent, shape.event())
                    count += 1
            except OSError as error:
                if error.errno == errno.ENOTTY and shape is not abi.LAYOUTS[-1]:
                    continue
                if error.errno != errno.ENOENT:  # "no event waits"
                    raise
            return count
        return 0

    def _identify(self) -> Identity:
        item = abi.Capability()
        ioctl(self.fd, abi.QUERYCAP, item)
        own = item.device_caps if item.capabilities & abi.CAP_DEVICE_CAPS else item.capabilities
        return Identity(driver=_text(item.driver), card=_text(item.card), bus=_text(item.bus_info), capabilities=own)

    def _sizes(self, pixelformat: int) -> tuple[tuple[tuple[int, int], ...], SizeRange | None]:
        sizes = []
        for index in range(_MOST_ITEMS):
            item = abi.FrameSize(index=index, pixel_format=pixelformat)
            if not self._enumerate(abi.ENUM_FRAMESIZES, item):
                break
            values = tuple(item.values)
            if item.type != abi.FRMSIZE_TYPE_DISCRETE:
                return (), SizeRange(values[:3], values[3:])
            sizes.append((values[0], values[1]))
        return tuple(dict.fromkeys(sizes)), None

    def _menu(self, query: abi.ControlQuery) -> Iterator[tuple[int, str]]:
        for index in range(query.minimum, min(query.maximum, query.minimum + _MOST_ITEMS) + 1):
            item = abi.MenuItem(id=query.id, index=index)
            if self._enumerate(abi.QUERYMENU, item):  # EINVAL: an index without an item
                yield index, _text(bytes(item.name))

    def _enumerate(self, request: int, item: ctypes.Structure) -> bool:
        """Ask for one item of a list. Return False if there is no such item, or no such list."""
        try:
            ioctl(self.fd, request, item)
        except OSError as error:
            if error.errno in {errno.EINVAL, errno.ENOTTY}:
                return False
            raise
        return True


def _text(raw: bytes) -> str:
    """A driver's text up to its zero."""
    return raw.split(b"\0")[0].decode("utf-8", "replace").strip()
