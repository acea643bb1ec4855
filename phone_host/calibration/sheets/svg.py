"""Writes a sheet as an SVG whose user unit is a millimetre. Pure."""

from html import escape

from phone_host.calibration.sheets.sheet import Sheet, Words


def svg(sheet: Sheet) -> str:
    """Return the file's text.

    Args:
        sheet: what is on the page.
    """
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
