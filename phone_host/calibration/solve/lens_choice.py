"""Chooses the formula of a lens by how well it predicts views that it has not seen. Pure.

A richer formula always explains the views it was fitted to better; whether it holds, only other views tell. So the views are
dealt out in five parts; each is predicted by a camera fitted to the other four, with the board's pose alone fitted to the view
itself. A richer formula is taken where its errors are smaller by more than their difference scatters from view to view.

Source: T. Hastie et al., "The Elements of Statistical Learning", 2009, section 7.10 (cross-validation, one-standard-error rule).
"""

import math
from dataclasses import replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.solve.board_pose import fit_pose
from phone_host.calibration.solve.bundle import adjust_alone, alone_state, fit_poses, view_rms_px
from phone_host.calibration.solve.bundle_problem import Bend, BundleState, Vector, errors_of, left_alone
from phone_host.calibration.solve.calibrate_alone import fisheye_camera
from phone_host.calibration.solve.verdict import LensTrial
from phone_host.calibration.target.corners import Corners
from phone_host.geometry.lens import farthest_angle, parameters_of, rays_through, with_parameters
from phone_host.model import CameraModel, Lens

_PARTS: Final = 5
_LEAST_VIEWS: Final = {Bend.USUAL: 5, Bend.WIDE: 5, Bend.FISHEYE: 5, Bend.RATIONAL: 7}
"""Views from which on a formula is tried, the simplest first: fewer do not leave enough in each part to fit it."""

_STANDARD_ERRORS: Final = 1.0
_LEAST_GAIN: Final = 0.005
"""Of the mean squared error: a smaller gain moves no point by a measurable amount, and is not worth another formula."""

_FAR_BETTER: Final = 0.85
"""Share of the wide lens's squared errors below which a fisheye lens is worth rejecting pairs anew: of fisheyes of 120 degrees at most 0.7, of pinholes 0.99."""

_WRONG: Final = 3.0
"""In usual errors: a view beyond is as wrong as any. Those far off the axis tell the lenses apart, so no median does."""

_WIDEST_RAD: Final = 4.5
"""Angle that an image's width covers, at the scale of its middle: no lens sees more than 260 degrees."""

_WIDE_RAD: Final = 1.3
"""Angle that an image's width covers from which on poses that a pinhole gave mislead the search for a fisheye."""

_EDGE_SAMPLES: Final = 200
_BEYOND: Final = 1.1
"""The image's radius is the bent one; the true one may be a tenth larger."""


def choose_lens(
    views: list[Corners], points_m: Vector, model: CameraModel, poses: Vector, at_least: Bend = Bend.USUAL
) -> tuple[LensTrial, list[LensTrial]]:
    """Choose the formula of one camera's lens.

    Args:
        views: (N, 2) corners of V views.
        points_m: (N, 3) corners in the board's axes.
        model: the camera as far as it is known.
        poses: (V, 6) of the boards in its axes.
        at_least: the formula that is already needed: no simpler one is tried. (A fisheye may have been needed for the other camera's sake: a rational lens is
            tried as well.)

    Returns:
        The chosen formula, and all that were tried. Too few views for any choice: the formula that is needed, untried.
    """
    order = list(_LEAST_VIEWS)
    wanted = order[order.index(at_least) :]
    trials = list[LensTrial]()
    for bend in wanted:
        if len(views) >= _LEAST_VIEWS[bend]:
            trial = _trial(views, points_m, alone_state(model, poses), bend, trials[0] if trials else None)
            trials += [] if trial is None else [trial]
    if not trials:
        return LensTrial(at_least, model, np.full(len(views), np.nan), np.full(len(views), np.nan)), []
    best = trials[0]
    for trial in trials[1:]:
        best = trial if _is_better(trial, best) else best
    return best, trials


def is_fisheye(views: list[Corners], points_m: Vector, size_px: tuple[int, int]) -> bool:
    """Return whether a fisheye lens explains the views of one camera far better than a wide one, or that one only by folding back; views may be wrong."""
    try:
        model, poses = fisheye_camera(views, points_m, size_px)
        middle = np.array([[1, 0, (size_px[0] - 1) / 2], [0, 1, (size_px[1] - 1) / 2], [0, 0, 1]])
        matrix = np.diag([model.matrix[0, 0], model.matrix[1, 1], 1.0])
        straight = replace(model, lens=Lens.PINHOLE, distortion=np.zeros(5), matrix=middle @ matrix)
        start = alone_state(straight, np.array([fit_pose(points_m, corners, straight) for corners in views]))
        wide = adjust_alone(views, points_m, start, Bend.WIDE.free())
    except (DataError, cv2.error, np.linalg.LinAlgError):
        return False
    as_fisheye, as_wide = (_errors_px(views, points_m, state) for state in (alone_state(model, poses), wide))
    most = _WRONG * float(np.median(as_fisheye))
    squares = [float((np.fmin(errors, most) ** 2).mean()) for errors in (as_fisheye, as_wide)]
    is_folded = size_px[0] > _WIDE_RAD * model.matrix[0, 0] and grows(model) and not grows(wide.left)
    return is_folded or squares[0] < _FAR_BETTER * squares[1]


def grows(model: CameraModel) -> bool:
    """Return whether a lens's formula grows all the way to the image's corners; if it folds back, the fit has failed."""
    fx, fy, cx, cy, *k = parameters_of(model)
    if min(fx, fy) * _WIDEST_RAD < model.width_px:
        return False
    aside = max(cx, model.width_px - cx) / fx, max(cy, model.height_px - cy) / fy
    if model.lens is Lens.FISHEYE:
        corners = np.array([[x, y] for x in (0.0, model.width_px - 1.0) for y in (0.0, model.height_px - 1.0)])
        return bool(np.isfinite(rays_through(corners, model)).all() or farthest_angle(model) >= np.pi / 2)
    r = np.linspace(0, math.hypot(*aside) * _BEYOND, _EDGE_SAMPLES)
    r2 = r * r
    under = 1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]))
    bent = r * (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / under
    return bool((under > 0).all() and (np.diff(bent) > 0).all())


def _trial(
    views: list[Corners], points_m: Vector, start: BundleState, bend: Bend, plain: LensTrial | None
) -> LensTrial | None:
    """Fit one formula to all views and to all but each part; None if that leads nowhere, as where it explains no more than `plain`."""
    try:
        whole = adjust_alone(views, points_m, _start(views, points_m, start, bend), bend.free())
        fitted_px = _errors_px(views, points_m, whole)
        # What does not explain the views that it was fitted to any better predicts no others better.
        if not grows(whole.left) or (plain is not None and not _is_less(fitted_px, plain.fitted_px)):
            return None
        errors = np.zeros(len(views))
        for part in range(min(_PARTS, len(views))):
            out = np.arange(len(views)) % min(_PARTS, len(views)) == part
            errors[out] = _predicted(views, points_m, whole, out, bend)
    except (DataError, cv2.error, np.linalg.LinAlgError):  # a richer formula may fail where a simpler one holds
        return None
    return LensTrial(bend, whole.left, errors, fitted_px) if np.isfinite(errors).all() else None


def _start(views: list[Corners], points_m: Vector, start: BundleState, bend: Bend) -> BundleState:
    model = start.left
    if bend.lens is model.lens:
        return start
    values = parameters_of(model)
    if bend.lens is Lens.FISHEYE and model.width_px > _WIDE_RAD * values[0]:
        return alone_state(*fisheye_camera(views, points_m, (model.width_px, model.height_px)))
    if bend is not Bend.RATIONAL or model.lens is Lens.FISHEYE:
        values[4:] = 0  # near the axis all lenses agree; the coefficients follow
    return alone_state(with_parameters(model, values, bend.lens), start.poses)


def _errors_px(views: list[Corners], points_m: Vector, state: BundleState) -> Vector:
    """Return each view's root mean square error, (V,) px."""
    return view_rms_px(errors_of(left_alone(views), points_m, state)[0])


def _is_less(rich_px: Vector, plain_px: Vector) -> bool:
    return float((rich_px**2).mean()) < (1 - _LEAST_GAIN) * float((plain_px**2).mean())


def _predicted(
    views: list[Corners], points_m: Vector, whole: BundleState, out: NDArray[np.bool_], bend: Bend
) -> Vector:
    """Return the errors of the views that are held out, px."""
    kept = [corners for corners, held in zip(views, out, strict=True) if not held]
    held = [corners for corners, held in zip(views, out, strict=True) if held]
    fitted = adjust_alone(kept, points_m, alone_state(whole.left, whole.poses[~out]), bend.free())
    return view_rms_px(fit_poses(left_alone(held), points_m, alone_state(fitted.left, whole.poses[out])).left_errors_px)


def _is_better(rich: LensTrial, plain: LensTrial) -> bool:
    """Return whether the errors of the first are smaller by more than chance."""
    gains = plain.held_out_px**2 - rich.held_out_px**2
    scatter = float(gains.std(ddof=1)) / math.sqrt(len(gains))
    gain = float(gains.mean())
    return gain > _STANDARD_ERRORS * scatter and gain > _LEAST_GAIN * plain.rms_px**2
