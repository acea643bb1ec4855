"""Whether this program runs on Android, and what has to be said there. The only place that asks."""

import sys
from typing import Final

INSTALL: Final = "sh deploy/host/termux-install.sh"
"""Installs and updates everything in Termux."""


def is_android() -> bool:
    """Return whether this is Android. Python says so itself from 3.13 on; before, only by a function."""
    return sys.platform == "android" or hasattr(sys, "getandroidapilevel")
