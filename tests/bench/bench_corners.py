"""How exactly corners of a chessboard are found, beside OpenCV's two estimators: `python -m tests.bench.bench_corners [--help]`.

Boards are rendered with exact corners (calibration_render) at random positions and turns, then blurred, darkened, made noisy and
compressed. One condition is varied at a time around: squares of 30 px, tilt 30 degrees, blur 0.7 px, noise 2 of 255, full contrast, no
compression. All estimators see the same images. `cornerSubPix` starts where ours does: at the truth, moved by up to 0.7 px.

Then photographs of 12 megapixels, with a board and without, through files: at most 0.3 s an image. Exit 4 when that is missed.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from phone_host.calibration.target.corner_fit import fit_corners, steps_between
from phone_host.calibration.target.corners import Board
from phone_host.geometry.lens import project
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Image
from tests.bench.calibration_render import render
from tests.bench.corner_photos import photos
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine

Floats = NDArray[np.float64]

_BOARD: Final = Board(9, 6, 0.03)
_FOCAL_PX: Final = 900.0
_SIZE_PX: Final = (1280, 960)
_PHOTOS: Final = "photographs"
_MOST_SECONDS: Final = 0.3
_START_PX: Final = 0.7
_UNTIL: Final = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-4)


@dataclass(frozen=True, slots=True)
class Condition:
    """How a board is seen.

    Attributes:
        square_px: side of a square in the middle of the image.
        tilt_deg: of the board.
        blur_px: deviation of a Gaussian blur.
        noise: deviation of Gaussian noise, grey levels.
        contrast: share of full contrast.
        quality: of JPEG; 0: not compressed.
    """

    square_px: float = 30.0
    tilt_deg: float = 30.0
    blur_px: float = 0.7
    noise: float = 2.0
    contrast: float = 1.0
    quality: int = 0


def conditions() -> Iterator[tuple[str, Condition]]:
    """Give what is varied, and how."""
    usual = Condition()
    yield from ((f"blur {each:g} px", replace(usual, blur_px=each)) for each in (0.0, 0.5, 1.0, 1.5, 2.0))
    yield from ((f"noise {each:g}", replace(usual, noise=each)) for each in (0.0, 2.0, 4.0, 6.0))
    yield from ((f"tilt {each:g} degrees", replace(usual, tilt_deg=each)) for each in (0.0, 30.0, 45.0, 60.0))
    yield from ((f"JPEG quality {each}", replace(usual, quality=each)) for each in (95, 85, 75, 60))
    yield from ((f"contrast {each:g}", replace(usual, contrast=each)) for each in (0.5, 0.25))
    yield from ((f"squares of {each:g} px", replace(usual, square_px=each)) for each in (8.0, 12.0, 20.0, 40.0, 80.0))


@dataclass(frozen=True, slots=True)
class Score:
    """How an estimator did: bias (length of the mean error along both edges), RMS of one coordinate, 95 % of the errors, px; share found; error / stated sigma."""

    bias_px: float
    rms_px: float
    p95_px: float
    found: float
    sigmas: float = float("nan")


def measured(condition: Condition, views: int, seed: int) -> dict[str, Score]:
    """Find the corners of some views by each estimator."""
    random = np.random.default_rng(seed)
    errors: dict[str, list[Floats]] = {"cornerSubPix": [], "sectors": [], "ours": []}
    sigmas = list[Floats]()
    for _ in range(views):
        image, truth = _view(condition, random)
        start = truth + random.uniform(-_START_PX, _START_PX, truth.shape)
        steps = steps_between(start.reshape(_BOARD.rows, _BOARD.columns, 2))
        fitted = fit_corners(image, start, *steps)
        errors["ours"].append(fitted.px - truth)
        sigmas.append(fitted.sigma_px)
        window = max(2, int(0.3 * min(np.linalg.norm(each, axis=1).min() for each in steps)))
        refined = cv2.cornerSubPix(
            cv2.GaussianBlur(image, (0, 0), 1.0),
            start.astype(np.float32).reshape(-1, 1, 2),
            (window, window),
            (-1, -1),
            _UNTIL,
        )
        errors["cornerSubPix"].append(refined.reshape(-1, 2) - truth)
        found, corners = cv2.findChessboardCornersSB(
            image, (_BOARD.columns, _BOARD.rows), flags=cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
        )
        if found:
            seen = np.asarray(corners, np.float64).reshape(-1, 2)
            seen = min(seen, seen[::-1], key=lambda each: float(np.abs(each - truth).sum()))
            errors["sectors"].append(seen - truth)
    scores = {name: _score(found, views) for name, found in errors.items()}
    off = np.concatenate(errors["ours"]) / np.concatenate(sigmas)[:, np.newaxis]
    scores["ours"] = replace(scores["ours"], sigmas=float(np.sqrt(np.nanmean(off**2))))
    return scores


def _score(errors: list[Floats], views: int) -> Score:
    if not errors:
        return Score(float("nan"), float("nan"), float("nan"), 0.0)
    every = np.concatenate(errors)
    seen = every[np.isfinite(every[:, 0])]
    lengths = np.linalg.norm(seen, axis=1)
    return Score(
        float(np.linalg.norm(seen.mean(axis=0))),
        float(np.sqrt((seen**2).mean())),
        float(np.percentile(lengths, 95)),
        len(seen) / (views * _BOARD.columns * _BOARD.rows),
    )


def _view(condition: Condition, random: np.random.Generator) -> tuple[Image, Floats]:
    """Render one view; returns it and its exact corners."""
    middle = np.array([[_FOCAL_PX, 0, (_SIZE_PX[0] - 1) / 2], [0, _FOCAL_PX, (_SIZE_PX[1] - 1) / 2], [0, 0, 1]])
    model = CameraModel(
        width_px=_SIZE_PX[0], height_px=_SIZE_PX[1], matrix=middle, distortion=np.array([-0.1, 0.02, 0, 0, 0.0])
    )
    azimuth, turn = random.uniform(0, 2 * np.pi), random.uniform(-0.4, 0.4)
    tilt = np.radians(condition.tilt_deg)
    rotation = (
        cv2.Rodrigues(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0]))[0]
        @ cv2.Rodrigues(np.array([0, 0, turn]))[0]
    )
    depth_m = _FOCAL_PX * _BOARD.square_m / condition.square_px
    board_m = _BOARD.points_m()
    centre = np.array([*random.uniform(-0.01, 0.01, 2), 1.0]) * depth_m
    pose = SE3(np.asarray(rotation, np.float64), centre - rotation @ board_m.mean(axis=0))
    image = render(model, pose, _BOARD).astype(np.float32)
    if condition.blur_px:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), condition.blur_px), np.float32)
    image = 120 + (image - 120) * condition.contrast + random.normal(0, condition.noise, image.shape).astype(np.float32)
    grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    if condition.quality:
        coded = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, condition.quality])[1]
        grey = np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), np.uint8)
    return grey, project(pose.apply(board_m), model)


def main() -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(
        "python -m tests.bench.bench_corners", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--views", type=int, default=20, help="views of each condition (default: %(default)s)")
    parser.add_argument("--only", default="", help="conditions whose name contains this")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    verdicts = _photographs() if options.only in _PHOTOS else []
    cv2.setNumThreads(1)
    table = Table(
        "condition",
        "cornerSubPix: RMS px",
        "p95",
        "sectors: RMS",
        "p95",
        "found",
        "ours: RMS",
        "p95",
        "bias",
        "error / sigma",
    )
    rows = {}
    for index, (name, condition) in enumerate(conditions()):
        if options.only not in name:
            continue
        rows[name] = scores = measured(condition, options.views, index)
        first, second, own = scores["cornerSubPix"], scores["sectors"], scores["ours"]
        table.add_row(
            name,
            *(f"{value:.3f}" for value in (first.rms_px, first.p95_px, second.rms_px, second.p95_px)),
            f"{second.found:.0%}",
            *(f"{value:.3f}" for value in (own.rms_px, own.p95_px, own.bias_px)),
            f"{own.sigmas:.2f}",
        )
    if options.json:
        print(
            json.dumps(
                {
                    "machine": str(machine()),
                    "rows": {k: {n: asdict(s) for n, s in v.items()} for k, v in rows.items()},
                    "verdicts": [asdict(each) for each in verdicts],
                }
            )
        )
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}")
        Console(width=150).print(table)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _photographs() -> list[Verdict]:
    """Search photographs with boards of several sizes, and without."""
    random, found = np.random.default_rng(5), []
    sizes = (Condition(square_px=square_px, noise=0.0) for square_px in (20.0, 30.0, 45.0, 60.0))
    boards = [_view(condition, random)[0] for condition in sizes]
    for what, shown in (("with a board", boards), ("without a board", [])):
        seen = photos(shown, _BOARD)
        is_right = seen.found == (seen.images if shown else 0)
        found.append(
            Verdict(
                f"{_PHOTOS} of 12 megapixels, {what}: time an image; found",
                seen.seconds <= _MOST_SECONDS and is_right,
                f"{seen.seconds:.2f} s (CPU {seen.cpu_seconds:.2f} s); {seen.found} of {seen.images}",
                f"{_MOST_SECONDS:g} s; {'all' if shown else 'none'}",
            )
        )
    return found


if __name__ == "__main__":
    sys.exit(main())
