"""Settings that are to be predicted."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import SettingsError
from phone_host.bench.changes import parse_changes
from phone_host.bench.prediction import Images, Target
from phone_host.bench.queue_model import LinkModel
from phone_host.sync.fifo import FifoSettings, Overflow

LINK = LinkModel(latency_ns=1e6, ns_per_byte=10.0, spread_ns=np.zeros(1), self_paced=False)
TARGET = Target(
    "tcp",
    LINK,
    Images(width_px=640, height_px=480, period_ns=1e9 / 30, size_bytes=np.array([30_000.0, 50_000.0])),
    FifoSettings(),
)


def test_each_change_changes_what_it_names() -> None:
    """Rate, size, bytes, queue, processing and link are as asked for; a change of size alone scales the bytes with the pixels."""
    (change,) = parse_changes(["fps=60, size=320x240, fifo=4:block, processing=0.5, link=bluetooth"])
    made = change.applied(TARGET)
    assert made.images.period_ns == pytest.approx(1e9 / 60)
    assert (made.images.width_px, made.images.height_px) == (320, 240)
    assert made.images.size_bytes.tolist() == [7_500.0, 12_500.0]
    assert made.fifo == FifoSettings(4, Overflow.BLOCK)
    assert made.processing_factor == 0.5
    # 80 kB/s.
    assert made.link.ns_per_byte == pytest.approx(12_500.0)
    assert made.link.self_paced


def test_bytes_that_are_named_are_the_mean() -> None:
    """`kB=20` halves frames of 40 kB on average, whatever size is asked for with it."""
    for text in ("kB=20", "size=320x240,kB=20", "kB=20,size=320x240"):
        (change,) = parse_changes([text])
        assert change.applied(TARGET).images.size_bytes.mean() == pytest.approx(20_000.0)


def test_what_is_not_named_stays() -> None:
    """A change of one thing leaves all others as they were."""
    (change,) = parse_changes(["processing=2"])
    made = change.applied(TARGET)
    assert (made.images, made.link, made.fifo) == (TARGET.images, LINK, FifoSettings())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "fps",
        "fps=0",
        "fps=a",
        "speed=3",
        "kB=0",
        "kB=nan",
        "kB=-1",
        "kB=1e9",
        "processing=inf",
        "fifo=0",
        "link=pigeon",
    ],
)
def test_what_makes_no_sense_is_refused(text: str) -> None:
    """Unknown names and impossible values give one SettingsError."""
    with pytest.raises(SettingsError):
        parse_changes([text])


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    """Any text gives changes or one SettingsError, nothing else."""
    try:
        assert parse_changes([text])
    except SettingsError as error:
        assert "\n" not in error.remedy  # noqa: PT017 - any text is allowed to be refused
