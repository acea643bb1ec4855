"""The commands' help as a new user sees it, by real processes; tests/unit/board_agent/test_examples.py looks at every verb's."""

import shlex
from pathlib import Path

import pytest

from tests.support.programs import program

COMMANDS = [
    *((module, verb) for module in ("board_agent.cli", "phone_host.cli") for verb in ([], ["run"])),
    ("phone_host.bench.cli", []),
]


@pytest.mark.parametrize(
    ("module", "verb"), COMMANDS, ids=lambda value: " ".join(value) if isinstance(value, list) else value
)
def test_help_opens_with_examples(module: str, verb: list[str], tmp_path: Path) -> None:
    """--help of a command and of a verb ends with exit 0 and opens with examples that begin with the command's own name."""
    with program(module, [*verb, "--help"], tmp_path, "help") as running:
        assert running.wait() == 0
    first, second = running.out.read_text().splitlines()[:2]
    assert first == "examples:"
    name = {"board_agent.cli": "board-agent", "phone_host.cli": "phone-host", "phone_host.bench.cli": "delay-bench"}[
        module
    ]
    words = [word for word in shlex.split(second, comments=True) if word != "sudo" and "=" not in word]
    assert Path(words[0]).name == name  # with its folder, where the shell does not find it by its name


@pytest.mark.parametrize("module", ["board_agent.cli", "phone_host.cli", "phone_host.bench.cli"])
def test_a_bare_name_says_what_can_be_done(module: str, tmp_path: Path) -> None:
    """Without arguments a program prints what one can do next, and runs nothing; this is no error."""
    with program(module, [], tmp_path, "bare") as running:
        assert running.wait() == 0
    assert "try it" in running.out.read_text() or "a first look" in running.out.read_text()
    assert running.stderr == ""
    assert [path.name for path in tmp_path.iterdir() if not path.name.startswith("bare")] == []
