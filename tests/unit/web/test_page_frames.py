"""A pair's message: what a browser gets is the disparity that was measured, to the stated step."""

import struct
import zlib
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from phone_host.model import Epipolar
from phone_host.web.frames import WIDTHS, Part, View, disparity, fitting_width, message, picture, taken_apart
from tests.support.samples import LEDGER
from tests.support.stereo_pages import GEOMETRY, LIMITS, processed


def decoded(data: bytes) -> np.ndarray:
    """Decode a picture."""
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return image


def unpacked(part: Part) -> np.ndarray:
    """Turn a grid back into px, as the page does."""
    data = zlib.decompress(part.data) if part.entry["type"] == "u16+deflate" else part.data
    cells = np.frombuffer(data, "<u2").reshape(part.entry["height"], part.entry["width"])
    return np.where(cells == 0, np.nan, part.entry["low"] + (cells.astype(float) - 1) / part.entry["scale"])


@given(
    hnp.arrays(
        np.float32,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=40),
        elements=st.floats(-100, 3000, width=32) | st.just(np.float32(np.nan)),
    ),
    st.sampled_from((7, 20, 160)),
    st.booleans(),
)
def test_disparities_survive(values: np.ndarray, width: int, packed: bool) -> None:  # noqa: FBT001
    """Every sampled value comes back within half a step, none stays none, and the grid is no wider than asked."""
    part = disparity(values, width, packed=packed)
    step = part.entry["step"]
    assert part.entry["width"] <= width
    assert step <= -(-values.shape[1] // width)
    back, sampled = unpacked(part), values[::step, ::step]
    assert np.array_equal(np.isnan(back), np.isnan(sampled))
    known = np.isfinite(sampled)
    assert np.all(np.abs(back - sampled)[known] <= 0.5 / part.entry["scale"] + 1e-3)


def test_a_usual_scene_is_told_to_a_sixty_fourth_of_a_pixel() -> None:
    """The wall at 2 m has 20 px, the box at 1 m has 40 px."""
    shown = processed()
    assert shown.disparity is not None
    back = unpacked(disparity(shown.disparity, 160, packed=True))
    assert back[119, 159] == pytest.approx(20.0, abs=1 / 64)
    assert back[60, 80] == pytest.approx(40.0, abs=1 / 64)


def test_a_message_says_what_is_in_it() -> None:
    """Header and parts come back as they were put in, with all that turns disparity into metres."""
    shown = processed()
    assert shown.disparity is not None
    parts = (
        picture(shown, View.LEFT, 80),
        picture(shown, View.RIGHT, 320),
        disparity(shown.disparity, 160, packed=False),
    )
    header, data = taken_apart(message(7, shown, replace(LEDGER, done_ns=3_000_000), parts))
    assert data == tuple(part.data for part in parts)
    assert (header["kind"], header["number"], header["width"], header["height"]) == ("pair", 7, 160, 120)
    assert header["geometry"] == {
        "focal": GEOMETRY.focal_px, "baseline": GEOMETRY.baseline_m, "doffs": 0.0, "cx": GEOMETRY.cx_px, "cy": GEOMETRY.cy_px,
        "error": LIMITS.disparity_error_px,
    }  # fmt: skip
    assert (header["near"], header["far"], header["way"]) == (0.5, 4.0, [-1, 0])
    assert header["ledger"]["processing_ms"] == 3.0  # type: ignore[index]
    # The box fills a ninth of the picture, so it is no stray; the strip at 8 m lies beyond the far limit and takes no colours.
    assert header["range"] == [20.0, 40.0]
    assert [decoded(each).shape for each in data[:2]] == [(60, 80, 3), (120, 160, 3)]


def test_colours_are_those_of_all_disparities_where_no_point_tells_them_apart() -> None:
    """Without metres, and where the limits leave nothing, the whole scene has its colours."""
    shown = processed()
    assert shown.cloud is not None
    for cloud in (None, np.full_like(shown.cloud, np.nan)):
        header, _ = taken_apart(message(0, replace(shown, cloud=cloud), LEDGER, ()))
        assert header["range"] == [5.0, 40.0]


def test_without_depth_there_is_no_geometry() -> None:
    """A run without a rig still has pictures; nothing claims metres."""
    shown = replace(processed(), disparity=None, cloud=None, geometry=None, limits=None)
    header, data = taken_apart(message(0, shown, LEDGER, (picture(shown, View.LEFT, 160),)))
    assert [header[name] for name in ("geometry", "near", "far", "range")] == [None] * 4
    assert len(data) == 1
    unlimited = replace(processed(), limits=replace(LIMITS, near_m=0.0))
    assert taken_apart(message(0, unlimited, LEDGER, ()))[0]["near"] is None
    assert taken_apart(message(0, replace(processed(), limits=None), LEDGER, ()))[0]["geometry"]["error"] == 0.0  # type: ignore[index]


@given(st.binary(max_size=200))
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    """No bytes raise anything but ValueError."""
    with pytest.raises(ValueError, match=r"."):
        taken_apart(data)


def test_a_message_with_another_length_is_refused() -> None:
    """A byte more or less than announced is no message."""
    whole = message(0, processed(), LEDGER, (Part({"name": "left"}, b"abc"),))
    for cut in (whole[:-1], whole + b"x", whole[:3], struct.pack("<I", 9) + b'{"parts":1}'):
        with pytest.raises(ValueError, match=r"."):
            taken_apart(cut)


def test_widths_are_few() -> None:
    """A viewer gets the next width that is not smaller, or the greatest."""
    assert [fitting_width(asked) for asked in (0, 160, 161, 640, 5000)] == [160, 160, 320, 640, WIDTHS[-1]]


def test_the_ways_of_epipolar_lines() -> None:
    """A point of the right image lies left of, above, or below its place in the left one, as `Epipolar` says."""
    assert [way.way for way in Epipolar] == [(-1, 0), (0, -1), (0, 1)]
