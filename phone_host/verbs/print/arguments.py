"""The options of phone-host print. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

SUMMARY = "slice a model, or take G-code, and send it to a 3D printer on a serial line"

EXAMPLES = """  phone-host print scan --printer serial:/dev/ttyUSB0    # scan: the folder that phone-host scan wrote; needs PrusaSlicer
  phone-host print cup.gcode --printer serial:/dev/ttyUSB0
  phone-host print cup.gcode --printer 'serial:/dev/ttyACM0?baud=250000' --bed 180,180,180
  phone-host print cup.gcode --printer socket://192.168.1.20:8080 --yes    # ser2net, or a bridge app of a phone
  phone-host print cup.gcode --printer rfcomm://00:11:22:33:44:55          # Bluetooth
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "what",
        type=Path,
        metavar="MODEL_OR_GCODE",
        help="the folder of a scan or a mesh, which is sliced, or the G-code of a slicer",
    )
    parser.add_argument(
        "--printer",
        required=True,
        metavar="URI",
        help="serial:DEVICE?baud=115200, rfcomm://ADDRESS or socket://HOST:PORT; it speaks Marlin's protocol",
    )
    parser.add_argument(
        "--bed",
        metavar="X,Y,Z",
        default="220,220,250",
        help="what the printer holds, mm (default 220,220,250); nothing that leaves it is sent",
    )
    parser.add_argument(
        "--profile",
        type=Path,
        metavar="FILE.ini",
        help="settings that PrusaSlicer has exported (default: PLA, layers of 0.2 mm, nozzle of 0.4 mm)",
    )
    parser.add_argument("--unit", choices=("m", "mm"), help="unit of a mesh file of another program (default m)")
    parser.add_argument(
        "--up", choices=("z", "y", "-y"), help="axis of the model that points up (default: as its axes say, else z)"
    )
    parser.add_argument("--yes", action="store_true", help="start without asking")
