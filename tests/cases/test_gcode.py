"""G-code as slicers and their profiles write it: prime lines beyond the bed, origins in its middle, round beds, binary files."""

import gzip
import math
import os
from pathlib import Path

import pytest

from common.errors import DataError, SettingsError
from phone_host.printers.bed import Bed, parse_bed, stated_bed
from phone_host.printers.binary_gcode import text_gcode
from phone_host.printers.preparing import require_input
from phone_host.printers.slicing import facts_of, require_inside

_MODEL = "G1 X{x} Y{y} Z0.2 F6000\nG1 X{x1} Y{y} E0.7\nG1 X{x1} Y{y1} E0.7\nG1 X{x} Y{y1} E0.7\nG1 X{x} Y{y} E0.7\n"
_END = "M104 S0\nM140 S0\nM84\n"
_PRUSA_PRIME = "M83\nG28 W\nG1 Z0.2 F720\nG1 Y-3 F1000\nG92 E0\nG1 X60 E9 F1000\nG1 X100 E12.5 F1000\nG92 E0\n"
_ENDER_PRIME = "M83\nG28\nG1 X-2 Y20 Z0.3 F5000\nG1 X-2 Y200 E15\nG1 X-1.6 Y200\nG1 X-1.6 Y20 E15\nG92 E0\n"
_STATED = "; bed_shape = {area}\n; max_print_height = 210\n"


def _square(x: float, y: float, side: float = 20.0) -> str:
    return _MODEL.format(x=x, y=y, x1=x + side, y1=y + side)


def _round_area(radius: int) -> str:
    return ",".join(
        f"{radius * math.cos(at * math.tau / 72):g}x{radius * math.sin(at * math.tau / 72):g}" for at in range(72)
    )


_DELTA = "M83\nG28\nG1 X-80 Y0 Z0.3 F5000\nG1 X-70 Y-40 E4\n" + _square(-10, -10) + _END


@pytest.mark.parametrize(
    ("text", "bed"),
    [
        pytest.param(_PRUSA_PRIME + _square(115, 95) + _END, "250,210,210", id="a prime line in front of the bed"),
        pytest.param(_ENDER_PRIME + _square(100, 100) + _END, "235,235,250", id="two prime lines left of the bed"),
        pytest.param(
            ";TYPE:Custom\n"
            + _PRUSA_PRIME.replace("Y-3", "Y-30")
            + ";LAYER_CHANGE\n;TYPE:Perimeter\n"
            + _square(9, 9)
            + ";TYPE:Custom\nG1 X10 Y-40 E3\n"
            + _END,
            "250,210,210",
            id="code of the printer that is marked, far outside, before and behind the model",
        ),
        pytest.param(_ENDER_PRIME + ";LAYER:0\n" + _square(100, 100) + _END, "235,235,250", id="layers of Cura"),
        pytest.param(_DELTA, "200,200,300@centre", id="the origin in the middle"),
        pytest.param(_DELTA, "200,200,300@-100,-100", id="the origin as numbers"),
        pytest.param(_DELTA, "round:200,300", id="a round bed"),
        pytest.param(
            _DELTA + _STATED.format(area="-100x-100,100x-100,100x100,-100x100"), None, id="a bed that is stated"
        ),
        pytest.param(_DELTA + _STATED.format(area=_round_area(100)), None, id="a round bed that is stated"),
        pytest.param(
            _DELTA + "; printable_area = -90x-90,90x-90,90x90,-90x90\n; printable_height = 180\n",
            None,
            id="stated by OrcaSlicer",
        ),
        pytest.param(
            "M83\nG28\n" + _square(240, 240) + _END + _STATED.format(area="0x0,300x0,300x300,0x300"),
            None,
            id="a larger bed",
        ),
    ],
)
def test_a_model_on_its_bed_is_taken(text: str, bed: str | None, tmp_path: Path) -> None:
    """Prime lines are the printer's business; the bed is the one that is named, else the one that the slicer states."""
    gcode = tmp_path / "part.gcode"
    gcode.write_text(text)
    require_inside(gcode, facts_of(gcode), None if bed is None else parse_bed(bed))


@pytest.mark.parametrize(
    ("text", "bed", "line"),
    [
        pytest.param(
            _PRUSA_PRIME + _square(240, 95) + _END,
            "250,210,210",
            "line 10 extrudes at X 260.0",
            id="beyond the right edge",
        ),
        pytest.param(
            _PRUSA_PRIME + _square(115, -5) + _END,
            "250,210,210",
            "line 10 extrudes at X 115.0, Y -5.0",
            id="a model in front of the bed",
        ),
        pytest.param(_DELTA, "200,200,300", "line 4 extrudes at X -80.0", id="another origin"),
        pytest.param(_DELTA, None, "line 4 extrudes at X -80.0", id="another origin, nothing stated"),
        pytest.param(
            "M83\nG28\n" + _square(70, 70) + _END,
            "round:200,300",
            "line 4 extrudes at X 90.0, Y 70.0",
            id="a round bed's corner",
        ),
        pytest.param(
            _DELTA + _STATED.format(area="0x0,200x0,200x200,0x200"),
            None,
            "line 4 extrudes at X -80.0",
            id="the stated bed has another origin",
        ),
        pytest.param(
            "M83\nG28\n" + _square(240, 240) + _END + _STATED.format(area="0x0,300x0,300x300,0x300"),
            "220,220,250",
            "line 4 ",
            id="what is named counts more",
        ),
        pytest.param(
            ";LAYER_CHANGE\n;TYPE:Perimeter\nM83\nG28\n" + _square(-9, 9) + _END,
            "220,220,250",
            "line 6 extrudes at X -9.0",
            id="marked from the start",
        ),
        pytest.param(
            "M83\nG28\n" + "".join(_square(-9, 9 + row) + "G92 E0\n" for row in range(30)) + _END,
            "220,220,250",
            "",
            id="G92 E0 behind each row",
        ),
        pytest.param(
            "M83\nG28\nG1 X-60 Y5 Z0.2\nG1 X-60 Y90 E4\nG92 E0\n" + _square(50, 50),
            "220,220,250",
            "begins with lines from X -60.0",
            id="start code far outside, not marked",
        ),
    ],
)
def test_a_model_beyond_its_bed_is_refused(text: str, bed: str | None, line: str, tmp_path: Path) -> None:
    """The line is named, with where it goes and what the bed is; the remedy tells how to name another bed."""
    gcode = tmp_path / "part.gcode"
    gcode.write_text(text)
    with pytest.raises(DataError) as caught:
        require_inside(gcode, facts_of(gcode), None if bed is None else parse_bed(bed))
    assert line in caught.value.problem
    assert "@centre" in caught.value.remedy


_PLAIN = "M83\nG28\n" + _square(100, 100)


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("\ufeff; würfel\r\n" + _PLAIN, id="a byte order mark before a comment"),
        pytest.param("\ufeff" + _PLAIN, id="a byte order mark before a command"),
        pytest.param(_PLAIN + "M117 Fertig: schöner Würfel\n", id="a message on the display"),
        pytest.param(_PLAIN + "M486 S0\nM486 AKörper, Würfel.stl\n", id="the name of an object"),
        pytest.param(_PLAIN + "EXCLUDE_OBJECT_START NAME=方块\n", id="a macro of Klipper"),
    ],
)
def test_names_and_messages_may_have_any_letters(text: str, tmp_path: Path) -> None:
    """Objects have the names that people give them, and editors put a mark before the text: both are G-code."""
    gcode = tmp_path / "part.gcode"
    gcode.write_text(text, encoding="utf-8")
    assert facts_of(gcode).extruding == 4


@pytest.mark.parametrize(
    "line", ["G1 X1\N{ARABIC-INDIC DIGIT TWO} E1", "M104 S2\N{ARABIC-INDIC DIGIT ZERO}", "ü", "M117 a\x00b"]
)
def test_commands_have_no_other_letters(line: str, tmp_path: Path) -> None:
    """Numbers are those that every firmware reads; what a broken file holds is not sent."""
    gcode = tmp_path / "part.gcode"
    gcode.write_text(_PLAIN + line + "\n", encoding="utf-8")
    with pytest.raises(DataError, match="line 8 is no G-code"):
        facts_of(gcode)


def test_a_disc_on_a_round_bed_is_taken(tmp_path: Path) -> None:
    """The box around a disc of 190 mm has corners beyond a round bed of 200 mm; the disc has none."""
    around = [(95 * math.cos(at * math.tau / 36), 95 * math.sin(at * math.tau / 36)) for at in range(37)]
    gcode = tmp_path / "disc.gcode"
    gcode.write_text("; a disc\nM83\nG28\nG1 Z0.2\n" + "".join(f"G1 X{x:.3f} Y{y:.3f} E1\n" for x, y in around))
    require_inside(gcode, facts_of(gcode), parse_bed("round:200,300"))
    with pytest.raises(DataError, match="leaves the bed"):
        require_inside(gcode, facts_of(gcode), parse_bed("round:180,300"))


def test_beds_are_read_as_they_are_named() -> None:
    """A rectangle begins in its corner, a round bed has its origin in the middle, and both may say otherwise."""
    assert parse_bed("220, 210,250mm") == Bed((220, 210, 250))
    assert parse_bed("200,180,300@centre") == parse_bed("200,180,300@center") == Bed((200, 180, 300), (-100, -90))
    assert parse_bed("250,210,210@0,-5") == Bed((250, 210, 210), (0, -5))
    assert parse_bed("round:200,300") == Bed((200, 200, 300), (-100, -100), is_round=True)
    assert parse_bed("round:200,300@0,0") == Bed((200, 200, 300), (0, 0), is_round=True)
    for text in ("50", "-100,100,300", "0,10,10", "1e3,2,3", "20000,1,1", "round:200", "200,200,300@middle", ""):
        with pytest.raises(SettingsError, match="--bed is"):
            parse_bed(text)


def test_the_middle_of_a_round_bed_is_told_in_whole_micrometres() -> None:
    """Corners that a slicer rounds lie around a middle that is zero but for the digits that no reader wants."""
    assert "around X 0, Y 0," in Bed((200, 200, 300), (-100 - 1e-14, -100 - 1e-14), is_round=True).words


def test_a_bed_that_is_stated_is_read_or_not_believed() -> None:
    """Fewer than three corners, corners in a line and heights that no printer has state no bed."""
    assert stated_bed("0x0,250x0,250x210,0x210", 210) == Bed((250, 210, 210))
    assert stated_bed(" -5x-3 , 245x-3, 245x207,-5x207", 210) == Bed((250, 210, 210), (-5, -3))
    disc = stated_bed(_round_area(90), 300)
    assert disc is not None
    assert disc.is_round
    assert disc.size_mm == pytest.approx((180, 180, 300), abs=1e-3)
    for area, height_mm in (
        ("", 10),
        ("0x0,5x5", 10),
        ("0x0,5x0,9x0", 10),
        ("a,b,c,d", 10),
        ("0x0,9x0,9x9", 0),
        ("0x0,9x0,9x9", 1e6),
    ):
        assert stated_bed(area, height_mm) is None
    assert not Bed((200, 200, 300)).holds(10, 10, 301)
    assert not Bed((200, 200, 300)).holds(10, 10, -1)
    assert "reaches from X -5 to 245" in Bed((250, 210, 210), (-5, -3)).words


_BINARY = b"GCDE\x01\x00\x00\x00\x01\x00" + bytes(range(40))


@pytest.mark.parametrize("name", ["cup.bgcode", "cup.gcode"])
def test_binary_gcode_is_known_by_its_first_bytes(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever its name is, one line says what it is and how to switch it off."""
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    (tmp_path / name).write_bytes(_BINARY)
    with pytest.raises(DataError, match="is binary G-code") as caught, text_gcode(tmp_path / name):
        pass
    assert 'switch "Supports binary G-code" off' in caught.value.remedy


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("cup.gcode.gz", gzip.compress(_PLAIN.encode(), mtime=0), "compressed"),
        ("cup.gcode", gzip.compress(_PLAIN.encode(), mtime=0), "compressed"),
        ("cup.gcode.3mf", b"PK\x03\x04" + bytes(40), "a ZIP archive"),
        ("CUP.UFP", b"PK\x03\x04" + bytes(40), "a ZIP archive"),
        ("cup.gcode", _PLAIN.encode("utf-16"), "UTF-16"),
    ],
    ids=["gzip", "gzip under another name", "3mf", "ufp", "UTF-16"],
)
def test_gcode_in_an_archive_is_named(name: str, content: bytes, what: str, tmp_path: Path) -> None:
    """What Cura and Bambu Studio compress is no broken G-code and no mesh: one line says what it is."""
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DataError, match=f"is {what}") as caught:
        require_input(tmp_path / name)
    assert "unpack it" in caught.value.remedy


def _converter(folder: Path, script: str) -> None:
    """A program with the arguments and the results of libbgcode's `bgcode`: NAME.bgcode becomes NAME.gcode beside it."""
    program = folder / "bgcode"
    program.write_text(f'#!/bin/sh\nout="${{1%.bgcode}}.gcode"\n{script}\n')
    program.chmod(0o755)


def test_binary_gcode_is_converted_where_a_program_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the program writes is read; its folder is gone afterwards, and the given file is as it was."""
    _converter(tmp_path, 'head -c 4 "$1" | grep -q GCDE && printf "G28\\nG1 X5 E1\\n" >"$out"')
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    (tmp_path / "cup.gcode").write_bytes(_BINARY)
    with text_gcode(tmp_path / "cup.gcode") as gcode:
        assert gcode.name == "cup.gcode"
        assert facts_of(gcode).lines == 2
    assert not gcode.exists()
    assert (tmp_path / "cup.gcode").read_bytes() == _BINARY


def test_a_converter_that_fails_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its last line is the reason."""
    _converter(tmp_path, 'echo "Error: Invalid checksum"; exit 1')
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    (tmp_path / "cup.bgcode").write_bytes(_BINARY)
    with pytest.raises(DataError, match="Error: Invalid checksum"), text_gcode(tmp_path / "cup.bgcode"):
        pass
