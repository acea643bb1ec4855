"""A camera is a source of still-encoded frames with stamps. Board and host use the same ones.

A camera never blocks: it says what to wait for (`pollable`, `due_ns`) and then gives what has come since.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol

from common.frame import Frame, FrameFault
from common.protocol.message import CameraDescription


@dataclass(frozen=True, slots=True)
class Spoiled:
    """A grab whose bytes are no whole image; it has a sequence number like any other.

    Attributes:
        sequence: number of the grab.
        fault: what is wrong with the bytes.
    """

    sequence: int
    fault: FrameFault


@dataclass(frozen=True, slots=True)
class Skipped:
    """A grab that was passed over unread, because a newer one was there already; it has a sequence number like any other.

    Attributes:
        sequence: number of the grab; of the first one where several are told of at once.
        frames: how many.
    """

    sequence: int
    frames: int = 1


@dataclass(frozen=True, slots=True)
class Ended:
    """No frame will follow."""


Grab = Frame | Spoiled | Skipped | Ended


@dataclass(frozen=True, slots=True)
class Mode:
    """What a camera can be told to give while it runs.

    Attributes:
        period_ns: nominal time between frames, ns.
        quality: of its JPEG images in the camera's own unit, more is better; 0 where it cannot be set.
        size_px: (width, height) of its images, px; zeros where it cannot be set.
    """

    period_ns: int
    quality: int = 0
    size_px: tuple[int, int] = (0, 0)


@dataclass(frozen=True, slots=True)
class Offers:
    """What a camera's mode can be made of, the present values first; both empty where nothing can be changed while it runs.

    Attributes:
        periods_ns: nominal times between frames, ns, the shortest first; none is shorter than the present one.
        qualities: of its JPEG images, the best first; none is better than the present one.
        sizes_px: (width, height) of its images, px, the largest first; all have exactly one shape and all of these periods.
    """

    periods_ns: tuple[int, ...] = ()
    qualities: tuple[int, ...] = ()
    sizes_px: tuple[tuple[int, int], ...] = ()


class CameraState(Enum):
    """Whether frames come."""

    RUNNING = "running"
    PAUSED = "paused"
    GONE = "gone"


@dataclass(frozen=True, slots=True)
class CameraHealth:
    """How a camera has fared since it was opened.

    Attributes:
        state: whether frames come.
        missed: frames that the camera took and the driver had no buffer for or lost on the bus (gaps in its numbers).
        faults: number of spoiled grabs by what was wrong with them.
        stalls: how often frames stayed away and the device was opened anew for it.
        failures: how often the driver failed (EIO and the like) and the device was opened anew.
        unplugged: how often the device vanished.
        returned: how often the device was back after any of these.
        distrusted_stamps: frames whose stamp could not be true, so that the moment of dequeuing stands for it.
        refused_controls: controls that the driver would not set.
        held: exposure, gain, white balance and focus as they are held now, by name, in the control's own unit.
        period_ns: time between frames as measured, ns; None where unknown.
        latency_ns: calibrated time from exposure to arrival that was subtracted from every stamp, ns; None where there is none, or the driver knows.
        latency_uncertainty_ns: of that, as it was stated; None: not stated.
        jitter_ns: how much later than the swiftest frame 95 % of them arrived; None where stamps are no arrivals.
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


def health_values(health: CameraHealth) -> dict[str, Any]:
    """A camera's health as a JSON object."""
    return {
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


class Camera(Protocol):
    """What every camera offers."""

    @property
    def description(self) -> CameraDescription:
        """Size as it was asked for, encoding, period and pacing. The period follows the mode; another size is told by the frames themselves."""

    @property
    def offers(self) -> Offers:
        """What it can be told to give instead of what it was asked for at first; that stays the first of each."""

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Give frames of another mode from now on; a device may need a new start for it. A camera that offers none takes no notice.

        Args:
            mode: made of what it offers.
            now_ns: CLOCK_MONOTONIC now, ns.
        """

    @property
    def pollable(self) -> int | None:
        """A file descriptor that becomes readable, urgent or in error when there is something to read; None for a camera that goes by `due_ns` alone.

        It may change with every `read`, `pause` and `resume`: a device that was lost comes back as another one.
        """

    def due_ns(self, now_ns: int) -> int:
        """When `read` will have something, ns on the machine's CLOCK_MONOTONIC; the far future if that is up to `pollable` or demand."""

    def read(self, now_ns: int) -> list[Grab]:
        """Give what has come since the last call, oldest first, without waiting.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns. A demand-paced camera gives one image for each call.
        """

    def anchor(self, exposed_ns: int, index: int) -> None:
        """Let a demand-paced camera's next image be number `index`, exposed at `exposed_ns`; other cameras take no notice."""

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Expose later from now on, as `description.steering` says; a camera that cannot takes no notice.

        Args:
            later_ns: by how much, less than a period, ns.
            now_ns: CLOCK_MONOTONIC now, ns.
        """

    @property
    def health(self) -> CameraHealth:
        """How it has fared; values, for summaries and for those who watch."""

    def pause(self) -> None:
        """Take note that nobody listens: a device may rest. Again is harmless."""

    def resume(self, now_ns: int) -> None:
        """Take note that somebody listens again: frames come as soon as can be. Again is harmless.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.
        """

    def close(self) -> None:
        """Let go of the device."""
