"""Plots: numbers are where the data put them, and nothing is invented."""

import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phone_host.svg.plot_scale import Linear, Log, duration_text, log_scale, span, ticks
from phone_host.svg.plots import (
    Budget,
    Quantity,
    Share,
    Strips,
    budgets,
    distributions,
)


def svg(text: str) -> ET.Element:
    return ET.fromstring(text)


def titles(root: ET.Element) -> list[str]:
    return [element.text or "" for element in root.iter("title")]


@settings(deadline=None, max_examples=50)
@given(parts=st.lists(st.floats(1.0, 1e9), min_size=1, max_size=6), width=st.integers(300, 1200))
def test_budget_bars_have_the_lengths_of_their_parts(parts: list[float], width: int) -> None:
    """The parts of the longest bar fill the width, side by side; each is as long as its share."""
    row = Budget("all", tuple(Share(f"p{index}", value, index) for index, value in enumerate(parts)))
    bars = svg(budgets([row], width)).findall("rect")
    edge = 0.0
    for bar, value in zip(bars, parts, strict=True):
        assert float(bar.get("x", "nan")) == pytest.approx(edge, abs=0.11)
        assert float(bar.get("width", "nan")) == pytest.approx(width * value / math.fsum(parts), abs=0.11)
        edge += width * value / math.fsum(parts)


def test_several_budgets_share_one_axis() -> None:
    """A bar of half the sum is half as long."""
    bars = svg(budgets([Budget("a", (Share("x", 10.0, 0),)), Budget("b", (Share("x", 5.0, 0),))], 400)).findall("rect")
    assert [float(bar.get("width", "nan")) for bar in bars] == [400.0, 200.0]


def test_strips_show_the_percentiles() -> None:
    """Bar, median line and numbers are at the percentiles of the data on the logarithmic axis."""
    values = np.arange(0.0, 1001.0) * 1000.0  # 0 to 1 ms in steps of 1 µs: percentile p is p * 10 µs
    root = svg(
        distributions([Strips("tcp", (Quantity(label="queuing", values_ns=values, colour=4, meaning="waiting"),))], 520)
    )
    words = " ".join(text.text or "" for text in root.iter("text"))
    assert "tcp" in words
    assert "p50 500 µs · p95 950 µs · p99 990 µs" in words.replace("\u202f", " ")
    # Decades 1 µs to 1 ms from x = 8 to x = 508.
    bar = root.find(".//rect[@class='bar']")
    assert bar is not None
    left, right = (8.0 + 500.0 * (math.log10(p) - 3.0) / 3.0 for p in (50e3, 950e3))
    assert float(bar.get("x", "nan")) == pytest.approx(left, abs=0.06)
    assert float(bar.get("width", "nan")) == pytest.approx(right - left, abs=0.06)
    median = root.find(".//path[@class='mark p50']")
    assert median is not None
    assert float(median.get("d", "")[1:].split()[0]) == pytest.approx(
        8.0 + 500.0 * (math.log10(500e3) - 3.0) / 3.0, abs=0.06
    )


def test_what_was_not_measured_is_not_drawn() -> None:
    """Only-NaN data give `not measured`, no data an empty plot."""
    nothing = Quantity(label="offset", values_ns=np.full(5, np.nan), colour=0)
    assert "not measured" in distributions([Strips("", (nothing,))], 400)
    assert "nothing measured" in budgets([], 400)


@pytest.mark.parametrize(
    ("ns", "text"),
    [
        (0.0, "0"),
        (7.0, "7.00 ns"),
        (999.0, "999 ns"),
        (999.6, "1.00 µs"),
        (12_345.0, "12.3 µs"),
        (-2.5e6, "-2.50 ms"),
        (99.96e6, "100 ms"),
        (61.5e9, "61.5 s"),
        (1234e9, "1234 s"),
        (math.nan, "\u2013"),
    ],
)
def test_durations_have_three_digits(ns: float, text: str) -> None:
    """A duration is shown with three significant digits in the appropriate unit."""
    assert duration_text(ns).replace("\u202f", " ") == text


@settings(deadline=None, max_examples=200)
@given(low=st.floats(-1e9, 1e9), width=st.floats(1e-3, 1e9), count=st.integers(2, 12))
def test_ticks_are_round_and_inside(low: float, width: float, count: int) -> None:
    """Ticks lie in the interval, are evenly spaced by 1, 2 or 5 times a power of ten, and are neither too many nor too few."""
    high = low + width
    found = ticks(low, high, count)
    assert len(found) <= count + 2
    slack = 1e-6 * max(abs(low), abs(high), width)
    assert all(low - slack <= tick <= high + slack for tick in found)
    if len(found) > 1:
        step = found[1] - found[0]
        mantissa = step / 10.0 ** math.floor(math.log10(step * 1.0001))
        assert min(abs(mantissa - good) for good in (1.0, 2.0, 5.0)) < 1e-3 * max(1.0, abs(low) / width)


@settings(deadline=None)
@given(value=st.floats(1e3, 1e9))
def test_scales_keep_order_and_ends(value: float) -> None:
    """Scales map their ends to their ends, map values in between to between, and clamp what lies outside."""
    for scale in (
        Linear(low=1e3, high=1e9, start_px=10.0, end_px=110.0),
        Log(low=1e3, high=1e9, start_px=10.0, end_px=110.0),
    ):
        assert scale.px(1e3) == pytest.approx(10.0)
        assert scale.px(1e9) == pytest.approx(110.0)
        assert 10.0 <= scale.px(value) <= 110.0
        assert scale.px(-5.0) == 10.0
        assert scale.px(1e12) == 110.0


def test_axes_of_nothing_and_of_one_value_exist() -> None:
    """No data or a single value still give an axis of positive length."""
    assert span(np.zeros(0)) == (0.0, 1.0)
    assert span(np.array([5.0, np.nan])) == (5.0, 6.0)
    for values in (np.zeros(3), np.array([1e6])):
        scale = log_scale(values, 0.0, 100.0)
        assert scale.high > scale.low > 0.0
