"""Names of others: shown without power over the terminal or the page, and always writable."""

import json
import os
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.plain_text import printable, printable_lines, printable_page, writable
from common.program.invocation import shell_word
from common.program.logs import event
from common.program.terminal import folded, say
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text, json_value
from phone_host.report.page_frame import document
from phone_host.report.page_script import Script
from phone_host.svg.plot_scale import duration_text

HOSTILE = "\x1b[31m\a\b\x7f\x9b\u202e\u2028\udcff"
SHOWN = r"\x1b[31m\x07\x08\x7f\x9b\u202e\u2028\xff"
anything = st.text(st.characters(codec=None, exclude_categories=()))  # surrogates as well


def test_what_controls_a_terminal_is_shown_as_python_writes_it() -> None:
    """Escapes, backspaces, C1 controls, turns of the direction and bytes that are no UTF-8 become letters; words of any script stay."""
    assert printable(HOSTILE) == printable_lines(HOSTILE) == printable_page(HOSTILE) == SHOWN
    for word in ("left.png", "зал 3", "左②", "é"):
        assert printable(word) == printable_page(word) == word


@given(anything)
def test_everything_shown_is_printable_and_can_be_written(text: str) -> None:
    """Whatever is quoted, its line is printable, its lines are as many as before, and pages and texts can be encoded."""
    assert printable(text).isprintable()
    assert printable_lines(text).count("\n") == text.count("\n")
    assert all(line.isprintable() for line in folded(text, 0).split("\n"))
    for made in (printable_page(text), writable(text)):
        assert made.encode().decode() == made


def test_said_lines_stay_lines(capsys: pytest.CaptureFixture[str]) -> None:
    """A name that holds the end of a line does not begin another one."""
    say([f"no partner: a\nok{HOSTILE}", "written"])
    assert capsys.readouterr().out == f"no partner: a\\nok{SHOWN}\nwritten\n"


def test_a_page_holds_no_control_character() -> None:
    """Neither title nor body of a page carries a name's controls; the ends of its lines stay."""
    page = document(HOSTILE, f"<p>{HOSTILE}</p>\n<p>b</p>", Script.COPY)
    assert f"<title>{SHOWN}</title>" in page
    assert f"<p>{SHOWN}</p>\n<p>b</p>" in page


def test_texts_with_names_that_are_no_utf_8_are_written(tmp_path: Path) -> None:
    """A file takes the name's bytes as codes, and other bytes as they are."""
    write_text(tmp_path / "page", "é \udcff")
    assert (tmp_path / "page").read_text("utf-8") == r"é \xff"


def test_json_holds_whole_letters_only() -> None:
    """Bytes that are no UTF-8 are codes in values and keys, so that strict readers take them; controls are JSON's own escapes."""
    text = json_text({"\udcff": ["\udcff.png", "\x1b"]})
    assert json.loads(text) == {"\\xff": ["\\xff.png", "\x1b"]}
    assert text.isascii()
    assert text.isprintable()


def test_json_that_is_nested_too_deep_is_none() -> None:
    """A file of nothing but brackets is refused like any other that is no JSON."""
    with pytest.raises(ValueError, match="deep"):
        json_value("[" * 200_000)


def test_a_log_line_quotes_no_control() -> None:
    """Neither with nor without blanks in a value."""
    assert event("lost", file=HOSTILE) == f"lost file={SHOWN}"
    assert event("lost", file=f"a {HOSTILE}").isprintable()


def test_a_command_to_paste_names_the_same_bytes() -> None:
    """A word that cannot be printed is quoted by codes that bash reads back; any other as ever."""
    for name in (b"\xff.png", b"a'\\\x1b\n\xe2\x80\xae"):
        word = shell_word(os.fsdecode(name))
        assert word.isascii()
        assert word.isprintable()
        assert subprocess.run(["bash", "-c", f"printf %s {word}"], capture_output=True, check=True).stdout == name
    assert shell_word("left 1.png") == "'left 1.png'"


@pytest.mark.parametrize("space", ["\u00a0", "\u2009", "\u202f", "\u3000"])
def test_a_number_and_its_unit_stay_apart_by_a_plain_space(space: str) -> None:
    """Pages keep a number and its unit on one line by a special space; on terminals and in logs it is the usual one, never a code."""
    assert printable(f"23.8{space}ms") == folded(f"23.8{space}ms", 0) == "23.8 ms"
    assert event("slow", took=f"23.8{space}ms") == event("slow", took="23.8 ms")


def test_delay_bench_writes_durations_in_ascii() -> None:
    """Of the lines that are printed none holds a code, whatever the terminal's encoding."""
    assert printable(duration_text(23.8e6)) == "23.8 ms"
