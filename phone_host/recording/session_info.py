"""What is in a recording, in figures: images, rates, gaps and how far the two cameras' exposures lie apart. Pure."""

import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from common.recording.layout import side_of
from common.recording.recorded import Recorded, Shown, period_ns
from common.recording.stamps import nearest

_GAP: Final = 1.5
"""A time between two images that is this many periods long has room for one that is missing."""


@dataclass(frozen=True, slots=True)
class Gap:
    """A time without images.

    Attributes:
        at_s: when it began, s after the recording's first image.
        seconds: how long it lasted, s.
        missing: for how many images there was room.
    """

    at_s: float
    seconds: float
    missing: int


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamInfo:
    """The images of one camera.

    Attributes:
        topic: of the images.
        side: left or right; empty: not told.
        camera: its name.
        size_px: width and height, px.
        images: how many.
        image_bytes: bytes of all images.
        from_s: first exposure, s after the recording's first one.
        to_s: last exposure.
        rate_hz: images per second: of the median time between two; 0: fewer than two images.
        gaps: longer times, the longest first.
        transit_ms: median time from exposure until it was received, ms.
    """

    topic: str
    side: str
    camera: str
    size_px: tuple[int, int]
    images: int
    image_bytes: int
    from_s: float
    to_s: float
    rate_hz: float
    gaps: tuple[Gap, ...]
    transit_ms: float


@dataclass(frozen=True, slots=True)
class Skew:
    """How far the exposures of the left images lie behind those of the nearest right ones, ms: median and the 5 % farthest."""

    median_ms: float
    far_ms: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionInfo:
    """What is in a recording.

    Attributes:
        is_complete: whether it was ended in order.
        is_ours: whether this program wrote it.
        size_bytes: of the file.
        seconds: from the first exposure to the last.
        begun_unix_s: the first exposure, s since 1970.
        streams: the cameras.
        skew: of the two; None: there are not two.
        messages: how many of each topic.
        unused: why a topic is not used, by topic.
        remarks: what is used instead of times that cannot be true, in words.
        attachments: names and sizes of the files in it.
        damages: where something is missing, in words.
    """

    is_complete: bool
    is_ours: bool
    size_bytes: int
    seconds: float
    begun_unix_s: float
    streams: tuple[StreamInfo, ...]
    skew: Skew | None
    messages: tuple[tuple[str, int], ...]
    unused: Mapping[str, str]
    remarks: tuple[str, ...]
    attachments: tuple[tuple[str, int], ...]
    damages: tuple[str, ...]


def session_info(recorded: Recorded) -> SessionInfo:
    """Sum up a recording.

    Raises:
        SpoiledImageError: the first image of a stream is none.
    """
    every = [shown.image.stamp_ns for stream in recorded.images.values() for shown in stream]
    first_ns, last_ns = min(every), max(every)
    return SessionInfo(
        is_complete=recorded.is_complete,
        is_ours=recorded.is_ours,
        size_bytes=recorded.size_bytes,
        seconds=(last_ns - first_ns) / 1e9,
        begun_unix_s=first_ns / 1e9,
        streams=tuple(_stream(recorded, topic, first_ns) for topic in sorted(recorded.images)),
        skew=_skew(recorded),
        messages=tuple(sorted(recorded.kinds.items())),
        unused={topic: each.reason for topic, each in sorted(recorded.unused.items())},
        remarks=tuple(recorded.remarks),
        attachments=tuple((name, len(data)) for name, data in recorded.attachments.items()),
        damages=tuple(one.text for one in recorded.damages),
    )


def skews_ms(recorded: Recorded) -> list[tuple[float, float]]:
    """Return for each left image when it was exposed, s after the first, and how much later than the nearest right one, ms.

    Those from before or after the right camera's time are left out: they have no neighbour.
    """
    streams = [recorded.images.get(recorded.topic_of(side), []) for side in ("left", "right")]
    if not all(streams):
        return []
    left, right = ([shown.image.stamp_ns for shown in stream] for stream in streams)
    right.sort()
    zero_ns, margin_ns = min(*left, right[0]), period_ns(streams[1]) // 2
    common = [at_ns for at_ns in left if right[0] - margin_ns <= at_ns <= right[-1] + margin_ns]
    return [((at_ns - zero_ns) / 1e9, (at_ns - right[nearest(right, at_ns)]) / 1e6) for at_ns in common]


def _skew(recorded: Recorded) -> Skew | None:
    apart = [ms for _, ms in skews_ms(recorded)]
    if not apart:
        return None
    return Skew(statistics.median(apart), sorted(abs(ms) for ms in apart)[(len(apart) * 95) // 100])


def _stream(recorded: Recorded, topic: str, first_ns: int) -> StreamInfo:
    shown, camera = recorded.images[topic], recorded.camera(topic)
    period = period_ns(shown)
    transits = [(one.log_ns - one.image.stamp_ns) / 1e6 for one in shown]
    return StreamInfo(
        topic=topic,
        side=side_of(topic),
        camera=camera.name,
        size_px=(camera.width_px, camera.height_px),
        images=len(shown),
        image_bytes=sum(len(one.image.content) for one in shown),
        from_s=(shown[0].image.stamp_ns - first_ns) / 1e9,
        to_s=(shown[-1].image.stamp_ns - first_ns) / 1e9,
        rate_hz=1e9 / period if len(shown) > 1 else 0.0,
        gaps=_gaps(shown, period, first_ns),
        transit_ms=statistics.median(transits),
    )


def _gaps(shown: list[Shown], period: int, first_ns: int) -> tuple[Gap, ...]:
    found = []
    for before, after in pairwise(shown):
        between_ns = after.image.stamp_ns - before.image.stamp_ns
        if between_ns > _GAP * period:
            missing = round(between_ns / period) - 1
            found.append(Gap((before.image.stamp_ns - first_ns) / 1e9, between_ns / 1e9, missing))
    return tuple(sorted(found, key=lambda gap: -gap.seconds))
