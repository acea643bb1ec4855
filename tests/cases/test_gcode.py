"""G-code as slicers and their profiles write it: prime lines beyond the bed, origins in its middle, round beds, binary files."""

import gzip
import json
import math
import os
import re
from pathlib import Path
from typing import Final

import pytest

from common.errors import DataError, SettingsError
from phone_host.printers.bed import Bed, bed_of_settings, parse_bed, stated_bed
from phone_host.printers.preparing import require_input, text_gcode
from phone_host.printers.slicing import facts_of, require_inside

FOLDER: Final = Path(__file__).parent / "gcode"
ANSWERS: Final[dict[str, list[dict[str, str | None]]]] = json.loads((FOLDER / "answers.json").read_text("utf-8"))
"""Of each file: beds that are named (null: none), and the words with which it is refused on them, if it is."""


def require_on(name: str, bed: str | None) -> None:
    """Read a case, and hold it against a bed."""
    require_inside(FOLDER / name, facts_of(FOLDER / name), None if bed is None else parse_bed(bed))


@pytest.mark.parametrize("name", ANSWERS)
def test_gcode_of_another_program_is_taken_or_refused(name: str) -> None:
    """The bed is the one that is named, else the one that the slicer states; prime lines are the printer's business.

    A line of the model beyond it is named, with where it goes and what the bed is; the remedy tells how to name another bed.
    """
    for answer in ANSWERS[name]:
        if (words := answer.get("refused")) is None:
            require_on(name, answer["bed"])
            continue
        with pytest.raises(DataError) as caught:
            require_on(name, answer["bed"])
        assert words in caught.value.problem
        assert ("@centre" in caught.value.remedy and ";TYPE:Custom" in caught.value.remedy) or "no G-code" in words


def test_the_documentation_names_every_case_and_no_other() -> None:
    """Each row of the table in docs/files.md is backed by the files that it names."""
    text = (FOLDER.parents[2] / "docs/files.md").read_text("utf-8")
    table = text.partition("## G-code of other programs")[2].partition("\n## ")[0]
    rows = [line.split("|") for line in table.splitlines() if line.startswith("| ") and ".gcode`" in line]
    named = [name for row in rows for name in re.findall(r"`([^`]+)`", row[3])]
    assert sorted(named) == sorted(ANSWERS) == sorted(path.name for path in FOLDER.glob("*.gcode"))


_PLAIN: Final = (FOLDER / "states-its-bed-as-slic3r.gcode").read_text().partition("M104")[0]


@pytest.mark.parametrize("line", ["M104 S2\N{ARABIC-INDIC DIGIT ZERO}", "ü", "M117 a\x00b"])
def test_commands_have_no_other_letters(line: str, tmp_path: Path) -> None:
    """Numbers are those that every firmware reads; what a broken file holds is not sent."""
    gcode = tmp_path / "part.gcode"
    gcode.write_text(_PLAIN + line + "\n", encoding="utf-8")
    with pytest.raises(DataError, match="line 9 is no G-code"):
        facts_of(gcode)


def test_a_disc_on_a_round_bed_is_taken(tmp_path: Path) -> None:
    """The box around a disc of 190 mm has corners beyond a round bed of 200 mm; the disc has none."""
    around = [(95 * math.cos(at * math.tau / 36), 95 * math.sin(at * math.tau / 36)) for at in range(37)]
    gcode = tmp_path / "disc.gcode"
    gcode.write_text("; a disc\nM83\nG28\nG1 Z0.2\n" + "".join(f"G1 X{x:.3f} Y{y:.3f} E1\n" for x, y in around))
    require_inside(gcode, facts_of(gcode), parse_bed("round:200,300"))
    with pytest.raises(DataError, match="leaves the bed"):
        require_inside(gcode, facts_of(gcode), parse_bed("round:180,300"))


def _round_area(radius: int) -> str:
    return ",".join(
        f"{radius * math.cos(at * math.tau / 72):g}x{radius * math.sin(at * math.tau / 72):g}" for at in range(72)
    )


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


@pytest.mark.parametrize(
    ("settings", "bed"),
    [
        ({"bed_size_x_mm": 180, "bed_size_y_mm": 190}, Bed((180, 190, 250))),
        ({"strokeXoverride": 200, "strokeYoverride": 200, "originOffsetXoverride": 5}, Bed((200, 200, 250), (-5, 0))),
        ({"bed_size_x_mm": 150, "bed_size_y_mm": 150, "round_bed": 1}, Bed((150, 150, 250), (-75, -75), is_round=True)),
        ({"strokeXoverride": 200, "strokeYoverride": 200, "originOffsetXoverride": -5}, None),
        ({"strokeXoverride": 200}, None),
        ({"bed_size_x_mm": 0, "bed_size_y_mm": 190}, None),
        ({"bed_size_x_mm": 180, "bed_size_y_mm": 190, "bed_size_z_mm": 1e9}, None),
        ({"round_bed": 1}, None),
    ],
)
def test_a_bed_of_single_numbers_is_read_or_not_believed(settings: dict[str, float], bed: Bed | None) -> None:
    """An origin before the bed's corner is not believed: nobody says what it means."""
    assert bed_of_settings(settings) == bed


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
