"""A rig's locks as the constraints of a browser's camera (W3C Image Capture), and back. Pure.

A rig's locks are whole numbers. The exposure counts in us there and in 100 us here; the colour temperature in K in both;
the focus in mm there and in m here; the zoom in hundredths there.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from common.camera_identity import LARGEST_LOCK, Lock
from common.protocol.message import Locks
from phone_host.camera.browser_wire import Groups


@dataclass(frozen=True, slots=True)
class _Control:
    """One lock as a browser has it.

    Attributes:
        group: of constraints that are set together.
        mode: constraint that says whether it is held; empty: it always is.
        value: constraint with its value.
        scale: the lock's value is this many times the constraint's.
    """

    group: str
    mode: str
    value: str
    scale: int


_CONTROLS: Final[Mapping[Lock, _Control]] = {
    Lock.EXPOSURE: _Control("exposure", "exposureMode", "exposureTime", 100),
    Lock.WHITE_BALANCE: _Control("white_balance", "whiteBalanceMode", "colorTemperature", 1),
    Lock.FOCUS: _Control("focus", "focusMode", "focusDistance", 1000),
    Lock.ZOOM: _Control("zoom", "", "zoom", 100),
}

_HELD: Final = "manual"


def locks_of(groups: Groups) -> Locks:
    """Return what a browser's camera is held at."""
    found = []
    for lock, control in _CONTROLS.items():
        values = groups.get(control.group, {})
        value = values.get(control.value)
        if control.mode and values.get(control.mode) != _HELD:
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            continue
        if abs(value) * control.scale <= LARGEST_LOCK:  # NaN is not
            found.append((lock, round(value * control.scale)))
    return tuple(found)


def groups_of(locks: Locks) -> dict[str, dict[str, object]]:
    """Return locks as constraints."""
    groups: dict[str, dict[str, object]] = {}
    for lock, value in locks:
        control = _CONTROLS[lock]
        exact = value / control.scale
        held: dict[str, object] = {control.mode: _HELD} if control.mode else {}
        groups[control.group] = held | {control.value: int(exact) if exact == int(exact) else exact}
    return groups
