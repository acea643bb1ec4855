"""The mistakes that are told apart in a series of board views, and what is said about one; a drift of the cameras is undone. Pure."""

from dataclasses import dataclass
from enum import Enum, StrEnum

import cv2
import numpy as np

from common.diagnostic import Diagnostic, Severity
from phone_host.calibration.failure_modes.arrangement import Misplaced
from phone_host.calibration.solve.bundle_problem import Vector
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import project, rays_through
from phone_host.model import CameraModel, Verdict


class Mistake(StrEnum):
    """What is wrong with a series.

    Attributes:
        SWAPPED: the right camera stands to the left of the left one.
        MIRRORED: one camera mirrors its images.
        TURNED: one camera's images are turned by a quarter.
        UPSIDE_DOWN: one camera stands on its head.
        PARTNERS: images of two moments make a pair.
        SQUARE: the squares have another size than --square says, or are no squares.
        SKEW: the board moved between the two exposures of a pair.
        BLUR: the images are blurred.
        GLARE: light washes squares out.
        ROWS: the board moved while rows were exposed one after the other.
        FOCUS: focus or zoom changed between views.
        UNSTIFF: the cameras turned against each other between views.
        BENT: the board is not flat.
        RESIZED: the pictures were resized to another shape.
    """

    SWAPPED = "swapped sides"
    MIRRORED = "mirrored camera"
    TURNED = "turned camera"
    UPSIDE_DOWN = "upside-down camera"
    PARTNERS = "wrong partners"
    SQUARE = "wrong square"
    SKEW = "not the same moment"
    BLUR = "blurred"
    GLARE = "glare"
    ROWS = "rolling shutter"
    FOCUS = "focus changed"
    UNSTIFF = "rig not stiff"
    BENT = "board not flat"
    RESIZED = "resized pictures"


class Course(Enum):
    """How two cameras turned against each other: steadily, at once, or this way and that."""

    DRIFT = "steadily"
    KNOCK = "at once"
    LOOSE = "this way and that"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Turned:
    """How much two cameras turned against each other during a series.

    Attributes:
        course: how.
        turn_rad: (3,) from the first to the last view, in the right camera's axes (x right, y down, z forward), rad; LOOSE: the
            standard deviation of a view.
        sigma_rad: (3,) its standard deviation, by the scatter of the views, rad.
        begins: the first view after a knock, counted from 0; -1 otherwise.
        names: of the V views that tell it.
        turns_rad: (V, 3) of each of them.
        lens: the right camera's, as far as it is known.
        rows_px: by how much rows of left and right differ for it where they do most in the image, px of the right image.
        depth_at_1_m_m: by how much depth at 1 m is wrong for it, m.
    """

    course: Course
    turn_rad: Vector
    sigma_rad: Vector
    begins: int
    names: tuple[str, ...]
    turns_rad: Vector
    lens: CameraModel
    rows_px: float
    depth_at_1_m_m: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MistakeEvidence:
    """What names a mistake's place, and how much it matters.

    Attributes:
        misplaced: the side and the turn, for MIRRORED, TURNED and UPSIDE_DOWN.
        turned: for UNSTIFF.
        most: the best verdict that such a series may get.
        explained_px: how much of the views' contradiction it explains, root mean square, px; NaN: it was found otherwise.
    """

    misplaced: Misplaced | None = None
    turned: Turned | None = None
    most: Verdict = Verdict.GOOD
    explained_px: float = float("nan")


def mistaken(
    mistake: Mistake,
    message: str,
    remedy: str,
    *,
    misplaced: Misplaced | None = None,
    turned: Turned | None = None,
    most: Verdict = Verdict.GOOD,
) -> Diagnostic:
    """Make a diagnostic of a mistake, whose evidence is a `MistakeEvidence`."""
    evidence = MistakeEvidence(misplaced=misplaced, turned=turned, most=most)
    return Diagnostic(message, remedy, Severity.FAIL if most is Verdict.REJECT else Severity.WARN, mistake, evidence)


def unturned(pairs: list[BoardPair], turned: Turned) -> list[BoardPair]:
    """Give the right corners of all views the place that they would have if the right camera had stood as it does last.

    A turn about the camera's centre moves each ray alike, at any depth. So it is undone without knowing the board:
    pixel -> ray -> turned ray -> pixel.

    Args:
        pairs: the corners, in the order in which they were taken.
        turned: how it turned. A pair that was not looked at stands as the one before it.

    Returns:
        The pairs as the rig of the last view would see them.
    """
    by_name = dict(zip(turned.names, turned.turns_rad, strict=True))
    last, turn = np.asarray(cv2.Rodrigues(turned.turns_rad[-1])[0]), turned.turns_rad[0]
    result = []
    for pair in pairs:
        turn = by_name.get(pair.name, turn)
        back = last @ np.asarray(cv2.Rodrigues(turn)[0]).T
        seen = project(rays_through(pair.right_px, turned.lens) @ back.T, turned.lens)
        result.append(BoardPair(pair.name, pair.left_px, seen))
    return result
