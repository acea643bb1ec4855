"""How much the board asks of its camera, so that the link can carry it: a ladder of modes, down when needed and up on trial. A core.

`now_ns` is passed in. A frame that the link did not carry in time is replaced by a newer one. If that happens to more than a tenth of the frames,
the camera goes down one rung; if none has been replaced for a while, the rung above is tried. A trial that fails is repeated after twice the
time, for each rung separately. So a link of constant rate is tried less and less, and a link that has improved is climbed rung by rung.
A new link resets these times but not the rung: what it carries is found out starting from the current rung.
"""

from collections.abc import Collection, Iterable
from dataclasses import replace
from enum import Enum
from typing import Final

from common.camera.base import Mode, Offers
from common.errors import SettingsError
from common.protocol.message import BoardCounts, DropReason, Rung

_WINDOW_NS: Final = 1_000_000_000
_FEWEST: Final = 10
"""Frames are judged in windows of a second and of at least this many, so that one late frame is a tenth."""

_KEPT: Final = 0.9
"""If a smaller share of the frames is carried, the link is too slow for the mode: eight of ten are not the requested rate."""

_AT_EASE: Final = 0.97
"""From this share on, the link may have room for more. Between the two, nothing changes."""

_SLOW_NS: Final = 2_500_000_000
"""What lasts this long is not a hiccup. One that is shorter than a window spoils at most two windows."""

_UNDER_WAY: Final = 2
_SETTLE_NS: Final = 500_000_000
"""After a step this much time must pass, so that a camera's automatic controls have settled, and two frames must have been sent: the one that
waited and the one under way."""

_PROOF_NS: Final = 5_000_000_000
_MOST_PROOF_NS: Final = 300_000_000_000
"""How long the link must be at ease before the next rung up is tried: initially and at most. The same limit as for other trials of a link
(phone_host/sync/flow.py)."""

_LOOK_NS: Final = 100_000_000
_NEVER: Final = 2**63 - 1


class Way(Enum):
    """What may be lowered in a camera's output."""

    QUALITY = "quality"
    RATE = "rate"
    SIZE = "size"


def ways(names: Iterable[str]) -> frozenset[Way]:
    """Parse the list of what may be lowered.

    Raises:
        SettingsError: a name is unknown.
    """
    known = {way.value: way for way in Way}
    wrong = sorted(set(names) - set(known))
    if wrong:
        raise SettingsError(f"adapt has {wrong[0]!r}", f"give some of {', '.join(known)}, or none")
    return frozenset(known[name] for name in names)


def ladder(offers: Offers, lowered: Collection[Way], least_fps: float) -> tuple[Mode, ...]:
    """Put a camera's modes in the order in which they are tried. Quality goes first, because every image is kept; then the rate, then the size.

    Args:
        offers: what the camera can be set to.
        lowered: what may be lowered.
        least_fps: the rate is not lowered below this, frames per second; 0: the rate is never lowered.

    Returns:
        Modes, each asking less of the link than the one before; the first is the current one. Empty for a camera with nothing to set.
    """
    if not offers.periods_ns:
        return ()
    period_ns, *longer_ns = offers.periods_ns
    quality, *lower = offers.qualities or (0,)
    size_px, *smaller_px = offers.sizes_px or ((0, 0),)
    modes = [Mode(period_ns, quality, size_px)]
    if Way.QUALITY in lowered:
        modes += [replace(modes[0], quality=value) for value in lower]
    if Way.RATE in lowered and least_fps > 0:
        # A driver's period is rounded to 100 ns; a difference of one hundredth is not another rate (v4l2_formats).
        modes += [replace(modes[-1], period_ns=longer) for longer in longer_ns if longer * least_fps <= 1.01e9]
    if Way.SIZE in lowered:
        modes += [replace(modes[-1], size_px=smaller) for smaller in smaller_px]
    return tuple(modes)


class RateControl:
    """Chooses the rung.

    Args:
        modes: a ladder, the present mode first, at least one.
    """

    def __init__(self, modes: tuple[Mode, ...]) -> None:
        self._modes = modes
        self._index = self._changes = 0
        self._link: int | None = None
        self._proofs_ns = [_PROOF_NS] * len(modes)
        self._due_ns = 0
        self._before = BoardCounts()
        self._has_settled = False
        self._slow_since_ns = _NEVER
        self._entered_ns = self._window_ns = self._good_ns = self._at_ease_since_ns = 0

    @property
    def mode(self) -> Mode:
        """The mode that the camera shall use now."""
        return self._modes[self._index]

    @property
    def rung(self) -> Rung:
        """The position of that mode on the ladder."""
        mode, last = self.mode, len(self._modes) - 1
        return Rung(
            index=self._index,
            last=last,
            changes=self._changes,
            period_ns=mode.period_ns,
            quality=mode.quality,
            width_px=mode.size_px[0],
            height_px=mode.size_px[1],
        )

    def is_due(self, now_ns: int) -> bool:
        """Whether `update` should be called now; ten times a second is enough.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.
        """
        return now_ns >= self._due_ns

    def update(self, counts: BoardCounts, link: int | None, now_ns: int) -> bool:
        """Check what became of the frames, and step if necessary.

        Args:
            counts: account of all frames so far.
            link: number of the link that carries frames; None: there is none.
            now_ns: CLOCK_MONOTONIC now, ns.

        Returns:
            Whether the mode has changed.
        """
        self._due_ns = now_ns + _LOOK_NS
        if link != self._link:
            self._link, self._proofs_ns = link, [_PROOF_NS] * len(self._modes)
            self._enter(counts, now_ns)
        if link is None or not self._is_settled(counts, now_ns):
            return False
        carried = counts.sent - self._before.sent
        offered = carried + _not_carried(counts) - _not_carried(self._before)
        # A link that carries nothing at all teaches nothing: it is about to be given up.
        if now_ns - self._window_ns < _WINDOW_NS or offered < _FEWEST or carried < _UNDER_WAY:
            return False
        begin_ns, self._before, self._window_ns = self._window_ns, counts, now_ns
        share = carried / offered
        if share < _KEPT:
            self._slow_since_ns = min(self._slow_since_ns, begin_ns)
            self._at_ease_since_ns = now_ns
            return now_ns - self._slow_since_ns >= _SLOW_NS and self._go_down(counts, now_ns)
        self._good_ns, self._slow_since_ns = now_ns, _NEVER
        if share < _AT_EASE:
            self._at_ease_since_ns = now_ns
        elif self._index and now_ns - self._at_ease_since_ns >= self._proofs_ns[self._index - 1]:
            self._step(-1, counts, now_ns)
            return True
        return False

    def _go_down(self, counts: BoardCounts, now_ns: int) -> bool:
        """Take the next rung down, if any. If the rung just left did not hold for its trial time, it is tried again only after twice that time."""
        if self._index == len(self._modes) - 1:
            return False
        proof_ns = self._proofs_ns[self._index]
        has_failed = self._good_ns - self._entered_ns < proof_ns
        self._proofs_ns[self._index] = min(_MOST_PROOF_NS, 2 * proof_ns) if has_failed else _PROOF_NS
        self._step(1, counts, now_ns)
        return True

    def _step(self, by: int, counts: BoardCounts, now_ns: int) -> None:
        self._index += by
        self._changes += 1
        self._enter(counts, now_ns)

    def _enter(self, counts: BoardCounts, now_ns: int) -> None:
        """Restart the measurement."""
        self._before, self._has_settled, self._slow_since_ns = counts, False, _NEVER
        self._entered_ns = self._window_ns = self._good_ns = self._at_ease_since_ns = now_ns

    def _is_settled(self, counts: BoardCounts, now_ns: int) -> bool:
        """Whether the measurement reflects the current mode. If it just begins to, the first window starts now."""
        if self._has_settled:
            return True
        if counts.sent - self._before.sent >= _UNDER_WAY and now_ns - self._entered_ns >= _SETTLE_NS:
            self._before, self._window_ns, self._has_settled = counts, now_ns, True
        return False


def _not_carried(counts: BoardCounts) -> int:
    """Frames for which the link had no room in time."""
    return sum(count for reason, count in counts.dropped if reason in {DropReason.REPLACED, DropReason.LINK_FULL})
