"""A sheet of paper, rectangles and words at places in millimetres, and its files: PDF and SVG. Pure."""

from dataclasses import dataclass, field
from enum import Enum
from html import escape
from typing import Final

_POINTS_A_MM: Final = 72 / 25.4


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


def pdf(sheet: Sheet) -> bytes:
    """Write a sheet as a PDF of one page: rectangles and words, no images, no fonts of its own.

    Lengths are exact: the page's unit is scaled to millimetres once, and viewers are asked not to fit it to the paper
    (ISO 32000-1: 8.3.4 matrices, 12.2 PrintScaling, 7.5.4 cross-reference table).
    """
    content = _content(sheet).encode("ascii")
    size = f"{sheet.width_mm * _POINTS_A_MM:.4f} {sheet.height_mm * _POINTS_A_MM:.4f}"
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {size}] /Contents 4 0 R"
        " /Resources << /Font << /F 5 0 R >> >> >>".encode("ascii"),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
        f"<< /Title ({_escaped(sheet.title)}) >>".encode("ascii"),
    ]
    file, places = bytearray(b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n"), []
    for number, each in enumerate(objects, start=1):
        places.append(len(file))
        file += b"%d 0 obj\n%s\nendobj\n" % (number, each)
    table = len(file)
    file += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
    for place in places:
        file += b"%010d 00000 n \n" % place
    file += b"trailer\n<< /Size %d /Root 1 0 R /Info 6 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(objects) + 1, table)
    return bytes(file)


def _content(sheet: Sheet) -> str:
    """Return the page's drawing: in mm, from the upper left corner down."""
    scale = f"{_POINTS_A_MM:.8f}"
    lines = [f"{scale} 0 0 -{scale} 0 {sheet.height_mm * _POINTS_A_MM:.4f} cm"]
    ink = None
    for each in sheet.rectangles:
        if each.ink is not ink:
            ink = each.ink
            lines.append("0 g" if ink is Ink.BLACK else "1 g")
        lines.append(f"{each.x_mm:.4f} {each.y_mm:.4f} {each.width_mm:.4f} {each.height_mm:.4f} re f")
    lines += ["0 g", *map(_words, sheet.words)]
    return "\n".join(lines)


def _words(words: Words) -> str:
    # The page runs downwards, letters do not: their matrix turns them back.
    turn = "0 -1 -1 0" if words.is_upward else "1 0 0 -1"
    at = f"{turn} {words.x_mm:.4f} {words.y_mm:.4f} Tm"
    return f"BT /F {words.height_mm / 0.7:.3f} Tf {at} ({_escaped(words.text)}) Tj ET"  # capitals are 0.7 of the size


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")


def svg(sheet: Sheet) -> str:
    """Write a sheet as an SVG whose user unit is a millimetre."""
    width, height = f"{sheet.width_mm:g}", f"{sheet.height_mm:g}"
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">',
        f"<title>{escape(sheet.title)}</title>",
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    lines += [
        f'<rect x="{each.x_mm:.4f}" y="{each.y_mm:.4f}" width="{each.width_mm:.4f}" height="{each.height_mm:.4f}"'
        f' fill="{each.ink.value}"/>'
        for each in sheet.rectangles
    ]
    lines += [
        f'<text x="{each.x_mm:.4f}" y="{each.y_mm:.4f}"{_turn(each)} font-family="Helvetica, Arial, sans-serif"'
        f' font-size="{each.height_mm / 0.7:.3f}">{escape(each.text)}</text>'
        for each in sheet.words
    ]
    return "\n".join([*lines, "</svg>"]) + "\n"


def _turn(words: Words) -> str:
    return f' transform="rotate(-90 {words.x_mm:.4f} {words.y_mm:.4f})"' if words.is_upward else ""
