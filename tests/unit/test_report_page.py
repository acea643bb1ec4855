"""The report page and its plots: numbers stand where the data say, nothing comes from outside, nothing is made up."""

import base64
import math
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DataError
from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes
from phone_host.report.page_frame import document
from phone_host.report.report_page import (
    DelaySeries,
    Figure,
    Headline,
    PageData,
    Picture,
    Table,
    delay_series,
    page,
)
from phone_host.svg.plot_parts import legend
from phone_host.svg.plot_scale import Linear, Log, duration_text, log_scale, span, ticks
from phone_host.svg.plots import (
    Budget,
    Part,
    Quantity,
    Strips,
    budgets,
    distributions,
    over_time,
    stacked_over_time,
)

VOID = {"meta", "img", "br", "path", "rect", "circle", "hr"}
PNG = cv2.imencode(".png", np.zeros((4, 4, 3), dtype=np.uint8))[1].tobytes()
JPEG = cv2.imencode(".jpg", np.zeros((4, 4, 3), dtype=np.uint8))[1].tobytes()


class Page(HTMLParser):
    """Collects elements and text; `open` is empty at the end when every element was closed."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.words = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Notes an element and that it is open."""
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Notes an element that closes itself."""
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        """Closes the innermost element, which must be this one."""
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Collects what is to be read."""
        if not self.open or self.open[-1] != "style":
            self.words += data


def svg(text: str) -> ET.Element:
    return ET.fromstring(text)


def titles(root: ET.Element) -> list[str]:
    return [element.text or "" for element in root.iter("title")]


def ledger(number: int, delays_ms: tuple[int, ...] = (1, 2, 3, 4, 5, 20), start_ms: int = 0) -> PairLedger:
    """A pair's ledger with the six delays given in ms."""
    marks = np.cumsum([start_ms, *delays_ms]) * 1_000_000
    exposed, grabbed, sent, received, queued, dequeued, done = (int(mark) for mark in marks)
    stages = StageTimes(
        decode=1_000_000, interpolate=0, rectify=2_000_000, match=10_000_000, reproject=3_000_000, write=4_000_000
    )
    board = BoardMarks(exposed_ns=exposed, grabbed_ns=grabbed, sent_ns=sent)
    return PairLedger(
        session="s",
        sequence=number,
        host_sequence=number,
        bytes=1,
        link="tcp",
        board=board,
        received_ns=received,
        paired_ns=received,
        queued_ns=queued,
        dequeued_ns=dequeued,
        done_ns=done,
        previous_done_ns=queued,
        stages=stages,
        time_skew_ns=-7000,
        offset_ns=0,
        uncertainty_ns=9000,
        host=HostMarks(exposed_ns=exposed + 7000, grabbed_ns=grabbed),
    )


def data(delays: DelaySeries, **changes: object) -> PageData:
    fields: dict[str, object] = {
        "title": "A run",
        "subtitle": "",
        "verdict": Headline.GOOD,
        "sentence": "All is well.",
        "figures": (Figure(label="Depth error", value="3.1", unit="mm"),),
        "pictures": (Picture("Left", JPEG), Picture("Disparity", PNG)),
        "delays": delays,
    }
    return PageData(**(fields | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize("pairs", [0, 1, 2, 50, 2000])
def test_page_is_whole_and_needs_nothing_from_outside(pairs: int) -> None:
    """For any number of pairs every element is closed, every reference is a data URI, and there is no script."""
    text = page(data(delay_series([ledger(k, start_ms=33 * k) for k in range(pairs)])))
    parsed = Page(text)
    assert not parsed.open
    assert not re.search(r"https?:|//[a-z]|url\(|@import", text.replace("data:image", ""))
    for tag, attributes in parsed.elements:
        assert tag not in {"script", "link", "iframe", "object"}
        for name in ("src", "href"):
            assert attributes.get(name, "data:") is None or str(attributes.get(name, "data:")).startswith("data:")


def test_page_of_no_pairs_says_so() -> None:
    """Without a pair the page shows no plot and says that there are no delays."""
    parsed = Page(page(data(delay_series([]), pictures=(), figures=())))
    assert "No pair was processed" in parsed.words
    assert not [tag for tag, _ in parsed.elements if tag in {"svg", "img"}]


def test_all_text_is_escaped() -> None:
    """Text with markup, from any field, stands on the page as it is and makes no element."""
    evil = '<img src=x onerror="boom()">&"\''
    text = page(
        data(
            delay_series([ledger(0)]),
            title=evil,
            subtitle=evil,
            sentence=evil,
            figures=(Figure(label=evil, value=evil, unit=evil, note=evil),),
            pictures=(Picture(evil, PNG),),
            tables=(Table(evil, (evil,), ((evil,),)),),
            notes=(evil,),
        )
    )
    parsed = Page(text)
    assert [attributes["src"] for tag, attributes in parsed.elements if tag == "img"] == [
        "data:image/png;base64," + base64.b64encode(PNG).decode()
    ]
    # title twice, subtitle, sentence, four of the figure, the caption, three of the table, the note.
    assert parsed.words.count(evil) == 13
    assert evil in Page(legend([(evil, 0)])).words
    quantity = Quantity(label=evil, values_ns=np.ones(3), colour=0, meaning=evil)
    for plot in (
        distributions([Strips(evil, (quantity,))], 400),
        stacked_over_time(np.arange(3.0), [quantity], 400),
        over_time(np.arange(3.0), quantity, 400),
        budgets([Budget(evil, (Part(evil, 1.0, 0),))], 400),
    ):
        assert svg(plot).find(".//img") is None


def test_pictures_are_the_bytes_given() -> None:
    """A picture's data URI holds its very bytes with their kind; what is neither PNG nor JPEG is refused by its name."""
    sources = [attributes["src"] for tag, attributes in Page(page(data(delay_series([])))).elements if tag == "img"]
    assert [str(source).split(";")[0] for source in sources] == ["data:image/jpeg", "data:image/png"]
    assert [base64.b64decode(str(source).split(",")[1]) for source in sources] == [JPEG, PNG]
    with pytest.raises(DataError, match="Left"):
        page(data(delay_series([]), pictures=(Picture("Left", b"BM..."),)))


def test_figures_tables_and_notes_are_on_the_page() -> None:
    """Every label, value, cell and note given is there; an empty table says `none`."""
    parsed = Page(
        page(
            data(
                delay_series([ledger(0)]),
                tables=(Table("Drops", ("reason", "frames"), (("too old", "17"),)), Table("Lost", ("reason",), ())),
                notes=("Open cloud.ply.",),
            )
        )
    )
    for words in ("Depth error", "3.1", "mm", "All is well.", "Drops", "too old", "17", "none", "Open cloud.ply."):
        assert words in parsed.words


def test_series_hold_what_the_ledgers_say() -> None:
    """Columns hold each ledger's delays in ns; the six add up to end-to-end; time counts from the first pair done."""
    series = delay_series([ledger(0), ledger(1, (2, 2, 3, 4, 5, 30), start_ms=40)])
    assert [quantity.label for quantity in series.delays] == [
        "capture",
        "outbox",
        "propagation",
        "pairing",
        "queuing",
        "processing",
    ]
    assert [quantity.values_ns[1] for quantity in series.delays] == [2e6, 2e6, 3e6, 4e6, 5e6, 30e6]
    assert np.array_equal(sum(quantity.values_ns for quantity in series.delays), series.end_to_end.values_ns)
    assert series.end_to_end.values_ns.tolist() == [35e6, 46e6]
    # Done at 35 ms and at 40 + 46 ms.
    assert series.time_s == pytest.approx([0.0, 0.051])
    assert [quantity.values_ns[0] for quantity in series.stages] == [1e6, 0.0, 2e6, 10e6, 3e6, 4e6]
    assert series.time_skew.values_ns[0] == -7000.0
    assert series.uncertainty.values_ns[0] == 9000.0


def test_means_of_the_delays_are_in_the_budget() -> None:
    """The page's first bar names each delay's mean and its share of the whole."""
    text = page(data(delay_series([ledger(0), ledger(1, (3, 2, 3, 4, 5, 40), start_ms=60)])))
    # Means 2, 2, 3, 4, 5, 30 ms: together 46 ms.
    shares = "capture: 2.00 ms, 4.3 %|outbox: 2.00 ms, 4.3 %|propagation: 3.00 ms, 6.5 %|pairing: 4.00 ms, 8.7 %"
    for share in (*shares.split("|"), "queuing: 5.00 ms, 10.9 %", "processing: 30.0 ms, 65.2 %"):
        assert share in text.replace("\u202f", " ")


@settings(deadline=None, max_examples=50)
@given(parts=st.lists(st.floats(1.0, 1e9), min_size=1, max_size=6), width=st.integers(300, 1200))
def test_budget_bars_have_the_lengths_of_their_parts(parts: list[float], width: int) -> None:
    """The parts of the longest bar fill the width, side by side, each as long as its share."""
    row = Budget("all", tuple(Part(f"p{index}", value, index) for index, value in enumerate(parts)))
    bars = svg(budgets([row], width)).findall("rect")
    edge = 0.0
    for bar, value in zip(bars, parts, strict=True):
        assert float(bar.get("x", "nan")) == pytest.approx(edge, abs=0.11)
        assert float(bar.get("width", "nan")) == pytest.approx(width * value / math.fsum(parts), abs=0.11)
        edge += width * value / math.fsum(parts)


def test_several_budgets_share_one_axis() -> None:
    """A bar of half the sum is half as long."""
    bars = svg(budgets([Budget("a", (Part("x", 10.0, 0),)), Budget("b", (Part("x", 5.0, 0),))], 400)).findall("rect")
    assert [float(bar.get("width", "nan")) for bar in bars] == [400.0, 200.0]


def test_stacked_columns_reach_their_sums() -> None:
    """Each layer starts where the one below ends, and heights are proportional to values."""
    layers = [
        Quantity(label="a", values_ns=np.array([10e6, 20e6]), colour=0),
        Quantity(label="b", values_ns=np.array([30e6, 20e6]), colour=1),
    ]
    root = svg(stacked_over_time(np.array([0.0, 1.0]), layers, 500, 260))
    lower, upper = (
        [float(v) for v in re.findall(r"V([\d.]+)", path.get("d", ""))] for path in root.findall("path[@style]")
    )
    # (top, bottom) of both columns: totals of 40 ms reach the top of the frame at y = 24, zero is at y = 260 - 34 = 226.
    height = 226.0 - 24.0
    assert lower == pytest.approx([226 - height / 4, 226.0, 226 - height / 2, 226.0], abs=0.06)
    assert upper == pytest.approx([24.0, 226 - height / 4, 24.0, 226 - height / 2], abs=0.06)
    assert titles(root)[0].replace("\u202f", " ") == "pair 1: 40.0 ms\na 10.0 ms\nb 30.0 ms"


def test_many_pairs_become_means_that_still_add_up() -> None:
    """Beyond one pair for three pixels, columns are means over slices of time, weighted they give the mean of all."""
    count = 5000
    values = np.random.default_rng(1).uniform(1e6, 9e6, count)
    root = svg(stacked_over_time(np.arange(count) / 30.0, [Quantity(label="a", values_ns=values, colour=0)], 500))
    names = titles(root)
    assert 100 <= len(names) <= 146
    total, pairs = 0.0, 0
    for name in names:
        found = re.match(r"mean of pairs (\d+) to (\d+): ([\d.]+)", name)
        assert found is not None
        size = int(found[2]) - int(found[1]) + 1
        total, pairs = total + size * float(found[3]), pairs + size
    assert pairs == count
    assert total / pairs == pytest.approx(values.mean() / 1e6, rel=0.002)


def test_a_gap_in_time_stays_a_gap() -> None:
    """A pause in the stream shows as empty room, not as a column stretched over it."""
    time_s = np.concatenate([np.arange(10.0), 100.0 + np.arange(10.0)])
    root = svg(stacked_over_time(time_s, [Quantity(label="a", values_ns=np.ones(20), colour=0)], 500))
    widths = [float(hit.get("width", "nan")) for hit in root.findall("rect")]
    # 438 px for 110 s: every column is one second wide.
    assert max(widths) == pytest.approx(438.0 / 110.0, abs=0.1)


def test_an_outlier_is_cut_off_and_marked() -> None:
    """One pair a hundred times slower than the rest does not flatten them: it is marked with its own value."""
    values = np.full(100, 10e6)
    values[50] = 1000e6
    root = svg(stacked_over_time(np.arange(100.0), [Quantity(label="a", values_ns=values, colour=0)], 500))
    late = root.findall("path[@class='late']")
    assert [title.text for mark in late for title in mark.iter("title")] == ["1.00\u202fs"]
    tops = [float(v) for v in re.findall(r"V([\d.]+)H", root.findall("path[@style]")[0].get("d", ""))]
    # The usual columns still fill 1 / 1.25 of the frame of 202 px.
    assert tops[0] == pytest.approx(226.0 - 202.0 / 1.25, abs=0.1)


def test_strips_show_the_percentiles() -> None:
    """Bar, median line and numbers stand at the percentiles of the data on the logarithmic axis."""
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
    """Only NaN gives `not measured` or an empty plot; NaN among numbers is left out."""
    nothing = Quantity(label="offset", values_ns=np.full(5, np.nan), colour=0)
    assert "not measured" in distributions([Strips("", (nothing,))], 400)
    assert "no pairs" in over_time(np.arange(5.0), nothing, 400)
    assert "no pairs" in stacked_over_time(np.zeros(0), [Quantity(label="a", values_ns=np.zeros(0), colour=0)], 400)
    assert "nothing measured" in budgets([], 400)
    some = Quantity(label="offset", values_ns=np.array([1.0, np.nan, 3.0]), colour=0)
    assert len(svg(over_time(np.arange(3.0), some, 400)).findall("circle")) == 2


def test_signed_values_stand_on_both_sides_of_zero() -> None:
    """Equal skews of either sign stand equally far from the zero line, and later pairs further right."""
    skew = Quantity(label="time skew", values_ns=np.array([-2e5, 2e5, 0.0]), colour=5)
    root = svg(over_time(np.array([0.0, 1.0, 2.0]), skew, 400, band_ns=np.full(3, 5e4)))
    x, y = zip(
        *((float(dot.get("cx", "nan")), float(dot.get("cy", "nan"))) for dot in root.findall("circle")), strict=True
    )
    assert list(x) == sorted(x)
    assert y[0] - y[2] == pytest.approx(y[2] - y[1], abs=0.15)
    assert root.find("path[@class='band']") is not None


def test_extremes_survive_thinning() -> None:
    """With more pairs than can be told apart, the least and the greatest value are still drawn."""
    values = np.zeros(10_000)
    values[1234], values[4321] = 5e6, -7e6
    drawn = " ".join(titles(svg(over_time(np.arange(10_000.0), Quantity(label="a", values_ns=values, colour=0), 340))))
    assert "5.00\u202fms" in drawn
    assert "-7.00\u202fms" in drawn


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
    """A duration reads with three significant digits in the fitting unit."""
    assert duration_text(ns).replace("\u202f", " ") == text


@settings(deadline=None, max_examples=200)
@given(low=st.floats(-1e9, 1e9), width=st.floats(1e-3, 1e9), count=st.integers(2, 12))
def test_ticks_are_round_and_inside(low: float, width: float, count: int) -> None:
    """Ticks lie in the interval, are evenly spaced by 1, 2 or 5 times a power of ten, and are neither many nor missing."""
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
    """Scales map their ends to their ends, keep values in between, and clamp what lies outside."""
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


def test_document_knows_phones_and_darkness() -> None:
    """Every page sets its width to the screen's and has colours for the dark."""
    text = document("t", "<p>x</p>")
    assert 'name="viewport"' in text
    assert "prefers-color-scheme:dark" in text
