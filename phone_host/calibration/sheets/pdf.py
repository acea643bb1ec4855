"""Writes a sheet as a PDF of one page: rectangles and words, no images, no fonts of its own. Pure.

Lengths are exact: the page's unit is scaled to millimetres once, and viewers are asked not to fit it to the paper
(ISO 32000-1: 8.3.4 matrices, 12.2 PrintScaling, 7.5.4 cross-reference table).
"""

from typing import Final

from phone_host.calibration.sheets.sheet import Ink, Sheet, Words

_POINTS_A_MM: Final = 72 / 25.4


def pdf(sheet: Sheet) -> bytes:
    """Return the file.

    Args:
        sheet: what is on the page.
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
