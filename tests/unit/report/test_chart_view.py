"""Charts of static pages: the script gets what was measured, gaps stay gaps, extremes survive, and a sentence says the most of it."""

import json
from dataclasses import replace
from typing import Any

import numpy as np

from phone_host.report.chart_view import MOST_PAIRS, dots_chart, stacked_chart
from phone_host.svg.plots import Quantity
from tests.support.html import Page


def given(chart: str) -> dict[str, Any]:
    """What the script reads."""
    (data,) = (one["data-chart"] for _, one in Page(chart).elements if "data-chart" in one)
    return dict(json.loads(str(data)))


def test_the_script_gets_the_values_and_the_reader_a_sentence() -> None:
    """Layers arrive in their order, in the unit of the usual sum; the sentence has the sum's median, and its longest with its time."""
    layers = [
        Quantity(label="a", values_ns=np.array([10e6, 20e6, 10e6]), colour=0),
        Quantity(label="b", values_ns=np.array([30e6, 60e6, 20e6]), colour=1),
    ]
    chart = stacked_chart("delays", np.array([0.0, 1.0, 2.0]), layers)
    assert given(chart) == {
        "unit": "ms",
        "stacked": True,
        "lines": [{"label": "a", "colour": "--c0", "mark": "area"}, {"label": "b", "colour": "--c1", "mark": "area"}],
        "columns": [[0.0, 1.0, 2.0], [10.0, 20.0, 10.0], [30.0, 60.0, 20.0]],
    }
    words = Page(chart).words.replace("\u202f", " ")
    assert "In sum: median 40.0 ms, 99 % below 79.2 ms, longest 80.0 ms after 1 s." in words
    assert "needs JavaScript" in words


def test_a_band_has_two_edges() -> None:
    """Dots come first, then the band's edges above and below zero; what was not measured is null, and no part of the sentence."""
    skew = Quantity(label="skew", values_ns=np.array([-7e3, np.nan, 9e3]), colour=5)
    chart = dots_chart(np.arange(3.0), skew, band_ns=np.array([2e3, 4e3, 2e3]))
    found = given(chart)
    assert [line["mark"] for line in found["lines"]] == ["dots", "edge", "edge"]
    assert (found["unit"], found["stacked"]) == ("µs", False)
    assert found["columns"][1:] == [[-7.0, None, 9.0], [2.0, 4.0, 2.0], [-2.0, -4.0, -2.0]]
    assert "Median 1.00 µs, between -7.00 µs and 9.00 µs." in Page(chart).words.replace("\u202f", " ")


def test_series_with_times_of_their_own_share_a_chart() -> None:
    """Where one has a value the other has none; each has its sentence, and one without any value is left out."""
    left = Quantity(label="left", values_ns=np.array([1e6, np.nan, 3e6]), colour=0)
    right = Quantity(label="right", values_ns=np.array([np.nan, 5e6, np.nan]), colour=1)
    chart = dots_chart(np.arange(3.0), left, right, replace(left, label="none", values_ns=np.full(3, np.nan)))
    assert given(chart)["columns"] == [[0.0, 1.0, 2.0], [1.0, None, 3.0], [None, 5.0, None]]
    words = Page(chart).words.replace("\u202f", " ")
    assert "left: median 2.00 ms, between 1.00 ms and 3.00 ms. right: median 5.00 ms" in words
    assert "none" not in words


def test_a_pause_is_a_gap() -> None:
    """Between pairs that are far apart stands a row of nothing, in the middle of the pause."""
    time_s = np.array([0.0, 1.0, 2.0, 102.0, 103.0])
    found = given(stacked_chart("delays", time_s, [Quantity(label="a", values_ns=np.full(5, 1e6), colour=0)]))
    assert found["columns"] == [[0.0, 1.0, 2.0, 52.0, 102.0, 103.0], [1.0, 1.0, 1.0, None, 1.0, 1.0]]


def test_extremes_survive_where_pairs_are_many() -> None:
    """Of very many pairs a bounded number is drawn, of dots every n-th; the least, the greatest and the pause are among them."""
    count = 20 * MOST_PAIRS
    values = np.full(count, 5e6)
    values[1234], values[4321] = 9e6, 1e6
    time_s = np.arange(float(count))
    time_s[count // 2 :] += 1000.0
    quantity = Quantity(label="a", values_ns=values, colour=0)
    for chart in (dots_chart(time_s, quantity), stacked_chart("a", time_s, [quantity])):
        times, column = given(chart)["columns"]
        assert MOST_PAIRS // 2 <= len(times) <= MOST_PAIRS + 3
        assert times == sorted(times)
        assert (column[times.index(1234.0)], column[times.index(4321.0)]) == (9.0, 1.0)
        assert column.count(None) == 1
    assert {20.0, 40.0, 60.0} <= set(given(dots_chart(time_s, quantity))["columns"][0])


def test_one_pair_has_a_sentence_and_none_says_so() -> None:
    """A single pair is no chart; without any value the page says that nothing was measured."""
    one = Quantity(label="a", values_ns=np.array([3e6]), colour=0)
    for chart in (stacked_chart("delays", np.zeros(1), [one]), dots_chart(np.zeros(1), one)):
        assert "data-chart" not in chart
        assert "edian 3.00" in chart
    none = Quantity(label="a", values_ns=np.full(4, np.nan), colour=0)
    for chart in (stacked_chart("delays", np.arange(4.0), [none]), dots_chart(np.arange(4.0), none)):
        assert Page(chart).words == "Not measured."
