"""board-agent pair: show a code with which a new host may connect."""

import argparse
import json
import sys

from board_agent.enrolment import NOBODY, absence, follow
from board_agent.settings import LONGEST_S, chosen_keys, is_service_hidden
from common.errors import SettingsError, UnavailableError
from common.program.terminal import fitted, say


def run(options: argparse.Namespace) -> int:
    """Show the code until a host has proved it."""
    if not 0 < options.seconds < LONGEST_S:
        raise SettingsError(f"--seconds is {options.seconds:g}", "give a number of seconds above 0")
    name, failed, keys = "", None, chosen_keys(options)
    for state in follow(keys, options.seconds):
        if state == NOBODY and is_service_hidden(keys):
            raise UnavailableError("the service's keys may not be used by this user", "run sudo board-agent pair")
        if state == NOBODY:
            say(f"board-agent: waiting: {absence(keys)}", sys.stderr)
        if state.problem:
            say(f"board-agent: waiting: {state.problem}: stop what uses that port, or move the link", sys.stderr)
        if failed is not None and state.failed > failed:
            print("board-agent: the code that was typed on the host was wrong; here is a new one", file=sys.stderr)
        name, failed = state.paired, state.failed
        if state.code and not name:
            asks = f"{state.asking} asks; " if state.asking else ""
            words = f"{state.address}: {asks}type this code on the host: {state.code}"
            say(words, sys.stderr if options.json else None, flush=True)
    print(json.dumps({"paired": name}) if options.json else fitted(f"paired with {name}"))
    return 0
