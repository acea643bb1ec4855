"""Judges the readings of a rig file. Pure. It needs numpy, so the doctor imports it only once numpy is known to work."""

from dataclasses import dataclass
from typing import Final

from common.diagnostic import Diagnostic
from common.doctor.finding import fail, ok, warn
from phone_host.stereo.scaled_rig import fits_rig, is_scaling

_USABLE_PX: Final = 1.0
"""With a stereo RMS above one pixel, the rows of the two images do not match, and no matcher finds much."""


@dataclass(frozen=True, slots=True)
class RigReadings:
    """Readings of a rig file.

    Attributes:
        path: the file.
        failure: what is wrong with it; None: it could be read and rectified.
        rms_px: stereo RMS, px; NaN = unknown.
        baseline_m: baseline, m.
        host_size_px: image size of the host camera in the rig, px.
        asked_size_px: image size that the host camera is asked for, px; None if the URI does not say.
        is_rejected: whether its own calibration found it unfit.
    """

    path: str
    failure: Diagnostic | None = None
    rms_px: float = float("nan")
    baseline_m: float = float("nan")
    host_size_px: tuple[int, int] = (0, 0)
    asked_size_px: tuple[int, int] | None = None
    is_rejected: bool = False


def check_rig(rig: RigReadings) -> Diagnostic:
    """Judge a rig file."""
    if rig.failure is not None:
        return rig.failure
    width_px, height_px = rig.host_size_px
    text = f"{rig.path}: baseline {rig.baseline_m * 1000:.1f} mm, host camera {width_px}x{height_px}"
    if rig.rms_px == rig.rms_px:
        text += f", stereo RMS {rig.rms_px:.2f} px"
    asked_px = rig.asked_size_px
    if asked_px is not None and asked_px != rig.host_size_px:
        asked = f"{asked_px[0]}x{asked_px[1]}"
        if not fits_rig(rig.host_size_px, asked_px):
            remedy = f"ask for size={width_px}x{height_px} or another size of this shape, or calibrate at {asked}"
            return fail("rig", f"{text}, but the camera is asked for {asked}, another shape", remedy)
        text += f", scaled to {asked}" if is_scaling(rig.host_size_px, asked_px) else f", cropped to {asked}"
    if rig.is_rejected:
        return warn("rig", f"{text}, verdict reject", "calibrate again; report.json beside it says what was wrong")
    if rig.rms_px > _USABLE_PX:
        return warn("rig", text, "calibrate again with sharper pictures of a flat board")
    return ok("rig", text)
