"""The one way from a result to JSON: a frozen dataclass becomes an object with its fields as keys. Its class is the JSON Schema (`tests.docs.schemas`).

A field's name is its key, without an underscore at its end (`from_`), and has the unit. What is not measured is NaN and becomes null, so
its type is `float | None`. A field that is ABSENT has no key. What a field is read from is said beside it (`FieldOf`), unless it is the attribute
of the same name; `made` reads.
"""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, field, fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Final, Generic, TypeVar, cast, get_args, get_origin, get_type_hints

from common.diagnostic import Diagnostic
from phone_host.output.json_text import json_number

D1 = Annotated[float, 1]
D2 = Annotated[float, 2]
D3 = Annotated[float, 3]
D4 = Annotated[float, 4]
D5 = Annotated[float, 5]
D6 = Annotated[float, 6]
"""Numbers that are written with so many decimals."""

Number = D6 | None
"""Null: not measured, or infinite."""


class Absent(Enum):
    """Says that an object has no such key."""

    ABSENT = "absent"


ABSENT: Final = Absent.ABSENT

S = TypeVar("S")
V = TypeVar("V")


class FieldOf(Generic[S]):
    """Declares fields of a result that is made of an S, each by the function that reads it there."""

    def __call__(self, read: Callable[[S], V]) -> V:
        """Declare one."""
        return cast("V", field(metadata={"read": read}))


def made(kind: type, source: Any, /, *parts: Any, **given: Any) -> Any:  # noqa: ANN401 - stands in a field of any type
    """Make a result of what it is read from; of None none, of several as many.

    Args:
        kind: its class.
        source: what the fields' functions read.
        parts: where else attributes of the fields' names are looked for, behind the source.
        given: fields that are not read.
    """
    if source is None:
        return None
    if isinstance(source, list | tuple):
        return tuple(made(kind, each) for each in source)
    for each in fields(kind):
        if each.name in given:
            continue
        if "read" in each.metadata:
            given[each.name] = each.metadata["read"](source)
        elif each.default is MISSING:
            holder = next((one for one in (source, *parts) if hasattr(one, each.name)), None)
            if holder is None:
                raise TypeError(f"{kind.__name__}.{each.name} can be read nowhere")
            given[each.name] = getattr(holder, each.name)
    return kind(**given)


def result_values(kind: type, source: Any) -> Any:  # noqa: ANN401
    """Return what JSON holds of a result; see `made`."""
    return None if source is None else json_values(made(kind, source))


def json_values(result: Any) -> dict[str, Any]:  # noqa: ANN401 - whatever dataclass
    """Return a result as what JSON holds: keys in the order of its fields; of a diagnostic, problem and remedy."""
    if isinstance(result, Diagnostic):
        return {"problem": result.message, "remedy": result.remedy}
    types = types_of(type(result))  # type: ignore[arg-type]  # a class is hashable
    told = ((name, getattr(result, name)) for name in types)
    return {name.rstrip("_"): _value(value, _digits(types[name])) for name, value in told if value is not ABSENT}


@cache
def types_of(kind: type) -> dict[str, Any]:
    """Return the types of a class of results by its fields, in their order."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: hints[field.name] for field in fields(kind)}


def problem_values(found: Diagnostic | None) -> dict[str, Any] | None:
    """Return what is wrong and what helps; None: nothing is."""
    return None if found is None else json_values(found)


def _digits(hint: Any) -> int | None:  # noqa: ANN401
    if get_origin(hint) is Annotated:
        return int(hint.__metadata__[0])
    return next((digits for each in get_args(hint) if (digits := _digits(each)) is not None), None)


def _value(value: Any, digits: int | None) -> Any:  # noqa: ANN401
    match value:
        case float():
            return value if digits is None else json_number(value, digits)
        case Enum():
            return value.value
        case Path():
            return str(value)
        case Mapping():
            return {key: _value(each, digits) for key, each in value.items()}
        case list() | tuple():
            return [_value(each, digits) for each in value]
        case _:
            return json_values(value) if is_dataclass(value) else value
