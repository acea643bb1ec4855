"""Choosing among the formats that a camera offers."""

from fractions import Fraction

import pytest

from common.camera.v4l2_formats import (
    FormatOffer,
    Rates,
    SizeRange,
    Wanted,
    choose,
    choose_rate,
    has_rates,
    slower_rates,
    smaller_sizes,
)
from common.errors import SettingsError, UnavailableError
from common.frame import PixelFormat

_SIZES = ((1920, 1080), (1280, 720), (640, 480), (320, 240))
_MJPEG = FormatOffer(letters="MJPG", text="Motion-JPEG", sizes_px=_SIZES)
_YUYV = FormatOffer(letters="YUYV", text="YUYV 4:2:2", sizes_px=((640, 480), (800, 600)))
_H264 = FormatOffer(letters="H264", text="H.264", sizes_px=_SIZES)


def test_jpeg_at_the_usual_size_without_a_wish() -> None:
    """If a camera has both, MJPEG is chosen, at 640x480, wherever they are in its list."""
    choice = choose((_YUYV, _H264, _MJPEG), Wanted(), "/dev/video0")
    assert (choice.letters, choice.pixel_format, choice.size_px) == ("MJPG", PixelFormat.MJPEG, (640, 480))


@pytest.mark.parametrize(
    ("sizes", "expected"),
    [
        (((1280, 720), (320, 240), (352, 288)), (352, 288)),
        (((1920, 1080), (1280, 720)), (1280, 720)),
    ],
)
def test_without_the_usual_size_the_nearest_is_taken(
    sizes: tuple[tuple[int, int], ...], expected: tuple[int, int]
) -> None:
    """A camera without 640x480 gives its largest size below that, or its smallest."""
    assert choose((FormatOffer(letters="MJPG", text="", sizes_px=sizes),), Wanted(), "x").size_px == expected


def test_a_size_that_only_raw_has_is_taken_raw() -> None:
    """A size that MJPEG lacks is taken from the next format."""
    choice = choose((_MJPEG, _YUYV), Wanted((800, 600)), "x")
    assert (choice.letters, choice.size_px) == ("YUYV", (800, 600))


def test_a_format_that_is_asked_for_is_taken() -> None:
    """The user's format overrides the preference."""
    assert choose((_MJPEG, _YUYV), Wanted(None, None, PixelFormat.YUYV), "x").letters == "YUYV"


def test_an_absent_size_is_refused_with_the_list() -> None:
    """An unavailable size gives an error of one line that names the camera and lists its sizes."""
    with pytest.raises(SettingsError) as caught:
        choose((_MJPEG,), Wanted((800, 601)), "/dev/video0")
    text = str(caught.value)
    assert "\n" not in text
    assert "/dev/video0 has no size 800x601" in text
    assert "1920x1080, 1280x720, 640x480, 320x240" in text


def test_an_absent_format_is_refused_with_the_list() -> None:
    """An unavailable format gives an error that lists the camera's formats."""
    with pytest.raises(SettingsError, match="nv12") as caught:
        choose((_MJPEG, _YUYV), Wanted(None, None, PixelFormat.NV12), "x")
    assert caught.value.remedy.endswith("MJPG, YUYV")


def test_a_camera_with_h264_alone_is_refused() -> None:
    """H.264 is not a sequence of images; the error says so, and what to use instead."""
    with pytest.raises(UnavailableError, match=r"has only H264, which cannot be sent.*MJPEG"):
        choose((_H264,), Wanted(), "x")


def test_a_camera_without_any_format_is_not_there_yet() -> None:
    """A loopback device without a source offers nothing: unavailable now, not wrong."""
    with pytest.raises(UnavailableError, match="no format at the moment"):
        choose((), Wanted(), "x")


def test_a_scaling_camera_takes_sizes_on_its_grid() -> None:
    """Between minimum and maximum a size counts as offered if it is a whole number of steps away."""
    offer = FormatOffer(letters="YUYV", text="", sizes_px=(), size_range=SizeRange((48, 1920, 2), (32, 1080, 8)))
    assert choose((offer,), Wanted((642, 480)), "x").size_px == (642, 480)
    for size in ((641, 480), (640, 484), (1922, 480), (640, 24)):
        with pytest.raises(SettingsError, match="48x32 to 1920x1080"):
            choose((offer,), Wanted(size), "x")


_NAMED = Rates((Fraction(60), Fraction(10_000_000, 333_333), Fraction(15)))


@pytest.mark.parametrize(
    ("rates", "wish", "expected"),
    [
        (_NAMED, None, Fraction(10_000_000, 333_333)),
        (_NAMED, Fraction(30), Fraction(10_000_000, 333_333)),
        (_NAMED, Fraction("59.94"), Fraction(60)),
        (Rates((Fraction(90), Fraction(60))), None, Fraction(60)),
        (Rates((), (Fraction(1), Fraction(25))), None, Fraction(25)),
        (Rates((), (Fraction(1), Fraction(25))), Fraction(20), Fraction(20)),
        (Rates(), None, Fraction(30)),
        (Rates(), Fraction(12), Fraction(12)),
    ],
)
def test_the_rate(rates: Rates, wish: Fraction | None, expected: Fraction) -> None:
    """By default the highest rate up to 30 is chosen; a requested rate is met within one per cent; an unknown list refuses nothing."""
    assert choose_rate(rates, Wanted(None, wish), "x") == expected


@pytest.mark.parametrize(
    ("rates", "listed"), [(_NAMED, "60, 30, 15"), (Rates((), (Fraction(1), Fraction(15))), "1 to 15")]
)
def test_an_absent_rate_is_refused_with_the_list(rates: Rates, listed: str) -> None:
    """An unavailable rate gives an error that lists the available ones."""
    with pytest.raises(SettingsError, match="25") as caught:
        choose_rate(rates, Wanted(None, Fraction(25)), "x")
    assert caught.value.remedy.endswith(listed)


def test_slower_rates_are_those_below() -> None:
    """Of listed rates those below the present one are offered, the highest first; of a continuous range, whole fractions of it; of an unknown set, none."""
    named = Rates((Fraction(30), Fraction(2997, 100), Fraction(15), Fraction(15, 2), Fraction(5)))
    assert slower_rates(named, Fraction(30)) == (Fraction(15), Fraction(15, 2), Fraction(5))
    assert slower_rates(named, Fraction(15)) == (Fraction(15, 2), Fraction(5))
    assert slower_rates(named, Fraction(5)) == ()
    between = Rates(between_hz=(Fraction(5), Fraction(60)))
    assert slower_rates(between, Fraction(30)) == (Fraction(15), Fraction(10), Fraction(15, 2), Fraction(5))
    assert slower_rates(Rates(), Fraction(30)) == ()


def test_smaller_sizes_have_exactly_one_shape() -> None:
    """Of the smaller sizes, those of exactly the same shape are offered, the largest first; a scaling camera offers halves, thirds and quarters."""
    sizes = ((1280, 960), (640, 480), (640, 360), (352, 288), (320, 240), (160, 120))
    assert smaller_sizes(FormatOffer(letters="MJPG", text="", sizes_px=sizes), (640, 480)) == ((320, 240), (160, 120))
    assert smaller_sizes(FormatOffer(letters="MJPG", text="", sizes_px=sizes), (352, 288)) == ()
    scaling = FormatOffer(letters="MJPG", text="", sizes_px=(), size_range=SizeRange((16, 1280, 8), (16, 960, 8)))
    assert smaller_sizes(scaling, (640, 480)) == ((320, 240), (160, 120))  # 213x160 is not an exact third
    assert smaller_sizes(scaling, (96, 96)) == ((48, 48), (32, 32), (24, 24))


def test_a_size_must_have_the_rates() -> None:
    """A size is usable if it has each rate of the ladder, to a hundredth."""
    rates = Rates((Fraction(30), Fraction(15), Fraction(5)))
    assert has_rates(rates, [Fraction(2997, 100), Fraction(5)])
    assert not has_rates(rates, [Fraction(30), Fraction(10)])
    assert has_rates(Rates(between_hz=(Fraction(1), Fraction(30))), [Fraction(30), Fraction(5, 2)])
    assert not has_rates(Rates(between_hz=(Fraction(1), Fraction(30))), [Fraction(60)])


@pytest.mark.parametrize(
    ("width_px", "height_px", "expected"),
    [
        ((16, 320, 2), (16, 240, 2), (320, 240)),
        ((800, 1920, 2), (600, 1080, 2), (800, 600)),
        ((40, 1920, 32), (30, 1080, 20), (616, 470)),  # 640 is no 40 + 32 n, 480 no 30 + 20 n
    ],
)
def test_a_scaling_camera_without_the_usual_size_gives_the_nearest(
    width_px: tuple[int, int, int], height_px: tuple[int, int, int], expected: tuple[int, int]
) -> None:
    """If 640x480 is beyond a scaling camera's sizes, or not on their grid, the largest size below it is chosen, or the smallest one."""
    scaling = FormatOffer(letters="YUYV", text="", sizes_px=(), size_range=SizeRange(width_px, height_px))
    assert choose((scaling,), Wanted(), "x").size_px == expected


def test_the_highest_rate_is_the_first_of_a_list_or_the_end_of_a_range() -> None:
    """The highest rate is the first of a list or the upper end of a range; if a driver names no rate, it is unknown."""
    assert Rates((Fraction(60), Fraction(30))).highest_hz == 60
    assert Rates(between_hz=(Fraction(1), Fraction(90))).highest_hz == 90
    assert Rates().highest_hz is None
