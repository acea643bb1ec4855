"""Rendered rigs for bench_calibration: two unlike cameras whose every number is known, as webcams would show a board to them.

Each image is rendered ray by ray through the camera's own lens, blurred, given shot and read noise, and recompressed as JPEG.
"""

from dataclasses import dataclass
from typing import Final, assert_never

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.solve.bundle_problem import Bend
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.corners import Board, agree, find_corners
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import parameters_of, project
from phone_host.geometry.se3 import SE3, rotations_of, vectors_of
from phone_host.model import CameraModel, Image, Lens, Rig
from tests.bench.calibration_render import render
from tests.support.fisheyes import BOARD as FISHEYES_BOARD
from tests.support.fisheyes import RIGHT_M, fisheye, fisheye_pairs

BOARD: Final = Board(11, 8, 0.022)
"""Fills an A4 sheet."""

VIEWS: Final = 25
"""What a guided session takes."""

SIZES: Final = ((640, 480), (800, 600), (1280, 720), (960, 540))
_MARGIN_PX: Final = 14
_QUALITY: Final = 85
_CONFIDENCE: Final = 1.96

_TRUE_TERMS: Final = {Lens.PINHOLE: 4, Lens.RATIONAL: 8, Lens.FISHEYE: 4}


@dataclass(frozen=True, slots=True)
class RenderedResult:
    """How far a calibration is from the truth.

    Attributes:
        name: of the rig.
        lenses: true and found kinds.
        views: used.
        focal_share: largest error of a focal length, as a share.
        baseline_share: error of the baseline, as a share.
        rotation_deg: error of the relative rotation, degrees.
        inside: for each comparable parameter, whether the truth lies inside the stated 95 %.
        rms_px: of the calibration.
    """

    name: str
    lenses: str
    views: int
    focal_share: float
    baseline_share: float
    rotation_deg: float
    inside: tuple[bool, ...]
    rms_px: float


def random_rig(seed: int) -> Rig:
    """Two cameras of other size, lens and focal length, 60 to 140 mm apart, turned by up to 3 degrees about each axis."""
    random = np.random.default_rng(seed)
    sizes = random.permutation(len(SIZES))[:2]
    kinds = random.choice([each.value for each in Lens], 2, p=[0.5, 0.25, 0.25])
    lenses = [Lens(str(kind)) for kind in kinds]
    models = [
        random_camera(random, SIZES[index], lens, is_wide=Lens.FISHEYE in lenses)
        for index, lens in zip(sizes, lenses, strict=True)
    ]
    rotation = rotations_of(np.radians(random.uniform(-3, 3, 3)))
    centre = np.array([random.uniform(0.06, 0.14), *random.uniform(-0.01, 0.01, 2)])
    return Rig(left=models[0], right=models[1], R_right_left=rotation, t_right_left_m=-rotation @ centre)


def random_camera(random: np.random.Generator, size_px: tuple[int, int], lens: Lens, *, is_wide: bool) -> CameraModel:
    """Beside a fisheye lens of 80 to 105 degrees stands a wide webcam: rigs whose cameras share little of their views are no rigs."""
    width, height = size_px
    focal = width * (random.uniform(0.55, 0.72) if is_wide else random.uniform(0.75, 1.1))
    k: NDArray[np.float64]
    match lens:
        case Lens.PINHOLE:
            k1 = random.uniform(-0.3, 0.1)
            k = np.array([k1, -0.4 * k1 + random.uniform(-0.03, 0.03), *random.uniform(-6e-4, 6e-4, 2), 0.0])
        case Lens.RATIONAL:
            under = np.array([random.uniform(0.2, 1.0), random.uniform(0.0, 0.4), random.uniform(0.0, 0.05)])
            k1, k2, k3 = under + np.array(
                [random.uniform(-0.25, 0.05), random.uniform(-0.02, 0.1), random.uniform(-0.01, 0.02)]
            )
            k = np.array([k1, k2, *random.uniform(-6e-4, 6e-4, 2), k3, *under])
        case Lens.FISHEYE:
            k = random.uniform(-1, 1, 4) * np.array([0.04, 0.01, 0.005, 0.001])
        case _:
            assert_never(lens)
    middle = np.array([width - 1, height - 1]) / 2 + random.uniform(-0.02, 0.02, 2) * width
    aspect = random.uniform(0.998, 1.002)
    matrix = np.array([[focal, 0, middle[0]], [0, focal * aspect, middle[1]], [0, 0, 1]])
    return CameraModel(width_px=width, height_px=height, matrix=matrix, distortion=k, lens=lens)


def random_poses(rig: Rig, seed: int, count: int = VIEWS) -> NDArray[np.float64]:
    """Poses of a board that both cameras see whole, tilted by 10 to 45 degrees, over the image and over depth, (V, 6)."""
    random, found = np.random.default_rng(1000 + seed), list[NDArray[np.float64]]()
    points, relative = BOARD.points_m(), SE3(rig.R_right_left, rig.t_right_left_m)
    middle = points.mean(axis=0)
    reach = np.array([rig.left.width_px, rig.left.height_px]) / np.diag(rig.left.matrix)[:2] / 2
    while len(found) < count:
        depth = float(np.exp(random.uniform(np.log(0.15), np.log(0.6))))
        around, tilt = random.uniform(0, 2 * np.pi), np.radians(random.uniform(10, 45))
        turn = rotations_of(np.array([np.cos(around), np.sin(around), 0]) * tilt)
        turn = turn @ rotations_of(np.array([0, 0, np.radians(random.uniform(-25, 25))]))
        centre = np.append(random.uniform(-1.2, 1.2, 2) * reach, 1.0) * depth
        pose = SE3(turn, centre - turn @ middle)
        seen = pose.apply(points)
        if _sees(rig.left, seen) and _sees(rig.right, relative.apply(seen)):
            found.append(pose.pose())
    return np.array(found)


def _sees(model: CameraModel, points_m: NDArray[np.float64]) -> bool:
    if points_m[:, 2].min() < 0.1:
        return False
    pixels = project(points_m, model)
    limit = np.array([model.width_px, model.height_px]) - 1 - _MARGIN_PX
    return bool((pixels > _MARGIN_PX).all() and (pixels < limit).all())


def webcam(image: Image, seed: int) -> Image:
    """Blur by 0.7 px, shot and read noise of a webcam in a room, JPEG."""
    random = np.random.default_rng(seed)
    seen = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 0.7)
    sigma = np.sqrt(1.5**2 + seen / 40.0)
    noisy = np.clip(seen + random.normal(0, 1, image.shape) * sigma, 0, 255)
    coded = cv2.imencode(".jpg", np.rint(noisy).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1]
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), np.uint8)


def rendered_pairs(rig: Rig, seed: int) -> list[BoardPair]:
    """Render a session and find the board in it."""
    pairs = []
    for index, pose in enumerate(random_poses(rig, seed)):
        where = SE3.of(pose)
        left = render(rig.left, where, BOARD)
        right = render(rig.right, SE3(rig.R_right_left, rig.t_right_left_m) @ where, BOARD)
        found = [
            find_corners(webcam(image, 10_000 * seed + 2 * index + side), BOARD)
            for side, image in enumerate((left, right))
        ]
        if all(len(each) for each in found):
            pairs.append(BoardPair(str(index), found[0], agree(found[0], found[1], BOARD)))
    return pairs


def compared(seed: int, rig: Rig, pairs: list[BoardPair], board: Board = BOARD, name: str = "") -> RenderedResult:
    """Calibrate and compare with the truth.

    Args:
        seed: names the rig.
        rig: the truth.
        pairs: what was found in its images.
        board: what they show.
        name: of the rig; empty: its seed.
    """
    sizes = ((rig.left.width_px, rig.left.height_px), (rig.right.width_px, rig.right.height_px))
    found = calibrate(pairs, board, sizes)
    made = found.rig
    focal = [
        abs(model.matrix[i, i] / truth.matrix[i, i] - 1)
        for model, truth in ((made.left, rig.left), (made.right, rig.right))
        for i in (0, 1)
    ]
    baseline, true = (float(np.linalg.norm(each.t_right_left_m)) for each in (made, rig))
    turn = vectors_of(made.R_right_left @ rig.R_right_left.T)
    kinds = zip((rig.left, rig.right), (made.left, made.right), found.bends, strict=True)
    return RenderedResult(
        name=name or str(seed),
        lenses=", ".join(f"{truth.lens.value}>{model.lens.value}{bend.terms}" for truth, model, bend in kinds),
        views=len(found.used),
        focal_share=float(max(focal)),
        baseline_share=abs(baseline / true - 1),
        rotation_deg=float(np.degrees(np.linalg.norm(turn))),
        inside=tuple(_inside(rig, found)),
        rms_px=made.rms_stereo_px,
    )


def _inside(truth: Rig, found: Calibration) -> list[bool]:
    """Return for each parameter that truth and calibration share whether the truth lies inside the stated 95 %."""
    made = found.rig
    sigmas = np.sqrt(np.diag(made.covariance))
    errors = np.concatenate(
        [
            parameters_of(made.left) - parameters_of(truth.left),
            parameters_of(made.right) - parameters_of(truth.right),
            vectors_of(made.R_right_left @ truth.R_right_left.T),
            made.t_right_left_m - truth.t_right_left_m,
        ]
    )
    counted = np.concatenate(
        [_shared(truth.left, found.bends[0]), _shared(truth.right, found.bends[1]), np.ones(6, bool)]
    )
    inside = np.abs(errors) <= _CONFIDENCE * sigmas
    baseline, true = (float(np.linalg.norm(each.t_right_left_m)) for each in (made, truth))
    return [*inside[counted & (sigmas > 0)].tolist(), abs(baseline - true) <= _CONFIDENCE * found.baseline_sigma_m]


def _shared(truth: CameraModel, bend: Bend) -> NDArray[np.bool_]:
    """Return which parameters mean the same: all of one formula that has all true terms, else focal lengths and middle."""
    is_fisheye = Lens.FISHEYE in {truth.lens, bend.lens}
    same = truth.lens is bend.lens if is_fisheye else bend.terms >= _TRUE_TERMS[truth.lens]
    return np.arange(12) < (12 if same else 4)


def fisheyes_result(across_deg: float, seed: int) -> RenderedResult:
    """Calibrate two alike fisheyes from exact corners with noise, up to the edge of what they see (`tests/support/fisheyes.py`), and compare.

    Args:
        across_deg: angle that the images' width covers.
        seed: of the boards.
    """
    camera = fisheye(across_deg)
    rig = Rig(left=camera, right=camera, R_right_left=np.eye(3), t_right_left_m=RIGHT_M)
    return compared(
        seed, rig, fisheye_pairs(camera, camera, seed), FISHEYES_BOARD, f"two of {across_deg:g} degrees, {seed}"
    )


def rendered_result(seed: int) -> RenderedResult:
    """Render a rig's session, calibrate and compare."""
    rig = random_rig(seed)
    return compared(seed, rig, rendered_pairs(rig, seed))
