"""How a daemon declares its settings. Lightweight: help is built from the declarations; `settings` resolves the values."""

from collections.abc import Callable
from dataclasses import field
from typing import Any


def setting(default: Any, doc: str, read: Callable[[str, str], float] | None = None) -> Any:  # noqa: ANN401 - stands in a dataclass field of any type, as dataclasses.field does
    """Declare one setting of a settings dataclass.

    Args:
        default: its value if nothing else is given.
        doc: one sentence for people.
        read: reads a number that may have a unit, from a text and the name of what holds it; None: the setting is no such number.
    """
    return field(default=default, metadata={"doc": doc, "read": read})
