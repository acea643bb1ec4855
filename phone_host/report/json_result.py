"""The one way from a result to JSON: a frozen dataclass becomes an object with its fields as keys. Its class is the JSON Schema (`tests.docs.schemas`).

A field's name is its key, without an underscore at its end (`from_`), and has the unit. What is not measured is NaN and becomes null, so
its type is `float | None`. A field that is ABSENT has no key.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Final, get_args, get_origin, get_type_hints

from phone_host.output.json_text import json_number

D1 = Annotated[float, 1]
D2 = Annotated[float, 2]
D3 = Annotated[float, 3]
D4 = Annotated[float, 4]
D6 = Annotated[float, 6]
"""Numbers that are written with so many decimals."""


class Absent(Enum):
    """Says that an object has no such key."""

    ABSENT = "absent"


ABSENT: Final = Absent.ABSENT


def json_values(result: Any) -> dict[str, Any]:  # noqa: ANN401 - whatever dataclass
    """Return a result as what JSON holds: keys in the order of its fields."""
    types = types_of(type(result))
    told = ((name, getattr(result, name)) for name in types)
    return {name.rstrip("_"): _value(value, _digits(types[name])) for name, value in told if value is not ABSENT}


def types_of(kind: type) -> dict[str, Any]:
    """Return the types of a class of results by its fields, in their order."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: hints[field.name] for field in fields(kind)}


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
