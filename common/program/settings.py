"""Settings with their origin: defaults, a TOML file, the environment and options, in increasing order of precedence.

A daemon declares its settings as one frozen dataclass whose fields are texts, numbers, booleans or tuples of texts, each with a
`doc` in its metadata. Keys in the file are the field names; in the environment, PREFIX_FIELD.
"""

import json
import logging
import os
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Final, Generic, TypeVar, get_args, get_origin, get_type_hints

from common.errors import DataError, SettingsError
from common.files import read_whole
from common.plain_text import printable_lines
from common.program.quantities import decimal_number, whole_number
from common.value import value

T = TypeVar("T")

DEFAULT: Final = "default"
"""The origin of a setting that nobody gave."""


@value()
class Resolved(Generic[T]):
    """Settings, and where each came from.

    Attributes:
        values: the settings dataclass.
        origins: (field, origin) in the order of the fields; origin is `default`, a file, a variable or an option.
    """

    values: T
    origins: tuple[tuple[str, str], ...]


def resolve(
    kind: type[T], prefix: str, file: Path | None, options: Mapping[str, object], *, aside: Sequence[str] = ()
) -> Resolved[T]:
    """Work out the settings.

    Args:
        kind: the settings dataclass.
        prefix: prefix of the environment variables, for example `BOARD_AGENT`.
        file: a TOML file, or None.
        options: options from the command line, by field name; None means not given.
        aside: names of tables in the file that others read.

    Raises:
        SettingsError: the file cannot be read, or a key or value makes no sense.
    """
    hints = get_type_hints(kind)
    in_file = {} if file is None else _read(file, set(hints), aside)
    values: dict[str, Any] = {}
    origins = []
    for item in fields(kind):  # type: ignore[arg-type]  # T is always a dataclass
        origin, variable = DEFAULT, f"{prefix}_{item.name.upper()}"
        value: Any = item.default
        read: Any = item.metadata.get("read")
        if item.name in in_file:
            origin, value, where = str(file), in_file[item.name], f"{item.name} in {file}"
            is_text = read is not None and isinstance(value, str)
            value = read(value, where) if is_text else _checked(value, hints[item.name], where)
        if variable in os.environ:
            origin, text = variable, os.environ[variable]
            value = read(text, variable) if read is not None else _parsed(text, hints[item.name], variable)
        if options.get(item.name) is not None:
            origin, value = f"--{item.name.replace('_', '-')}", options[item.name]
        values[item.name] = value
        origins.append((item.name, origin))
    return Resolved(kind(**values), tuple(origins))


def with_origins(
    resolved: Resolved[Any] | None, options: Mapping[str, object], words: Sequence[str]
) -> dict[str, dict[str, object]]:
    """Return the settings and options of a run as one JSON object, by name, each with its value and origin.

    Args:
        resolved: the settings; None if the command has none.
        options: all options by name, with defaults for those not given. Options that are also settings appear as settings; the verb is left out.
        words: the command line's words; they show which options were given.
    """
    known = {f"--{name.replace('_', '-')}": name for name in options if name != "verb"}
    given: set[str] = set()
    for word in (word.partition("=")[0] for word in words if len(word) > 2 and word.startswith("--")):
        given |= (
            {word} if word in known else {option for option in known if option.startswith(word)}
        )  # as argparse does
    found: dict[str, dict[str, object]] = {}
    for option, name in known.items():
        value = options[name]
        shown = str(value) if isinstance(value, Path) else value
        found[name] = {"value": shown, "origin": option if option in given else "default"}
    for name, origin in () if resolved is None else resolved.origins:
        assert resolved is not None
        found[name] = {"value": getattr(resolved.values, name), "origin": origin}
    return found


def listing(resolved: Resolved[Any], *, as_json: bool) -> str:
    """What a `settings` verb prints: each setting with its value and origin.

    Args:
        resolved: the settings.
        as_json: whether to return one JSON object, by name; otherwise a table with a line for each.

    Returns:
        The text, without a trailing newline.
    """
    rows = [(name, getattr(resolved.values, name), origin) for name, origin in resolved.origins]
    if as_json:
        return json.dumps({name: {"value": value, "origin": origin} for name, value, origin in rows})
    shown = [
        (name, " ".join(value) if isinstance(value, tuple) else str(value), origin) for name, value, origin in rows
    ]
    widths = [max(len(row[column]) for row in shown) for column in (0, 1)]
    return printable_lines(
        "\n".join(f"{name:{widths[0]}}  {value:{widths[1]}}  {origin}" for name, value, origin in shown)
    )


def log_level(name: str) -> int:
    """Return the log level of that name.

    Raises:
        SettingsError: there is no level of that name.
    """
    levels = {"debug": logging.DEBUG, "info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}
    if name.lower() not in levels:
        raise SettingsError(f"log_level is {name!r}", f"give one of {', '.join(levels)}")
    return levels[name.lower()]


_MOST_BYTES = 1 << 16
"""Limit for a settings file, which usually has one page."""

_MOST_DOTS = 200
"""Limit for a line. Python's TOML parser takes time and memory with the square of the parts of a key, a.b.c; a line with a dozen addresses has 50."""

_MOST_SHOWN = 80
"""Characters of a wrong line that an error shows."""


def read_file(file: Path) -> dict[str, Any]:
    """Return what a settings file holds, whatever it is.

    Raises:
        SettingsError: it cannot be read, or is not TOML.
    """
    text = ""
    try:
        text = read_whole(file, _MOST_BYTES).decode("utf-8")
        _require_few_dots(text, file)
        content = tomllib.loads(text)
    except OSError as error:
        raise SettingsError(f"settings file {file} cannot be read ({error.strerror})", "check --config") from None
    except DataError as error:
        raise SettingsError(f"settings file {error.problem}", "check --config") from None
    except UnicodeDecodeError as error:
        raise SettingsError(f"settings file {file} is not UTF-8 text ({error.reason})", "save it as UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        where, what = _place(str(error), text)
        raise SettingsError(
            f"settings file {file} is not TOML{where}: {what}",
            'mend that line; texts are in quotes, as in camera = "v4l2:auto"',
        ) from None
    except (ValueError, RecursionError):  # a number of thousands of digits; lists in lists, thousands deep
        raise SettingsError(f"settings file {file} holds a number or a list beyond all measure", "remove it") from None
    return content


def _read(file: Path, known: set[str], aside: Sequence[str]) -> dict[str, Any]:
    content = read_file(file)
    for table in aside:
        content.pop(table, None)
    if unknown := set(content) - known:
        raise SettingsError(f"unknown key {min(unknown)!r} in {file}", f"the keys are {', '.join(sorted(known))}")
    return content


def _require_few_dots(text: str, file: Path) -> None:
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > _MOST_DOTS:
            raise SettingsError(
                f"settings file {file} has {line.count('.')} dots in line {number}", "shorten that line"
            )


def _place(problem: str, text: str) -> tuple[str, str]:
    """Return where in the text a TOML error lies, with the line itself, and what the error is.

    A password in an address is not shown, nor what belongs to an address: that is a key.
    """
    found = re.fullmatch(r"(.*) \(at line (\d+), column \d+\)", problem)
    if found is None:  # at its end
        return "", problem
    line = text.splitlines()[int(found[2]) - 1 : int(found[2])]
    shown = re.sub(r"//[^/@]*@", "//...@", "".join(line).strip())
    shown = re.sub(r"""^(['"]?[\w-]+:[^=]*=).*""", r"\1 ...", shown)[:_MOST_SHOWN]
    return f" in line {found[2]}, {shown!r}", found[1]


def _checked(value: object, hint: Any, where: str) -> object:  # noqa: ANN401 - a type hint
    if get_origin(hint) is tuple:
        if isinstance(value, list) and all(isinstance(item, get_args(hint)[0]) for item in value):
            return tuple(value)
    elif hint is float and type(value) in {int, float}:
        return float(value)  # type: ignore[arg-type]  # int or float, as just checked
    elif type(value) is hint:
        return value
    raise SettingsError(f"{where} is {value!r}", f"give {_name(hint)}")


_READERS: Final[dict[Any, Callable[[str], object]]] = {str: str, int: whole_number, float: decimal_number}


def _parsed(text: str, hint: Any, where: str) -> object:  # noqa: ANN401 - a type hint
    try:
        if get_origin(hint) is tuple:
            return tuple(text.split())
        if hint is bool:
            return {"0": False, "1": True, "false": False, "true": True}[text.lower()]
        return _READERS[hint](text)
    except (ValueError, KeyError):
        raise SettingsError(f"{where} is {text!r}", f"give {_name(hint)}") from None


def _name(hint: Any) -> str:  # noqa: ANN401 - a type hint
    if get_origin(hint) is tuple:
        return 'a list of texts, such as ["one", "two"]'
    return {str: "a text", int: "a whole number", float: "a number", bool: "true or false"}[hint]
