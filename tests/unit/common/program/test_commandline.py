"""What all commands have in common: errors are one line, wherever they come from."""

import errno
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

import pytest

from common.errors import DataError, SettingsError, UnavailableError
from common.program.commandline import ExamplesFirstParser, run_command


def sample() -> ExamplesFirstParser:
    parser = ExamplesFirstParser("sample", description="examples:\n  sample run\n")
    verb = parser.add_subparsers(dest="verb", required=True, metavar="VERB").add_parser("run")
    verb.add_argument("--count", type=int, required=True)
    verb.add_argument("--kind", choices=("a", "b"))
    return parser


@pytest.mark.parametrize(
    ("arguments", "start", "culprit"),
    [
        ([], "sample: error: ", "VERB"),
        (["walk"], "sample: error: ", "walk"),
        (["run"], "sample run: error: ", "--count"),
        (["run", "--count", "many\nlines"], "sample run: error: ", "many"),
        (["run", "--count", "1", "--kind", "c"], "sample run: error: ", "--kind is 'c', but must be a or b: see"),
        (["run", "--count", "1", "--spee\nd", "3"], "sample run: error: ", "--spee"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_2(
    arguments: list[str], start: str, culprit: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Errors of the command or of a verb are one line on stderr that names the culprit, without the usage."""
    assert run_command(sample(), arguments, lambda _: 0) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(start)
    assert said.err.endswith(" --help\n")
    assert said.err.count("\n") == 1
    assert culprit in said.err


def run(command: Callable[[Namespace], int], arguments: list[str] | None = None) -> int:
    parser = ExamplesFirstParser("sample")
    parser.add_argument("--debug", action="store_true")
    return run_command(parser, arguments or [], command)


def failing(error: BaseException) -> Callable[[Namespace], int]:
    def command(_: Namespace) -> int:
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (SettingsError("--a is 3", "give 2"), 2, "sample: error: --a is 3: give 2\n"),
        (UnavailableError("no link", "plug it in"), 3, "sample: error: no link: plug it in\n"),
        (DataError("bad", "mend it"), 4, "sample: error: bad: mend it\n"),
        (KeyboardInterrupt(), 130, "sample: interrupted\n"),
    ],
)
def test_errors_are_one_line_and_their_exit_code(
    error: BaseException, code: int, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each error class, and Ctrl-C, gives one line on stderr and its exit code."""
    assert run(failing(error)) == code
    assert capsys.readouterr().err == line


def test_the_commands_own_code_is_given_and_help_is_0(capsys: pytest.CaptureFixture[str]) -> None:
    """What the command returns is the exit code; --help gives 0, an unknown option 2."""
    assert run(lambda _: 4) == 4
    assert run(lambda _: 4, ["--help"]) == 0
    assert run(lambda _: 4, ["--speed"]) == 2
    assert "--debug" in capsys.readouterr().out


def test_debug_shows_the_traceback() -> None:
    """With --debug the error goes on to the interpreter."""
    with pytest.raises(SettingsError):
        run(failing(SettingsError("a", "b")), ["--debug"])


def test_an_error_that_is_not_stdouts_is_not_called_so() -> None:
    """An OSError about a file is a bug in our code and stays one."""
    with pytest.raises(OSError, match="No space"):
        run(failing(OSError(errno.ENOSPC, "No space left on device", "cloud.ply")))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["ron"], "unknown verb ron (did you mean run?)"),
        (["walk"], "unknown verb walk (the verbs are run)"),
        (["run"], "missing: --count"),
        (["run", "--cuont", "3"], "unknown option --cuont (did you mean --count?)"),
        (["--spede"], "unknown option --spede"),
        (["run", "--count"], "--count needs a value"),
        (["run", "--count", "3", "--knid", "a"], "unknown option --knid (did you mean --kind?)"),
        (["run", "--count", "3", "left2.jpg"], "nothing takes left2.jpg (put patterns such as 'left*.jpg' in quotes)"),
        (["run", "--count", "-3mm"], "--count is '-3mm', but must be a whole number, such as 30"),
        (["run", "--count", "3mm"], "--count is '3mm', but must be a whole number, such as 30"),
    ],
)
def test_a_mistake_of_typing_is_named(arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The line says which word is wrong and, if a known one is close, what was probably meant."""
    assert run_command(sample(), arguments, lambda _: 0) == 2
    assert told in capsys.readouterr().err


def test_an_empty_path_is_refused() -> None:
    """To a shell variable that is not set, `--out "$OUT"` must not mean the current folder."""
    parser = ExamplesFirstParser("sample", description="")
    parser.add_argument("--out", type=Path)
    with pytest.raises(SettingsError, match="--out is empty"):
        parser.parse_args(["--out", ""])
    assert parser.parse_args(["--out", "."]).out == Path()


@pytest.mark.parametrize(
    ("arguments", "culprit"),
    [
        (["--kind", ""], "--kind is empty"),
        (["--kind=--"], "--kind needs a value"),
        (["--count=--"], "--count needs a value"),
        (["--size=--"], "--size needs a value"),
        (["--out=--"], "--out needs a value"),
        (["--count", "1_0"], "--count is '1_0'"),
        (["--size", "\u0661"], "--size is '\u0661'"),
        ([""], "IMAGE is empty"),
        (["--kind\x1b[31m"], r"--kind\x1b[31m"),
    ],
)
def test_values_that_nobody_means_are_wrong_usage(
    arguments: list[str], culprit: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing at all, two dashes and numbers in other scripts are refused for every kind of argument; the line controls no terminal."""
    parser = ExamplesFirstParser("sample")
    parser.add_argument("images", nargs="*", metavar="IMAGE")
    parser.add_argument("--kind")
    parser.add_argument("--count", type=int)
    parser.add_argument("--size", type=float)
    parser.add_argument("--out", type=Path)
    assert run_command(parser, arguments, lambda _: 0) == 2
    said = capsys.readouterr().err
    assert culprit in said
    assert said.rstrip("\n").isprintable()
    assert run_command(parser, ["--kind=-", "--", "--count=--"], lambda options: len(options.images)) == 1
