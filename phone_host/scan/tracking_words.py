"""What the tracker says of a view, and what helps. Pure."""

from enum import Enum
from typing import Final


class Tracking(Enum):
    """How sure a view's pose is.

    TRACKING: fused. WEAK: fused, but something is wrong; a `Weakness` says what. LOST: not fused. RELOCALISED: found again, fused.
    """

    TRACKING = "tracking"
    WEAK = "weak"
    LOST = "lost"
    RELOCALISED = "relocalised"


class Weakness(Enum):
    """Why a pose is weak, or lost."""

    NONE = "none"
    NO_DEPTH = "no depth"
    FEW_CORNERS = "few corners"
    TOO_FAST = "too fast"
    LITTLE_OVERLAP = "little overlap"
    FULL = "memory full"
    POOR_FIT = "poor fit"
    FLAT = "flat"
    RESTLESS = "something moves"
    APART = "apart"
    AMBIGUOUS = "ambiguous"
    NO_MAT = "mat not seen"
    EMPTY_BOX = "nothing in the box"
    NO_TABLE = "no table"
    BARE_TABLE = "nothing on the table"
    NOTHING_TURNS = "nothing turns"
    ALL_TURNS = "background turns too"
    OUTSIDE = "out of the picture"

    @property
    def advice(self) -> str:
        """What happened and what to do, in one line."""
        return {
            Weakness.NONE: "",
            Weakness.NO_DEPTH: "hardly any pixel has a depth: move closer, or give more light",
            Weakness.FEW_CORNERS: "too few features to follow: show more texture, or give more light",
            Weakness.TOO_FAST: "moved too fast: go back to where it was, and move more slowly",
            Weakness.LITTLE_OVERLAP: "too little of the model is in view: move back to where it was",
            Weakness.FULL: "the model has filled its memory: move back to where it was, or start again with a larger --memory or --voxel",
            Weakness.POOR_FIT: "the view does not fit the model: move back to where it was, and keep the scene still",
            Weakness.APART: "tracked again, but not connected to the model: move back to where it was",
            Weakness.AMBIGUOUS: "this view matches several similar places of the model, or one too far away: move back to where it was, or show something that occurs only once",
            Weakness.NO_MAT: "too little of the mat is in view: show more of it to both cameras, sharp and without glare",
            Weakness.EMPTY_BOX: "nothing in view lies in the box: move or enlarge --box, or leave it out",
            Weakness.NO_TABLE: "no table was found: show more of it around the object, from above, and give it some texture",
            Weakness.BARE_TABLE: "nothing stands on the table in the middle of the picture: aim at the object, and show where it stands",
            Weakness.RESTLESS: "something in the scene moves: keep the scene still, or wait until it has passed",
            Weakness.FLAT: "only a flat surface is in view: show something that stands out from it",
            Weakness.NOTHING_TURNS: "nothing has turned since the last pair: turn the object by 3 to 15 degrees between the pairs",
            Weakness.ALL_TURNS: "the background moves, too: the cameras must stand still, or leave --turntable out",
            Weakness.OUTSIDE: "the turning object reaches beyond the picture: move the cameras back, or the object to the middle",
        }[self]


OF_TURNING: Final = (Weakness.NOTHING_TURNS, Weakness.ALL_TURNS, Weakness.OUTSIDE)
"""Why a pair is of no use where an object is to turn before cameras that stand still."""

OF_TABLE: Final = (Weakness.NO_TABLE, Weakness.BARE_TABLE)
"""Why a scan of an object on a table does not begin."""
