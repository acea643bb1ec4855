"""Numbers and nouns agree."""

import pytest

from common.words import counted, times, two_digits


@pytest.mark.parametrize(
    ("count", "noun", "plural", "words"),
    [
        (0, "pair", "", "0 pairs"),
        (1, "pair", "", "1 pair"),
        (2, "pair", "", "2 pairs"),
        (1, "spoiled image", "", "1 spoiled image"),
        (3, "body", "bodies", "3 bodies"),
        (1, "body", "bodies", "1 body"),
    ],
)
def test_one_is_singular(count: int, noun: str, plural: str, words: str) -> None:
    """One takes the singular, every other number the plural."""
    assert counted(count, noun, plural) == words


def test_how_often_has_words() -> None:
    """Once and twice are words; more is a number of times."""
    assert [times(count) for count in (1, 2, 3)] == ["once", "twice", "3 times"]


@pytest.mark.parametrize(
    ("value", "text"), [(0.187, "0.19"), (91.2, "91"), (213.0, "210"), (1520.0, "1500"), (0.0, "0")]
)
def test_two_digits_have_no_exponent(value: float, text: str) -> None:
    """As people write them."""
    assert two_digits(value) == text
