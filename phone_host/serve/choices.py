"""The page's choices are options of `phone-host run` by name. They become requests, and are read by what reads command lines."""

import argparse
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final, NoReturn, TypeVar

from common.errors import SettingsError
from common.program.commandline import ExamplesFirstParser
from common.program.request import add_options, read_request
from phone_host.camera.uris import is_browser
from phone_host.jobs.run_request import RunRequest
from phone_host.jobs.scan_request import ModelOptions, model_wanted
from phone_host.scan.scan_wanted import ScanWanted

Choices = Mapping[str, str]
"""Options by name without dashes."""

T = TypeVar("T")

_YES: Final = frozenset({"yes", "true", "on", "1"})
_NO: Final = frozenset({"", "no", "false", "off", "0"})

_NOT_CHOSEN: Final = frozenset(
    {"help", "version", "config", "json", "debug", "serve", "lan", "open", "keys", "log-level", "wait"}
)
"""Options of `run` that are not the page's: what concerns this program as a whole, and what a page cannot be asked."""

_PLACES: Final = frozenset({"calibration", "out"})
"""Options that name a file or folder."""

_SHORT: Final = frozenset({"link", "camera", "board-side", "tolerance", "fifo", "max-megapixels"})
"""What a run without depth needs."""

_OF_SCAN: Final = ("voxel", "box", "mat", "turntable", "object", "unseen")
"""Options of `scan` that the page may give."""


class _StrictParser(ExamplesFirstParser):
    """A parser that raises what it would print."""

    def __init__(self) -> None:
        super().__init__("phone-host", add_help=False)
        self.add_argument("--json", action="store_true")
        self.add_argument("--debug", action="store_true")

    def error(self, message: str) -> NoReturn:
        """See ExamplesFirstParser."""
        raise SettingsError(
            f"not valid: {self.problem(message)}", "give it as on the command line: phone-host run --help"
        )


def _parser(kind: type) -> _StrictParser:
    made = _StrictParser()
    add_options(made, kind)
    return made


@cache
def _declared(kind: type) -> dict[str, argparse.Action]:
    """Return the options of a request: the page's state asks for them several times a second."""
    return _parser(kind).declared


def with_changes(choices: Choices, changes: Choices) -> dict[str, str]:
    """Return choices with some changed; an empty value takes one back.

    Raises:
        SettingsError: there is no such option, or it is a switch and the value neither yes nor no.
    """
    declared = _declared(RunRequest)
    made = dict(choices)
    for name, value in changes.items():
        if name not in declared or name in _NOT_CHOSEN:
            raise SettingsError(f"{name!r} is no option of a run that the page can set", "see phone-host run --help")
        made.pop(name, None)
        kept = placed(value) if name in _PLACES else value.strip()
        if _is_switch(declared[name]):
            if kept.lower() not in _YES | _NO:
                raise SettingsError(f"{name} is {value!r}", "give yes or no")
            kept = "yes" if kept.lower() in _YES else ""
        if kept:
            made[name] = kept
    return made


def placed(path: str) -> str:
    """Return a path as it stays right wherever the program is started next: absolute, with ~ for the home folder.

    Args:
        path: as it was typed; empty: none.
    """
    typed = path.strip()
    return str(Path(os.path.expanduser(typed)).absolute()) if typed else ""  # noqa: PTH111 - Path's own raises without a home


def words_of(choices: Choices, kind: type = RunRequest) -> list[str]:
    """Return those choices that a request takes as the words of its command line, after the verb."""
    declared, words = _declared(kind), list[str]()
    for name, value in choices.items():
        if name not in declared:
            continue
        if _is_switch(declared[name]):
            words.append(f"--{name}")
        else:
            for each in value.split() if name == "link" else [value]:
                words += [f"--{name}={each}"] if each.startswith("-") else [f"--{name}", each]
    return words


def shown_words(choices: Choices) -> list[str]:
    """Return choices as the words of the command line that is shown: a browser's camera needs the page."""
    return [*words_of(choices), *(["--serve"] if is_browser(choices.get("camera", "")) else [])]


def choices_of(given: Mapping[str, object]) -> dict[str, str]:
    """Return the options of a run that differ from the usual ones, as choices.

    Args:
        given: of `run`, by name.
    """
    found = {}
    for name, action in _declared(RunRequest).items():
        value = given.get(action.dest)
        if name not in _NOT_CHOSEN and value != action.default and value is not None:
            found[name] = "yes" if _is_switch(action) else " ".join(value) if isinstance(value, list) else str(value)
    return found


def given_by(choices: Choices, kind: type = RunRequest) -> dict[str, object]:
    """Return the options of a request by name, as a command line gives them; what they say is not checked.

    Raises:
        SettingsError: one lacks its value, or has one of another kind.
    """
    return vars(_parser(kind).parse_args(words_of(choices, kind)))


def request_of(choices: Choices, kind: type[T]) -> T:
    """Make a request, or a group of options, of choices.

    Raises:
        SettingsError: they are not valid.
    """
    return read_request(kind, given_by(choices, kind))


def asked_scan(values: Choices) -> ScanWanted:
    """Return what the page wants of a scan, by the options of the command.

    Args:
        values: options of `scan` by name; what is missing or empty is as the command has it.

    Raises:
        SettingsError: the page may not give one of them, or it is invalid, or contradicts another.
    """
    if unknown := set(values) - set(_OF_SCAN):
        raise SettingsError(
            f"{min(unknown)!r} is no option of a scan that the page can set", f"give some of {', '.join(_OF_SCAN)}"
        )
    chosen = {name: text for name, value in values.items() if (text := value.strip())}
    return model_wanted(request_of(chosen, ModelOptions), None)


def without_depth(choices: Choices) -> dict[str, str]:
    """Return what of the choices a run without depth needs."""
    return {name: value for name, value in choices.items() if name in _SHORT}


def _is_switch(action: argparse.Action) -> bool:
    return action.nargs == 0
