"""The report page: it shows everything that it was given, loads nothing from outside, and invents nothing."""

import base64
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import cv2
import numpy as np
import pytest

from common.errors import DataError
from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes
from phone_host.report.chart_view import dots_chart, stacked_chart
from phone_host.report.page_frame import document
from phone_host.report.page_script import Script, script
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
from phone_host.svg.plots import (
    Budget,
    Quantity,
    Share,
    Strips,
    budgets,
    distributions,
)
from tests.support.html import Page
from tests.support.samples import LEDGER

PNG = cv2.imencode(".png", np.zeros((4, 4, 3), dtype=np.uint8))[1].tobytes()
JPEG = cv2.imencode(".jpg", np.zeros((4, 4, 3), dtype=np.uint8))[1].tobytes()


def ledger(number: int, delays_ms: tuple[int, ...] = (1, 2, 3, 4, 5, 20), start_ms: int = 0) -> PairLedger:
    """A pair's ledger with the six delays given in ms."""
    marks = np.cumsum([start_ms, *delays_ms]) * 1_000_000
    exposed, grabbed, sent, received, queued, dequeued, done = (int(mark) for mark in marks)
    stages = StageTimes(
        decode=1_000_000, interpolate=0, rectify=2_000_000, match=10_000_000, reproject=3_000_000, write=4_000_000
    )
    board = BoardMarks(exposed_ns=exposed, grabbed_ns=grabbed, sent_ns=sent)
    return replace(
        LEDGER,
        sequence=number,
        host_sequence=number,
        board=board,
        received_ns=received,
        paired_ns=received,
        queued_ns=queued,
        dequeued_ns=dequeued,
        done_ns=done,
        previous_done_ns=queued,
        stages=stages,
        time_skew_ns=-7000,
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
    """For any number of pairs every element is closed, every reference is a data URI, and the only script is ours, where there are charts."""
    text = page(data(delay_series([ledger(k, start_ms=33 * k) for k in range(pairs)])))
    parsed = Page(text)
    assert not parsed.open
    drawing = script(Script.CHARTS) if pairs > 1 else ""
    assert parsed.script == drawing
    assert not re.search(r"https?:|//[a-z]|url\(|@import", text.replace(drawing, "").replace("data:image", ""))
    for tag, attributes in parsed.elements:
        assert tag not in {"link", "iframe", "object"}
        for name in ("src", "href"):
            assert attributes.get(name, "data:") is None or str(attributes.get(name, "data:")).startswith("data:")


def test_without_scripts_the_page_says_where_the_values_are() -> None:
    """The charts need JavaScript; the file beside the page does not."""
    assert "<noscript><p>delays.jsonl has all values.</p></noscript>" in page(
        data(delay_series([ledger(1), ledger(2)]))
    )


def test_page_of_no_pairs_says_so() -> None:
    """Without a pair the page shows no plot and says that there are no delays."""
    parsed = Page(page(data(delay_series([]), pictures=(), figures=())))
    assert "No pair was processed" in parsed.words
    assert not [tag for tag, _ in parsed.elements if tag in {"svg", "img"}]


def test_all_text_is_escaped() -> None:
    """Text with markup, in any field, is shown literally and makes no element."""
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
    # title twice, subtitle, sentence, four of the figure, the caption, three of the table, the note
    assert parsed.words.count(evil) == 13
    assert evil in Page(legend([(evil, 0)])).words
    quantity = Quantity(label=evil, values_ns=np.ones(3), colour=0, meaning=evil)
    for plot in (
        distributions([Strips(evil, (quantity,))], 400),
        budgets([Budget(evil, (Share(evil, 1.0, 0),))], 400),
    ):
        assert ET.fromstring(plot).find(".//img") is None
    for chart in (stacked_chart(evil, np.arange(3.0), [quantity]), dots_chart(np.arange(3.0), quantity)):
        assert {tag for tag, _ in Page(chart).elements} == {"figure", "div", "p", "figcaption"}


def test_pictures_are_the_bytes_given() -> None:
    """A picture's data URI holds its exact bytes with their type; a file that is neither PNG nor JPEG is refused by name."""
    sources = [attributes["src"] for tag, attributes in Page(page(data(delay_series([])))).elements if tag == "img"]
    assert [str(source).split(";")[0] for source in sources] == ["data:image/jpeg", "data:image/png"]
    assert [base64.b64decode(str(source).split(",")[1]) for source in sources] == [JPEG, PNG]
    with pytest.raises(DataError, match="Left"):
        page(data(delay_series([]), pictures=(Picture("Left", b"BM..."),)))


def test_figures_tables_and_notes_are_on_the_page() -> None:
    """Every given label, value, cell and note is shown; an empty table is left out, its title, too."""
    parsed = Page(
        page(
            data(
                delay_series([ledger(0)]),
                tables=(Table("Drops", ("reason", "frames"), (("too old", "17"),)), Table("Lost", ("reason",), ())),
                notes=("Open cloud.ply.",),
            )
        )
    )
    for words in ("Depth error", "3.1", "mm", "All is well.", "Drops", "too old", "17", "Open cloud.ply."):
        assert words in parsed.words
    assert "Lost" not in parsed.words


def test_series_hold_what_the_ledgers_say() -> None:
    """Columns hold each ledger's delays in ns; the six add up to end-to-end; time starts when the first pair was done."""
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
    """The page's first bar gives each delay's mean and its share of the whole."""
    text = page(data(delay_series([ledger(0), ledger(1, (3, 2, 3, 4, 5, 40), start_ms=60)])))
    # Means 2, 2, 3, 4, 5, 30 ms: together 46 ms.
    shares = "capture: 2.00 ms, 4.3 %|outbox: 2.00 ms, 4.3 %|propagation: 3.00 ms, 6.5 %|pairing: 4.00 ms, 8.7 %"
    for share in (*shares.split("|"), "queuing: 5.00 ms, 10.9 %", "processing: 30.0 ms, 65.2 %"):
        assert share in text.replace("\u202f", " ")


def test_document_knows_phones_and_darkness() -> None:
    """Every page adapts its width to the screen, and has colours for dark mode."""
    text = document("t", "<p>x</p>")
    assert 'name="viewport"' in text
    assert "prefers-color-scheme:dark" in text
