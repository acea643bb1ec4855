"""Text on a phone's terminal: nothing is wider than 50 columns, and no number, path or command is cut."""

import io
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from rich.console import Console

from common.ledger import BoardMarks
from common.program.terminal import columns, folded
from phone_host.accounts.link_account import LinkAccount, LinkTally
from phone_host.bench.tables import narrow_rows
from phone_host.calibration.target.pairs import Reason, Rejected
from phone_host.report.calibration_lines import rejections
from phone_host.report.summary import summary
from phone_host.run.terminal_view import LiveTable
from tests.support.bench_results import result
from tests.support.run_snapshots import MS, run
from tests.support.samples import LEDGER
from tests.support.terminal import in_terminal

ROOT = Path(__file__).resolve().parents[4]
PHONE = 50
WORDS = st.lists(st.text(st.characters(categories=["L", "N", "P"]), min_size=1, max_size=70), max_size=30)


@given(WORDS, st.integers(10, 120))
@example([".", "0", "0", "0", "000"], 10)
def test_folding_keeps_every_word_whole(words: list[str], width: int) -> None:
    """Folded text has the same words in the same order, and a line is wider than the terminal only if it is one word or a command."""
    assume(words[:1] != ["."])  # begins a command of the shell, which stays whole
    text = " ".join(words)
    lines = folded(text, width).split("\n")
    assert " ".join(lines).split() == text.split()
    assert all(len(line) <= width or len(line.split()) == 1 for line in lines)


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("try next  phone-host run --camera 'replay:/a/very/long/path/of/a/film?fps=15&loop=1' --out scan", 1),
        ("          board-agent run --camera 'replay:/a/very/long/path/of/a/film?fps=15&loop=1'", 1),
        ("then    phone-host calibrate left/ right/ --board charuco:8x6:28mm:20mm:5x5 --out rig.yaml", 1),
        ("phone-host: error: LEFT 'left' does not exist: give a folder of images", 2),
        ("phone-host export: error: nothing takes cup (put patterns in quotes): see phone-host export --help", 3),
        ("use phone-host calibrate again, with more photographs of the board than before", 2),
        ("phone-host: error: the camera has gone: plug it in again, and then start again", 2),
    ],
)
def test_commands_stay_whole(line: str, found: int) -> None:
    """A line that is a command, with a label before it or not, is not folded, so that it can be pasted; a sentence about one is."""
    assert len(folded(line, PHONE).split("\n")) == found


def test_continued_lines_stand_below_their_column() -> None:
    """The text of a table's last column goes on below its beginning; without columns it is indented by two."""
    assert folded("ok    camera  one two three four five six", 32) == (
        "ok    camera  one two three four\n              five six"
    )
    assert folded("  one two three four", 12) == "  one two\n    three\n    four"


def test_what_is_no_terminal_is_not_folded() -> None:
    """Text for a file or a pipe stays as it is."""
    assert columns(io.StringIO()) == 0
    assert folded("x " * 500, 0) == "x " * 500


def test_the_summary_of_a_run_fits_a_phone() -> None:
    """At 50 columns no line of the summary is wider, the table has its median and its greatest value, and links are listed below each other."""
    links = (LinkTally("usb", frames=20, bytes=900, carried=1), LinkTally("tcp", frames=11, carried=2, lost=1))
    links[0].age.add(7 * MS)
    seen = run(31)
    seen.link.links = links
    text = folded(summary(seen, PHONE), PHONE)
    assert max(len(line) for line in text.split("\n")) <= PHONE
    assert re.search(r"delay, ms +p50 +p95 +max\n", text)
    assert re.search(r"end-to-end +15\.000 +15\.000 +15\.000\n", text)
    assert "link usb: 20 frames, took over once, lost 0 times," in text
    assert "p99" in summary(seen)


@pytest.mark.parametrize("width", [40, PHONE, 63, 64, 80])
def test_the_live_table_cuts_no_number(width: int) -> None:
    """At every width the live table shows whole numbers, also such as 12345 ms, and no line is wider than the terminal."""
    seen = run(31)
    seen.delays.add(replace(LEDGER, board=BoardMarks(exposed_ns=0, grabbed_ns=0, sent_ns=0), done_ns=12_345_678_901))
    screen = io.StringIO()
    console = Console(file=screen, width=width, height=60, force_terminal=True, color_system=None)
    with LiveTable(lambda: seen, console, pairs=100) as live:
        live.refresh()
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue()).replace("\r", "\n")
    assert "…" not in text
    assert "12346" in text
    assert max(len(line) for line in text.split("\n")) <= width


def test_the_benchmarks_table_of_a_phone_has_one_run() -> None:
    """A narrow table leaves out the link and the 99th percentile; its longest row has 13 + 3 x 9 characters."""
    table = narrow_rows(result())
    assert ("processing", "15.000", "15.000", "15.000") in table
    assert max(len(cell) for row in table for cell in row[1:]) <= 9
    assert LinkAccount([]).links == ()


_BENCH = """
import sys
sys.path.insert(0, {root!r})
from phone_host.bench.analysis import analyse
from phone_host.bench.changes import parse_changes
from phone_host.bench.command import print_results
from tests.support.bench_results import UNDER, result
results = [result(link=link) for link in ("tcp", "ipc", "tcp://192.168.107.222:55555?a=1&b=2&c=3&d=4")]
print_results(results, UNDER, analyse(results, UNDER.fifo, parse_changes(["fps=60,link=bluetooth"])))
"""


@pytest.mark.parametrize("width", [PHONE, 80])
def test_all_that_delay_bench_prints_fits_a_terminal(width: int, tmp_path: Path) -> None:
    """In a real terminal every number is whole: the delays, the fits, the predictions. No line is wider, save one that is a single word."""
    with in_terminal([sys.executable, "-P", "-c", _BENCH.format(root=str(ROOT))], width, tmp_path) as running:
        assert running.read_all() == 0
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", running.seen.decode())
    assert "…" not in text
    assert len(re.findall(r"processing +(\S+ +)?15\.000 +15\.000 +15\.000", text.replace("│", ""))) >= 1
    assert "predicted, not run:" in text
    assert all(len(line) <= width or len(line.split()) == 1 for line in text.split("\r\n"))


def test_the_benchmark_asks_columns_where_there_is_no_terminal(tmp_path: Path) -> None:
    """In a pipe the table is whole, however many columns it takes; COLUMNS=50 asks for the narrow one. Neither cuts a number."""
    texts = {}
    for columns_asked in ("", "50"):
        done = subprocess.run(
            [sys.executable, "-P", "-c", _BENCH.format(root=str(ROOT))],
            env={**os.environ, "COLUMNS": columns_asked},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        assert "…" not in done.stdout
        texts[columns_asked] = done.stdout
    assert "p99" in texts[""]
    assert "p99" not in texts["50"]


def test_the_list_of_interfaces_fits_a_phone(tmp_path: Path) -> None:
    """`delay-bench --emulate list` names each interface at the beginning of a line, and its numbers are beside it."""
    command = [sys.executable, "-P", "-m", "phone_host.bench.cli", "--emulate", "list"]
    with in_terminal(command, PHONE, tmp_path) as running:
        assert running.read_all() == 0
    lines = running.seen.decode().split("\r\n")
    assert "usb-serial: serial, 1000 kB/s, 1 to 2 ms" in lines
    assert max(len(line) for line in lines) <= PHONE


def test_rejected_pairs_fit_a_phones_terminal() -> None:
    """The line of a pair that is not used goes on below its reason; nothing is wider than 50 columns."""
    [line] = rejections(
        (Rejected("12", Reason.NOT_FOUND_LEFT, "the board is not seen whole and sharp in the left image"),)
    )
    lines = folded(line, PHONE).split("\n")
    assert len(lines) == 3
    assert all(len(each) <= PHONE for each in lines)
    assert all(each.startswith(" " * 10) for each in lines[1:])
