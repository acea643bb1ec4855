"""What a matcher does on the boards of real rigs: inside a chessboard's outline the true disparity is a plane, known from its corners.

    python -m tests.bench.depth_boards [MATCHER]

Boards hold what desks, screens and tiles hold: areas without texture, and a pattern that repeats. Each rig of $SCAN_DATA
is calibrated once by our own command; its views are rectified as the product rectifies them, and kept in build/boards
with their planes, because finding corners takes longer than matching.

Columns, in percent of the pixels inside the outlines: density = with a value; bad1, bad2 = off by more than 1, 2 px, of
those with a value; wrong2, right2 = off by more, by at most 2 px, of all; worst = the worst view's bad2.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.output.rig_yaml import read_rig
from phone_host.stereo.rectifier import Rectifier
from tests.bench.depth_accuracy import ANCHORS, MakeMatcher, by_maker, matching
from tests.bench.depth_scenes import Image, Values

KEPT_IN: Final = Path(__file__).resolve().parents[2] / "build" / "boards"
COLUMNS: Final = ("density", "bad1", "bad2", "wrong2", "right2", "worst")

_REJECTED: Final = 4
"""Exit code of a calibration that ends in a verdict of reject; it writes the rig all the same."""

_MOST_OFF_PX: Final = 1.0
"""A view whose corners are farther from one plane has corners that were found wrongly."""

_NEAREST_PX: Final = 2.0
_NEARER: Final = 1.15
_BEYOND_PX: Final = 2
"""The search reaches this share and these pixels beyond the nearest corner: the board's rim lies outside its corners."""


@dataclass(frozen=True, slots=True)
class Rig:
    """Where one rig's board views lie.

    Attributes:
        name: for the table.
        folder: in the data.
        left: pattern of the left images.
        right: pattern of the right ones.
        corners: inner corners of the board, columns and rows.
    """

    name: str
    folder: str
    left: str
    right: str
    corners: tuple[int, int]


RIGS: Final = (
    Rig("opencv", "opencv_stereo_calib", "left*.jpg", "right*.jpg", (9, 6)),
    Rig("rig1", "simplestereo_rig1/calib", "*_L.png", "*_R.png", (7, 6)),
    Rig("sourishg", "sourishg_rig/calib_imgs/1", "left[0-9]*.jpg", "right[0-9]*.jpg", (9, 6)),
    Rig("stereopi", "stereopi_rig/pairs", "left*.png", "right*.png", (9, 6)),
)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One rectified board view.

    Attributes:
        rig: the rig's name.
        number: of the view.
        left: (H, W, 3).
        right: the same.
        truth: (H, W) float32, px; NaN outside the outline and where the right image ends.
        disparities: N, px.
    """

    rig: str
    number: int
    left: Image
    right: Image
    truth: Values
    disparities: int


@dataclass(frozen=True, slots=True)
class BoardRow:
    """Means over one rig's views."""

    rig: str
    views: int
    density: float
    bad1: float
    bad2: float
    wrong2: float
    right2: float
    worst: float


def board_views(only: str = "") -> Iterator[View]:
    """Give the views, calibrating and rectifying those rigs that are not kept yet.

    Args:
        only: rigs whose name contains this.
    """
    for rig in RIGS:
        if only in rig.name:
            path = KEPT_IN / f"{rig.name}.npz"
            if not path.exists():
                _keep(rig, path)
            with np.load(path) as kept:
                for number in kept["numbers"].tolist():
                    left, right, truth = (kept[f"{name}{number}"] for name in ("left", "right", "truth"))
                    yield View(rig.name, number, left, right, truth, int(kept[f"disparities{number}"]))


def _keep(rig: Rig, path: Path) -> None:
    arrays: dict[str, NDArray[np.generic]] = {}
    numbers = []
    for view in _rectified(rig):
        numbers.append(view.number)
        for name, values in (("left", view.left), ("right", view.right), ("truth", view.truth)):
            arrays[f"{name}{view.number}"] = values
        arrays[f"disparities{view.number}"] = np.array(view.disparities)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part.npz")
    np.savez(part, numbers=np.array(numbers), **arrays)  # type: ignore[arg-type]
    part.rename(path)


def _rectified(rig: Rig) -> Iterator[View]:
    folder = Path(os.environ["SCAN_DATA"]) / rig.folder
    left, right = ({_number(path): path for path in folder.glob(pattern)} for pattern in (rig.left, rig.right))
    with tempfile.TemporaryDirectory() as name:
        out = Path(name)
        both = sorted(left.keys() & right.keys())
        for side, files in (("l", left), ("r", right)):
            (out / side).mkdir()
            for number in both:
                (out / side / f"{number:03d}{files[number].suffix}").symlink_to(files[number].resolve())
        _calibrate(out, rig.corners)
        rectifier = Rectifier(read_rig(out / "rig.yaml"))
    for number in both:
        images = [np.asarray(cv2.imread(str(files[number])), np.uint8) for files in (left, right)]
        pair = rectifier.rectify(images[0], images[1])
        truth = _plane(pair.left, pair.right, rig.corners)
        if truth is not None:
            nearest = float(np.nanmax(truth)) * _NEARER + _BEYOND_PX
            yield View(rig.name, number, pair.left, pair.right, truth, int(np.ceil(nearest / 16)) * 16)


def _calibrate(out: Path, corners: tuple[int, int]) -> None:
    command = [sys.executable, "-m", "phone_host.cli", "calibrate", str(out / "l"), str(out / "r")]
    board = ["--board", f"{corners[0]}x{corners[1]}", "--square", "25mm", "--out", str(out / "rig.yaml")]
    done = subprocess.run([*command, *board], capture_output=True, text=True, check=False)
    if done.returncode not in {0, _REJECTED}:
        raise RuntimeError(f"calibrate ended with {done.returncode}: {done.stderr[-300:]}")


def _number(path: Path) -> int:
    return int(re.findall(r"\d+", path.name)[-1])


def _corners(image: Image, size: tuple[int, int]) -> NDArray[np.float64] | None:
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    for flags in (cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY, cv2.CALIB_CB_ACCURACY):
        found, corners = cv2.findChessboardCornersSB(grey, size, flags=flags)
        if found:
            return np.asarray(corners, np.float64).reshape(-1, 2)
    return None


def _plane(left: Image, right: Image, size: tuple[int, int]) -> Values | None:
    """The disparity inside the board's outline; None: the corners of the two views do not lie on one plane."""
    seen, other = _corners(left, size), _corners(right, size)
    if seen is None or other is None:
        return None
    ones = np.column_stack([seen, np.ones(len(seen))])
    # A board with an even sum of rows and columns looks the same upside down, so either order may be the right one.
    fits = []
    for order in (other, other[::-1]):
        apart = seen[:, 0] - order[:, 0]
        plane = np.linalg.lstsq(ones, apart, rcond=None)[0]
        fits.append((float(np.abs(ones @ plane - apart).max()), float(apart.min()), plane))
    off_px, least_px, plane = min(fits, key=lambda fit: fit[0])
    if off_px > _MOST_OFF_PX or least_px < _NEAREST_PX:
        return None
    inside = np.zeros(left.shape[:2], np.uint8)
    cv2.fillConvexPoly(inside, cv2.convexHull(seen.astype(np.float32)).astype(np.int32), 1)
    y, x = np.indices(inside.shape)
    disparity = plane[0] * x + plane[1] * y + plane[2]
    return np.where((inside > 0) & (x >= disparity), disparity, np.nan).astype(np.float32)


def view_scores(view: View, found: Values) -> NDArray[np.float64]:
    """density, bad1, bad2, wrong2, right2 of one view, %. Values of 0 and below count as none."""
    counted = np.isfinite(view.truth)
    values = np.where(found[counted] > 0, found[counted], np.nan)
    has = np.isfinite(values)
    error = np.abs(values[has] - view.truth[counted][has])
    shares = [has.mean(), *((error > limit_px).mean() if has.any() else 1.0 for limit_px in (1, 2))]
    wrong2 = (error > 2).sum() / has.size
    return 100.0 * np.array([*shares, wrong2, has.mean() - wrong2])


def evaluate_boards(matcher: str | MakeMatcher, views: Sequence[View]) -> list[BoardRow]:
    """Match every view and give the means of each rig.

    Args:
        matcher: a name (ours, or an anchor's), or a callable that makes a matcher from N.
        views: the board views.
    """
    match = matching(matcher) if isinstance(matcher, str) else by_maker(matcher)
    rows = []
    for rig in dict.fromkeys(view.rig for view in views):
        chosen = [view for view in views if view.rig == rig]
        scores = np.array([view_scores(v, match(v.left, v.right, v.disparities)) for v in chosen])
        density, bad1, bad2, wrong2, right2 = scores.mean(axis=0).tolist()
        rows.append(BoardRow(rig, len(chosen), density, bad1, bad2, wrong2, right2, float(scores[:, 2].max())))
    return rows


def main() -> None:
    """Print a matcher's rows beside the anchor's."""
    views = list(board_views())
    for name in (ANCHORS[0], *(sys.argv[1:] or ["sgbm"])):
        for row in evaluate_boards(name, views):
            shares = "  ".join(f"{column} {getattr(row, column):6.2f}" for column in COLUMNS)
            print(f"{row.rig:10} {name:8} views {row.views:2}  {shares}")


if __name__ == "__main__":
    main()
