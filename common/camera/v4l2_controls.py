"""Which controls of a camera are set to what, in the order that drivers require. Values only: no device is touched here.

A control governed by an automatic mode is refused (EACCES) while that mode runs, so the automatic mode is switched off first. What the user does
not set is left automatic until it has settled, then read and held at that value: the two cameras of a rig must not readjust mid-scan.
"""

from dataclasses import replace
from enum import Enum
from typing import Final

from common.camera import v4l2_abi as abi
from common.camera_identity import LARGEST_LOCK, Lock
from common.value import value


class PowerLine(Enum):
    """The mains frequency at which lamps flicker: values of V4L2_CID_POWER_LINE_FREQUENCY."""

    OFF = 0
    HZ_50 = 1
    HZ_60 = 2


class Axis(Enum):
    """One thing that a camera may adjust, by itself or when told."""

    EXPOSURE = "exposure"
    GAIN = "gain"
    WHITE_BALANCE = "white_balance"
    FOCUS = "focus"
    ZOOM = "zoom"


_LOCKED: Final = {
    Lock.EXPOSURE: Axis.EXPOSURE,
    Lock.WHITE_BALANCE: Axis.WHITE_BALANCE,
    Lock.FOCUS: Axis.FOCUS,
    Lock.ZOOM: Axis.ZOOM,
}
_EXPOSURE_UNIT_US: Final = abi.EXPOSURE_UNIT_NS // 1000


def to_axis(lock: Lock, value: int) -> tuple["Axis", int]:
    """Convert a lock to the axis and the control's own unit."""
    return _LOCKED[lock], max(1, round(value / _EXPOSURE_UNIT_US)) if lock is Lock.EXPOSURE else value


def to_locks(held: tuple[tuple["Axis", int], ...]) -> tuple[tuple[Lock, int], ...]:
    """Convert axes with values in the controls' own units to locks. Axes that are no locks are left out."""
    values = dict(held)
    found = ((lock, values[axis]) for lock, axis in _LOCKED.items() if axis in values)
    return tuple(
        (lock, min(LARGEST_LOCK, value * _EXPOSURE_UNIT_US) if lock is Lock.EXPOSURE else value)
        for lock, value in found
    )


@value(kw_only=True)
class Control:
    """One control of a camera, as its driver describes it.

    Attributes:
        id: V4L2_CID.
        name: the driver's name.
        kind: V4L2_CTRL_TYPE.
        minimum: lowest value.
        maximum: highest value.
        step: between values.
        default: the driver's default.
        flags: V4L2_CTRL_FLAG bits.
        menu: (index, name) of each item of a menu.
    """

    id: int
    name: str
    kind: int
    minimum: int
    maximum: int
    step: int
    default: int
    flags: int = 0
    menu: tuple[tuple[int, str], ...] = ()

    @property
    def can_be_set(self) -> bool:
        """Whether the driver would ever accept a value. An inactive control becomes active when its automatic mode is off."""
        return not self.flags & (abi.CTRL_FLAG_DISABLED | abi.CTRL_FLAG_GRABBED | abi.CTRL_FLAG_READ_ONLY)

    @property
    def can_be_read(self) -> bool:
        """Whether the driver reports its value."""
        return not self.flags & (abi.CTRL_FLAG_DISABLED | abi.CTRL_FLAG_WRITE_ONLY)

    def fitted(self, value: int) -> int:
        """The nearest value that the control accepts."""
        if self.kind not in {abi.CTRL_TYPE_INTEGER, abi.CTRL_TYPE_BOOLEAN}:
            return value
        step = max(1, self.step)
        inside = min(max(value, self.minimum), self.maximum)
        steps = (inside - self.minimum + step // 2) // step
        return min(self.minimum + steps * step, self.maximum)

    def has_item(self, index: int) -> bool:
        """Whether a menu has an item of that index."""
        return any(at == index for at, _ in self.menu)


@value()
class ControlWishes:
    """The user's wishes for the controls.

    Attributes:
        held: value of each axis in the control's own unit (exposure: 100 us; white balance: K); a missing axis stays automatic.
        power_line: None: leave it as it is.
        lock: whether axes that are not held are held as found, once the automatic modes have settled.
        quality: JPEG quality, in the camera's own unit; 0: leave it as it is.
    """

    held: tuple[tuple[Axis, int], ...] = ()
    power_line: PowerLine | None = None
    lock: bool = True
    quality: int = 0

    def value(self, axis: Axis) -> int | None:
        """The value to hold an axis at; None: it stays automatic."""
        return dict(self.held).get(axis)

    def with_held(self, held: tuple[tuple[Axis, int], ...]) -> "ControlWishes":
        """These wishes with other values for some axes."""
        return replace(self, held=tuple({**dict(self.held), **dict(held)}.items()))

    def with_found(self, found: tuple[tuple[Axis, int], ...]) -> "ControlWishes":
        """These wishes with the found axes held as well: a camera that is plugged in again comes back as it was."""
        return replace(self, held=tuple({**dict(found), **dict(self.held)}.items()))


@value()
class Step:
    """Set one control.

    Attributes:
        control: which.
        value: to what.
    """

    control: Control
    value: int


@value()
class _AxisControls:
    """The controls of an axis: the automatic mode, the values that switch it off (the best first), and the value itself."""

    automatic: int
    off: tuple[int, ...]
    value: int


_NONE: Final = 0
"""No control has this id."""

_AXES: Final = {
    Axis.EXPOSURE: _AxisControls(
        abi.CID_AUTO_EXPOSURE, (abi.EXPOSURE_MANUAL, abi.EXPOSURE_SHUTTER_PRIORITY), abi.CID_EXPOSURE_TIME_ABSOLUTE
    ),
    Axis.GAIN: _AxisControls(abi.CID_AUTOGAIN, (0,), abi.CID_GAIN),
    Axis.WHITE_BALANCE: _AxisControls(abi.CID_WHITE_BALANCE_AUTOMATIC, (0,), abi.CID_WHITE_BALANCE_TEMPERATURE),
    Axis.FOCUS: _AxisControls(abi.CID_FOCUS_AUTOMATIC_CONTINUOUS, (0,), abi.CID_FOCUS_ABSOLUTE),
    Axis.ZOOM: _AxisControls(_NONE, (), abi.CID_ZOOM_ABSOLUTE),
}


_QUALITIES: Final = (0.85, 0.7, 0.5, 0.3)
"""Shares of the best quality. OpenCV's JPEGs of ten photographs (Middlebury 2014, quarter size) have 55, 37, 28 and 20 % of the bytes at 95: about
a third less each."""


def lower_qualities(control: Control, present: int) -> tuple[int, ...]:
    """Return the values that make a camera's JPEG images smaller.

    The range is the driver's own. Only positive values have a meaning, and larger ones give better images (ext-ctrls-jpeg).

    Returns:
        Values below that, the best first.
    """
    wanted = (control.fitted(max(1, round(share * control.maximum))) for share in _QUALITIES)
    return tuple(sorted({value for value in wanted if 0 < value < present}, reverse=True))


class ControlPlan:
    """The order in which a camera's controls are set."""

    def __init__(self, controls: tuple[Control, ...]) -> None:
        self._by_id = {control.id: control for control in controls}

    def missing(self, wishes: ControlWishes) -> tuple[Axis, ...]:
        """The axes that the user wants held but the camera lacks."""
        return tuple(axis for axis, _ in wishes.held if _AXES[axis].value not in self._by_id)

    def to_start(self, wishes: ControlWishes) -> list[Step]:
        """What to set before the stream: frame rate before brightness, lamps, and the axes whose values are known."""
        steps = self._maybe(abi.CID_EXPOSURE_DYNAMIC_FRAMERATE, 0)
        if wishes.power_line is not None:
            steps += self._maybe(abi.CID_POWER_LINE_FREQUENCY, wishes.power_line.value)
        steps += self.to_set_quality(wishes.quality)
        for axis in Axis:
            value = wishes.value(axis)
            if value is not None:
                steps += self._hold(axis, value)
        return steps

    def to_hold(self, held: tuple[tuple[Axis, int], ...]) -> list[Step]:
        """How to hold axes at values while the camera runs."""
        return [step for axis, value in held for step in self._hold(axis, value)]

    def value_control(self, axis: Axis) -> Control | None:
        """The control that holds an axis's value, if there is one."""
        return self._by_id.get(_AXES[axis].value)

    def lockable(self) -> list[tuple[Axis, Control]]:
        """The axes that can be locked: their values can be set and read."""
        found = [(axis, self.value_control(axis)) for axis in _LOCKED.values()]
        return [(axis, item) for axis, item in found if item is not None and item.can_be_set and item.can_be_read]

    def to_set_quality(self, quality: int) -> list[Step]:
        """How to set the JPEG quality, before or during the stream; 0: leave it as it is."""
        return self._maybe(abi.CID_JPEG_COMPRESSION_QUALITY, quality) if quality else []

    def quality(self) -> Control | None:
        """The JPEG quality control, if there is one that can be read and set."""
        control = self._by_id.get(abi.CID_JPEG_COMPRESSION_QUALITY)
        return control if control is not None and control.can_be_set and control.can_be_read else None

    def to_find(self, wishes: ControlWishes) -> list[tuple[Axis, Control]]:
        """What to read once the automatic modes have settled: the axes to be held as found."""
        if not wishes.lock:
            return []
        open_axes = [axis for axis in Axis if wishes.value(axis) is None]
        found = [(axis, self._by_id.get(_AXES[axis].value)) for axis in open_axes]
        return [(axis, control) for axis, control in found if control is not None and control.can_be_read]

    def to_lock(self, found: tuple[tuple[Axis, int], ...], wishes: ControlWishes) -> list[Step]:
        """How to hold what was found. An axis with an automatic mode but no value of its own just has that mode switched off."""
        steps = [step for axis, value in found for step in self._hold(axis, value)]
        done = {axis for axis, _ in (*found, *wishes.held)}
        for axis in (Axis.GAIN, Axis.WHITE_BALANCE, Axis.FOCUS):
            if axis not in done:
                steps += self._switch_off(axis)
        return steps

    def exposure(self) -> Control | None:
        """The control that reports the exposure time, if there is one that can be read."""
        control = self._by_id.get(abi.CID_EXPOSURE_TIME_ABSOLUTE)
        return control if control is not None and control.can_be_read else None

    def _hold(self, axis: Axis, value: int) -> list[Step]:
        if _AXES[axis].value not in self._by_id:
            return []  # switching an automatic mode off without setting a value instead would leave the image dark
        return self._switch_off(axis) + self._maybe(_AXES[axis].value, value)

    def _switch_off(self, axis: Axis) -> list[Step]:
        automatic = self._by_id.get(_AXES[axis].automatic)
        if automatic is None:
            return []
        off = [value for value in _AXES[axis].off if automatic.kind != abi.CTRL_TYPE_MENU or automatic.has_item(value)]
        return self._maybe(automatic.id, off[0]) if off else []

    def _maybe(self, control_id: int, value: int) -> list[Step]:
        control = self._by_id.get(control_id)
        if control is None or not control.can_be_set:
            return []
        return [Step(control, control.fitted(value))]
