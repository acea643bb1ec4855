"""A check of a camera in words: one finding for each thing that was looked at, with its remedy. Pure."""

import math
from typing import Final, assert_never

from common.diagnostic import Diagnostic
from common.doctor.finding import ok, warn
from common.words import counted
from phone_host.doctor.camera_check.check import Progress, Stage
from phone_host.model.capture import CaptureReport, CaptureSource, Pace, Rigidity, Unseen, Warping

_RATE: Final = 0.9
"""Of the rate that was asked for."""

_HALF: Final = 0.6
_DARK: Final = 60
"""Mean grey level of a room that is too dark for a phone's automatic exposure to keep its rate."""

_LONG: Final = 0.5
"""Share of the frame period beyond which an exposure blurs what moves."""

_SLOWER: Final = 0.9
_LATER_MS: Final = 20.0
_JITTER: Final = 0.15
"""Share of the frame period by which stamps of a sensor never scatter; arrivals do."""


CHECK_AGAIN: Final = "phone-host doctor --capture with this --camera and --calibration"
"""The remedy on the command line; the page has a button."""


def findings_of(report: CaptureReport) -> list[Diagnostic]:
    """Judge a report."""
    pace = report.pace
    if not math.isfinite(pace.rate_hz):
        return [warn("rate", f"{counted(pace.frames, 'frame')} came: too few to judge", "check that the camera works")]
    return [
        _rate(pace),
        _stamps(pace),
        _exposure(pace),
        _shutter(report.rigidity),
        _heat(pace),
        warp_finding(report.rigidity),
    ]


def _rate(pace: Pace) -> Diagnostic:
    asked = f", {pace.asked_hz:.3g} asked for" if math.isfinite(pace.asked_hz) else ""
    gaps = f", {counted(pace.missing, 'frame')} missing" if pace.missing else ""
    text = f"{pace.rate_hz:.3g} frames/s{asked}{gaps}"
    if not math.isfinite(pace.asked_hz) or pace.usual_hz >= _RATE * pace.asked_hz:
        if pace.missing > (1 - _RATE) * pace.frames:
            return warn("rate", text, "close other programs, or ask for a smaller image")
        return ok("rate", text)
    is_dark = pace.brightness < _DARK or pace.exposure_ms > _RATE * 1e3 / pace.asked_hz
    if is_dark or pace.usual_hz < _HALF * pace.asked_hz:
        return warn(
            "rate", text, "give more light, or lock the exposure: automatic exposure slows a camera down in the dark"
        )
    return warn("rate", text, "ask for a smaller image, or for this rate")


def _stamps(pace: Pace) -> Diagnostic:
    period_ms = 1e3 / pace.usual_hz
    delay = f"{pace.delay_ms:.0f} ms from stamp to arrival" if math.isfinite(pace.delay_ms) else "arrival unknown"
    text = f"jitter {pace.jitter_ms:.1f} ms, {delay} (95 % within {pace.delay_jitter_ms:.0f} ms more)"
    if pace.backwards:
        remedy = "restart the camera's program; its stamps cannot be used to pair images"
        return warn("stamps", f"{counted(pace.backwards, 'stamp')} not later than the one before; {text}", remedy)
    if pace.jitter_ms > _JITTER * period_ms:
        return warn(
            "stamps",
            text,
            "stamps that vary so much are arrival times: use a camera interface that stamps the exposure",
        )
    return ok("stamps", text)


def _exposure(pace: Pace) -> Diagnostic:
    if not math.isfinite(pace.exposure_ms):
        return ok("exposure", f"not reported by the camera; mean brightness {pace.brightness:.0f} of 255")
    text = f"{pace.exposure_ms:.1f} ms, at most {pace.longest_exposure_ms:.1f} ms; mean brightness {pace.brightness:.0f} of 255"
    if pace.exposure_ms > _LONG * 1e3 / pace.usual_hz:
        return warn("exposure", text, "give more light, and lock a shorter exposure: moving objects are blurred")
    return ok("exposure", text)


def _shutter(rigidity: Rigidity) -> Diagnostic:
    if not math.isfinite(rigidity.readout_ms):
        return ok("shutter", "cannot be determined from these images")
    text = f"rows are read within {rigidity.readout_ms:.1f} +- {max(rigidity.readout_sigma_ms, 0.1):.1f} ms"
    return ok(
        "shutter",
        f"rolling: {text}" if rigidity.readout_ms > 3 * rigidity.readout_sigma_ms + 1 else f"global, or nearly: {text}",
    )


def _heat(pace: Pace) -> Diagnostic:
    text = f"{pace.first_hz:.3g} frames/s at first, {pace.last_hz:.3g} at the end of {pace.seconds:.0f} s"
    if pace.last_hz < _SLOWER * pace.first_hz:
        return warn(
            "slow-down", text, "let the phone cool, out of its case and off the charger; or ask for a smaller image"
        )
    if pace.last_delay_ms > pace.first_delay_ms + _LATER_MS:
        later = f"frames arrive {pace.last_delay_ms - pace.first_delay_ms:.0f} ms later than at first"
        return warn("slow-down", later, "let the phone cool, or ask for a smaller image: processing does not keep up")
    return ok("slow-down", f"none: {text}")


_SCENE: Final = "film a shelf or a desk with things on it, near and far"

_REASONS: Final = {
    Unseen.STILL: (
        "the picture moved too little",
        "turn the camera by some degrees, left and right, up and down, for 20 seconds",
    ),
    Unseen.PLAIN: ("too few details in the picture", _SCENE),
    Unseen.FLAT: ("the scene is flat", _SCENE),
    Unseen.LIVELY: ("too much in the picture moves on its own", "film a scene in which nothing moves"),
    Unseen.VAGUE: (
        "the segments of the film contradict each other",
        "film something with more details, in more light",
    ),
}

_UNCALIBRATED: Final = "; without its calibration a crop is not seen: check again once the lens is calibrated"


def warp_finding(rigidity: Rigidity) -> Diagnostic:
    """Say whether the camera's software warps its images."""
    of = f"{rigidity.warped} of {counted(rigidity.windows, 'stretch', 'stretches')} of film"
    match rigidity.warping:
        case Warping.GOOD:
            lens = "" if rigidity.knows_lens else _UNCALIBRATED
            return ok("stabilisation", f"none seen: the images move as one rigid camera's{lens}")
        case Warping.STABILISED:
            text = f"the images are warped or cropped: no rigid camera with this lens can have made {of}"
            if math.isfinite(rigidity.readout_ms):
                text = "all rows show one moment: software corrects the rolling shutter, as stabilisation does"
            return warn(
                "stabilisation",
                text,
                "switch stabilisation and zoom off in the camera's program, or take another camera, lens or image size of this phone; a"
                " phone that is fixed and does not move is not warped",
            )
        case Warping.UNKNOWN:
            reason, remedy = _REASONS[rigidity.unseen or Unseen.STILL]
            return warn("stabilisation", f"cannot tell: {reason}", remedy)
        case _:
            assert_never(rigidity.warping)


_STAGES: Final = {
    Stage.STILL: "hold the camera still",
    Stage.MOVE: "turn it a little, left and right, up and down, in front of a still scene",
    Stage.WATCH: "put it down and let it film: its frame rate is measured",
    Stage.DONE: "done",
}


def stage_words(progress: Progress) -> str:
    """Say what the user shall do now, and why if it does not help yet."""
    if progress.stage is not Stage.MOVE or progress.last is None:
        return _STAGES[progress.stage]
    go_on = "" if progress.last is Unseen.STILL else "; go on turning"
    return f"{': '.join(_REASONS[progress.last])}{go_on}"


def stored_finding(kept: CaptureReport | None, source: CaptureSource, *, has_lens: bool) -> Diagnostic:
    """Judge the report of an earlier check: does it hold for this camera?

    Args:
        kept: the report beside the calibration, or from before it; None: there is none.
        source: the camera as it is now.
        has_lens: whether its lens is calibrated by now.
    """
    if kept is None:
        return warn("capture", "this camera's images were never checked for stabilisation", CHECK_AGAIN)
    if not holds_for(kept.source, source):
        return warn("capture", f"the check was of {_named(kept.source)}, this is {_named(source)}", CHECK_AGAIN)
    found = warp_finding(kept.rigidity)
    if has_lens and not kept.rigidity.knows_lens and kept.rigidity.warping is Warping.GOOD:
        return warn(
            "capture", "this camera's images were checked before it was calibrated: a crop was not seen", CHECK_AGAIN
        )
    return Diagnostic(f"checked: {found.message}", found.remedy, found.severity, "capture")


def holds_for(checked: CaptureSource, source: CaptureSource) -> bool:
    """Tell whether a check of one camera holds for another: same device, software and image size, as far as they are known."""
    is_same_software = not (checked.software and source.software) or checked.software == source.software
    same_size = (checked.width_px, checked.height_px) == (source.width_px, source.height_px)
    return is_same_software and same_size and not checked.camera.differs_from(source.camera)


def _named(source: CaptureSource) -> str:
    by = f" in {source.software}" if source.software else ""
    return f"{source.camera}{by} at {source.width_px}x{source.height_px}"
