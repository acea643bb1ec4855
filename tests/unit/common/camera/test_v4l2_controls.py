"""The order in which a camera's controls are set, and their values."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera import v4l2_abi as abi
from common.camera.v4l2_controls import Axis, ControlPlan, ControlWishes, PowerLine, lower_qualities
from tests.support.samples import control

_AUTO_EXPOSURE = control(
    abi.CID_AUTO_EXPOSURE, "Auto Exposure", abi.CTRL_TYPE_MENU, (0, 3, 1, 3), menu=((1, "Manual"), (3, "Aperture"))
)
_EXPOSURE = control(
    abi.CID_EXPOSURE_TIME_ABSOLUTE,
    "Exposure Time",
    abi.CTRL_TYPE_INTEGER,
    (1, 5000, 1, 156),
    flags=abi.CTRL_FLAG_INACTIVE,
)
_DYNAMIC = control(abi.CID_EXPOSURE_DYNAMIC_FRAMERATE, "Dynamic Framerate", abi.CTRL_TYPE_BOOLEAN, (0, 1, 1, 0))
_GAIN = control(abi.CID_GAIN, "Gain", abi.CTRL_TYPE_INTEGER, (0, 100, 10, 0))
_AUTO_WHITE = control(abi.CID_WHITE_BALANCE_AUTOMATIC, "White Balance, Auto", abi.CTRL_TYPE_BOOLEAN, (0, 1, 1, 1))
_WHITE = control(
    abi.CID_WHITE_BALANCE_TEMPERATURE, "White Balance", abi.CTRL_TYPE_INTEGER, (2800, 6500, 1, 4600), flags=0x10
)
_AUTO_FOCUS = control(abi.CID_FOCUS_AUTOMATIC_CONTINUOUS, "Focus, Auto", abi.CTRL_TYPE_BOOLEAN, (0, 1, 1, 1))
_FOCUS = control(abi.CID_FOCUS_ABSOLUTE, "Focus", abi.CTRL_TYPE_INTEGER, (0, 250, 5, 0), flags=abi.CTRL_FLAG_INACTIVE)
_MAINS = control(
    abi.CID_POWER_LINE_FREQUENCY,
    "Power Line",
    abi.CTRL_TYPE_MENU,
    (0, 2, 1, 2),
    menu=((0, "Off"), (1, "50"), (2, "60")),
)
_WEBCAM = (_WHITE, _AUTO_WHITE, _GAIN, _MAINS, _FOCUS, _AUTO_FOCUS, _EXPOSURE, _AUTO_EXPOSURE, _DYNAMIC)


def _set(steps: list[object]) -> list[tuple[str, int]]:
    return [(step.control.name, step.value) for step in steps]  # type: ignore[attr-defined]  # steps of a plan


def test_known_values_are_set_with_the_automatism_off_first() -> None:
    """The frame rate comes first, then each automatic mode is switched off before its value is set: drivers require that order (EACCES otherwise)."""
    wishes = ControlWishes(((Axis.FOCUS, 30), (Axis.EXPOSURE, 100), (Axis.WHITE_BALANCE, 4000)), PowerLine.HZ_50)
    assert _set([*ControlPlan(_WEBCAM).to_start(wishes)]) == [
        ("Dynamic Framerate", 0),
        ("Power Line", 1),
        ("Auto Exposure", 1),
        ("Exposure Time", 100),
        ("White Balance, Auto", 0),
        ("White Balance", 4000),
        ("Focus, Auto", 0),
        ("Focus", 30),
    ]


def test_what_was_found_is_held() -> None:
    """Controls without a requested value are read, and then fixed at that value; those with one are left alone."""
    plan, wishes = ControlPlan(_WEBCAM), ControlWishes(((Axis.GAIN, 20),))
    assert [axis for axis, _ in plan.to_find(wishes)] == [Axis.EXPOSURE, Axis.WHITE_BALANCE, Axis.FOCUS]
    found = ((Axis.EXPOSURE, 333), (Axis.WHITE_BALANCE, 5100), (Axis.FOCUS, 45))
    assert _set([*plan.to_lock(found, wishes)]) == [
        ("Auto Exposure", 1),
        ("Exposure Time", 333),
        ("White Balance, Auto", 0),
        ("White Balance", 5100),
        ("Focus, Auto", 0),
        ("Focus", 45),
    ]
    held = wishes.with_found(found)
    assert held.value(Axis.GAIN) == 20
    assert held.value(Axis.EXPOSURE) == 333
    assert plan.to_find(held) == []


def test_lock_off_leaves_the_automatisms_alone() -> None:
    """With lock=0 nothing is read to be fixed, and only the frame rate is kept constant."""
    plan, wishes = ControlPlan(_WEBCAM), ControlWishes(lock=False)
    assert plan.to_find(wishes) == []
    assert _set([*plan.to_start(wishes)]) == [("Dynamic Framerate", 0)]


def test_a_camera_without_controls_is_left_alone() -> None:
    """Only existing controls are set, and requests that cannot be met are named."""
    plan, wishes = ControlPlan(()), ControlWishes(((Axis.EXPOSURE, 100),), PowerLine.HZ_60)
    assert plan.to_start(wishes) == []
    assert plan.to_find(wishes) == []
    assert plan.to_lock((), wishes) == []
    assert plan.missing(wishes) == (Axis.EXPOSURE,)
    assert plan.exposure() is None


def test_an_automatism_without_a_value_is_switched_off() -> None:
    """If white balance has only an automatic mode, it is fixed by switching that off; exposure is not, as the image could go dark."""
    plan = ControlPlan((_AUTO_WHITE, _AUTO_EXPOSURE))
    assert _set([*plan.to_lock((), ControlWishes())]) == [("White Balance, Auto", 0)]


def test_shutter_priority_stands_in_for_manual() -> None:
    """A camera whose menu has no manual mode is fixed in shutter priority."""
    menu = control(abi.CID_AUTO_EXPOSURE, "Auto Exposure", abi.CTRL_TYPE_MENU, (0, 3, 1, 3), menu=((0, "A"), (2, "S")))
    steps = ControlPlan((menu, _EXPOSURE)).to_start(ControlWishes(((Axis.EXPOSURE, 50),)))
    assert _set([*steps]) == [("Auto Exposure", 2), ("Exposure Time", 50)]


@pytest.mark.parametrize("flag", [abi.CTRL_FLAG_GRABBED, abi.CTRL_FLAG_READ_ONLY, abi.CTRL_FLAG_DISABLED])
def test_controls_that_cannot_be_set_are_not_tried(flag: int) -> None:
    """Grabbed, read-only and disabled controls are left alone. Inactive ones are set, as they become active when their automatic mode is off."""
    gain = control(abi.CID_GAIN, "Gain", abi.CTRL_TYPE_INTEGER, (0, 100, 1, 0), flags=flag)
    assert ControlPlan((gain,)).to_start(ControlWishes(((Axis.GAIN, 5),))) == []
    assert _EXPOSURE.can_be_set


@given(
    value=st.integers(-(2**40), 2**40), low=st.integers(-1000, 1000), span=st.integers(0, 5000), step=st.integers(0, 99)
)
def test_values_are_fitted_to_the_range(value: int, low: int, span: int, step: int) -> None:
    """A fitted value lies in the range, on the grid or at its end, and no further than half a step from the nearest possible value."""
    made = control(abi.CID_GAIN, "Gain", abi.CTRL_TYPE_INTEGER, (low, low + span, step, low))
    fitted = made.fitted(value)
    assert low <= fitted <= low + span
    assert (fitted - low) % max(1, step) == 0 or fitted == low + span
    assert abs(fitted - min(max(value, low), low + span)) <= max(1, step) // 2 + 1


_QUALITY = control(abi.CID_JPEG_COMPRESSION_QUALITY, "Compression Quality", abi.CTRL_TYPE_INTEGER, (1, 100, 1, 80))


def test_a_quality_is_set_before_the_stream_and_again_after_a_loss() -> None:
    """A chosen quality is set at every start; without a choice, or without the control, it is not."""
    assert _set([*ControlPlan((_QUALITY,)).to_start(ControlWishes(quality=45))]) == [("Compression Quality", 45)]
    assert _set([*ControlPlan((_QUALITY,)).to_start(ControlWishes())]) == []
    assert ControlPlan(_WEBCAM).to_start(ControlWishes(quality=45)) == ControlPlan(_WEBCAM).to_start(ControlWishes())
    held = ControlWishes(quality=45).with_found(((Axis.GAIN, 20),))
    assert _set([*ControlPlan((_QUALITY,)).to_start(held)]) == [("Compression Quality", 45)]


def test_a_quality_that_cannot_be_set_is_none() -> None:
    """A camera without the control, or whose driver only reports the value, offers no quality."""
    told = replace(_QUALITY, flags=abi.CTRL_FLAG_READ_ONLY)
    assert ControlPlan((_QUALITY,)).quality() == _QUALITY
    assert ControlPlan((told,)).quality() is None
    assert ControlPlan(_WEBCAM).quality() is None


@given(st.integers(1, 50), st.integers(0, 255), st.integers(1, 7), st.data())
def test_lower_qualities_are_values_of_the_control(minimum: int, range_: int, step: int, data: st.DataObject) -> None:
    """For any range of a driver, each offered value is valid for its control and below the present one; the best comes first, and there are at most four."""
    control = replace(_QUALITY, minimum=minimum, maximum=minimum + range_, step=step)
    present = data.draw(st.integers(control.minimum, control.maximum))
    values = lower_qualities(control, present)
    assert list(values) == sorted(set(values), reverse=True)
    assert all(control.fitted(value) == value and control.minimum <= value < present for value in values)
    assert len(values) <= 4


def test_lower_qualities_of_the_usual_range() -> None:
    """Of 1 to 100, the kernel's recommended range, at 80 there are three more."""
    assert lower_qualities(_QUALITY, 80) == (70, 50, 30)
    assert lower_qualities(_QUALITY, 30) == ()
