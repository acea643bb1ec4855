"""What words of a command line ask for, and what the programs take."""

import argparse
from typing import Any

from common.program.request import read_request
from phone_host.cli import command_of, parser


def request_of(*words: str) -> Any:
    """Return the request that the words of phone-host make, with the verb first."""
    return read_request(command_of(words[0])[1], vars(parser().parse_args(list(words))))


def options_of(program: argparse.ArgumentParser) -> list[argparse.Action]:
    """Return the options and arguments of a parser, in their order, without its verbs."""
    return [action for action in program._actions if not isinstance(action.choices, dict)]  # noqa: SLF001 - argparse tells them nowhere else


def verbs_in(program: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parsers of a program's verbs by their names, as they are before a verb is chosen."""
    actions = program._actions  # noqa: SLF001 - see above
    return {
        name: verb for action in actions if isinstance(action.choices, dict) for name, verb in action.choices.items()
    }


def verbs_of(program: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parsers of a program's verbs, each with all of its options."""
    found = verbs_in(program)
    for verb in found.values():
        if hasattr(verb, "learn"):
            verb.learn()
    return found
