"""How a daemon declares its settings. Lightweight: help is built from the declarations; `settings` resolves the values."""

from dataclasses import field
from typing import Any


def setting(default: Any, doc: str) -> Any:  # noqa: ANN401 - stands in a dataclass field of any type, as dataclasses.field does
    """Declare one setting of a settings dataclass.

    Args:
        default: its value if nothing else is given.
        doc: one sentence for people.
    """
    return field(default=default, metadata={"doc": doc})
