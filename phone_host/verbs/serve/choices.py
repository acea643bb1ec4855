"""The page's choices are options of `phone-host run` by name. They become a command line, and are read by what reads command lines."""

import argparse
import os
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Final, NoReturn

from common.errors import SettingsError
from common.program.commandline import ExamplesFirstParser
from common.program.request import add_options, read_request
from phone_host.camera.browser_uri import is_browser
from phone_host.jobs.run_request import RunRequest
from phone_host.jobs.scan_request import ScanRequest
from phone_host.verbs.calibrate import arguments as calibrate_arguments

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


class _Strict(ExamplesFirstParser):
    """A parser that raises what it would print."""

    def error(self, message: str) -> NoReturn:
        """See ExamplesFirstParser."""
        raise SettingsError(
            f"not valid: {self.problem(message)}", "give it as on the command line: phone-host run --help"
        )


def _parser(
    add_arguments: Callable[[argparse.ArgumentParser], None] = lambda made: add_options(made, RunRequest),
) -> _Strict:
    made = _Strict("phone-host", add_help=False)
    add_arguments(made)
    made.add_argument("--json", action="store_true")
    made.add_argument("--debug", action="store_true")
    return made


@cache
def _declared() -> dict[str, argparse.Action]:
    """Return the options of `run`: the state asks for them several times a second."""
    return _parser().declared


@cache
def _declared_by_scan() -> dict[str, argparse.Action]:
    """Return the options of `scan`."""
    return _parser(lambda made: add_options(made, ScanRequest)).declared


def with_changes(choices: Mapping[str, str], changes: Mapping[str, str]) -> dict[str, str]:
    """Return choices with some changed; an empty value takes one back.

    Args:
        choices: by the option's name.
        changes: likewise.

    Raises:
        SettingsError: there is no such option, or it is a switch and the value neither yes nor no.
    """
    declared = _declared()
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


def run_words(choices: Mapping[str, str]) -> list[str]:
    """Return choices as the words of a command line, after `run`."""
    return _words(choices, _declared())


def scan_words(choices: Mapping[str, str]) -> list[str]:
    """Return those choices that `scan` takes, too, as the words of a command line, after `scan`."""
    declared = _declared_by_scan()
    return _words({name: value for name, value in choices.items() if name in declared}, declared)


def _words(choices: Mapping[str, str], declared: Mapping[str, argparse.Action]) -> list[str]:
    words: list[str] = []
    for name, value in choices.items():
        action = declared[name]
        if _is_switch(action):
            words.append(f"--{name}")
        else:
            for each in value.split() if name == "link" else [value]:
                words += [f"--{name}={each}"] if each.startswith("-") else [f"--{name}", each]
    return words


def shown_words(choices: Mapping[str, str]) -> list[str]:
    """Return choices as the words of the command line that is shown: a browser's camera needs the page."""
    return [*run_words(choices), *(["--serve"] if is_browser(choices.get("camera", "")) else [])]


def choices_of(given: Mapping[str, object]) -> dict[str, str]:
    """Return the options of a run that differ from the usual ones, as choices.

    Args:
        given: of `run`, by name.
    """
    found = {}
    for name, action in _declared().items():
        value = given.get(action.dest)
        if name not in _NOT_CHOSEN and value != action.default and value is not None:
            found[name] = "yes" if _is_switch(action) else " ".join(value) if isinstance(value, list) else str(value)
    return found


def run_request(words: Sequence[str]) -> RunRequest:
    """Read words as `phone-host run` reads them.

    Raises:
        SettingsError: they are not valid.
    """
    return read_request(RunRequest, run_given(words))


def run_given(words: Sequence[str]) -> dict[str, object]:
    """Return the options of words by name, as they were written; what they say is not checked.

    Raises:
        SettingsError: there is no such option, or it lacks its value.
    """
    return vars(_parser().parse_args(list(words)))


def calibrate_options(words: Sequence[str]) -> argparse.Namespace:
    """Read words as `phone-host calibrate` reads them.

    Raises:
        SettingsError: they are not valid.
    """
    return _parser(calibrate_arguments.add_arguments).parse_args(list(words))


def without_depth(choices: Mapping[str, str]) -> dict[str, str]:
    """Return what of the choices a run without depth needs."""
    return {name: value for name, value in choices.items() if name in _SHORT}


def _is_switch(action: argparse.Action) -> bool:
    return action.nargs == 0
