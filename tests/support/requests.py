"""What words of a command line ask for, and what the programs take."""

import argparse
from typing import Any

from common.program.request import read_request
from phone_host.cli import command_of, parser


def request_of(*words: str) -> Any:
    """Return the request that the words of phone-host make, with the verb first."""
    return read_request(command_of(words[0])[1], vars(parser().parse_args(list(words))))


def verbs_of(program: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parsers of a program's verbs, each with all of its options."""
    found: dict[str, argparse.ArgumentParser] = {}
    for action in program._actions:
        if isinstance(action, argparse._SubParsersAction):
            found |= action.choices
    for verb in found.values():
        if hasattr(verb, "learn"):
            verb.learn()
    return found
