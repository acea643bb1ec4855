"""The figures of a calibration as tables: how good it is, and each camera's parameters with their uncertainty. Pure."""

import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.imagesize.head import size_text
from phone_host.model import CameraModel, Lens
from phone_host.model.calibration_session import SessionRig
from phone_host.report.page_frame import section, table

Floats = NDArray[np.float64]

_DASH: Final = "\u2013"
_COEFFICIENTS: Final = {
    Lens.PINHOLE: ("k1", "k2", "p1", "p2", "k3"),
    Lens.RATIONAL: ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    Lens.FISHEYE: ("k1", "k2", "k3", "k4"),
}
_HALF: Final = 12
"""Parameters of a camera in the rig's covariance."""


def figure_rows(found: SessionRig) -> list[tuple[str, ...]]:
    """Return a row for each figure: name, value, good up to, usable up to, what it means.

    Args:
        found: the rig.
    """
    rig, limits = found.rig, found.limits
    rows = list[tuple[str, ...]]()
    p95_px = float(np.percentile(found.vertical_px, 95))
    if math.isfinite(p95_px):
        mean, most = float(found.vertical_px.mean()), float(found.vertical_px.max())
        rows.append(
            (
                "vertical error, 95 %",
                f"{p95_px:.3f} px (mean {mean:.3f}, most {most:.3f})",
                f"{limits.good_px:.2f} px",
                f"{limits.usable_px:.2f} px",
                "how far matching points lie from the same row: a matcher looks along rows only",
            )
        )
    rows.append(
        (
            "RMS",
            f"left {rig.rms_left_px:.3f}, right {rig.rms_right_px:.3f}, together {rig.rms_stereo_px:.3f} px",
            _DASH,
            _DASH,
            "how far corners lie from where the rig expects them",
        )
    )
    baseline_m = float(np.linalg.norm(rig.t_right_left_m))
    good, usable = (f"{share:.0%}" for share in (limits.good_share, limits.usable_share))
    rows.append(
        (
            "baseline",
            f"{baseline_m * 1e3:.2f} ± {found.baseline_sigma_m * 1e3:.2g} mm ({found.baseline_sigma_m / baseline_m:.2%})",
            good,
            usable,
            "distance of the two cameras; its uncertainty is that of all depths",
        )
    )
    rows += [
        (
            f"depth error at {depth_m:g} m",
            f"± {sigma_m * 1e3:.2g} mm ({sigma_m / depth_m:.2%})",
            good if depth_m == 1 else _DASH,
            usable if depth_m == 1 else _DASH,
            "one standard deviation, by the calibration alone; noise of matching comes on top",
        )
        for depth_m, sigma_m in found.depths
        if math.isfinite(sigma_m)
    ]
    if math.isfinite(found.square_mean_m):
        off = found.square_mean_m / found.square_m - 1
        rows.append(
            (
                "squares held out",
                f"{found.square_mean_m * 1e3:.2f} ± {found.square_sigma_m * 1e3:.2f} mm ({off:+.2%})",
                good,
                usable,
                f"squares on boards that the rig was not fitted to; {found.square_m * 1e3:.2f} mm is true",
            )
        )
    if math.isfinite(found.far_m):
        rows.append(
            (
                "far limit",
                f"{found.far_m:.1f} m (zero ± {rig.zero_sigma_px:.2f} px)",
                _DASH,
                _DASH,
                "depth beyond it is a guess",
            )
        )
    return rows


def camera_tables(found: SessionRig) -> str:
    """Make the card with both cameras' parameters and their relative pose.

    Args:
        found: the rig.
    """
    rig = found.rig
    sigmas = np.sqrt(np.diag(rig.covariance).clip(min=0))
    left, right = (
        _parameters(model, sigmas[at : at + _HALF]) for model, at in ((rig.left, 0), (rig.right, _HALF))
    )
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
    known = f" ± {sigma:.2g}" if math.isfinite(sigma) and sigma > 0 else ""
    return f"{value:.{digits}f}{known} {unit}".strip()


def _three(values: Floats, sigmas: Floats, unit: str, digits: int) -> str:
    return ", ".join(
        _with_sigma(float(value), float(sigma), unit, digits) for value, sigma in zip(values, sigmas, strict=True)
    )
