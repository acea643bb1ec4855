"""The figures of a calibration as tables: how good it is, and each camera's parameters with their uncertainty. Pure."""

import math
from html import escape
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.imagesize.head import size_text
from phone_host.model import CameraModel, Lens
from phone_host.model.calibration_series import SeriesRig
from phone_host.report.page_frame import section, table

Floats = NDArray[np.float64]

_DASH: Final = "\u2013"
_COEFFICIENTS: Final = {
    Lens.PINHOLE: ("k1", "k2", "p1", "p2", "k3"),
    Lens.RATIONAL: ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    Lens.FISHEYE: ("k1", "k2", "k3", "k4"),
}
_JUDGED_M: Final = 1.0
"""The depth whose error has limits."""

_WHOLE_MM: Final = 10.0
_HALF: Final = 12
"""Parameters of a camera in the rig's covariance."""


def figures_card(found: SeriesRig) -> str:
    """Make the card with the figures, their limits and what they mean."""
    parts = (_rows(found), _rms(found), _baseline(found), _depths(found), _squares(found), _far(found))
    rows = [row for part in parts for row in part]
    meanings = "".join(
        f"<dt>{escape(part[0][0])}</dt><dd>{escape(words)}</dd>"
        for part, words in zip(parts, _MEANINGS, strict=True)
        if part
    )
    details = f'<details><summary>What the figures mean</summary><dl class="words files">{meanings}</dl></details>'
    return section("How good it is", "", table(("", "figure", "good up to", "usable up to"), rows) + details)


_Row = tuple[str, ...]
"""What it is, its value, good up to, usable up to; shorter where there are no limits."""

_MEANINGS: Final = (
    "how far matching points lie from the same row after rectification; a matcher looks along rows only",
    "how far corners lie from where each camera alone, and the whole rig, expects them; root mean square",
    "distance of the two cameras; its uncertainty is that of every depth",
    "one standard deviation that the calibration alone leaves; noise of matching comes on top",
    "squares on boards that the rig was not fitted to: mean and standard deviation",
    "depth beyond it is a guess, because the disparity of infinity is not known better",
)


def _rows(found: SeriesRig) -> list[_Row]:
    errors, limits = found.vertical_px, found.limits
    if not np.isfinite(errors).all():
        return []
    p95 = f"{np.percentile(errors, 95):.3f} px"
    return [
        ("vertical error, 95 %", p95, f"{limits.good_px:.2f} px", f"{limits.usable_px:.2f} px"),
        ("mean, greatest", f"{errors.mean():.3f}, {errors.max():.3f} px", _DASH, _DASH),
    ]


def _rms(found: SeriesRig) -> list[_Row]:
    rig = found.rig
    alone = f"{rig.rms_left_px:.3f}, {rig.rms_right_px:.3f} px"
    return [("RMS left, right", alone, _DASH, _DASH), ("RMS together", f"{rig.rms_stereo_px:.3f} px", _DASH, _DASH)]


def _baseline(found: SeriesRig) -> list[_Row]:
    baseline_m, sigma_m = float(np.linalg.norm(found.rig.t_right_left_m)), found.baseline_sigma_m
    if not math.isfinite(sigma_m):
        return [("baseline", f"{baseline_m * 1e3:.2f} mm", _DASH, _DASH)]
    words = f"{baseline_m * 1e3:.2f} ± {millimetres(sigma_m)} mm ({sigma_m / baseline_m:.2%})"
    return [("baseline", words, *_shares(found))]


def _depths(found: SeriesRig) -> list[_Row]:
    return [
        (
            f"depth error at {depth_m:g} m",
            f"± {millimetres(sigma_m)} mm ({sigma_m / depth_m:.2%})",
            *(_shares(found) if depth_m == _JUDGED_M else (_DASH, _DASH)),
        )
        for depth_m, sigma_m in found.depths
        if math.isfinite(sigma_m)
    ]


def _squares(found: SeriesRig) -> list[_Row]:
    if not math.isfinite(found.square_mean_m):
        return []
    off = round(found.square_mean_m / found.square_m - 1, 4) + 0.0
    mean, sigma, true = (each * 1e3 for each in (found.square_mean_m, found.square_sigma_m, found.square_m))
    words = f"{mean:.2f} ± {sigma:.2f} mm; true {true:.2f} mm ({off:+.2%})"
    return [("squares held out", words, *_shares(found))]


def _far(found: SeriesRig) -> list[_Row]:
    if not (math.isfinite(found.far_m) and math.isfinite(found.rig.zero_sigma_px)):
        return []
    words = f"{found.far_m:.3g} m (infinity ± {found.rig.zero_sigma_px:.2f} px)"
    return [("far limit", words, _DASH, _DASH)]


def _shares(found: SeriesRig) -> tuple[str, str]:
    return f"{found.limits.good_share:.0%}", f"{found.limits.usable_share:.0%}"


def millimetres(length_m: float) -> str:
    """Write an uncertainty: two digits, and never a power of ten for a large one."""
    found_mm = length_m * 1e3
    return f"{found_mm:.0f}" if found_mm >= _WHOLE_MM else f"{found_mm:.2g}"


def camera_tables(found: SeriesRig) -> str:
    """Make the card with both cameras' parameters and their relative pose."""
    rig = found.rig
    sigmas = np.sqrt(np.diag(rig.covariance).clip(min=0))
    left, right = (_parameters(model, sigmas[at : at + _HALF]) for model, at in ((rig.left, 0), (rig.right, _HALF)))
    names = [name for name, _ in max(left, right, key=len)]
    values = [dict(side) for side in (left, right)]
    rows = [(name, *(side.get(name, _DASH) for side in values)) for name in names]
    turn_deg = np.degrees(np.ravel(cv2.Rodrigues(rig.R_right_left)[0]))
    centre_mm = -rig.R_right_left.T @ rig.t_right_left_m * 1e3
    pose = [
        ("turned about x, y, z", _three(turn_deg, np.degrees(sigmas[2 * _HALF : 2 * _HALF + 3]), "°", 3)),
        ("stands at x, y, z", _three(centre_mm, sigmas[2 * _HALF + 3 :] * 1e3, "mm", 2)),
    ]
    tried = [
        (side, each.words + (" (taken)" if each.is_chosen else ""), f"{each.held_out_px:.3f} px")
        for side, trials in zip(("left", "right"), found.tried, strict=True)
        for each in trials
    ]
    content = table(("", "left", "right"), rows)
    content += "<h3>The right camera against the left one</h3>" + table(("", "value"), pose)
    if tried:
        content += "<h3>Lenses that were tried</h3>" + table(("camera", "lens", "error on views held out"), tried)
    words = "± is one standard deviation. Values without one were not estimated. Axes: x right, y down, z forward."
    return section("The cameras", words, content)


def _parameters(model: CameraModel, sigmas: Floats) -> list[tuple[str, str]]:
    matrix = model.matrix
    rows = [("lens", model.lens.value), ("image", f"{size_text((model.width_px, model.height_px))} px")]
    for index, (name, value) in enumerate(
        (("fx", matrix[0, 0]), ("fy", matrix[1, 1]), ("cx", matrix[0, 2]), ("cy", matrix[1, 2]))
    ):
        rows.append((name, _with_sigma(float(value), float(sigmas[index]), "px", 2)))
    for index, (name, value) in enumerate(zip(_COEFFICIENTS[model.lens], model.distortion, strict=False)):
        rows.append((name, _with_sigma(float(value), float(sigmas[4 + index]), "", 4)))
    return rows


def _with_sigma(value: float, sigma: float, unit: str, digits: int) -> str:
    """Write a value with its uncertainty, two digits of that; with so many digits if it is not known."""
    if not (math.isfinite(sigma) and sigma > 0):
        return f"{value:.{digits}f} {unit}".strip()
    digits = max(0, 1 - math.floor(math.log10(sigma)))
    return f"{value:.{digits}f} ± {sigma:.{digits}f} {unit}".strip()


def _three(values: Floats, sigmas: Floats, unit: str, digits: int) -> str:
    return ", ".join(
        _with_sigma(float(value), float(sigma), unit, digits) for value, sigma in zip(values, sigmas, strict=True)
    )
