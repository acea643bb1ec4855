"""The options of phone-host print. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from phone_host.printers.bed import BED_HELP

SUMMARY = "slice a model, or take G-code, and send it to a 3D printer"

EXAMPLES = """  phone-host print --find                                   # printers that announce themselves in the network
  phone-host print scan --printer octoprint://octopi.local  # scan: the folder that phone-host scan wrote; needs a slicer
  phone-host print cup.gcode --printer moonraker://192.168.1.20
  phone-host print cup.gcode --printer serial:/dev/ttyUSB0
  phone-host print cup.gcode --printer 'serial:/dev/ttyACM0?baud=250000' --bed 180,180,180
  phone-host print cup.gcode --printer socket://192.168.1.20:8080 --yes    # ser2net, or a bridge app of a phone
  phone-host print cup.gcode --printer rfcomm://00:11:22:33:44:55          # Bluetooth
  phone-host print scan --printer file:cup.gcode            # the sliced G-code, for a card or a stick
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "what",
        nargs="?",
        type=Path,
        metavar="MODEL_OR_GCODE",
        help="the folder of a scan or a mesh, which is sliced, or the G-code of a slicer",
    )
    parser.add_argument(
        "--printer",
        metavar="URI",
        help="octoprint://HOST, moonraker://HOST, prusalink://HOST (keys: table [printers] of the settings file),"
        " serial:DEVICE?baud=115200, rfcomm://ADDRESS, socket://HOST:PORT, or file:OUT.gcode",
    )
    parser.add_argument("--find", action="store_true", help="list the printers that announce themselves in the network")
    parser.add_argument(
        "--bed",
        metavar="X,Y,Z",
        help=f"{BED_HELP} (default: what the G-code states, else 220,220,250); no model that leaves it is sent",
    )
    parser.add_argument("--slicer", choices=("prusa", "cura"), help="of those installed (default: prusa, else cura)")
    parser.add_argument(
        "--profile",
        type=Path,
        metavar="FILE",
        help="settings that PrusaSlicer has exported (.ini), or a machine of Cura (.def.json) (default: PLA, layers of 0.2 mm, nozzle of 0.4 mm)",
    )
    parser.add_argument("--unit", choices=("m", "mm"), help="unit of a mesh file of another program (default m)")
    parser.add_argument(
        "--up", choices=("z", "y", "-y"), help="axis of the model that points up (default: as its axes say, else z)"
    )
    parser.add_argument("--yes", action="store_true", help="start without asking")
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="settings file with the keys (default: ~/.config/tandemscan/phone-host.toml)",
    )
