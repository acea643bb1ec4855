"""What a recording tells of the board's clock: written while it grows, read when it is played or joined. Pure."""

import json
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
