"""The delay benchmark's page and figure: whole, self-contained, and the result first."""

import dataclasses
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

from phone_host.bench.cases import (
    Case,
    Interface,
    Size,
)
from phone_host.bench.page import figure, page
from phone_host.bench.tables import (
    result_sentence,
)
from tests.support.bench_results import UNDER, analysed, result, slower


def test_a_run_of_few_pairs_is_doubted_and_says_how_long_to_run() -> None:
    """16 pairs at 30.3 per second: 10 s are enough for 50; the page then has no green tick. 50 pairs are enough."""
    short = dataclasses.replace(result(), ledgers=result().ledgers[:16], measured_s=0.528)
    sentence = result_sentence([result(link="ipc"), short])
    assert "from only 16 pairs: run it longer (--seconds 10)" in sentence
    text = page([short], UNDER, analysed(short))
    assert 'class="verdict warning"' in text
    assert 'class="verdict good"' in page([result()], UNDER, analysed(result()))
    assert "run it longer" not in result_sentence([dataclasses.replace(result(), ledgers=result().ledgers[:50])])


def test_the_page_begins_with_the_result_and_ends_with_the_fits() -> None:
    """Sentence, stacked bars, then how it was measured, the model and the fits; what was not measured has no card."""
    results = [result(), slower("ipc", 2.0)]
    text = page(results, UNDER, analysed(*results))
    places = [
        text.index(words)
        for words in (
            "is the fastest link",
            "shares of the delays",
            "How this was measured",
            "The interfaces",
            "Delay against bytes",
        )
    ]
    assert places == sorted(places)
    assert "The model beside" not in page(results[:1], UNDER, analysed(*results[:1]))


def test_page_is_whole_html_and_refers_to_nothing_outside() -> None:
    """All elements are closed, each link has its plots, and nothing is loaded from elsewhere."""

    class Checker(HTMLParser):
        open_tags: list[str]
        plots = 0

        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            assert not [value for name, value in attrs if name in {"src", "href"} and value and "://" in value]
            self.plots += tag == "svg" and ("class", "plot") in attrs
            if tag not in {"meta", "br", "path", "line", "rect", "circle", "polygon"}:
                self.open_tags.append(tag)

        def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            pass

        def handle_endtag(self, tag: str) -> None:
            if tag in self.open_tags:
                while self.open_tags.pop() != tag:
                    pass

    checker = Checker()
    checker.open_tags = []
    small = dataclasses.replace(
        result(), case=Case(interface=Interface("tcp"), size=Size(320, 240), quality_percent=80, rate_hz=15)
    )
    results = [result(), result(link="ipc"), small]
    text = page(results, UNDER, analysed(*results))
    checker.feed(text)
    assert checker.open_tags == []
    assert not re.search(r"<script|<link|<iframe|<object|@import|url\(|<image", text)
    # Each in two widths: four for both kinds of images, one for both interfaces, one for the model.
    assert checker.plots == 2 * (4 * 2 + 2 + 1)
    assert "rfcomm was not run: no radio" in text
    assert "640x480 JPEG 80 at 30" in text
    assert "320x240 JPEG 80 at 15" in text


def test_figure_is_an_svg_file_of_its_own() -> None:
    """The picture for a README parses as XML, names every interface and delay, carries its colours and refers to nothing outside."""
    text = figure([result(), result(link="ipc")], UNDER)
    root = ET.fromstring(text)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    words = {element.text for element in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"tcp", "ipc", "capture", "processing"} <= words
    assert "prefers-color-scheme:dark" in text
    assert "href" not in text
