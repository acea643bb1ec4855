"""The controls of an open V4L2 device: set in planned order, read, watched. A control that the driver refuses is counted, not fatal."""

import errno
import logging

from common.camera import v4l2_abi as abi
from common.camera.v4l2_controls import Axis, ControlPlan, ControlWishes, Step, lower_qualities
from common.camera.v4l2_device import Device
from common.camera.v4l2_stamps import Tally
from common.program.logs import event

_LOG = logging.getLogger(__name__)


class OpenControls:
    """The controls of a device, set before its stream begins.

    Attributes:
        exposure_ns: exposure time as last read, ns; None if the camera does not report it.
        tells_exposure: whether the driver reports each change of the exposure time.
        held: the axes that are held, with the values that the driver reports for them.

    Args:
        device: the device; must outlive this.
        wishes: wishes for the controls; after a first life, with the values found then.
        tally: where to count.

    Raises:
        OSError: the camera is gone.
    """

    def __init__(self, device: Device, wishes: ControlWishes, tally: Tally) -> None:
        self._device, self._tally = device, tally
        self._plan = ControlPlan(device.controls())
        for axis in self._plan.missing(wishes):
            _LOG.warning(event("no_such_control", camera=device.path, control=axis.value))
        self._apply(self._plan.to_start(wishes))
        self._exposure = self._plan.exposure()
        self.tells_exposure = self._exposure is not None and device.watch_control(self._exposure.id)
        self.exposure_ns: int | None = None
        self.held: tuple[tuple[Axis, int], ...] = ()
        self.read_exposure()
        self._read_held(wishes.held)

    def has_events(self) -> bool:
        """Take the waiting events; return whether there were any, which means that the exposure time has changed.

        Raises:
            OSError: the camera is gone.
        """
        return self.tells_exposure and self._device.take_events() > 0

    def read_exposure(self) -> None:
        """Read the exposure time.

        Raises:
            OSError: the camera is gone.
        """
        if self._exposure is None:
            return
        value = self._read(self._exposure.id)
        self.exposure_ns = None if value is None else value * abi.EXPOSURE_UNIT_NS

    def lock(self, wishes: ControlWishes) -> tuple[tuple[Axis, int], ...]:
        """Hold exposure, gain, white balance and focus at the values that the automatic modes have found.

        Returns:
            What was found.

        Raises:
            OSError: the camera is gone.
        """
        read = [(axis, self._read(control.id)) for axis, control in self._plan.to_find(wishes)]
        found = tuple((axis, value) for axis, value in read if value is not None)
        self._apply(self._plan.to_lock(found, wishes))
        self.read_exposure()
        self._read_held((*found, *wishes.held))
        held = {axis.value: value for axis, value in (*found, *wishes.held)}
        if held:
            _LOG.info(event("controls_held", camera=self._device.path, **held))
        return found

    def hold(self, held: tuple[tuple[Axis, int], ...]) -> None:
        """Hold axes at values. Drivers accept that while they stream, or refuse it, which is counted.

        Args:
            held: each axis with its value, in the control's own unit.

        Raises:
            OSError: the camera is gone.
        """
        self._apply(self._plan.to_hold(held))
        self.read_exposure()
        self._read_held((*self.held, *held))

    def lockable(self) -> tuple[tuple[Axis, int], ...]:
        """The axes that can be locked, with their present values.

        Raises:
            OSError: the camera is gone.
        """
        read = [(axis, self._read(control.id)) for axis, control in self._plan.lockable()]
        return tuple((axis, value) for axis, value in read if value is not None)

    def qualities(self) -> tuple[int, ...]:
        """The JPEG qualities, the current one first, then the lower ones; empty if it cannot be set.

        Raises:
            OSError: the camera is gone.
        """
        control = self._plan.quality()
        present = None if control is None else self._read(control.id)
        return () if control is None or not present else (present, *lower_qualities(control, present))

    def set_quality(self, quality: int) -> None:
        """Set the JPEG quality. Drivers accept it while they stream, or refuse it, which is counted.

        Raises:
            OSError: the camera is gone.
        """
        self._apply(self._plan.to_set_quality(quality))

    def _apply(self, steps: list[Step]) -> None:
        for step in steps:
            try:
                self._device.set_control(step.control.id, step.value)
            except OSError as error:
                if error.errno == errno.ENODEV:
                    raise
                self._tally.refused += 1
                reason = errno.errorcode.get(error.errno or 0, str(error))
                _LOG.warning(event("control_refused", control=step.control.name, value=step.value, reason=reason))

    def _read_held(self, wanted: tuple[tuple[Axis, int], ...]) -> None:
        """Note what the driver made of the values; a control that cannot be read is taken to hold what was set."""
        found: dict[Axis, int] = {}
        for axis, value in dict(wanted).items():
            control = self._plan.value_control(axis)
            if control is not None:
                read = self._read(control.id) if control.can_be_read else control.fitted(value)
                found |= {} if read is None else {axis: read}
        self.held = tuple(found.items())

    def _read(self, control_id: int) -> int | None:
        """A control's value; None if the driver does not report it."""
        try:
            return self._device.control(control_id)
        except OSError as error:
            if error.errno == errno.ENODEV:
                raise
            return None
