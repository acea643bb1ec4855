"""What `value` promises: classes that behave as frozen slotted dataclasses do, for everybody but an assignment."""

from dataclasses import dataclass, field, replace

import pytest

from common.value import value


@value()
class Spot:
    """Two numbers, one of which does not count, and one that is not shown."""

    x: int
    y: int = 0
    note: str = field(default="", compare=False)
    hidden: bytes = field(default=b"", repr=False)


@value(kw_only=True)
class Named:
    """One number that must be named."""

    x: int


@value()
class Own:
    """A class that shows itself in its own way."""

    x: int

    def __repr__(self) -> str:
        return "mine"


@dataclass(frozen=True, slots=True)
class Frozen:
    """The same fields as Spot, from the standard library."""

    x: int
    y: int = 0
    note: str = field(default="", compare=False)
    hidden: bytes = field(default=b"", repr=False)


def test_values_are_equal_by_what_counts() -> None:
    """Two values are equal, and have one hash, if all fields that count are; a value of another class is never equal."""
    assert Spot(1, 2, "a") == Spot(1, 2, "b")
    assert hash(Spot(1, 2, "a")) == hash(Spot(1, 2, "b"))
    assert Spot(1, 2) != Spot(2, 1)
    assert Spot(1, 2, hidden=b"x") != Spot(1, 2)
    others: list[object] = [Named(x=1), (1, 0, "", b"")]
    assert Spot(1) not in others
    assert len({Spot(1), Spot(1), Spot(2)}) == 2


def test_a_value_shows_itself_as_a_dataclass_does() -> None:
    """The text names the class and its fields, but not those that are not to be shown; a class's own text stays."""
    assert repr(Spot(1, note="n", hidden=b"secret")) == repr(Frozen(1, note="n", hidden=b"secret")).replace(
        "Frozen", "Spot"
    )
    assert repr(Own(1)) == "mine"


def test_a_value_takes_part_in_matching_and_replacing() -> None:
    """Patterns take its fields in order, `replace` makes a changed copy, and no field can be added."""
    match Spot(1, 2):
        case Spot(x, y):
            assert (x, y) == (1, 2)
    assert replace(Spot(1, 2), y=3) == Spot(1, 3)
    with pytest.raises(AttributeError):
        Spot(1).other = 2  # type: ignore[attr-defined]
    with pytest.raises(TypeError):
        Named(1)  # type: ignore[call-arg]
