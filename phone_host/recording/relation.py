"""How a board's clock relates to the host's in two recordings that know nothing of each other: by an exchange that a host stored, or by what both saw."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from common.errors import DataError
from common.recording.recorded import Shown, period_ns
from phone_host.recording.clock_messages import ToldClock
from phone_host.recording.offset_fit import Offset, fit_offset
from phone_host.recording.offset_search import LEAST_S, LOBE_S, Unclear, search_offset
from phone_host.recording.watching import watch
from phone_host.sync.clock import ClockEstimate

_TO_999: Final = 3.2905 / 1.96
"""From a half-width that holds 95 % to one that holds 99.9 %."""

_USABLE: Final = 0.5
"""A clock known to this share of a period finds every pair."""


class By(Enum):
    """What told the relation."""

    CLOCK = "clock"
    CONTENT = "content"


@dataclass(frozen=True, slots=True)
class Stream:
    """A camera's images and the clock of their stamps.

    Attributes:
        shown: in the order of their exposure.
        unix_ns: what was added to each time.
        name: the file, for messages.
    """

    shown: Sequence[Shown]
    unix_ns: int
    name: str

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last exposure on the clock of whoever recorded, ns."""
        return self.shown[0].image.stamp_ns - self.unix_ns, self.shown[-1].image.stamp_ns - self.unix_ns


@dataclass(frozen=True, slots=True)
class Relation:
    """The relation between both clocks.

    Attributes:
        by: what told it.
        clock: the relation.
        uncertainty_ns: half-width that holds the true offset in 95 %, where it is known worst.
        content: what was measured, if the content told it.
    """

    by: By
    clock: ClockEstimate
    uncertainty_ns: int
    content: Offset | None = None

    def to_host(self, board_ns: int) -> int:
        """Convert a moment of the board's clock to the host's, ns."""
        return board_ns + self.clock.offset_at(board_ns)


def relate(
    board: Stream, host: Stream, told: Iterable[ToldClock], boot_id: str, advance: Callable[[float], None]
) -> Relation:
    """Find the relation.

    Args:
        board: the board's images.
        host: the images of the host's own camera.
        told: what a host stored of boards' clocks, all on the host clock of `host`.
        boot_id: of the board.
        advance: called with the share that is done, 0 to 1.

    Raises:
        DataError: nothing tells it.
    """
    known = [one.estimate for one in told if boot_id and one.boot_id == boot_id]
    ends = board.span_ns
    best = min(known, key=lambda one: _worst_ns(one, ends), default=None)
    longest_ns = max(period_ns(board.shown), period_ns(host.shown))
    if best is not None and _worst_ns(best, ends) <= _USABLE * longest_ns:
        return Relation(By.CLOCK, best, round(_worst_ns(best, ends) / _TO_999))
    return _by_content(board, host, best, advance)


def _worst_ns(estimate: ClockEstimate, ends_ns: tuple[int, int]) -> int:
    return max(estimate.uncertainty_at(moment_ns) for moment_ns in ends_ns)


def _by_content(board: Stream, host: Stream, known: ClockEstimate | None, advance: Callable[[float], None]) -> Relation:
    zeros = board.span_ns[0], host.span_ns[0]
    first = watch(board.shown, board.unix_ns + zeros[0], lambda share: advance(share / 2))
    second = watch(host.shown, host.unix_ns + zeros[1], lambda share: advance((1 + share) / 2))
    within_s = None if known is None else _within_s(known, board.span_ns, zeros)
    if min(len(first.at_s), len(second.at_s)) < 2:
        raise _unclear(Unclear.SHORT, board, host)
    found = search_offset(first, second, within_s)
    if isinstance(found, Unclear):
        raise _unclear(found, board, host)
    offset = fit_offset(first, second, found.offset_s)
    uncertainty_ns = math.ceil(offset.worst_s * 1e9)
    if uncertainty_ns > _USABLE * max(period_ns(board.shown), period_ns(host.shown)):
        raise DataError(
            f"{board.name} and {host.name} tell their offset only to +-{uncertainty_ns / 1e6:.0f} ms",
            "record longer, and move both cameras together quickly",
        )
    return Relation(By.CONTENT, _estimate(offset, zeros), uncertainty_ns, offset)


def _within_s(known: ClockEstimate, span_ns: tuple[int, int], zeros: tuple[int, int]) -> tuple[float, float]:
    """Return between which offsets, board minus host from their zeros on, the facts of a stored exchange leave it, s."""
    limits = [known.limits_at(moment_ns) for moment_ns in span_ns]
    apart_ns = zeros[0] - zeros[1]
    return (-max(high for _, high in limits) - apart_ns) / 1e9, (-min(low for low, _ in limits) - apart_ns) / 1e9


def _estimate(offset: Offset, zeros: tuple[int, int]) -> ClockEstimate:
    """Return the relation as a clock estimate. Its limits: beyond them nothing fitted."""
    host_ns = zeros[1] + round(offset.at_s * 1e9)
    board_ns = zeros[0] + round((offset.at_s + offset.offset_s) * 1e9)
    wide = math.ceil(offset.uncertainty_s * _TO_999 * 1e9)
    turn = offset.drift_uncertainty * _TO_999
    skew = -offset.drift / (1 + offset.drift)
    offset_ns, limit_ns = host_ns - board_ns, round(LOBE_S * 1e9)
    return ClockEstimate(
        reference_ns=board_ns,
        offset_ns=offset_ns,
        skew=skew,
        skew_uncertainty=turn,
        uncertainty_ns=wide,
        round_trip_ns=0,
        low_ns=offset_ns - limit_ns,
        high_ns=offset_ns + limit_ns,
        skew_low=skew - turn,
        skew_high=skew + turn,
    )


def _unclear(why: Unclear, board: Stream, host: Stream) -> DataError:
    both = f"{board.name} and {host.name}"
    move = "move both cameras together, and not in a rhythm, while they record"
    match why:
        case Unclear.STILL_FIRST:
            return DataError(f"nothing moves in {board.name}, so its times cannot be told", move)
        case Unclear.STILL_SECOND:
            return DataError(f"nothing moves in {host.name}, so its times cannot be told", move)
        case Unclear.REPEATED:
            return DataError(f"what moves in {both} repeats itself: they fit at several offsets", move)
        case Unclear.SHORT:
            return DataError(f"{both} do not both last {LEAST_S:g} s", "record longer")
        case Unclear.STRANGE:
            return DataError(
                f"{both} show no movement in common",
                f"give recordings of the same that overlap by more than {LEAST_S:g} s, in which the cameras move together",
            )
        case _:
            assert_never(why)
