"""Times, rates and sizes are read alike in all commands, settings files and variables."""

import argparse
from collections.abc import Callable
from pathlib import Path

import pytest

import board_agent.cli
import board_agent.settings
import phone_host.bench.cli
import phone_host.cli
from common.camera.factory import parse_camera
from common.camera.v4l2_stream import V4l2Settings
from common.errors import SettingsError
from common.program.quantities import (
    decimal_number,
    frames_per_second,
    image_size,
    milliseconds,
    seconds,
    whole_number,
)
from phone_host.bench.cases import Size, parse_qualities, parse_rates, parse_sizes
from phone_host.settings import most_pixels, resolve_settings
from tests.support.requests import options_of, verbs_of

Parser = Callable[[], argparse.ArgumentParser]
HOST, BOARD, BENCH = phone_host.cli.parser, board_agent.cli.parser, phone_host.bench.cli.parser


@pytest.mark.parametrize(
    ("text", "expected_s"),
    [("3", 3), ("3s", 3), (" 3 S ", 3), ("500ms", 0.5), ("2min", 120), ("1.5h", 5400), (".5", 0.5), ("1e1", 10)],
)
def test_a_time_in_any_unit(text: str, expected_s: float) -> None:
    """A number alone is seconds; milliseconds, minutes and hours are what they are."""
    assert seconds(text, "--wait") == pytest.approx(expected_s)


@pytest.mark.parametrize(("text", "expected_ms"), [("5", 5), ("5ms", 5), ("0.005s", 5), ("250us", 0.25), ("0", 0)])
def test_a_time_whose_bare_number_is_milliseconds(text: str, expected_ms: float) -> None:
    """The unit of a bare number is the option's own; a unit is always the same time."""
    assert milliseconds(text, "--tolerance") == pytest.approx(expected_ms)


@pytest.mark.parametrize("text", ["", "s", "three", "-3", "3 m", "3km", "nan", "inf", "1,5s", "3s4", "9" * 400, "٣"])
def test_what_is_no_time_is_refused_by_name(text: str) -> None:
    """Also a minus sign, and `m`, which could be minutes or metres. The line shows what was typed and what would be right."""
    with pytest.raises(SettingsError) as caught:
        seconds(text, "--wait")
    assert repr(text) in str(caught.value)
    assert "--wait" in str(caught.value)
    assert "500ms" in caught.value.remedy


def test_rates_and_sizes_are_forgiving_too() -> None:
    """In the benchmark's lists, and the size in a camera's address."""
    assert frames_per_second("29.97 fps", "--fps") == pytest.approx(29.97)
    assert parse_rates("15fps, 30Hz,60") == (15, 30, 60)
    assert parse_sizes("640X480, 320 x 240,160x120px") == (Size(640, 480), Size(320, 240), Size(160, 120))
    assert parse_qualities("50%,80") == (50, 80)
    assert image_size("1280X720", "--size") == (1280, 720)
    camera = parse_camera("v4l2:/dev/video0?size=640X480", "")
    assert isinstance(camera, V4l2Settings)
    assert camera.wanted.size_px == (640, 480)


@pytest.mark.parametrize("text", ["640", "640x", "0x480", "640x480x3", "640.5x480", "axb"])
def test_what_is_no_size_is_refused_by_name(text: str) -> None:
    """The line shows a size that would be right."""
    with pytest.raises(SettingsError, match="640x480"):
        parse_sizes(text)


@pytest.mark.parametrize(
    ("parser", "words", "name", "expected"),
    [
        (HOST, ["run", "--wait", "3s"], "wait", 3),
        (HOST, ["run", "--tolerance", "5ms"], "tolerance", 5),
        (HOST, ["doctor", "--wait", "500ms"], "wait", 0.5),
        (HOST, ["demo", "--seconds", "5s"], "seconds", 5),
        (HOST, ["calibrate-time", "--seconds", "1min"], "seconds", 60),
        (HOST, ["calibrate-time", "--wait", "3"], "wait", 3),
        (HOST, ["settings", "--tolerance", "0.005s"], "tolerance", 5),
        (BENCH, ["--seconds", "0.5min"], "seconds", 30),
        (BOARD, ["pair", "--seconds", "5min"], "seconds", 300),
        (BOARD, ["run", "--least-fps", "5fps"], "least_fps", 5),
    ],
)
def test_every_command_takes_units(parser: Parser, words: list[str], name: str, expected: float) -> None:
    """Options of one kind are read by one reader, whatever the command."""
    assert getattr(parser().parse_args(words), name) == pytest.approx(expected)


def test_no_option_for_a_time_is_forgotten() -> None:
    """Every option whose help names seconds or milliseconds takes units."""
    forgotten = []
    for parser in (HOST(), BOARD(), BENCH()):
        parsers = [parser, *verbs_of(parser).values()]
        actions = [
            (one.prog, action)
            for one in parsers
            for action in options_of(one)
            if action.metavar in {"S", "MS"} and action.dest != "scale"
        ]
        forgotten += [
            f"{prog} {action.option_strings}" for prog, action in actions if action.type in {None, float, int}
        ]
    assert forgotten == []


def test_files_and_variables_take_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A settings file may give a number or a text with a unit, and so may the environment; both name the key if it is neither."""
    file = tmp_path / "host.toml"
    for written in ('tolerance = "5ms"', "tolerance = 5", 'tolerance = "0.005 s"'):
        file.write_text(written)
        assert resolve_settings({"config": file}).values.tolerance == 5
    file.write_text('tolerance = "wide"')
    with pytest.raises(SettingsError, match=r"tolerance in .*host.toml is 'wide'"):
        resolve_settings({"config": file})
    monkeypatch.setenv("PHONE_HOST_TOLERANCE", "7ms")
    assert resolve_settings({"config": None}).values.tolerance == 7
    monkeypatch.setenv("BOARD_AGENT_IDLE_AFTER", "2min")
    assert board_agent.settings.resolve_settings(BOARD().parse_args(["settings"])).values.idle_after == 120


@pytest.mark.parametrize("megapixels", [0, 1025, 30_000, 10**30])
def test_a_limit_of_megapixels_is_one_that_a_decoder_has(megapixels: int) -> None:
    """OpenCV decodes up to 2^30 pixels: 1024 of our megapixels are taken, more are refused by name."""
    assert most_pixels(None, 1024) == 2**30
    with pytest.raises(SettingsError, match="max_megapixels is"):
        most_pixels(None, megapixels)


@pytest.mark.parametrize(
    "text", ["1_000", "\u0661\u0666", "\uff11\uff16", "\u00b2", "", "1e", "0x10", "nan", "inf", "1e999", "9" * 5000]
)
def test_numbers_are_of_ascii_digits_only(text: str) -> None:
    """What Python takes beside them is no number to us, nor is what is none at all."""
    for read in (whole_number, decimal_number):
        with pytest.raises(ValueError, match=r"^"):
            read(text)


def test_plain_numbers_are_read() -> None:
    """With and without sign, blanks and exponent."""
    assert [whole_number(text) for text in ("16", " -3", "+2 ")] == [16, -3, 2]
    assert [decimal_number(text) for text in ("16", "-.5", "2.", "1e3", "+31.086")] == [16, -0.5, 2, 1000, 31.086]
