"""Names the mistake of a series of board views, or none. Pure.

From the plainest to the finest: what the images look like; which pictures belong together; how the cameras stand to each
other; how the pairs deviate from one stiff rig; whether the squares can be as large as was said; and whether the board is flat.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from common.diagnostic import Diagnostic
from common.errors import DataError
from common.orientation import Flip, Orientation
from common.words import counted
from phone_host.calibration.failure_modes.arrangement import Misplaced, misplaced
from phone_host.calibration.failure_modes.deviating import deviation
from phone_host.calibration.failure_modes.lone import both_alone, is_plain, with_plain_lenses
from phone_host.calibration.failure_modes.mistakes import Mistake, mistaken
from phone_host.calibration.failure_modes.partners import wrong_partners
from phone_host.calibration.solve.board_in_space import BENT_SIGMAS, common_bows_m
from phone_host.calibration.solve.calibrate import Sizes
from phone_host.calibration.solve.verdict import REFERENCE_PX, Calibration, size_factor
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair, Reason
from phone_host.calibration.target.sharpness import SeenLook
from phone_host.model import Side, Verdict

_BENT: Final = 0.004
"""Share of the board's side: 0.8 mm of 200 mm. Boards of four real rigs, whose results are good, stay at 0.003 and below."""

_SPOILED_SHARE: Final = 0.2
"""A series is blurred or glaring if this share of its images is."""

_BLURRED_EDGE_PX: Final = 6.0
"""For images of up to 1280 px. Sharp edges are 1.5 to 3.5 px wide in the images of four real rigs; a blur of sigma gives 2.5 sigma."""

_WASHED: Final = 0.08
"""Share of a board's edges. In the images of four real rigs none is above 0.03."""

_MORE_BRIGHT: Final = 0.02
"""Share of an image by which one without a board is brighter than its side usually is."""

_CONTRADICTION_PX: Final = 1.0
"""As in the verdict: real rigs fit to 0.15 to 0.4 px."""

_LARGEST_BOARD_M, _SMALLEST_BOARD_M = 2.0, 0.03
BASELINE_OFF: Final = 0.03
"""A ruler between two lenses is off by less."""

_BASELINE_FAR_OFF: Final = 0.1
"""From here on it is told before all that makes views deviate: that scatters to both sides, and costs less than such a scale."""

_STRETCHED: Final = 0.01
"""Pixels of all usual cameras are square to 0.1 %, and so are prints to scale."""

_SHAPES: Final = ("4:3", "16:9", "3:2", "16:10", "5:4")
"""Width to height of cameras' pictures."""

_SAME_SHAPE: Final = 0.006
"""Two shapes differ by less. It is small beside a print's stretch, so that few prints are taken for resized pictures."""

_ALIKE: Final = 0.3
"""Two cameras before one stretched print err alike to this share."""

_LEAST_SHIFTED, _SHIFTED_SHARE = 3, 0.8
"""Exchanged pictures are some among many; where numbers are shifted, only those at the ends fit otherwise."""

_EXPLAINED_SHARE: Final = 0.35
"""Of the squares of each view alone: a good series's cannot be explained so."""


def bent(found: Calibration, board: Board) -> Diagnostic | None:
    """Name a board that is bent in all views alike, as noise and what contradicts a stiff rig are not.

    The rig was calibrated with that bend (`solve.board_in_space`): what is told is what a flat board would spare.
    """
    bows, sigmas = common_bows_m([used.in_space for used in found.used])
    sides = np.array([board.columns - 1, board.rows - 1]) * board.square_m
    shares = np.where(np.abs(bows) > BENT_SIGMAS * sigmas, np.abs(bows) / sides, 0.0)
    axis = int(shares.argmax())
    if not shares[axis] > _BENT:
        return None
    along = ("rows", "columns")[axis]
    bow = f"{abs(bows[axis]) * 1e3:.2f} +- {sigmas[axis] * 1e3:.2f} mm over {sides[axis] * 1e3:.0f} mm"
    return mistaken(
        Mistake.BENT,
        f"the board is not flat: along its {along} it is bent by {bow}",
        "glue it to glass or another flat plate, and take all views again",
    )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BoardSeries:
    """What a series of board views gives.

    Attributes:
        pairs: the corners, in the order in which they were taken.
        board: the board.
        sizes_px: width and height of the left and of the right images.
        looks: of all images that could be read.
        baseline_m: the distance of the cameras as the user measured it, m; NaN: not told.
    """

    pairs: tuple[BoardPair, ...]
    board: Board
    sizes_px: Sizes
    looks: tuple[SeenLook, ...] = ()
    baseline_m: float = math.nan


def name_mistake(series: BoardSeries, found: Calibration | DataError) -> Diagnostic | None:
    """Name what is wrong with a series.

    Returns:
        The mistake with its figures; None if the views tell of none.
    """
    return (
        _absurd_square(series)
        or _in_a_mirror(series)
        or _spoiled(series)
        or _exchanged(series, found)
        or placed(series, found)
        or _swapped(found)
        or _stretched(series)
        or _other_baseline(series, found, _BASELINE_FAR_OFF)
        or _deviating(series, found)
        or _other_baseline(series, found, BASELINE_OFF)
        or _upright_stretch(series, found)
        or (None if isinstance(found, DataError) else bent(found, series.board))
    )


def _in_a_mirror(series: BoardSeries) -> Diagnostic | None:
    """Name a side whose coded marks are seen in the mirror only."""
    for side in Side:
        own = [each for each in series.looks if each.side is side]
        if own and 2 * sum(each.look.is_mirrored for each in own) > len(own):
            return mistaken(
                Mistake.MIRRORED,
                f"the marks in the {side.value} images are mirrored",
                "switch mirroring off in that camera",
                misplaced=Misplaced(side=side, turn=Orientation(0, Flip.H)),
            )
    return None


def _spoiled(series: BoardSeries) -> Diagnostic | None:
    """Name blur or glare, if many images have it."""
    looks = series.looks
    blurred, glaring = list[str](), list[str]()
    for side, size in zip(Side, series.sizes_px, strict=True):
        own = [each for each in looks if each.side is side]
        seen = [each.look.bright for each in own if math.isfinite(each.look.edge_px)]
        usual = float(np.median(seen)) if seen else 0.0
        limit_px = _BLURRED_EDGE_PX * max(1.0, max(size) / REFERENCE_PX)
        blurred += [each.name for each in own if each.look.edge_px > limit_px]
        glaring += [
            each.name
            for each in own
            if each.look.washed > _WASHED or (math.isnan(each.look.edge_px) and each.look.bright > usual + _MORE_BRIGHT)
        ]
    for mistake, names, what, remedy in (
        (
            Mistake.GLARE,
            glaring,
            "light washes squares out",
            "turn the board away from the lamp or the window, or light it from the side",
        ),
        (Mistake.BLUR, blurred, "the board is blurred", "hold the board still, give more light, and check the focus"),
    ):
        if len(names) >= max(2, _SPOILED_SHARE * len(looks)):
            number = f"{len(names)} of {counted(len(looks), 'image')}"
            return mistaken(mistake, f"{what} in {number}, such as {names[0]}", remedy)
    return None


def _exchanged(series: BoardSeries, found: Calibration | DataError) -> Diagnostic | None:
    """Name pictures that belong to another pair's partner."""
    misfits = (Reason.MOVED, Reason.CORNERS_LEFT, Reason.CORNERS_RIGHT)
    if (
        isinstance(found, Calibration)
        and not any(each.reason in misfits for each in found.rejected)
        and found.rig.rms_stereo_px <= _CONTRADICTION_PX * size_factor(found.rig)
    ):
        return None  # all pairs fit one rig
    wrong = wrong_partners(list(series.pairs), series.board, series.sizes_px)
    if not wrong:
        return None
    shift = _numbers_apart(wrong)
    if shift:
        which = f"{abs(shift)} {'higher' if shift > 0 else 'lower'}"
        return mistaken(
            Mistake.PARTNERS,
            f"the folders' numbers are shifted: each left picture belongs to the right one whose number is {which}",
            "give both images of a pair the same number",
        )
    shown = ", ".join(f"left {left} with right {right}" for left, right in wrong[:4]) + (", ..." if wrong[4:] else "")
    return mistaken(
        Mistake.PARTNERS,
        f"{counted(len(wrong), 'left picture has', 'left pictures have')} the wrong partner: {shown} belong together",
        "give both images of a pair the same number",
    )


def _numbers_apart(wrong: list[tuple[str, str]]) -> int:
    """Return by how much the numbers of partners differ, right minus left, where nearly all differ alike; else 0."""
    apart = [int(right) - int(left) for left, right in wrong if left.isdecimal() and right.isdecimal()]
    if len(apart) < _LEAST_SHIFTED:
        return 0
    usual = max(set(apart), key=apart.count)
    return usual if apart.count(usual) >= _SHIFTED_SHARE * len(wrong) else 0


def placed(series: BoardSeries, found: Calibration | DataError) -> Diagnostic | None:
    """Name a turned or mirrored side; who knows the options given writes the sentence. Arguments as those of `name_mistake`."""
    wrong = misplaced(list(series.pairs), series.board, series.sizes_px, found)
    if wrong is None:
        return None
    if wrong.is_mirrored:
        mistake, state = Mistake.MIRRORED, "mirrored"
    elif wrong.turn.rotate_deg == 180:
        mistake, state = Mistake.UPSIDE_DOWN, "upside down"
    else:
        mistake, state = Mistake.TURNED, "turned by a quarter"
    return mistaken(
        mistake,
        f"the {wrong.side.value} images are {state} against the others",
        "turn them back",
        misplaced=wrong,
    )


def _swapped(found: Calibration | DataError) -> Diagnostic | None:
    if isinstance(found, DataError) or found.obstacle is None:
        return None
    x, y, z = -found.rig.R_right_left.T @ found.rig.t_right_left_m
    if x < 0 and abs(x) > max(abs(y), abs(z)):
        return mistaken(Mistake.SWAPPED, found.obstacle.problem, found.obstacle.remedy)
    return None


def _deviating(series: BoardSeries, found: Calibration | DataError) -> Diagnostic | None:
    """Name how the pairs deviate from one stiff rig; what only a bent lens makes them do is none."""
    finding = deviation(series.pairs, series.board, series.sizes_px)
    if finding is None or isinstance(found, DataError) or (is_plain(found.rig.left) and is_plain(found.rig.right)):
        return finding
    plain = with_plain_lenses(list(series.pairs), found.rig)
    finding = deviation(tuple(plain), series.board, series.sizes_px)
    if finding is None or finding.evidence.turned is None:
        return finding
    seen = finding.evidence
    return replace(finding, evidence=replace(seen, turned=replace(seen.turned, lens=found.rig.right)))


def _absurd_square(series: BoardSeries) -> Diagnostic | None:
    """Name a square that no board has: it is told first, because nothing else depends on the scale."""
    board = series.board
    longest_m = max(board.columns, board.rows) * board.square_m
    if _SMALLEST_BOARD_M <= longest_m <= _LARGEST_BOARD_M:
        return None
    return mistaken(
        Mistake.SQUARE,
        f"with squares of {board.square_m * 1e3:g} mm the board would be {longest_m:.2g} m long",
        "check the unit of --square",
        most=Verdict.REJECT,
    )


def _other_baseline(series: BoardSeries, found: Calibration | DataError, off_share: float) -> Diagnostic | None:
    """Name a square that cannot be as long as --square says, because the user measured a distance of the cameras that is off by such a share."""
    board = series.board
    if isinstance(found, DataError):
        return None
    baseline_m = float(np.linalg.norm(found.rig.t_right_left_m))
    factor = series.baseline_m / baseline_m
    sigma = 3 * found.baseline_sigma_m / baseline_m if math.isfinite(found.baseline_sigma_m) else 0.0
    if not math.isfinite(factor) or abs(factor - 1) <= off_share + sigma:
        return None
    return mistaken(
        Mistake.SQUARE,
        (
            f"the cameras would be {baseline_m * 1e3:.1f} mm apart, and you measured {series.baseline_m * 1e3:.1f} mm:"
            f" squares of {board.square_m * factor * 1e3:.2f} mm would fit, --square says {board.square_m * 1e3:g} mm"
        ),
        "measure ten squares together with a ruler",
        most=Verdict.REJECT,
    )


def _upright_stretch(series: BoardSeries, found: Calibration | DataError) -> Diagnostic | None:
    """Name squares that are no squares of boards that were all held upright: the lenses take the stretch, both the same."""
    if isinstance(found, DataError):
        return None
    left, right = (lens.matrix[0, 0] / lens.matrix[1, 1] - 1 for lens in (found.rig.left, found.rig.right))
    stretch = float(left + right) / 2
    is_stretched = abs(stretch) > _STRETCHED and abs(left - right) < _ALIKE * abs(stretch)
    return _no_squares(stretch, series) if is_stretched else None


def _stretched(series: BoardSeries) -> Diagnostic | None:
    """Name squares that are no squares: a board that is longer explains more, however each is turned."""
    try:
        squares = _squares_by_stretch(list(series.pairs), series)
    except cv2.error:
        return None
    if squares is None:
        return None
    less, as_said, more = squares
    bend = less - 2 * as_said + more
    stretch = _STRETCHED * (less - more) / (2 * bend) if bend > 0 else 0.0
    remaining = as_said - (less - more) ** 2 / (8 * bend) if bend > 0 else as_said
    if abs(stretch) < _STRETCHED or remaining > (1 - _EXPLAINED_SHARE) * as_said:
        return None
    return _no_squares(stretch, series)


def _squares_by_stretch(pairs: list[BoardPair], series: BoardSeries) -> tuple[float, float, float] | None:
    """Return the squares that a board leaves which is shorter, as said, and longer, px^2, of the same pairs; None if they fit no lens.

    Raises:
        cv2.error: no lens explains the views.
    """
    points_m, squares, common = series.board.points_m(), list[float](), pairs
    for stretch in (-_STRETCHED, 0.0, _STRETCHED):
        found = both_alone(pairs, points_m * [1 + stretch, 1.0, 1.0], series.sizes_px)
        if found is None:
            return None
        kept, left, right = found
        common = [pair for pair in common if pair in kept]
        squares.append(left.squares_px2 + right.squares_px2)
    # A stretched board makes some views look wrong: what the others leave cannot be compared.
    if len(common) < len(pairs):
        return _squares_by_stretch(common, series)
    return squares[0], squares[1], squares[2]


def _no_squares(stretch: float, series: BoardSeries) -> Diagnostic:
    """Name resized pictures where both have a camera's shape without the stretch, else the print."""
    amount = f"{abs(stretch):.1%} {'wider' if stretch > 0 else 'narrower'}"
    shapes = [_usual_shape(width / height / (1 + stretch)) for width, height in series.sizes_px]
    if all(shapes):
        width, height = series.sizes_px[0]
        return mistaken(
            Mistake.RESIZED,
            f"the pictures were resized: {width}x{height} px show the squares {amount} than they are, as pictures of {shapes[0]} would",
            "give the pictures as the camera took them, or resize width and height by the same factor",
            most=Verdict.USABLE,
        )
    return mistaken(
        Mistake.SQUARE,
        f"the squares look stretched: they are {amount} than they are high",
        'print the board without "fit to page", and measure a square both ways',
        most=Verdict.REJECT,
    )


def _usual_shape(ratio: float) -> str:
    """Return the shape that a ratio of width to height has, held upright or not; empty: no camera's."""
    for shape in _SHAPES:
        width, height = map(int, shape.split(":"))
        if any(abs(ratio / each - 1) < _SAME_SHAPE for each in (width / height, height / width)):
            return shape
    return ""
