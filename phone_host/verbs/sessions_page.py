"""The page of `sessions info`: what is in a recording, and two plots over time."""

from html import escape
from itertools import pairwise

import numpy as np

from common.recording.recorded import Recorded
from common.words import counted
from phone_host.recording.session_info import SessionInfo, skews_ms
from phone_host.report.page_frame import document, section, table, two_widths
from phone_host.svg.plot_parts import legend
from phone_host.svg.plot_times import Durations, over_time

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
        one = Durations("left behind right", 0, at_s, values * 1e6)
        plot = two_widths(lambda px: over_time([one], "time skew over time", px))
        parts.append(section("Time skew", "Exposure of each left image minus that of the nearest right one.", plot))
    held = [[topic, str(count)] for topic, count in info.messages]
    held += [[name, counted(size, "byte")] for name, size in info.attachments]
    parts.append(section("Contents", "", table(["topic or file", "messages or size"], held)))
    return document(f"{name}: recording", "".join(parts))


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
    series = []
    zero_ns = min(shown[0].image.stamp_ns for shown in recorded.images.values())
    for number, (topic, shown) in enumerate(sorted(recorded.images.items())):
        stamps = [one.image.stamp_ns for one in shown]
        at_s = np.array([(stamp - zero_ns) / 1e9 for stamp in stamps[1:]], np.float64)
        between = np.array([after - before for before, after in pairwise(stamps)], np.float64)
        series.append(Durations(topic, number, at_s, between))
    plot = two_widths(lambda px: over_time(series, "time between two images", px))
    return legend([(one.label, one.colour) for one in series]) + plot


def _gaps(info: SessionInfo) -> list[list[str]]:
    every = [(gap, one.topic) for one in info.streams for gap in one.gaps]
    longest = sorted(every, key=lambda item: -item[0].seconds)[:_LONGEST]
    return [[topic, f"{gap.at_s:.2f}", f"{gap.seconds:.3f}", str(gap.missing)] for gap, topic in longest]
