"""What the uncertainty of a rig does to disparity and depth, and which view of the board would lower it most. Pure.

The covariance of the parameters is carried through to first order:

    variance of a disparity = J C J^T,  J = its derivative by the parameters.

J is exact (`geometry.lens`). A point at infinity has D = d + doffs = 0 in an exact rig; in a
calibrated one its sigma, the noise of zero, decides how far the rig can see, because depth is f b / D.

For each kind of view, some are imagined: where the board would stand, which corners both cameras would see. What they would add is
known before they are taken: each view's normal equations with its pose eliminated, at the corners' noise of the views so far.
The kind that leaves the smallest depth error is the one to take.
"""

from dataclasses import dataclass, replace
from enum import Enum
from typing import Final, assert_never

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.solve.bundle import BundleResult, rig_of
from phone_host.calibration.solve.bundle_problem import (
    GLOBALS,
    BundleState,
    RigProblem,
    Vector,
    project_view,
)
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import pixel_derivatives
from phone_host.geometry.schur import Flags
from phone_host.geometry.se3 import SE3, rotations_of, vectors_of
from phone_host.model import CameraModel, Epipolar, Rectification, Rig

DEPTHS_M: Final = (0.3, 0.5, 1.0, 2.0)
"""Depths at which a calibration states its depth error."""

_COLUMNS, _ROWS = 9, 7
"""Points over the image. The error bends as slowly as the lens: a finer grid changes the result by less than a tenth."""

DEPTH_M: Final = 1.0
"""Where the depth error counts that is to become smaller."""

_FILLS: Final = 0.4
"""Share of the image's width that an imagined board fills, where nothing else is said."""

_NEAR_FILLS, _FAR_FILLS = 0.6, 0.2
_TILT_DEG: Final = 35.0
_ASIDE: Final = 0.28
"""How far from the middle, in image sizes, a board in a corner has its own middle."""

_LEAST_SEEN: Final = 0.5
"""An imagined view of which a camera would see less than this share of the corners would not be found."""

_LEAST_SIGMA_PX: Final = 0.02
"""Corners of rendered boards err by about as much: no view teaches without limit."""


def zero_sigma_px(rig: Rig, rectification: Rectification) -> float:
    """Return the standard uncertainty of the disparity of infinitely far points.

    Returns:
        Root mean square over the rectified image, px of that image; NaN if the covariance is not known.
    """
    return _disparity_sigma_px(rig, rectification, np.inf)


def depth_sigma_m(rig: Rig, rectification: Rectification, depth_m: float) -> float:
    """Return the standard uncertainty of depths that the calibration alone leaves, m.

    Returns:
        Root mean square over the rectified image, m; NaN if the covariance is not known or both cameras see nothing so near.
    """
    geometry = rectification.geometry
    sigma_px = _disparity_sigma_px(rig, rectification, depth_m)
    return depth_m**2 / (geometry.focal_px * geometry.baseline_m) * sigma_px


def _disparity_sigma_px(rig: Rig, rectification: Rectification, depth_m: float) -> float:
    if not np.isfinite(rig.covariance).all():
        return float("nan")
    jacobian = disparity_derivatives(rig, rectification, depth_m)
    variances = np.einsum("ni,ij,nj->n", jacobian, rig.covariance, jacobian)
    return float(np.sqrt(variances.clip(min=0).mean())) if len(variances) else float("nan")


def disparity_derivatives(rig: Rig, rectification: Rectification, depth_m: float) -> Vector:
    """Return the derivatives of disparities by the true parameters, (N, 30), px per unit, at points spread over what both cameras see; their depth may be infinite."""
    slopes = _slopes(rectification)
    axis = 1 if rectification.epipolar.is_vertical else 0
    if np.isfinite(depth_m):  # what the right camera does not see has no disparity
        geometry = rectification.geometry
        pixels = slopes[:, axis] * geometry.focal_px + (geometry.cy_px if axis else geometry.cx_px)
        towards = -1.0 if rectification.epipolar is Epipolar.DOWN else 1.0
        matched = pixels - towards * geometry.focal_px * geometry.baseline_m / depth_m
        slopes = slopes[(matched >= 0) & (matched < (rectification.height_px if axis else rectification.width_px))]
    both = pixel_derivatives(slopes, np.full(len(slopes), 1 / depth_m), rig, rectification)[:, :, axis]
    return np.asarray(both[:, 0] - both[:, 1], np.float64)


def _slopes(rectification: Rectification) -> Vector:
    """Return slopes (N, 2) spread evenly over the rectified image."""
    geometry = rectification.geometry
    columns = (np.arange(_COLUMNS) + 0.5) / _COLUMNS * rectification.width_px
    rows = (np.arange(_ROWS) + 0.5) / _ROWS * rectification.height_px
    x, y = (axis.ravel() for axis in np.meshgrid(columns, rows))
    return np.column_stack([x - geometry.cx_px, y - geometry.cy_px]) / geometry.focal_px


class Kind(Enum):
    """What to show."""

    TILTED = "tilted"
    CORNERS = "corners"
    NEAR = "near"
    FAR = "far"
    MORE = "more"


@dataclass(frozen=True, slots=True)
class NextView:
    """What to show next, and what it would bring.

    Attributes:
        kind: what to show.
        sigma_m: standard uncertainty of depth at 1 m now, m.
        after_m: the same after four such views, m.
    """

    kind: Kind
    sigma_m: float
    after_m: float


def next_view(result: BundleResult, free: Flags, points_m: Vector, rectification: Rectification) -> NextView | None:
    """Find out which view would teach a calibration most.

    Returns:
        The view; None if it cannot be told.
    """
    sigmas = [float(np.sqrt(np.nanmean(errors**2))) for errors in (result.left_errors_px, result.right_errors_px)]
    lesson = Lesson(
        state=result.state,
        covariance=result.covariance,
        flags=free,
        sigmas_px=(sigmas[0], sigmas[1]),
        points_m=points_m,
        rectification=rectification,
    )
    now = lesson.sigma_m()
    if not np.isfinite(now):
        return None
    found = [NextView(kind, now, lesson.after_m(_poses(kind, result.state, points_m))) for kind in Kind]
    seen = [each for each in found if np.isfinite(each.after_m)]
    return min(seen, key=lambda each: each.after_m) if seen else None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lesson:
    """What a calibration knows, and what more views would teach it.

    Attributes:
        state: the rig; of its poses only those of Kind.MORE are asked for.
        covariance: (30, 30) of its parameters.
        flags: (30,) which of them are estimated.
        sigmas_px: standard deviation of one coordinate of a corner, left and right.
        points_m: (N, 3) corners in the board's axes.
        rectification: of the rig.
    """

    state: BundleState
    covariance: Vector
    flags: NDArray[np.bool_]
    sigmas_px: tuple[float, float]
    points_m: Vector
    rectification: Rectification

    def sigma_m(self) -> float:
        """Return the standard uncertainty of depth at 1 m now, m; NaN: not known."""
        return _sigma_m(self.covariance, self.state, self.rectification)

    def after_m(self, poses: Vector) -> float:
        """Return the same after views of the board in some poses (V, 6), m; NaN: a camera would see too little of it."""
        views = [_imagined(self.state, pose, self.points_m) for pose in poses]
        known = [(view, pose) for view, pose in zip(views, poses, strict=True) if view is not None]
        if not known:
            return float("nan")
        state = replace(self.state, poses=np.array([pose for _, pose in known]))
        nothing = np.zeros(GLOBALS), np.zeros(GLOBALS)
        noise = max(self.sigmas_px[0], _LEAST_SIGMA_PX), max(self.sigmas_px[1], _LEAST_SIGMA_PX)
        problem = RigProblem([view for view, _ in known], self.points_m, nothing, noise)
        free = np.ix_(self.flags, self.flags)
        more = problem.linearised(state).reduced(0.0, self.flags)[0] * len(poses) / len(known)
        covariance = np.zeros((GLOBALS, GLOBALS))
        information = np.linalg.pinv(self.covariance[free], hermitian=True)
        covariance[free] = np.linalg.pinv(information + more, hermitian=True)
        return _sigma_m(covariance, state, self.rectification)


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a board is imagined to stand.

    Attributes:
        aside: of its middle from that of the images, in image sizes, right and down.
        tilt_deg: across: positive if its left edge is away; down: positive if its top edge is.
        fills: share of the image's width.
    """

    aside: tuple[float, float] = (0.0, 0.0)
    tilt_deg: tuple[float, float] = (-6.0, -6.0)
    fills: float = _FILLS


def after_one_m(rig: Rig, rectification: Rectification, points_m: Vector, spot: Spot) -> float:
    """Return the standard uncertainty of depth at 1 m that one more view would leave, m; NaN: it cannot be told."""
    if not np.isfinite(rig.covariance).all():
        return float("nan")
    state = BundleState(
        left=rig.left,
        right=rig.right,
        rotation=vectors_of(rig.R_right_left),
        translation_m=rig.t_right_left_m,
        poses=np.empty((0, 6)),
    )
    lesson = Lesson(
        state=state,
        covariance=rig.covariance,
        flags=np.diag(rig.covariance) > 0,
        sigmas_px=(rig.rms_stereo_px / np.sqrt(2), rig.rms_stereo_px / np.sqrt(2)),
        points_m=points_m,
        rectification=rectification,
    )
    across, down = np.radians(spot.tilt_deg)
    pose = _pose(state, points_m, aside=spot.aside, turn=np.array([-down, across, 0.0]), fills=spot.fills)
    return lesson.after_m(pose[np.newaxis])


def _sigma_m(covariance: Vector, state: BundleState, rectification: Rectification) -> float:
    return depth_sigma_m(replace(rig_of(state), covariance=covariance), rectification, DEPTH_M)


def _imagined(state: BundleState, pose: Vector, points_m: Vector) -> BoardPair | None:
    """Return what both cameras would see of a board; None if one sees too little of it."""
    seen = []
    for model, pixels in zip((state.left, state.right), project_view(state, pose, points_m), strict=True):
        limit = np.array([model.width_px - 1, model.height_px - 1])
        inside = np.all((pixels > 0) & (pixels < limit), axis=1)
        if inside.mean() < _LEAST_SEEN:
            return None
        seen.append(np.where(inside[:, np.newaxis], pixels, np.nan))
    return BoardPair("", seen[0], seen[1])


def _poses(kind: Kind, state: BundleState, points_m: Vector) -> Vector:
    """Return four poses (4, 6) of the board for a kind of view."""
    match kind:
        case Kind.MORE:
            return np.asarray(state.poses[np.linspace(0, len(state.poses) - 1, 4).astype(int)], np.float64)
        case Kind.TILTED:
            turns = [np.array([x, y, 0.0]) * np.radians(_TILT_DEG) for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))]
            return np.array([_pose(state, points_m, turn=turn) for turn in turns])
        case Kind.CORNERS:
            corners = [(x, y) for x in (-_ASIDE, _ASIDE) for y in (-_ASIDE, _ASIDE)]
            return np.array([_pose(state, points_m, aside=corner) for corner in corners])
        case Kind.NEAR | Kind.FAR:
            fills = _NEAR_FILLS if kind is Kind.NEAR else _FAR_FILLS
            spots = ((-0.1, 0.0), (0.1, 0.0), (0.0, -0.1), (0.0, 0.1))
            return np.array([_pose(state, points_m, aside=spot, fills=fills) for spot in spots])
        case _:
            assert_never(kind)


def _pose(
    state: BundleState,
    points_m: Vector,
    *,
    aside: tuple[float, float] = (0.0, 0.0),
    turn: Vector | None = None,
    fills: float = _FILLS,
) -> Vector:
    """Return the pose of a board that stands between the two cameras' axes, slightly tilted unless said otherwise."""
    left, right = SE3(np.eye(3), np.zeros(3)), SE3(rotations_of(state.rotation), state.translation_m)
    size_m = float(np.ptp(points_m[:, 0]))
    depth_m = max(_distance_m(model, size_m, fills) for model in (state.left, state.right))
    rotation = rotations_of(np.array([0.1, -0.1, 0.0]) if turn is None else turn)
    spots = []
    for model, camera in ((state.left, left), (state.right, right)):
        field = np.array([model.width_px, model.height_px]) / np.diag(model.matrix)[:2]
        spots.append(camera.inverse().apply(np.append(np.array(aside) * field, 1.0) * depth_m))
    middle = np.mean(spots, axis=0)
    return SE3(rotation, middle - rotation @ points_m.mean(axis=0)).pose()


def _distance_m(model: CameraModel, size_m: float, fills: float) -> float:
    return float(model.matrix[0, 0]) * size_m / (fills * model.width_px)
