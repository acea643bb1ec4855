"""A person who follows the live guide's words, by the corners that both cameras would see: no images, no clock. Fast enough for unit tests."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.guide.gates import Gate, Glance, View
from phone_host.calibration.guide.guide import Guide
from phone_host.calibration.guide.snapshot import Ended, Progress
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.sharpness import BoardLook
from phone_host.model import Rig
from tests.support.rigs import project_points

Vector = NDArray[np.float64]

_STEP_NS: Final = 100_000_000
_SOLVE_NS: Final = 700_000_000
_REACTION_NS: Final = 600_000_000
_AGAIN_NS: Final = 1_000_000_000
_SPEED: Final = 0.35
"""Of the way to where the hand is wanted, per second and dimension: shares of the image, of a full fill, of 90 degrees."""

_AWAY: Final = (("left", 0, 1), ("right", 0, -1), ("top", 1, 1), ("bottom", 1, -1))
_NOISE_PX: Final = 0.08
_MARGIN: Final = 1.0
"""In squares: the whole board with its outer squares must be inside."""


@dataclass(slots=True)
class Hand:
    """Where a board is held: across and down, in image sizes from the middle; how much of the width it fills; tilts across and down, degrees."""

    at: Vector
    aim: Vector
    is_holding: bool = False

    def move(self, seconds: float, random: np.random.Generator) -> None:
        """Go on towards the aim; a hand that holds still shivers less."""
        if self.is_holding:
            self.at += random.normal(0, 1, 5) * [2e-4, 2e-4, 1e-4, 0.03, 0.03]
            return
        limits = np.array([_SPEED, _SPEED, _SPEED, 45.0, 45.0]) * seconds
        self.at += np.clip(self.aim - self.at, -limits, limits) + random.normal(0, 1, 5) * [0.006, 0.006, 0.002, 1, 1]


def heard(hand: Hand, words: str, random: np.random.Generator) -> None:
    """Do what is said."""
    hand.is_holding = words == "hold still" or words.startswith("taken")
    if hand.is_holding:
        return
    aim = hand.at.copy()
    if words.startswith(("show the", "the ")):
        aim = np.array([0, 0, 0.35, 0, 0])
    elif words.startswith("tilt"):
        aim[:2] *= 0.3
        across, down = {"left": (1, 0), "right": (-1, 0), "top": (0, 1), "bottom": (0, -1)}[words.split()[3]]
        aim[3:] = np.array([across, down]) * random.uniform(22, 38)
    elif "move the board a little" in words:
        aim[:3] += random.normal(0, 1, 3) * [0.08, 0.08, 0.03]
    if "back from" in words:
        for word, axis, way in _AWAY:
            if word in words.split():
                aim[axis] = hand.at[axis] + way * 0.1
    for word, axis, back in _AWAY:
        if word in words.split() and not words.startswith(("tilt", "show", "the")) and "back" not in words:
            aim[axis] = -back * random.uniform(0.3, 0.42)
            aim[3:] *= 0.5
    if "closer" in words:
        aim[2] = hand.at[2] + 0.08
        aim[:2] *= 0.5
    if "farther" in words:
        aim[2] = hand.at[2] * 0.85
    hand.aim = aim


def seen(rig: Rig, board: Board, at: Vector, random: np.random.Generator, noise_px: float) -> tuple[Vector, Vector]:
    """What both cameras see of the board; empty where it is not whole."""
    points = board.points_m()
    left = rig.left
    z = float(np.ptp(points[:, 0])) * left.matrix[0, 0] / left.width_px / at[2]
    rotation = np.asarray(cv2.Rodrigues(np.radians([-at[4], at[3], 0.0]))[0])
    centre = -rig.R_right_left.T @ rig.t_right_left_m
    middle = np.array(
        [at[0] * left.width_px / left.matrix[0, 0] * z, at[1] * left.height_px / left.matrix[1, 1] * z, z]
    )
    placed = (points - points.mean(axis=0)) @ rotation.T + middle + centre / 2 * [1, 1, 0]
    found = []
    for pixels, lens in zip(project_points(placed, rig), (rig.left, rig.right), strict=True):
        square = float(np.linalg.norm(pixels[1] - pixels[0])) * _MARGIN
        limit = np.array([lens.width_px, lens.height_px])
        whole = bool(((pixels > square) & (pixels < limit - square)).all())
        found.append(pixels + random.normal(0, noise_px, pixels.shape) if whole else np.empty((0, 2)))
    return found[0], found[1]


Grow = Callable[[tuple[View, ...]], Progress]


def follow(
    rig: Rig, board: Board, random: np.random.Generator, grow: Grow, *, most_s: float = 300.0, most_views: int = 25
) -> Guide:
    """Let a person follow the words until the guide ends, or time is up.

    Args:
        rig: the true cameras.
        board: the board.
        random: of the hand and of the corners' noise.
        grow: calibrates from the views so far.
        most_s: give up after this time.
        most_views: as the guide takes it.
    """
    guide = Guide(board, most_views, 0)
    start = np.array([*random.uniform(-0.2, 0.2, 2), random.uniform(0.2, 0.5), *random.uniform(-10, 10, 2)])
    hand = Hand(start, start.copy())
    sizes = ((rig.left.width_px, rig.left.height_px), (rig.right.width_px, rig.right.height_px))
    words, heard_at, solve_at = "", 0, 0
    for now_ns in range(_STEP_NS, round(most_s * 1e9), _STEP_NS):
        hand.move(_STEP_NS / 1e9, random)
        corners = seen(rig, board, hand.at, random, _NOISE_PX)
        skew_ns = int(random.uniform(-16e6, 16e6))
        glance = Glance(at_ns=now_ns, skew_ns=skew_ns, left_px=corners[0], right_px=corners[1], sizes_px=sizes)
        look = BoardLook(2.5, 0.0, 0.1)
        if guide.see(glance, now_ns) is Gate.READY and guide.examine(glance, (look, look), now_ns) is Gate.TAKEN:
            solve_at = now_ns + _SOLVE_NS
        if solve_at and now_ns >= solve_at and len(guide.views) >= 3:
            guide.grow(grow(tuple(guide.views)), now_ns)
            solve_at = 0
        if guide.words(now_ns) != words:
            words, heard_at = guide.words(now_ns), now_ns
        if now_ns >= heard_at + _REACTION_NS:
            heard(hand, words, random)
            heard_at += _AGAIN_NS  # a person goes on until something else is said
        if guide.ended is not Ended.RUNNING:
            break
    return guide
