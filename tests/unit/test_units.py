"""Lengths on the command line are read alike everywhere."""

import pytest

from common.errors import SettingsError
from phone_host.verbs.units import length_mm


@pytest.mark.parametrize(
    ("text", "expected_mm"),
    [("25", 25), ("25mm", 25), ("2.5cm", 25), ("0.025m", 25), ("537.2 mm", 537.2), ("1E2", 100), (" .5M ", 500)],
)
def test_a_length_has_a_unit_or_is_in_millimetres(text: str, expected_mm: float) -> None:
    assert length_mm(text, "--x", "25mm") == pytest.approx(expected_mm)


@pytest.mark.parametrize("text", ["", "mm", "-3", "0", "nan", "inf", "1e400m", "25 inch", "2,5cm"])
def test_anything_else_is_refused_with_the_option_and_an_example(text: str) -> None:
    with pytest.raises(SettingsError, match="--x") as caught:
        length_mm(text, "--x", "25mm")
    assert "25mm" in caught.value.remedy
