"""One line for people on how the board is doing: its rate, its host, or what is missing. A core, `now_ns` passed in."""

from typing import Final

from common.protocol.message import BoardCounts, Pacing, Rung

_SILENT_NS: Final = 3_000_000_000
"""Without a frame for this long a camera that goes by the clock counts as silent: above the slowest useful rate of 1 fps."""


class StatusLine:
    """Makes up the line from the account of the frames.

    Args:
        camera: the camera's URI.
        pacing: whether it gives frames by itself.
        links: URIs of the links.
        now_ns: CLOCK_MONOTONIC now, ns.
    """

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
    ) -> str:
        """Give the line; the rate is the mean since it was asked for last.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.
            counts: what became of all frames so far.
            has_host: whether a host is served.
            carrier: index of the link that its frames go to; None while there is none.
            rung: how far the camera is lowered; None where it cannot be.
        """
        fresh = counts.grabbed - self._grabbed
        rate_hz = fresh * 1e9 / max(1, now_ns - self._measured_ns)
        if fresh:
            self._moved_ns = now_ns
        self._measured_ns, self._grabbed = now_ns, counts.grabbed
        silent_ns = now_ns - self._moved_ns
        if not has_host:
            self._moved_ns = now_ns  # the camera may rest
            return f"waiting for a host on {' and '.join(self._links)}"
        if self._pacing is Pacing.CLOCK and silent_ns >= _SILENT_NS:
            return f"no frame from {self._camera} for {silent_ns // 1_000_000_000} s: is it plugged in?"
        dropped = sum(count for _, count in counts.dropped)
        over = "" if carrier is None else f" over {self._links[carrier]}"
        return f"{rate_hz:.1f} fps{over}, {counts.sent} sent to the host, {dropped} dropped{_lowered(rung)}"


def _lowered(rung: Rung | None) -> str:
    """What the camera gives where that is less than was asked for."""
    if rung is None or not rung.index:
        return ""
    quality = f" at quality {rung.quality}" if rung.quality else ""
    size = f" of {rung.width_px}x{rung.height_px}" if rung.width_px else ""
    fps = f"{1e9 / rung.period_ns:.3g}"
    return f"; lowered to {fps} fps{size}{quality} for the link (rung {rung.index} of {rung.last})"
