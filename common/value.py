"""Values that are cheap to make and cheap to define: frozen for the type checker only.

A frozen dataclass sets each of its fields through a call of `object.__setattr__`, which takes four times as long as an assignment: forty such
fields were a tenth of a frame's processor time on the link (bench_link). And it compiles six methods when its module is imported, which takes
four times as long as the one that is compiled here; the eighty classes of a board were a fifth of its start (bench_board).
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, TypeVar, dataclass_transform

T = TypeVar("T")


@dataclass_transform(frozen_default=True)
def value(*, kw_only: bool = False) -> Callable[[type[T]], type[T]]:
    """Make a slotted, hashable dataclass that mypy takes for a frozen one.

    Args:
        kw_only: whether its fields must be named when it is made.
    """

    def made(cls: type[T]) -> type[T]:
        slotted: Any = dataclass(slots=True, eq=False, repr=False, kw_only=kw_only)(cls)
        slotted.__eq__, slotted.__hash__ = _equal, _hash
        if slotted.__repr__ is object.__repr__:
            slotted.__repr__ = _shown
        return slotted  # type: ignore[no-any-return]

    return made


def _values(item: Any) -> tuple[object, ...]:  # noqa: ANN401 - any of these classes
    return tuple(getattr(item, one.name) for one in fields(item) if one.compare)


def _equal(item: object, other: object) -> object:
    if other.__class__ is not item.__class__:
        return NotImplemented
    return _values(item) == _values(other)


def _hash(item: object) -> int:
    return hash(_values(item))


def _shown(item: Any) -> str:  # noqa: ANN401 - any of these classes
    shown = ", ".join(f"{one.name}={getattr(item, one.name)!r}" for one in fields(item) if one.repr)
    return f"{item.__class__.__qualname__}({shown})"
