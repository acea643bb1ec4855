"""The options of phone-host export. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from phone_host.verbs.unseen_argument import add_unseen_argument

SUMMARY = "write a scan or mesh as STL, OBJ, 3DS, PLY, 3MF or GLB for other programs and printers"

EXAMPLES = """  phone-host export scan --to stl --out print                    # scan: the folder that phone-host scan wrote
  phone-host export scan --to stl,3mf,glb --out print
  phone-host export part.obj --unit mm --to 3mf --out print      # a mesh of another program, in millimetres
  phone-host export scan --to stl --tolerance 0                  # every triangle
  phone-host export scan --to glb --unseen cut                   # only what was in view
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("model", metavar="MODEL", help="the folder of a scan, or a mesh: .ply, .stl, .obj, .glb, .3mf")
    parser.add_argument("--to", required=True, metavar="stl,3mf", help="formats: stl, obj, 3ds, ply, 3mf, glb")
    parser.add_argument(
        "--unit", choices=("m", "mm"), help="unit of a mesh file of another program (default m; our own files say it)"
    )
    parser.add_argument(
        "--tolerance",
        metavar="MM",
        help="leave out triangles where the surface stays as near as this; 0: none (default: a tenth of the scan's voxel; none for a mesh file)",
    )
    add_unseen_argument(parser, default=None, otherwise="default: as the scan was told, else fill")
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="DIR", help="folder for the files (default: the current folder)"
    )
