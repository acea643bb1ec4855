"""The options of phone-host print. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

SUMMARY = "send G-code to a 3D printer on a serial line: USB, Bluetooth, or a TCP port that leads to one"

EXAMPLES = """  phone-host print cup.gcode --printer serial:/dev/ttyUSB0
  phone-host print cup.gcode --printer 'serial:/dev/ttyACM0?baud=250000' --bed 180,180,180
  phone-host print cup.gcode --printer socket://192.168.1.20:8080 --yes    # ser2net, or a bridge app of a phone
  phone-host print cup.gcode --printer rfcomm://00:11:22:33:44:55          # Bluetooth
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("gcode", type=Path, metavar="FILE.gcode", help="what a slicer wrote")
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
    parser.add_argument("--yes", action="store_true", help="start without asking")
