"""Requests: what a command is asked for, as a frozen dataclass each of whose fields says by which option it is given. Light.

    @dataclass(frozen=True, slots=True, kw_only=True)
    class ExportRequest(Request):
        unit: str | None = option("--unit", choices=("m", "mm"), help="unit of a mesh file of another program")

`add_options` gives a parser the options; `read_request` makes the request of what was given, by whomever: a value is read and checked by the
same function, whether it comes from a command line, a page or a settings file.
"""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import Any, Final, TypeVar

from common.program.quantities import reading

T = TypeVar("T")

_OPTION: Final = "option"
_PART: Final = "part"


@dataclass(frozen=True, slots=True)
class Option:
    """See `option`."""

    flags: tuple[str, ...]
    read: Callable[[str, str], Any] | None
    number: Callable[[str, str], float] | None
    alone: bool
    often: bool
    group: str
    page: bool
    declared: dict[str, Any]

    @property
    def is_switch(self) -> bool:
        """Whether it is given without a value."""
        return self.declared.get("action") == "store_true"

    @property
    def usual(self) -> Any:  # noqa: ANN401 - of any field
        """What counts as given where nothing is."""
        return self.declared.get(
            "default", False if self.is_switch else [] if self.declared.get("nargs") == "*" else None
        )

    def called(self, name: str) -> str:
        """Return what a user calls it: the flag, or what stands for a positional argument."""
        return self.flags[0] if self.flags else str(self.declared.get("metavar", name))

    def key(self, name: str) -> str:
        """Return the name of its value among those given."""
        return self.flags[0].lstrip("-").replace("-", "_") if self.flags else name

    def value(self, given: Any, name: str) -> Any:  # noqa: ANN401 - of any field
        """Read what was given."""
        if isinstance(given, list | tuple):
            return tuple(self.value(each, name) for each in given)
        return self.read(given, self.called(name)) if self.read is not None and isinstance(given, str) else given


def option(
    *flags: str,
    read: Callable[[str, str], Any] | None = None,
    number: Callable[[str, str], float] | None = None,
    alone: bool = False,
    often: bool = False,
    group: str = "",
    page: bool = True,
    **declared: Any,  # noqa: ANN401 - argparse's own
) -> Any:  # noqa: ANN401 - stands in a dataclass field of any type, as dataclasses.field does
    """Declare a field of a request, and the option that gives it.

    Args:
        flags: names of the option; none: it is a positional argument, called as the field.
        read: makes the field's value of a text and the option's name, or raises SettingsError. What was given is kept as it was written.
        number: reads a number that may have a unit, likewise; what was given is kept as that number.
        alone: this option and the others that say so exclude each other.
        often: many need it, so help shows it first, outside of its group.
        group: title of the group in which help shows it; empty: that of its part.
        page: whether the page may set it. Options of the program itself, and what only a terminal can do, are not the page's.
        declared: what `ArgumentParser.add_argument` takes; the default is as a user writes it.
    """
    made = Option(flags, read, number, alone, often, group, page, declared)
    is_required = declared.get("required", not flags and declared.get("nargs") not in {"?", "*"})
    usual = MISSING if is_required else made.value(made.usual, "")
    return field(default=usual, metadata={_OPTION: made})


def setting(
    default: Any,  # noqa: ANN401 - as above
    doc: str,
    number: Callable[[str, str], float] | None = None,
    flag: str = "",
    **declared: Any,  # noqa: ANN401 - as above
) -> Any:  # noqa: ANN401 - as above
    """Declare one setting of a settings dataclass, and the option that gives it.

    Args:
        default: its value if nothing else is given.
        doc: one sentence for people: the option's help.
        number: reads a number that may have a unit, from a text and the name of what holds it; None: the setting is no such number.
        flag: name of the option; empty: it has none here.
        declared: what `option` takes.
    """
    made = option(flag, number=number, help=doc, default=None, **declared).metadata if flag else {}
    return field(default=default, metadata={"read": number, **made})


def option_of(settings: type, name: str, **changes: Any) -> Any:  # noqa: ANN401 - as above
    """Declare a field of a request that is given by the option of a setting; None: the setting stays as it is.

    Args:
        settings: the settings dataclass.
        name: of the setting.
        changes: what of `option` is different here.
    """
    made = next(item.metadata[_OPTION] for item in fields(settings) if item.name == name)
    return field(default=None, metadata={_OPTION: replace(made, **changes)})


def part(kind: type[T], when: str = "", group: str = "") -> T:
    """Declare a field of a request that is a group of options, which several requests share.

    Args:
        kind: the group: a dataclass of such fields.
        when: begins the help of each, such as "live: ".
        group: title of the group in which help shows them; empty: none.
    """
    return field(default_factory=kind, metadata={_PART: (kind, when, group)})


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What every command can be asked for.

    Attributes:
        as_json: whether to print one JSON object on stdout.
        given: all options as they were given, by name, for reports that say what a run was told.
    """

    as_json: bool = False
    given: Mapping[str, object] = field(default_factory=dict, repr=False, compare=False)


def add_options(parser: argparse.ArgumentParser, kind: type, when: str = "", group: str = "") -> None:
    """Declare the options of a request, or of a group of options.

    Args:
        parser: of the command.
        kind: the dataclass.
        when: begins the help of each.
        group: title of the group in which help shows them; empty: none.
    """
    alone = None
    for item in fields(kind):
        if _PART in item.metadata:
            add_options(parser, *item.metadata[_PART])
        if _OPTION not in item.metadata:
            continue
        made: Option = item.metadata[_OPTION]
        declared = {**made.declared, "help": when + made.declared["help"]}
        if made.number is not None:
            declared["type"] = reading(made.number, made.called(item.name))
        if made.flags:
            declared["dest"] = made.key(item.name)
        if made.alone and alone is None:
            alone = parser.add_mutually_exclusive_group()
        place: Any = alone if made.alone and alone else parser
        if place is parser and (title := made.group or group) and made.flags and not made.often:
            known = (each for each in parser._action_groups if each.title == title)  # noqa: SLF001 - argparse tells of them nowhere else
            place = next(known, None) or parser.add_argument_group(title)
        place.add_argument(*made.flags or (item.name,), **declared)


def options_of(kind: type) -> dict[str, Option]:
    """Return the options of a request, or of a group of options, with those of its parts, each by the name of its value."""
    found: dict[str, Option] = {}
    for item in fields(kind):
        if _PART in item.metadata:
            found |= options_of(item.metadata[_PART][0])
        elif _OPTION in item.metadata:
            found[item.metadata[_OPTION].key(item.name)] = item.metadata[_OPTION]
    return found


def read_request(kind: type[T], given: Mapping[str, object]) -> T:
    """Make a request of what was given.

    Args:
        kind: the request, or a group of options.
        given: values by the option's name, as `add_options` has a parser read them; what is missing is as usual.

    Raises:
        SettingsError: a value makes no sense.
    """
    values: dict[str, Any] = {}
    for item in fields(kind):  # type: ignore[arg-type]  # T is always a dataclass
        if _PART in item.metadata:
            values[item.name] = read_request(item.metadata[_PART][0], given)
        elif _OPTION in item.metadata and (key := item.metadata[_OPTION].key(item.name)) in given:
            values[item.name] = item.metadata[_OPTION].value(given[key], item.name)
    if issubclass(kind, Request):
        values |= {"as_json": bool(given.get("json")), "given": given}
    return kind(**values)


def given_words(kind: type, given: Mapping[str, object]) -> dict[str, list[str]]:
    """Return the options that are not as usual, each by its name with the words of a command line that give it.

    Args:
        kind: a request, or a group of options.
        given: values by the option's name, as they were written.
    """
    found: dict[str, list[str]] = {}
    for key, made in options_of(kind).items():
        value = given.get(key, made.usual)
        if not made.flags or value == made.usual:
            continue
        flag = made.flags[0]
        if isinstance(value, bool):
            found[key] = [flag if value else f"--no-{flag.removeprefix('--')}"]
        elif made.declared.get("action") == "append" and isinstance(value, list):
            found[key] = [word for each in value for word in (flag, str(each))]
        else:
            found[key] = [flag, *map(str, value if isinstance(value, list) else [value])]
    return found
