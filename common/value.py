"""Values that are made anew for every frame.

A frozen dataclass sets each of its fields through a call of `object.__setattr__`, which takes four times as long as an assignment: forty such
fields were a tenth of a frame's processor time on the link (bench_link). These classes are frozen for the type checker only.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, dataclass_transform

T = TypeVar("T")


@dataclass_transform(frozen_default=True)
def value(*, kw_only: bool = False) -> Callable[[type[T]], type[T]]:
    """Make a slotted, hashable dataclass that mypy takes for a frozen one.

    Args:
        kw_only: whether its fields must be named when it is made.
    """
    return dataclass(slots=True, unsafe_hash=True, kw_only=kw_only)
