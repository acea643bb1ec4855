"""phone-host print --find: the printers that announce themselves in the network."""

import argparse

from common.android import is_android
from common.errors import UnavailableError
from common.program.terminal import say
from common.words import counted
from phone_host.output.json_text import json_text
from phone_host.printers.announced_printers import SERVICES, FoundPrinter, printers_of
from phone_host.run.progress_bar import busy_bar


def find(options: argparse.Namespace) -> int:
    """List the printers.

    Raises:
        UnavailableError: this machine cannot listen for them.
    """
    with busy_bar("listening for printers"):
        found = _found()
    if options.json:
        told = [{"printer": each.uri, "name": each.name} for each in found]
        print(json_text({"command": "print", "printers": told}))
        return 0
    if not found:
        say("no printer announces itself in this network: give its address with --printer")
        return 0
    width = max(len(each.uri) for each in found)
    say(
        [f"{counted(len(found), 'printer')} found", *(f"  --printer {each.uri:{width}}  {each.name}" for each in found)]
    )
    return 0


def _found() -> list[FoundPrinter]:
    try:
        from phone_host.boards.announced import listen  # noqa: PLC0415 - zeroconf is optional
    except ImportError:
        why = "Android keeps mDNS from Termux" if is_android() else "the package zeroconf is missing"
        raise UnavailableError(f"printers cannot be looked for: {why}", "give the address with --printer") from None
    return printers_of(listen(SERVICES))
