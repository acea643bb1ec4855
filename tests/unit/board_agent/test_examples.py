"""What the programs suggest is what they take: examples in every help, and what a bare name prints."""

import ast
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import board_agent.cli
import phone_host.api
import phone_host.bench.cli
import phone_host.cli
from common.errors import SettingsError
from common.program.invocation import PROGRAMS
from common.versions import all_versions
from tests.support.requests import verbs_in

MAINS: dict[str, Callable[[list[str]], int]] = {
    "phone-host": phone_host.cli.main,
    "board-agent": board_agent.cli.main,
    "delay-bench": phone_host.bench.cli.main,
}
PARSERS = {
    "phone-host": phone_host.cli.parser,
    "board-agent": board_agent.cli.parser,
    "delay-bench": phone_host.bench.cli.parser,
}


CALLS = [(program, [verb] if verb else []) for program in PROGRAMS for verb in ("", *verbs_in(PARSERS[program]()))]
named = pytest.mark.parametrize(
    ("program", "verb"), CALLS, ids=lambda value: " ".join(value) if isinstance(value, list) else value
)


@pytest.fixture(autouse=True)
def on_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs of this installation are found by their names."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:/usr/bin")


def suggested(text: str) -> list[list[str]]:
    """The words of each command line in a text, without variables and sudo. A trailing backslash joins lines."""
    found = []
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True) if line.startswith("  ") and not line.startswith("   ") else []
        while words and (words[0] == "sudo" or "=" in words[0]):
            words = words[1:]
        if words and Path(words[0]).name in PROGRAMS:
            found.append([Path(words[0]).name, *words[1:]])
    return found


def refusal(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """What the real parser has against the line; empty if it takes it, or prints what the line asks for."""
    try:
        PARSERS[words[0]]().parse_args(words[1:])
    except SystemExit:
        capsys.readouterr()
    except SettingsError as error:
        return str(error)
    return ""


@named
def test_every_help_shows_its_own_examples(program: str, verb: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """The examples of a verb come first and call this verb, one with each kind of need, and the parser takes every one of them."""
    assert MAINS[program]([*verb, "--help"]) == 0
    told = capsys.readouterr().out
    assert told.startswith("examples:\n")
    # Where a verb is still to be chosen, the help shows none of its options.
    assert ("--debug" in told) is (bool(verb) or program == "delay-bench")
    examples = suggested(told.partition("\nusage:")[0])
    assert len(examples) >= 2
    for words in examples:
        assert words[: 1 + len(verb)] == [program, *verb]
        assert refusal(words, capsys) == ""


@named
def test_every_command_and_verb_tells_its_version(
    program: str, verb: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """`--version` is understood wherever it stands first, also where a verb has required arguments."""
    assert MAINS[program]([*verb, "--version"]) == 0
    assert capsys.readouterr().out == all_versions() + "\n"


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_bare_name_says_what_can_be_done_next(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    """It fits a screen of 24 lines and 120 columns, leads to the help, each task has a sentence, and each command is one that the program takes."""
    assert MAINS[program]([]) == 0
    told = capsys.readouterr().out
    lines = told.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 120
    assert [program, "--help"] in suggested(told)
    tasks = [line for line in lines[1:] if line and not line.startswith(" ")]
    assert len(tasks) >= 4
    assert all(line.endswith(":") for line in tasks)
    for words in suggested(told):
        assert refusal(words, capsys) == ""


def test_a_program_not_on_the_path_is_suggested_by_its_path(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every line that one would paste begins with a file that exists, in the help and after the bare name."""
    monkeypatch.setenv("PATH", "/usr/bin:/bin")
    monkeypatch.chdir("/")
    for arguments in ([], ["--help"]):
        assert phone_host.cli.main(arguments) == 0
        told = capsys.readouterr().out.partition("\nusage:")[0]
        commands = [shlex.split(line)[0] for line in told.splitlines() if line.startswith("  ")]
        assert len(commands) >= 4
        assert all(Path(command).is_file() for command in commands)


@pytest.mark.parametrize("program", ["phone-host", "board-agent"])
def test_help_is_a_word_too(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    """`phone-host help` is `phone-host --help`, and `phone-host help run` is `phone-host run --help`."""
    for words, meant in ((["help"], ["--help"]), (["help", "run"], ["run", "--help"])):
        assert MAINS[program](words) == 0
        said = capsys.readouterr().out
        assert MAINS[program](meant) == 0
        assert said == capsys.readouterr().out


@pytest.mark.parametrize(
    "example", sorted((Path(__file__).parents[3] / "examples").glob("*.py")), ids=lambda path: path.stem
)
def test_examples_import_only_what_stays(example: Path) -> None:
    """Of this project they import the API alone, and from it only names that it lists: all else may move."""
    imports = [
        node for node in ast.walk(ast.parse(example.read_text())) if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    for node in imports:
        modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names]
        ours = {module for module in modules if module.partition(".")[0] in {"phone_host", "board_agent", "common"}}
        assert ours <= {"phone_host.api"}
        if ours:
            assert {alias.name for alias in node.names} <= set(phone_host.api.__all__)
