"""Series of board views with one mistake each, by the corners that two cameras would see: exact geometry, noise, and the mistake.

Good series have what good series have: noise, a board that is not quite flat, corners that glare has moved a little, and
now and then a pair in which the board moved.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.orientation import Flip, Orientation
from phone_host.calibration.failure_modes.arrangement import turned_corners
from phone_host.calibration.failure_modes.mistakes import Mistake
from phone_host.calibration.target.corners import Board, agree
from phone_host.calibration.target.pairs import BoardPair
from phone_host.model import Image, Rig
from tests.support.boards import render_pair
from tests.support.cause_rigs import random_poses, random_rig
from tests.support.cause_spoils import blurring, glaring
from tests.support.rigs import project_points

Vector = NDArray[np.float64]
Sizes = tuple[tuple[int, int], tuple[int, int]]

_BOARDS: Final = (Board(9, 6, 0.025), Board(7, 6, 0.03), Board(8, 6, 0.028), Board(8, 5, 0.03))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Made:
    """A series as a program sees it.

    Attributes:
        pairs: the corners.
        board: the board as the user names it.
        sizes_px: of the images.
        rig: the true cameras, the right one as it stands in the last view; of a real series: as it is calibrated.
        baseline_m: what the user measured; NaN: nothing.
        images: of series whose mistake shows in pixels only; otherwise none.
        truth: what the series was made with, in words.
    """

    pairs: list[BoardPair]
    board: Board
    sizes_px: Sizes
    rig: Rig
    baseline_m: float = math.nan
    images: tuple[tuple[Image, Image], ...] = ()
    truth: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """How a view differs from one stiff rig.

    The board's motion before the right exposure (6,): rotation vector, m; the right camera's turn about the middle of the
    bar, rotation vector; the board's motion during a readout (6,); factors on the focal lengths.
    """

    board: Vector
    turn: Vector
    speed: Vector
    focus: tuple[float, float] = (1.0, 1.0)


_STILL: Final = _Motion(np.zeros(6), np.zeros(3), np.zeros(6))


def _turned_rig(rig: Rig, turn: Vector, focus: tuple[float, float]) -> Rig:
    """The right camera turned about the middle of the bar, and both with other focal lengths."""
    rotation = np.asarray(cv2.Rodrigues(turn)[0], np.float64)
    centre = -rig.R_right_left.T @ rig.t_right_left_m
    pivot = rig.R_right_left @ (centre / 2) + rig.t_right_left_m  # in the right camera's axes
    lenses = []
    for lens, factor in zip((rig.left, rig.right), focus, strict=True):
        matrix = lens.matrix.copy()
        matrix[[0, 1], [0, 1]] *= factor
        lenses.append(replace(lens, matrix=matrix))
    return replace(
        rig,
        left=lenses[0],
        right=lenses[1],
        R_right_left=rotation @ rig.R_right_left,
        t_right_left_m=rotation @ (rig.t_right_left_m - pivot) + pivot,
    )


def _seen(rig: Rig, points: Vector, motion: _Motion) -> tuple[Vector, Vector]:
    """What both cameras see of a board's points, (N, 3) in the left camera's axes."""
    rig = _turned_rig(rig, motion.turn, motion.focus)
    left, right = project_points(points, rig)[0], project_points(_moved(points, motion.board), rig)[1]
    if not motion.speed.any():
        return left, right
    rolled = []
    for side, (seen, lens) in enumerate(((left, rig.left), (right, rig.right))):
        shares = seen[:, 1] / lens.height_px - 0.5  # of the readout; a second round would move a corner by 1 % of that
        own = np.array([_moved(points, motion.speed * share)[index] for index, share in enumerate(shares)])
        rolled.append(project_points(own, rig)[side])
    return rolled[0], rolled[1]


def _moved(points: Vector, motion: Vector) -> Vector:
    """Points turned about their middle and shifted: (6,) rotation vector and m."""
    middle = points.mean(axis=0)
    return np.asarray((points - middle) @ np.asarray(cv2.Rodrigues(motion[:3])[0]).T + middle + motion[3:], np.float64)


def _series(
    random: np.random.Generator,
    motions: Callable[[int], list[_Motion]] | None = None,
    stretch: float = 1.0,
    bend: tuple[float, float] = (0.0, 0.0),
) -> Made:
    """A series with a motion in each view; the board is bent along its rows and along its columns by a share of their length."""
    rig, board = random_rig(random), _BOARDS[random.integers(len(_BOARDS))]
    count = int(random.integers(10, 22))
    noise_px = random.uniform(0.05, 0.18) * max(1.0, rig.left.width_px / 1280)
    bow_m = random.uniform(0, 0.0004)
    flat = board.points_m() * [stretch, 1.0, 1.0]
    middle = flat.mean(axis=0)
    away = np.linalg.norm(flat - middle, axis=1)
    flat[:, 2] += bow_m * (away / away.max()) ** 2
    flat[:, 2] += (2 * (flat - middle) / np.ptp(flat, axis=0).clip(1e-9))[:, :2] ** 2 @ (
        bend * np.ptp(flat[:, :2], axis=0)
    )
    own = motions(count) if motions is not None else [_STILL] * count
    pairs = []
    for index, (pose, motion) in enumerate(zip(random_poses(rig, board, count, random), own, strict=True)):
        points = flat @ np.asarray(cv2.Rodrigues(pose[:3])[0]).T + pose[3:]
        left, right = (seen + random.normal(0, noise_px, seen.shape) for seen in _seen(rig, points, motion))
        pairs.append(BoardPair(str(index), left, agree(left, right, board)))
    last = _turned_rig(rig, own[-1].turn, own[-1].focus)
    sizes = ((rig.left.width_px, rig.left.height_px), (rig.right.width_px, rig.right.height_px))
    return Made(pairs=pairs, board=board, sizes_px=sizes, rig=last)


def good(random: np.random.Generator) -> Made:
    """Nothing is wrong; in some, the board moved in one pair of many."""
    spoiled = random.random() < 0.3

    def motions(count: int) -> list[_Motion]:
        own = [_STILL] * count
        if spoiled:
            own[int(random.integers(count))] = replace(_STILL, board=_jolt(random, 0.01, 2.0))
        return own

    made = _series(random, motions)
    measured = float(np.linalg.norm(made.rig.t_right_left_m)) * random.uniform(0.99, 1.01)
    return replace(
        made, baseline_m=measured if random.random() < 0.5 else math.nan, truth="one pair moved" if spoiled else ""
    )


def _jolt(random: np.random.Generator, metres: float, degrees: float) -> Vector:
    direction = random.normal(size=3)
    turn = random.normal(size=3)
    return np.concatenate(
        [np.radians(degrees) * turn / np.linalg.norm(turn), metres * direction / np.linalg.norm(direction)]
    )


def swapped(random: np.random.Generator) -> Made:
    """LEFT and RIGHT are exchanged."""
    made = _series(random)
    pairs = [BoardPair(pair.name, pair.right_px, agree(pair.right_px, pair.left_px, made.board)) for pair in made.pairs]
    return replace(made, pairs=pairs, sizes_px=(made.sizes_px[1], made.sizes_px[0]))


def _placed(random: np.random.Generator, turn: Orientation) -> Made:
    made, index = _series(random), int(random.integers(2))
    sizes = list(made.sizes_px)
    sizes[index] = turn.turned_size(sizes[index])
    pairs = []
    for pair in made.pairs:
        sides = [pair.left_px, pair.right_px]
        sides[index] = turned_corners(sides[index], made.sizes_px[index], turn, made.board)
        pairs.append(BoardPair(pair.name, sides[0], agree(sides[0], sides[1], made.board)))
    return replace(
        made, pairs=pairs, sizes_px=(sizes[0], sizes[1]), truth=f"side {index}, {turn.rotate_deg} {turn.flip.value}"
    )


def mirrored(random: np.random.Generator) -> Made:
    """One camera mirrors its images."""
    return _placed(random, Orientation(0, Flip.H))


def turned(random: np.random.Generator) -> Made:
    """One camera's images are turned by a quarter."""
    return _placed(random, Orientation((90, 270)[random.integers(2)]))


def upside_down(random: np.random.Generator) -> Made:
    """One camera stands on its head."""
    return _placed(random, Orientation(180))


def partners(random: np.random.Generator) -> Made:
    """Some right images belong to other left ones: two exchanged, all shifted from one on, or in another order."""
    made = _series(random)
    count = len(made.pairs)
    order = list(range(count))
    kind = int(random.integers(3))
    if kind == 0:
        a, b = random.choice(count, 2, replace=False)
        order[a], order[b] = order[b], order[a]
    elif kind == 1:
        first = int(random.integers(0, count // 2))
        order = order[:first] + order[first + 1 :]
    else:
        order = [int(each) for each in random.permutation(count)]
    pairs = [
        BoardPair(left.name, left.left_px, agree(left.left_px, made.pairs[right].right_px, made.board))
        for left, right in zip(made.pairs, order, strict=False)
    ]
    return replace(made, pairs=pairs, truth=("two exchanged", "shifted", "in another order")[kind])


def square(random: np.random.Generator) -> Made:
    """--square is wrong and the baseline was measured, or wrong by ten; or the print is stretched."""
    kind = int(random.integers(3))
    if kind == 2:
        return replace(_series(random, stretch=1 + random.uniform(0.02, 0.06)), truth="stretched")
    made = _series(random)
    factor = (
        (10.0 if random.random() < 0.5 else 0.1)
        if kind == 1
        else math.exp(random.uniform(0.06, 0.3) * random.choice([-1, 1]))
    )
    measured = float(np.linalg.norm(made.rig.t_right_left_m)) * random.uniform(0.99, 1.01) if kind == 0 else math.nan
    board = replace(made.board, square_m=made.board.square_m * factor)
    return replace(made, board=board, baseline_m=measured, truth=f"times {factor:.2f}")


def skew(random: np.random.Generator) -> Made:
    """The board moves by 1 to 8 mm, and turns, between the two exposures of each pair."""
    metres, degrees = random.uniform(0.001, 0.008), random.uniform(0.05, 1.0)

    def motions(count: int) -> list[_Motion]:
        scales = random.uniform(0.3, 1.7, count)
        return [replace(_STILL, board=_jolt(random, metres * scale, degrees * scale)) for scale in scales]

    return replace(_series(random, motions), truth=f"{metres * 1e3:.1f} mm")


def rows(random: np.random.Generator) -> Made:
    """The board moves by 3 to 12 mm, and turns, while the rows of both images are exposed."""
    metres, degrees = random.uniform(0.003, 0.012), random.uniform(0.1, 1.0)

    def motions(count: int) -> list[_Motion]:
        scales = random.uniform(0.3, 1.7, count)
        return [replace(_STILL, speed=_jolt(random, metres * scale, degrees * scale)) for scale in scales]

    return replace(_series(random, motions), truth=f"{metres * 1e3:.1f} mm")


def focus(random: np.random.Generator) -> Made:
    """The focal length of one camera changes by 0.5 to 5 %, at once or little by little."""
    side, change = int(random.integers(2)), random.uniform(0.005, 0.05) * random.choice([-1, 1])
    at_once = bool(random.random() < 0.6)

    def motions(count: int) -> list[_Motion]:
        first = int(random.integers(3, count - 2))
        shares = (np.arange(count) >= first) if at_once else np.linspace(0, 1, count)
        factors = 1 + change * np.asarray(shares, float)
        return [replace(_STILL, focus=(1.0, f) if side else (f, 1.0)) for f in factors]

    return replace(_series(random, motions), truth=f"side {side} {change:+.1%} {'at once' if at_once else 'slowly'}")


def unstiff(random: np.random.Generator) -> Made:
    """The right camera turns about the middle of the bar: steadily by 0.05 to 0.4 degrees, at once by 0.08 to 1, or this way and that."""
    kind = int(random.integers(3))
    degrees = (random.uniform(0.05, 0.4), random.uniform(0.08, 1.0), random.uniform(0.04, 0.2))[kind]
    turn = random.normal(size=3) * [1, 1, 0.5]
    turn = np.radians(degrees) * turn / np.linalg.norm(turn)

    def motions(count: int) -> list[_Motion]:
        if kind == 2:
            return [replace(_STILL, turn=np.radians(degrees) * random.normal(size=3)) for _ in range(count)]
        first = int(random.integers(3, count - 2))
        shares = np.linspace(0, 1, count) if kind == 0 else (np.arange(count) >= first).astype(float)
        return [replace(_STILL, turn=turn * share) for share in shares]

    return replace(_series(random, motions), truth=f"{('drift', 'knock', 'loose')[kind]} {degrees:.2f} degrees")


def bent(random: np.random.Generator) -> Made:
    """The board is bent by 1 to 3 % of its length, as paper that is not glued down: along its rows, its columns, or both."""
    share = random.uniform(0.01, 0.03) * random.choice([-1, 1])
    kind = int(random.integers(3))
    bend = ((share, 0.0), (0.0, share), (share, share))[kind]
    truth = f"{share:+.1%} along its {('rows', 'columns', 'rows and columns')[kind]}"
    return replace(_series(random, bend=bend), truth=truth)


def _pictured(random: np.random.Generator, spoil: Callable[[Image], Image], spoiled: float) -> Made:
    """A series of images, of which a share is spoiled."""
    rig, board = _small(random_rig(random)), _BOARDS[random.integers(len(_BOARDS))]
    images = []
    for pose in random_poses(rig, board, 5, random):
        pair = []
        for image in render_pair(rig, pose, board):
            soft = cv2.GaussianBlur(image, (0, 0), random.uniform(0.5, 0.9))
            noisy = np.clip(soft + random.normal(0, 3, soft.shape), 0, 255).astype(np.uint8)
            pair.append(spoil(noisy) if random.random() < spoiled else noisy)
        images.append((pair[0], pair[1]))
    sizes = ((rig.left.width_px, rig.left.height_px), (rig.right.width_px, rig.right.height_px))
    return Made(pairs=[], board=board, sizes_px=sizes, rig=rig, images=tuple(images))


def _small(rig: Rig) -> Rig:
    """The same cameras with images 640 px wide: rendered in a quarter of the time."""
    lenses = []
    for lens in (rig.left, rig.right):
        scale = 640 / lens.width_px
        matrix = lens.matrix * np.array([[scale], [scale], [1.0]])
        lenses.append(replace(lens, matrix=matrix, width_px=640, height_px=round(lens.height_px * scale)))
    return replace(rig, left=lenses[0], right=lenses[1])


def good_pictures(random: np.random.Generator) -> Made:
    """Images of which none is spoiled."""
    return _pictured(random, lambda image: image, 0.0)


def blur(random: np.random.Generator) -> Made:
    """Half or more of the images are out of focus, or were taken while the board moved."""
    moving = bool(random.random() < 0.5)
    spoil = blurring(random, moving=moving)
    return replace(_pictured(random, spoil, random.uniform(0.5, 1.0)), truth="moving" if moving else "out of focus")


def glare(random: np.random.Generator) -> Made:
    """A lamp's reflection washes out a part of the board in half of the images or more."""
    return _pictured(random, glaring(random), random.uniform(0.5, 1.0))


_SHAPES: Final = {4 / 3: 16 / 9, 16 / 9: 4 / 3, 3 / 2: 16 / 9}
"""Shapes of pictures, and to which each is squeezed or stretched."""


def resized(random: np.random.Generator) -> Made:
    """All pictures were given another width, so that they have another camera's shape."""
    made = _series(random)
    factors = []
    for width, height in made.sizes_px:
        shape = min(_SHAPES, key=lambda each: abs(each * height / width - 1))
        factors.append(round(width * _SHAPES[shape] / shape) / width)
    if abs(factors[0] - factors[1]) > 0.01:  # cameras of two shapes are not resized alike
        return resized(random)
    pairs = [
        BoardPair(
            pair.name,
            *(
                (seen + 0.5) * [factor, 1] - 0.5
                for seen, factor in zip((pair.left_px, pair.right_px), factors, strict=True)
            ),
        )
        for pair in made.pairs
    ]
    sizes = [(round(width * factor), height) for (width, height), factor in zip(made.sizes_px, factors, strict=True)]
    return replace(made, pairs=pairs, sizes_px=(sizes[0], sizes[1]), truth=f"width times {factors[0]:.3f}")


MAKERS: Final[dict[Mistake, Callable[[np.random.Generator], Made]]] = {
    Mistake.SWAPPED: swapped,
    Mistake.MIRRORED: mirrored,
    Mistake.TURNED: turned,
    Mistake.UPSIDE_DOWN: upside_down,
    Mistake.PARTNERS: partners,
    Mistake.SQUARE: square,
    Mistake.SKEW: skew,
    Mistake.BLUR: blur,
    Mistake.GLARE: glare,
    Mistake.ROWS: rows,
    Mistake.FOCUS: focus,
    Mistake.UNSTIFF: unstiff,
    Mistake.BENT: bent,
    Mistake.RESIZED: resized,
}
