"""A camera is a source of still-encoded frames with stamps. Board and host use the same implementations.

A camera never blocks: it says what to wait for (`pollable`, `due_ns`) and then returns what has come since.
"""

from enum import Enum
from typing import Any, Protocol, cast

from common.frame import Frame, FrameFault
from common.orientation import UPRIGHT, Orientation
from common.protocol.message import CameraDescription, Locks
from common.value import value


@value()
class Spoiled:
    """A grab whose bytes are not a whole image. It has a sequence number like any other.

    Attributes:
        sequence: number of the grab.
        fault: what is wrong with the bytes.
    """

    sequence: int
    fault: FrameFault


@value()
class Skipped:
    """A grab that was skipped unread because a newer one was already there. It has a sequence number like any other.

    Attributes:
        sequence: number of the grab; of the first one if several are reported at once.
        frames: how many were skipped.
    """

    sequence: int
    frames: int = 1


@value()
class Ended:
    """No frame will follow."""


Grab = Frame | Spoiled | Skipped | Ended


@value()
class Mode:
    """What a camera can be told to deliver while it runs.

    Attributes:
        period_ns: nominal time between frames, ns.
        quality: JPEG quality in the camera's own unit, more is better; 0 where it cannot be set.
        size_px: image size (width, height), px; zeros where it cannot be set.
    """

    period_ns: int
    quality: int = 0
    size_px: tuple[int, int] = (0, 0)


@value()
class Offers:
    """The values that a camera's mode can take, the current ones first. Empty tuples where nothing can be changed while it runs.

    Attributes:
        periods_ns: nominal times between frames, ns, the shortest first; none is shorter than the current one.
        qualities: JPEG qualities, the best first; none is better than the current one.
        sizes_px: image sizes (width, height), px, the largest first; all have exactly the same shape and support all of these periods.
    """

    periods_ns: tuple[int, ...] = ()
    qualities: tuple[int, ...] = ()
    sizes_px: tuple[tuple[int, int], ...] = ()


class CameraState(Enum):
    """Whether frames come."""

    RUNNING = "running"
    PAUSED = "paused"
    GONE = "gone"


@value()
class StampOrigin:
    """How a camera's stamps came onto this machine's clock, where they had to be taken over from another one.

    Attributes:
        epoch: the clock on which they were found to count, in words; empty: it is being found out.
        uncertainty_ns: uncertainty of the newest one by that, ns; None: there is none yet.
        bound_ns: its hard bound, ns; None likewise.
    """

    epoch: str
    uncertainty_ns: int | None = None
    bound_ns: int | None = None


def origin_words(origin: StampOrigin) -> str:
    """Say how a camera's stamps came onto this machine's clock."""
    if not origin.epoch or origin.uncertainty_ns is None:
        return "on which clock its stamps count is not known yet"
    known = f", known to +-{origin.uncertainty_ns / 1e6:.2f} ms" if origin.uncertainty_ns else ""
    return f"its stamps count on {origin.epoch}{known}"


@value()
class CameraHealth:
    """How a camera has performed since it was opened.

    Attributes:
        state: whether frames come.
        missed: frames that the camera took but the driver had no buffer for or lost on the bus (gaps in its numbers).
        faults: number of spoiled grabs, by fault.
        stalls: how often frames stopped coming and the device was reopened.
        failures: how often the driver failed (EIO and the like) and the device was reopened.
        unplugged: how often the device vanished.
        returned: how often the device came back after any of these.
        distrusted_stamps: frames whose stamp could not be true, so that the time of dequeuing replaces it.
        refused_controls: controls that the driver would not set.
        held: exposure, gain, white balance and focus as now held, by name, in the control's own unit.
        period_ns: measured time between frames, ns; None where unknown.
        latency_ns: calibrated time from exposure to arrival, subtracted from every stamp, ns; None if there is none, or the driver knows it.
        latency_uncertainty_ns: stated uncertainty of that; None if not stated.
        jitter_ns: how much later than the fastest frame 95 % of the frames arrived; None where stamps are not arrival times.
        origin: how stamps were taken over from another clock; None where they were not.
    """

    state: CameraState = CameraState.RUNNING
    missed: int = 0
    faults: tuple[tuple[FrameFault, int], ...] = ()
    stalls: int = 0
    failures: int = 0
    unplugged: int = 0
    returned: int = 0
    distrusted_stamps: int = 0
    refused_controls: int = 0
    held: tuple[tuple[str, int], ...] = ()
    period_ns: int | None = None
    latency_ns: int | None = None
    latency_uncertainty_ns: int | None = None
    jitter_ns: int | None = None
    origin: StampOrigin | None = None


def health_values(health: CameraHealth) -> dict[str, Any]:
    """A camera's health as a JSON object; `stamps` only where they were taken over from another clock."""
    values: dict[str, Any] = {
        "state": health.state.value,
        "missed": health.missed,
        "faults": {fault.value: count for fault, count in health.faults},
        "stalls": health.stalls,
        "failures": health.failures,
        "unplugged": health.unplugged,
        "returned": health.returned,
        "distrusted_stamps": health.distrusted_stamps,
        "refused_controls": health.refused_controls,
        "held": dict(health.held),
        "period_ms": None if health.period_ns is None else round(health.period_ns / 1e6, 3),
    }
    if (origin := health.origin) is not None:
        values["stamps"] = {
            "epoch": origin.epoch,
            "uncertainty_us": None if origin.uncertainty_ns is None else origin.uncertainty_ns / 1e3,
            "bound_us": None if origin.bound_ns is None else origin.bound_ns / 1e3,
        }
    return values


class Camera(Protocol):
    """What every camera offers."""

    @property
    def description(self) -> CameraDescription:
        """Requested size, encoding, period and pacing. The period follows the mode; the frames themselves tell a different size."""

    @property
    def offers(self) -> Offers:
        """What it can deliver instead of what was first requested. The first request stays the first of each."""

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Deliver frames of another mode from now on. A device may need a restart for this. A camera that offers none ignores the call.

        Args:
            mode: composed of offered values.
            now_ns: CLOCK_MONOTONIC now, ns.
        """

    @property
    def pollable(self) -> int | None:
        """A file descriptor that becomes readable, urgent or in error when there is something to read; None if only `due_ns` counts.

        It may change with every `read`, `pause` and `resume`: a lost device comes back as a different one.
        """

    def due_ns(self, now_ns: int) -> int:
        """When `read` will have something, ns on the machine's CLOCK_MONOTONIC; the far future if that depends on `pollable` or demand."""

    def read(self, now_ns: int) -> list[Grab]:
        """Return what has come since the last call, oldest first, without waiting.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns. A demand-paced camera returns one image per call.
        """

    def anchor(self, exposed_ns: int, index: int) -> None:
        """Make a demand-paced camera's next image number `index`, exposed at `exposed_ns`. Other cameras ignore the call."""

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Expose later from now on, as `description.steering` allows. A camera that cannot ignores the call.

        Args:
            later_ns: by how much, less than a period, ns.
            now_ns: CLOCK_MONOTONIC now, ns.
        """

    @property
    def health(self) -> CameraHealth:
        """The camera's health as values, for summaries and for monitoring."""

    def pause(self) -> None:
        """Tell the camera that nobody listens, so a device may rest. Repeating the call is harmless."""

    def resume(self, now_ns: int) -> None:
        """Tell the camera that somebody listens again: frames come as soon as possible. Repeating the call is harmless."""

    def close(self) -> None:
        """Release the device."""


class LockableCamera(Protocol):
    """What a camera offers besides if some of its controls can be held at given values. `description.controls` names them."""

    @property
    def held_locks(self) -> Locks:
        """The controls that are held now, with the values that the device reports; none while it is away."""

    def hold(self, locks: Locks, now_ns: int) -> None:
        """Hold controls at values from now on, also after the device was away.

        Args:
            locks: each control with its value; one that the device lacks is left out.
            now_ns: CLOCK_MONOTONIC now, ns.
        """


def lockable(camera: Camera) -> LockableCamera | None:
    """Return what holds a camera's controls; None for a camera that has nothing to hold."""
    return cast("LockableCamera", camera) if hasattr(camera, "hold") and hasattr(camera, "held_locks") else None


def software_of(camera: Camera) -> str:
    """Return the program that makes a camera's images out of what its device gives, such as a browser; empty: none."""
    return str(getattr(camera, "software", ""))


def held_locks(camera: Camera) -> Locks:
    """Return the controls of any camera that are held now, with their values."""
    holder = lockable(camera)
    return () if holder is None else holder.held_locks


def upright_px(camera: Camera) -> tuple[int, int]:
    """Return width and height of a camera's upright images, px: after what the headers of replayed files say, then after the camera's turn."""
    description = camera.description
    stored: Orientation = getattr(camera, "stored", UPRIGHT)  # a replay's alone
    return description.orientation.turned_size(stored.turned_size((description.width_px, description.height_px)))
