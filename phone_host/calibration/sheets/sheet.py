"""A sheet of paper: rectangles, lines and words at places in millimetres. No behaviour but its sizes."""

from dataclasses import dataclass, field
from enum import Enum


class Paper(Enum):
    """A sheet's size, portrait: width and height, mm (ISO 216; ANSI Letter)."""

    A4 = (210.0, 297.0)
    A3 = (297.0, 420.0)
    LETTER = (215.9, 279.4)


class Ink(Enum):
    """What a rectangle is filled with."""

    BLACK = "black"
    WHITE = "white"


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A filled rectangle: its upper left corner, width and height, mm; x to the right, y down."""

    x_mm: float
    y_mm: float
    width_mm: float
    height_mm: float
    ink: Ink = Ink.BLACK


@dataclass(frozen=True, slots=True)
class Words:
    """A line of text: where its base line begins, mm, how high its letters are, mm, and whether it runs upwards."""

    x_mm: float
    y_mm: float
    text: str
    height_mm: float = 3.0
    is_upward: bool = False


@dataclass(frozen=True, slots=True)
class Sheet:
    """What is printed.

    Attributes:
        title: what it is, for the file's own title.
        width_mm: of the paper.
        height_mm: of the paper.
        check: what to measure on the print, in words.
        rectangles: in the order in which they are painted.
        words: over them; ASCII only.
    """

    title: str
    width_mm: float
    height_mm: float
    check: str
    rectangles: tuple[Rectangle, ...]
    words: tuple[Words, ...] = field(default=())
