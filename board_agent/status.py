"""One line for people about how the board is doing: its rate, its host, or what is missing. A core, `now_ns` passed in."""

from typing import Final

from common.camera.base import CameraState
from common.protocol.message import BoardCounts, Pacing, Rung

_SILENT_NS: Final = 3_000_000_000
"""A clock-paced camera counts as silent after this long without a frame. This is above the period of the slowest useful rate, 1 fps."""


class StatusLine:
    """Makes the status line from the account of the frames."""

    def __init__(self, camera: str, pacing: Pacing, links: tuple[str, ...], now_ns: int) -> None:
        self._camera = camera
        self._pacing = pacing
        self._links = links
        self._measured_ns = self._moved_ns = now_ns
        self._grabbed = 0

    def text(
        self,
        now_ns: int,
        counts: BoardCounts,
        *,
        has_host: bool,
        carrier: int | None = None,
        rung: Rung | None = None,
        camera: CameraState = CameraState.RUNNING,
    ) -> str:
        """Return the line. Its rate is the mean since the last call.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.
            counts: account of all frames so far.
            has_host: whether a host is served.
            carrier: index of the link that carries frames; None if there is none.
            rung: how far the camera is lowered; None if it cannot be.
            camera: whether the camera is there.
        """
        fresh = counts.grabbed - self._grabbed
        rate_hz = fresh * 1e9 / max(1, now_ns - self._measured_ns)
        if fresh:
            self._moved_ns = now_ns
        self._measured_ns, self._grabbed = now_ns, counts.grabbed
        silent_ns = now_ns - self._moved_ns
        if not has_host and camera is CameraState.GONE:
            return f"the camera is gone: {self._camera}; waiting for it, and for a host on {' and '.join(self._links)}"
        if not has_host:
            self._moved_ns = now_ns  # the camera may rest
            return f"waiting for a host on {' and '.join(self._links)}"
        if self._pacing is Pacing.CLOCK and silent_ns >= _SILENT_NS:
            return f"no frame from {self._camera} for {silent_ns // 1_000_000_000} s: is it plugged in?"
        dropped = sum(count for _, count in counts.dropped)
        over = "" if carrier is None else f" over {self._links[carrier]}"
        return f"{rate_hz:.1f} fps{over}, {counts.sent} sent to the host, {dropped} dropped{_lowered(rung)}"


def _lowered(rung: Rung | None) -> str:
    """Describe the camera's output where it is less than was asked for."""
    if rung is None or not rung.index:
        return ""
    quality = f" at quality {rung.quality}" if rung.quality else ""
    size = f" of {rung.width_px}x{rung.height_px}" if rung.width_px else ""
    fps = f"{1e9 / rung.period_ns:.3g}"
    return f"; lowered to {fps} fps{size}{quality} for the link (rung {rung.index} of {rung.last})"
