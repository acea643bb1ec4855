"""What the documentation says is what the programs do."""

import json
import re
from pathlib import Path

import pytest

import board_agent.cli
import phone_host.bench.cli
import phone_host.cli
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.docs import troubleshooting
from tests.docs.commands import ROOT, Command, documented, pages
from tests.docs.imports import PICTURE, reduced, rooms
from tests.docs.message_texts import Code
from tests.support.requests import verbs_in
from tests.support.rigs import unlike_rig
from tests.support.samples import LEDGER

_PARSERS = {
    "phone-host": phone_host.cli.parser,
    "board-agent": board_agent.cli.parser,
    "delay-bench": phone_host.bench.cli.parser,
}
_COMMANDS = documented()


@pytest.fixture(scope="module")
def code() -> Code:
    """All our packages; no constant, since every worker would read them."""
    return Code(troubleshooting.packages())


@pytest.mark.parametrize("command", _COMMANDS, ids=lambda command: f"{command.page} {command.line}"[:90])
def test_every_command_line_is_one_that_the_program_takes(command: Command) -> None:
    """The real parser accepts it; text that only names a verb names an existing one."""
    parser = _PARSERS[command.words[0]]()
    if command.is_mention:
        assert set(command.named[1:]) <= verbs_in(parser).keys()
    else:
        parser.parse_args(command.words[1:])


def test_the_pages_are_read() -> None:
    """Each page of the first steps has command lines, so that a change of layout cannot empty the test above."""
    counts = {
        page.name: sum(command.page.startswith(str(page.relative_to(ROOT))) for command in _COMMANDS)
        for page in pages()
    }
    for name in ("README.md", "first-scan.md", "board.md", "host.md", "calibration.md", "delays.md", "links.md"):
        assert counts[name] >= 2, name


def test_every_error_stands_in_troubleshooting_with_its_remedy(code: Code) -> None:
    """The page's maker can read every message (`make docs` writes the page)."""
    assert troubleshooting.unresolved(code) == []


def test_troubleshooting_misses_no_error(code: Code) -> None:
    """There are as many messages as calls that make errors, counted in the source text, not in the tree that the page is made from."""
    raised = re.compile(rf"\b({'|'.join(code.errors)})\(\n?\s*[^)\s]")
    in_text = sum(len(raised.findall(path.read_text(encoding="utf-8"))) for path in troubleshooting.packages())
    rows = [line for line in troubleshooting.page(code).splitlines() if line.endswith(("| 2 |", "| 3 |", "| 4 |"))]
    assert in_text >= 250
    assert len(rows) >= 0.9 * in_text  # some places say the same


def test_every_key_of_our_files_is_described(tmp_path: Path) -> None:
    """Each key of a rig.yaml and of a line of delays.jsonl is on the page of file formats."""
    described = set(re.findall(r"`(\w+)`", (ROOT / "docs" / "files.md").read_text(encoding="utf-8")))
    rig = unlike_rig()
    write_rig(tmp_path / "rig.yaml", rig, rectify_rig(rig))
    keys = set(re.findall(r"^(\w+):", (tmp_path / "rig.yaml").read_text(encoding="utf-8"), re.MULTILINE))
    line = json.loads(LEDGER.to_json())
    assert len(keys) + len(line) >= 40
    assert keys | set(line) <= described


def test_readme_is_one_screen() -> None:
    """At most 120 lines of 120 characters, and 900 words; every figure in it comes from the page of figures."""
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 120
    assert max(map(len, lines)) <= 120
    assert sum(len(line.split()) for line in lines) <= 900


def test_the_picture_of_imports_is_of_this_code() -> None:
    """Each room of phone_host and each import that no other implies; `python -m tests.docs.imports` draws it anew."""
    drawn = set(re.findall(r"<title>([\w&#;]+)</title>", PICTURE.read_text(encoding="utf-8"))) - {"imports"}
    graph = reduced(rooms())
    assert drawn == graph.keys() | {f"{room}&#45;&gt;{other}" for room in graph for other in graph[room]}
    assert "geometry" in drawn
