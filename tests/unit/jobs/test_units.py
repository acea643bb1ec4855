"""Lengths on the command line are read alike everywhere."""

import pytest

from common.errors import SettingsError
from phone_host.jobs.units import baseline_mm, bounded_mm, length_mm, limit_mm


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


@pytest.mark.parametrize("text", ["0.001mm", "1e9mm", "2.001m"])
def test_a_size_that_nothing_has_is_refused_with_both_bounds(text: str) -> None:
    """From 10 mm to 2 m, ends included."""
    with pytest.raises(SettingsError, match="--width is ") as caught:
        bounded_mm(text, "--width", "100mm", (10, 2000))
    assert caught.value.remedy == "give 10 to 2000 mm, for example 100mm"
    assert [bounded_mm(text, "--width", "100mm", (10, 2000)) for text in ("1cm", "2m")] == [10, 2000]


def test_a_number_alone_that_can_only_mean_metres_is_refused_with_both_readings() -> None:
    """Wrong by 1000, every depth would look right: 0.193 is refused as a baseline, 2 as a limit, and both readings are named."""
    with pytest.raises(SettingsError, match="has no unit") as caught:
        limit_mm("2", "--far", "5m")
    assert caught.value.remedy == "write 2000mm or 2m; 2mm if you mean that"
    with pytest.raises(SettingsError, match="has no unit") as caught:
        baseline_mm("0.193")
    assert caught.value.remedy == "write 193mm or 0.193m"  # 0.193 mm would be refused, too


def test_what_a_unit_states_is_believed() -> None:
    """With a unit, and from 5 mm (baseline) or 10 mm (limits) on without one, the number is what it says."""
    assert [baseline_mm(text) for text in ("1mm", "5", "193.001", "0.193m")] == pytest.approx([1, 5, 193.001, 193])
    assert [limit_mm(text, "--near", "300mm") for text in ("2mm", "10", "2m")] == pytest.approx([2, 10, 2000])


def test_cameras_ten_metres_apart_are_the_limit() -> None:
    """10m is taken; 193001, which is micrometres, is not."""
    assert baseline_mm("10m") == pytest.approx(10_000)
    with pytest.raises(SettingsError, match=r"193001 is 193\.001 m"):
        baseline_mm("193001")


def test_no_two_cameras_are_nearer_than_a_millimetre() -> None:
    """Nor is a length that a unit makes absurd believed: 0.1 um."""
    with pytest.raises(SettingsError, match=r"--baseline 0\.0001mm is 0\.0001 mm") as caught:
        baseline_mm("0.0001mm")
    assert "at least 1mm" in caught.value.remedy


def test_no_stereo_camera_sees_a_hundred_kilometres_far() -> None:
    """100 km is taken, 1e99 m is named and refused."""
    assert limit_mm("100000m", "--far", "5m") == pytest.approx(1e8)
    with pytest.raises(SettingsError, match="give at most 100 km"):
        limit_mm("1e99m", "--near", "300mm")
