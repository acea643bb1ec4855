"""The page of figures: what it says about made-up results, and that README quotes nothing else."""

import json
import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from tests.bench.bench_board import Figures
from tests.bench.board_guest import Cost
from tests.docs.commands import ROOT
from tests.docs.figure_sources import SOURCES, Source, Topic
from tests.docs.figures import PAGE, Outcome, load, page

_BY_NAME = {source.name: source for source in SOURCES}
_LIMIT_MS = 35.0

_QUANTITY = re.compile(r"\d+(?:\.\d+)?(?: (?:%|px|mm|us|ms|s|MB)(?![a-z]))?")
"""A number with its unit."""


def _age(p95_ms: float) -> dict[str, Any]:
    """What bench_age prints, with one row."""
    windows = [{"frames": 150, "p50_ms": 1.0, "p95_ms": p95_ms, "max_ms": 50.0}] * 2
    row = {"name": "FIFO 1:drop-oldest", "link": windows, "pipeline": windows, "camera_hz": 29.98, "used_hz": 3.0}
    verdict = {"what": "age at the link", "reached": p95_ms <= _LIMIT_MS, "found": f"{p95_ms} ms", "limit": "35.0 ms"}
    return {"machine": "m", "seconds": 5.0, "rows": [row], "verdicts": [verdict]}


def _outcome(data: dict[str, Any], code: int = 0, reason: str = "") -> Outcome:
    return Outcome("python -m tests.bench.x --json", "2026-01-02T03:04:05+0000", "A CPU, 2 cores", code, reason, data)


def _section(text: str, topic: Topic) -> str:
    return text.partition(f"## {topic.value}\n")[2].partition("\n## ")[0]


def test_a_result_is_told_in_rows_with_command_machine_and_date(tmp_path: Path) -> None:
    """Figure, limit and verdict stand in a row; command, machine and day in one line below the table."""
    (tmp_path / "age.json").write_text(json.dumps(asdict(_outcome(_age(12.5)))), encoding="utf-8")
    section = _section(page(load(tmp_path)), Topic.AGE)
    assert "| age at the link | 12.5 ms | 35.0 ms: reached |" in section
    assert re.search(r"\| FIFO 1:drop-oldest: .* \| 12\.5 ms / 12\.5 ms; 30\.0 \|  \|", section)
    assert "`python -m tests.bench.x --json`, A CPU, 2 cores, 2026-01-02\n" in section


def test_a_missed_figure_is_told() -> None:
    """A missed figure is reported in its row, and at the head of the page with what was found."""
    text = page({"age": _outcome(_age(77.5), code=4)})
    assert "| age at the link | 77.5 ms | 35.0 ms: **missed** |" in text
    assert "Of 1 figures that are to be reached, 0 were." in text
    assert (
        "**Missed:**\n\n- Age and queues: age at the link: 77.5 ms (to reach: 35.0 ms)\n" in text.partition("\n## ")[0]
    )


def test_the_board_is_told_where_it_can_be_measured() -> None:
    """CPU time per frame and memory, from what bench_board counts: 600 frames in 6 s of CPU time are 10 ms each."""
    cost = Cost(frames=600, seconds=20.0, cpu_ns=6_000_000_000, system_ns=1, resident_bytes=25_000_000)
    found = asdict(Figures(quiet=True, interpreter_s=2.0, costs={"C program": [cost]})) | {"verdicts": []}
    section = _section(page({"board": _outcome(json.loads(json.dumps(found)))}), Topic.BOARD)
    assert "| C program: CPU time a frame; resident memory | 10.00 ms; 25.0 MB |" in section


def test_a_source_that_cannot_run_here_is_told_with_its_reason() -> None:
    """One line with the reason and its command, and no table."""
    section = _section(page({"board": _outcome({}, code=3, reason="no root | here")}), Topic.BOARD)
    assert "Not measured on this machine: no root \\| here.\n" in section
    assert f"`{_BY_NAME['board'].command}`" in section
    assert "| what is measured |" not in section


def test_without_any_result_every_source_is_named() -> None:
    """The page has all sections, each with its commands, and claims nothing."""
    text = page({})
    assert [line[3:] for line in text.splitlines() if line.startswith("## ")] == [topic.value for topic in Topic]
    assert all(f"`{source.command}`" in text for source in SOURCES)
    assert "Of 0 figures that are to be reached, 0 were." in text


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.name)
def test_commands_name_no_path_of_a_machine(source: Source) -> None:
    """Only $SCAN_DATA, and folders of the project."""
    assert not re.search(r'(^|[\s"])(/|~)', source.command)
    assert source.command.endswith(" --json")


def test_the_committed_page_has_every_source() -> None:
    """Today's sources wrote it: it has each command, and no folder of the machine that wrote it."""
    text = PAGE.read_text(encoding="utf-8")
    assert all(f"`{source.command}`" in text for source in SOURCES)
    assert not re.search(r"/(home|root|work|tmp|Users)/", text)


def test_readme_quotes_at_most_eight_figures_and_each_stands_on_the_page() -> None:
    """Every number in README's table is on the page of figures with its unit: whoever measures again must update README."""
    section = (ROOT / "README.md").read_text(encoding="utf-8").partition("## Figures\n")[2].partition("\n## ")[0]
    rows = [line.split("|")[1:-1] for line in section.splitlines() if line.startswith("| ")][1:]
    assert 1 <= len(rows) <= 8
    text = PAGE.read_text(encoding="utf-8")
    for row in rows:
        for quantity in _QUANTITY.findall(" ".join(row)):
            assert re.search(rf"(?<![\d.]){re.escape(quantity)}(?!\d|\.\d)", text), f"{quantity} of{row[0]}"


def test_one_source_measured_anew_leaves_the_sections_of_the_others() -> None:
    """On a machine without the others' results their sections stay as they were, and the head counts and names their figures, too."""
    before = PAGE.read_text(encoding="utf-8")
    age = replace(_outcome(_age(12.5)), command=_BY_NAME["age"].command)
    assert page({}, before) == before
    text = page({"age": age}, before)
    for topic in (Topic.DEPTH, Topic.CLOCK, Topic.BOARD):
        assert _section(text, topic) == _section(before, topic)
    assert "| age at the link | 12.5 ms | 35.0 ms: reached |" in _section(text, Topic.AGE)
    missed = [line for line in before.partition("\n## ")[0].splitlines() if line.startswith("- Links: ")]
    assert missed
    assert set(missed) <= set(text.partition("\n## ")[0].splitlines())
