"""All that the guide says, in a few words each; what `wants` says beside. Pure."""

from enum import Enum

from common.words import counted


class Words(Enum):
    """What a person is told; beside these: what a wanted view lacks, and `taken`."""

    SHOW_BOTH = "show the whole board to both cameras"
    SHOW_LEFT = "the left camera sees too little of the board: to the left, or farther away"
    SHOW_RIGHT = "the right camera sees too little of the board: to the right, or farther away"
    PART = "show more of the board"
    HELP = "no board found: more light, no glare, the whole board with its white margin"
    STILL = "hold still"
    BLURRED = "too blurred"
    GLARE = "glare: turn the board a little"
    ELSEWHERE = "move the board a little"


def taken(views: int) -> str:
    """Return what is said when a view is taken."""
    return f"taken, {views}"


def done(verdict: str, views: int) -> str:
    """Return what is said at the end."""
    return f"done: verdict {verdict}" if verdict else f"done: {counted(views, 'view')}"
