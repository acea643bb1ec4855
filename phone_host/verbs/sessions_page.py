"""The page of `sessions info`: what is in a recording, and two plots over time."""

from html import escape
from itertools import pairwise

import numpy as np

from common.recording.recorded import Recorded
from common.words import counted
from phone_host.recording.session_info import SessionInfo, skews_ms
from phone_host.report.chart_view import dots_chart
from phone_host.report.page_frame import document, section, table
from phone_host.report.page_script import Script
from phone_host.svg.plot_parts import COLOURS
from phone_host.svg.plots import Quantity

_LONGEST = 20


def info_page(name: str, recorded: Recorded, info: SessionInfo) -> str:
    """Make the page.

    Args:
        name: of the file.
        recorded: what is in it.
        info: the same in figures.
    """
    state = "ended in order" if info.is_complete else "broken off"
    head = f'<h1>{escape(name)}</h1><p class="sub">{info.seconds:.1f} s, {info.size_bytes / 1e6:.1f} MB, {state}</p>'
    parts = [head, section("Cameras", "", _streams(info))]
    if info.damages:
        parts.append(
            section(
                "What is missing", "Everything else can be used.", table(["where"], [[one] for one in info.damages])
            )
        )
    parts.append(
        section(
            "Time between two images", "A gap is a time with room for an image that is missing.", _between(recorded)
        )
    )
    if gaps := _gaps(info):
        parts.append(section("Longest gaps", "", table(["topic", "at, s", "lasted, s", "images missing"], gaps)))
    if skews := skews_ms(recorded):
        at_s, values = (np.array(column, np.float64) for column in zip(*skews, strict=True))
        plot = dots_chart(at_s, Quantity(label="left behind right", values_ns=values * 1e6, colour=0))
        parts.append(section("Time skew", "Exposure of each left image minus that of the nearest right one.", plot))
    held = [[topic, str(count)] for topic, count in info.messages]
    held += [[name, counted(size, "byte")] for name, size in info.attachments]
    parts.append(section("Contents", "", table(["topic or file", "messages or size"], held)))
    return document(f"{name}: recording", "".join(parts), Script.CHARTS)


def _streams(info: SessionInfo) -> str:
    rows = [
        [
            one.topic,
            one.camera,
            f"{one.size_px[0]}x{one.size_px[1]}",
            str(one.images),
            f"{one.rate_hz:.2f}",
            f"{one.image_bytes / max(1, one.images) / 1000:.1f}",
            str(sum(gap.missing for gap in one.gaps)),
        ]
        for one in info.streams
    ]
    return table(["topic", "camera", "px", "images", "per second", "kB each", "missing"], rows)


def _between(recorded: Recorded) -> str:
    zero_ns = min(shown[0].image.stamp_ns for shown in recorded.images.values())
    topics = sorted(recorded.images)
    stamps = ([one.image.stamp_ns for one in recorded.images[topic]] for topic in topics)
    spans = [(end, end - start, number) for number, each in enumerate(stamps) for start, end in pairwise(each)]
    ends_ns, between_ns, numbers = np.array(sorted(spans), np.int64).reshape(-1, 3).T
    return dots_chart(
        (ends_ns - zero_ns) / 1e9,
        *(
            Quantity(label=topic, values_ns=np.where(numbers == number, between_ns, np.nan), colour=number % COLOURS)
            for number, topic in enumerate(topics)
        ),
    )


def _gaps(info: SessionInfo) -> list[list[str]]:
    every = [(gap, one.topic) for one in info.streams for gap in one.gaps]
    longest = sorted(every, key=lambda item: -item[0].seconds)[:_LONGEST]
    return [[topic, f"{gap.at_s:.2f}", f"{gap.seconds:.3f}", str(gap.missing)] for gap, topic in longest]
