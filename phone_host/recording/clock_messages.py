"""What a recording tells of the board's clock: written while it grows, read when it is played or joined. Pure."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Final

from common.protocol.message import BoardHello
from common.recording.layout import CLOCK
from common.recording.recorded import Recorded
from common.strict_json import strict_json, whole_number
from phone_host.sync.clock import ClockEstimate

_BOOT: Final = "boot_id"


@dataclass(frozen=True, slots=True)
class ToldClock:
    """What was known of a board's clock.

    Attributes:
        log_ns: when, ns since 1970.
        boot_id: of the board: whose clock it is; empty: not told.
        estimate: its relation to the host's clock.
    """

    log_ns: int
    boot_id: str
    estimate: ClockEstimate


def boot_of(hello: BoardHello | None) -> str:
    """Return the boot of a board that has said hello; empty: none has."""
    return "" if hello is None else hello.boot_id


def clock_text(estimate: ClockEstimate, boot_id: str) -> str:
    """Write an estimate as a message.

    Args:
        estimate: the estimate.
        boot_id: of the board; empty: not known.
    """
    return json.dumps({**asdict(estimate), _BOOT: boot_id}, separators=(",", ":"))


def told_clocks(recorded: Recorded) -> list[ToldClock]:
    """Read all estimates of a recording, in their order. Spoiled ones are left out."""
    found = []
    for message in recorded.texts.get(CLOCK, []):
        try:
            values = strict_json(bytes(message.data))
            boot_id = str(values.pop(_BOOT, ""))
            for name in values:
                values[name] = whole_number(values[name]) if name.endswith("_ns") else float(values[name])
            found.append(ToldClock(message.log_ns, boot_id, ClockEstimate(**values)))
        except (ValueError, TypeError, AttributeError, OverflowError):
            continue
    return found


def narrowest(told: Iterable[ToldClock], boot_id: str, span_ns: tuple[int, int]) -> ClockEstimate | None:
    """Choose the estimate of a board's clock that is least uncertain over a span.

    Args:
        told: estimates, all on one host's clock.
        boot_id: of the board.
        span_ns: first and last moment on the board's clock, ns.

    Returns:
        The estimate; None if none is of that boot.
    """
    known = [one.estimate for one in told if boot_id and one.boot_id == boot_id]
    return min(known, key=lambda one: worst_ns(one, span_ns), default=None)


def worst_ns(estimate: ClockEstimate, span_ns: tuple[int, int]) -> int:
    """Return the half-width that holds the true offset in 99.9 % at either end of a span on the board's clock, ns."""
    return max(estimate.uncertainty_at(moment_ns) for moment_ns in span_ns)
