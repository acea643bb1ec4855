"""The options of phone-host target. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

SUMMARY = "make a calibration board or an object mat to print, as PDF and SVG to scale"

EXAMPLES = """  phone-host target chessboard                                # 9x6 inner corners on A4, as large as fits
  phone-host target chessboard --size 7x5 --square 40mm --paper A3 --out print
  phone-host target charuco --size 8x6 --square 28mm --mark 20mm --paper letter
  phone-host target mat --out print                           # to lay objects on: 10x8 squares of 25 mm
  phone-host target chessboard --screen 1920x1080 --diagonal 15.6in    # an image for a screen
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "kind",
        choices=("chessboard", "charuco", "mat"),
        metavar="chessboard|charuco|mat",
        help="a chessboard; a chessboard with coded marks, of which a part is enough; or the mat that objects are laid on",
    )
    parser.add_argument(
        "--size",
        metavar="9x6",
        help="of a chessboard its inner corners, columns x rows (default 9x6); of charuco and mat its squares (default 8x6; mat 10x8)",
    )
    parser.add_argument("--square", metavar="25mm", help="side of a square (default: as large as fits; mat 25mm)")
    parser.add_argument("--mark", metavar="18mm", help="side of a coded mark (default: 0.72 of the square's)")
    parser.add_argument(
        "--family", choices=("4x4", "5x5", "6x6"), default="5x5", help="ArUco family of the marks (default 5x5)"
    )
    parser.add_argument(
        "--paper",
        type=str.upper,
        choices=("A4", "A3", "LETTER"),
        default="A4",
        help="sheet of paper: A4, A3 or letter (default A4)",
    )
    parser.add_argument(
        "--screen", metavar="1920x1080", help="make an image of a chessboard for a screen of so many pixels, instead"
    )
    parser.add_argument(
        "--diagonal", metavar="15.6in", help="of that screen: from it the size of a pixel and a square follows"
    )
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="DIR", help="folder for the files (default: the current folder)"
    )
