"""The page's choices are options of `phone-host run` by name. They become requests, and are read by what reads command lines."""

import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final, TypeVar

from common.errors import SettingsError
from common.program.commandline import ExamplesFirstParser
from common.program.request import Option, add_options, options_of, read_request
from phone_host.camera.uris import is_browser
from phone_host.jobs.calibrate.request import CalibrateRequest
from phone_host.jobs.run_request import RunRequest
from phone_host.jobs.scan_request import ModelOptions, model_wanted
from phone_host.scan.scan_wanted import ScanWanted

Choices = Mapping[str, str]
"""Options by name without dashes."""

T = TypeVar("T")

_YES: Final = frozenset({"yes", "true", "on", "1"})
_NO: Final = frozenset({"", "no", "false", "off", "0"})

_PLACES: Final = frozenset({"calibration", "out"})
"""Options that name a file or folder."""

_SHORT: Final = frozenset({"link", "camera", "board-side", "tolerance", "fifo", "max-megapixels"})
"""What a run without depth needs."""


@cache
def options_by_flag(kind: type) -> dict[str, Option]:
    """Return the options of a request: the page's state asks for them several times a second."""
    return {made.flags[0].removeprefix("--"): made for made in options_of(kind).values() if made.flags}


def page_options(kind: type) -> dict[str, Option]:
    """Return those that the page may set."""
    return {name: made for name, made in options_by_flag(kind).items() if made.page}


def calibrate_options() -> dict[str, Option]:
    """Return those of `calibrate` that the page may set beside what is chosen for a run."""
    chosen = page_options(RunRequest).keys() - {"baseline", "out"}
    return {name: made for name, made in page_options(CalibrateRequest).items() if name not in chosen}


def value_schemas() -> dict[str, object]:
    """Return JSON schemas of the values that the page's commands of the same names take."""
    kinds = {"set": page_options(RunRequest), "calibrate": calibrate_options(), "scan": page_options(ModelOptions)}
    return {
        f"{do}_values": {
            "type": "object",
            "properties": {
                name: {"type": "string", "description": made.declared["help"].replace("%%", "%")}
                for name, made in options.items()
            },
        }
        for do, options in kinds.items()
    }


def with_changes(choices: Choices, changes: Choices) -> dict[str, str]:
    """Return choices with some changed; an empty value takes one back.

    Raises:
        SettingsError: there is no such option, or it is a switch and the value neither yes nor no.
    """
    settable = page_options(RunRequest)
    made = dict(choices)
    for name, value in changes.items():
        if name not in settable:
            raise SettingsError(f"{name!r} is no option of a run that the page can set", "see phone-host run --help")
        made.pop(name, None)
        kept = placed(value) if name in _PLACES else value.strip()
        if settable[name].is_switch:
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
    declared, words = options_by_flag(kind), list[str]()
    for name, value in choices.items():
        if name not in declared:
            continue
        if declared[name].is_switch:
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
    for name, made in page_options(RunRequest).items():
        value = given.get(made.key(name))
        if value != made.usual and value is not None:
            found[name] = "yes" if made.is_switch else " ".join(value) if isinstance(value, list) else str(value)
    return found


def given_by(choices: Choices, kind: type = RunRequest, verb: str = "run") -> dict[str, object]:
    """Return the options of a request by name, as the command line of its verb gives them; what they say is not checked.

    Raises:
        SettingsError: one lacks its value, or has one of another kind.
    """
    parser = ExamplesFirstParser(f"phone-host {verb}", add_help=False)
    add_options(parser, kind)
    return {"json": False, "debug": False, **vars(parser.parse_args(words_of(choices, kind)))}


def request_of(choices: Choices, kind: type[T], verb: str = "run") -> T:
    """Make a request, or a group of options, of choices.

    Raises:
        SettingsError: they are not valid.
    """
    return read_request(kind, given_by(choices, kind, verb))


def asked_scan(values: Choices) -> ScanWanted:
    """Return what the page wants of a scan, by the options of the command.

    Args:
        values: options of `scan` by name; what is missing or empty is as the command has it.

    Raises:
        SettingsError: the page may not give one of them, or it is invalid, or contradicts another.
    """
    settable = page_options(ModelOptions)
    if unknown := values.keys() - settable:
        raise SettingsError(
            f"{min(unknown)!r} is no option of a scan that the page can set", f"give some of {', '.join(settable)}"
        )
    chosen = {name: text for name, value in values.items() if (text := value.strip())}
    return model_wanted(request_of(chosen, ModelOptions, "scan"), None)


def without_depth(choices: Choices) -> dict[str, str]:
    """Return what of the choices a run without depth needs."""
    return {name: value for name, value in choices.items() if name in _SHORT}
