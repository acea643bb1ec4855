"""The delay benchmark's own plots: everything is drawn where the numbers put it."""

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from common.ledger import BoardMarks, StageTimes
from phone_host.bench.delay_fit import fit_delay
from phone_host.svg.plot_delays import Compared, Life, Scatter, against_bytes, compared, lives
from phone_host.svg.plot_parts import point_legend
from tests.support.samples import LEDGER

MS = 1_000_000


def svg(text: str) -> ET.Element:
    return ET.fromstring(text)


def numbers(path: str) -> list[float]:
    return [float(part) for part in path.replace("M", " ").replace("L", " ").split()]


def test_dots_and_line_stand_at_their_bytes_and_delays() -> None:
    """For frames on a line every dot lies on the drawn line, and at zero bytes the line is at the latency."""
    size = np.linspace(10_000.0, 50_000.0, 30)
    scatter = Scatter(
        size_bytes=size,
        delay_ns=2 * MS + 100.0 * size,
        number=(1,) * 30,
        fit=fit_delay(size, 2 * MS + 100.0 * size, draws=0),
    )
    root = svg(against_bytes(scatter, 500))
    line = root.find("path[@class='mark fit']")
    assert line is not None
    x0, y0, x1, y1 = numbers(line.get("d", ""))
    dots = [(float(dot.get("cx", "nan")), float(dot.get("cy", "nan"))) for dot in root.findall("circle")]
    assert len(dots) == 30
    for x, y in dots:
        assert y == pytest.approx(y0 + (x - x0) / (x1 - x0) * (y1 - y0), abs=0.3)
    assert dots == sorted(dots, key=lambda dot: dot[0])
    # The axis of the delays is at 52 px.
    assert x0 == 52.0


def test_a_frame_held_up_for_long_is_marked_at_the_top() -> None:
    """One delay a thousand times the others does not flatten them: it becomes a triangle with its value, and the others keep their space."""
    size = np.linspace(10_000.0, 50_000.0, 100)
    delay = 1 * MS + 100.0 * size
    delay[50] = 5000.0 * MS
    root = svg(
        against_bytes(
            Scatter(size_bytes=size, delay_ns=delay, number=(0,) * 100, fit=fit_delay(size, delay, draws=0)), 500
        )
    )
    assert len(root.findall("circle")) == 99
    titles = [title.text or "" for path in root.findall("path") for title in path.iter("title")]
    assert [text for text in titles if "5.00\u202fs" in text] == titles
    assert len(titles) == 1
    heights = [float(dot.get("cy", "nan")) for dot in root.findall("circle")]
    assert max(heights) - min(heights) > 40


def test_frames_of_one_size_have_no_line() -> None:
    """With fewer than two sizes there are dots and no line."""
    size, delay = np.full(9, 30_000.0), np.arange(9.0) * MS
    root = svg(
        against_bytes(Scatter(size_bytes=size, delay_ns=delay, number=(0,) * 9, fit=fit_delay(size, delay)), 400)
    )
    assert root.find("path[@class='mark fit']") is None
    assert root.findall("circle")


def test_a_pairs_bars_are_as_long_as_its_delays() -> None:
    """Delays of 10, 20, 40, 10, 20 and 100 ms are bars of these lengths on one scale; each begins where the one before ends."""
    board = BoardMarks(exposed_ns=0, grabbed_ns=10 * MS, sent_ns=30 * MS)
    ledger = replace(
        LEDGER,
        board=board,
        received_ns=70 * MS,
        paired_ns=80 * MS,
        queued_ns=80 * MS,
        dequeued_ns=100 * MS,
        done_ns=200 * MS,
        stages=StageTimes(match=90 * MS, write=10 * MS),
    )
    root = svg(lives([Life("tcp, typical", ledger)], 500))
    bars = {
        (title.text or "").partition(":")[0]: (float(bar.get("x", "nan")), float(bar.get("width", "nan")))
        for bar in root.findall("rect")
        for title in bar.iter("title")
    }
    # 438 px for 1.02 x 200 ms.
    scale = 438.0 / 204.0
    at = 52.0
    for name, length_ms in (
        ("capture", 10),
        ("outbox", 20),
        ("propagation", 40),
        ("pairing", 10),
        ("queuing", 20),
        ("processing", 100),
    ):
        assert bars[name][0] == pytest.approx(at, abs=0.1)
        assert bars[name][1] == pytest.approx(max(2.0, length_ms * scale), abs=0.1)
        at += length_ms * scale
    assert bars["match"][1] == pytest.approx(90 * scale, abs=0.1)
    assert bars["write"][0] + bars["write"][1] == pytest.approx(at, abs=0.2)
    assert "200\u202fms" in [text.text for text in root.iter("text")]


def test_no_pairs_are_said() -> None:
    """Without pairs there is a picture that says so."""
    assert "no pairs" in lives([], 300)


def test_what_is_foretold_rightly_stands_on_the_line() -> None:
    """Equal figures lie on the diagonal. A prediction that is too long lies above it, one that is too short below."""
    points = [
        Compared(name="a", measured_ns=1e7, predicted_ns=1e7, number=0),
        Compared(name="b", measured_ns=1e8, predicted_ns=2e8, number=1),
        Compared(name="c", measured_ns=1e9, predicted_ns=4e8, number=2),
    ]
    root = svg(compared(points, 500, 300))
    diagonal = root.findall("path[@class='axis']")[-1]
    x0, y0, x1, y1 = numbers(diagonal.get("d", ""))
    off = []
    for dot in root.findall("circle"):
        x, y = float(dot.get("cx", "nan")), float(dot.get("cy", "nan"))
        off.append(y0 + (x - x0) / (x1 - x0) * (y1 - y0) - y)
    assert abs(off[0]) < 0.2
    # A factor of two is log(2) / log(span) of the height.
    span = math.log(1.25 * 1e9 / (0.8 * 1e7))
    assert off[1] == pytest.approx(math.log(2.0) / span * (y0 - y1), abs=0.3)
    assert off[2] == pytest.approx(math.log(0.4) / span * (y0 - y1), abs=0.3)


def test_things_by_the_dozen_have_marks_of_their_own() -> None:
    """No two of 32 interfaces are drawn alike, and the legend shows each one's mark as in the plot."""
    points = [
        Compared(name=f"interface {number}", measured_ns=1e7 * (number + 1), predicted_ns=1e8, number=number)
        for number in range(32)
    ]
    drawn: dict[str, tuple[str, ...]] = {}
    for mark in svg(compared(points, 500)).iter():
        for title in mark.findall("title"):
            shape = re.sub(r"M[\d.]+ [\d.]+", "", mark.get("d", "")), mark.get("style", ""), mark.tag
            drawn[(title.text or "").partition(":")[0]] = shape
    assert len(drawn) == 32
    assert len(set(drawn.values())) == 32
    shown = svg(point_legend([(point.name, point.number) for point in points])).findall("li/svg/*")
    assert [mark.tag for mark in shown] == [shape[-1] for shape in drawn.values()]
    assert len({(re.sub(r"M[\d.]+ [\d.]+", "", mark.get("d", "")), mark.get("style")) for mark in shown}) == 32
