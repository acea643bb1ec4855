"""How a daemon declares its settings. Light: help is made of what is declared; `settings` works out the values."""

from dataclasses import field
from typing import Any


def setting(default: Any, doc: str) -> Any:  # noqa: ANN401 - stands in a dataclass field of any type, as dataclasses.field does
    """Declare one setting of a settings dataclass.

    Args:
        default: its value where nothing else is said.
        doc: one sentence for people.
    """
    return field(default=default, metadata={"doc": doc})
