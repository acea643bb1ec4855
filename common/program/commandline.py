"""What the commands have in common: help begins with examples, an error is one line, exit codes follow the contract."""

import argparse
import contextlib
import errno
import io
import itertools
import os
import re
import signal
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NoReturn

from common.errors import SettingsError, TandemError
from common.program import interrupts
from common.program.interrupts import forget_terminal
from common.program.invocation import as_found
from common.program.out_of_memory import is_out_of_memory, remedy_of, words_of
from common.program.packages import package_error
from common.program.quantities import decimal_number, whole_number
from common.program.terminal import fitted
from common.versions import all_versions

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

_STANDARD: Final = (0, 1, 2)


def mend_streams() -> None:
    """Open what is closed, and let every letter be written.

    A closed descriptor (`>&-`) would go to the next file that is opened, and what native code prints would end up in it. What is written to
    such a stream is lost, as its caller wanted. A letter that the terminal's encoding does not have is written as its code.
    """
    for descriptor in _STANDARD:
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free one: this
    sys.stdin = sys.stdin or open(0, closefd=False)  # noqa: SIM115 - a descriptor, for the whole process
    sys.stdout = sys.stdout or open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = sys.stderr or open(2, "w", closefd=False)  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
    if isinstance(sys.stderr, io.TextIOWrapper) and not isinstance(sys.stderr, _Stderr) and sys.stderr.isatty():
        sys.stderr = _Stderr(
            sys.stderr.buffer, encoding=sys.stderr.encoding, errors=sys.stderr.errors, line_buffering=True
        )


class _Stderr(io.TextIOWrapper):
    """Messages to a terminal. Once that is closed they are lost: a bar that cannot be drawn must not end the work that it shows."""

    def write(self, text: str, /) -> int:
        """Write, as every stream; a terminal that is gone takes everything."""
        try:
            return super().write(text)
        except OSError as error:
            self._forget(error)
            return len(text)

    def flush(self) -> None:
        """Flush, likewise."""
        try:
            super().flush()
        except OSError as error:
            self._forget(error)

    def _forget(self, error: OSError) -> None:
        if error.errno != errno.EIO:
            raise error
        forget_terminal()


INTERRUPTED: Final = interrupts.INTERRUPTED
CHECK_FAILED: Final = 4
"""Exit code: the data are bad, or a check failed."""

_UNAVAILABLE: Final = 3

# Errors on writing to stdout when the disk, a quota, a device or the terminal behind it fails.
_WRITE_FAILURES: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF})


_MISSING: Final = "the following arguments are required: "  # argparse's words


class ExamplesFirstParser(argparse.ArgumentParser):
    """A parser whose help shows its description (the examples) first and unchanged, save that programs are named as the shell finds them.

    Its sub-parsers are of the same class.
    """

    _words: tuple[str, ...] = ()
    """What is being parsed."""

    def __init__(self, *given: Any, **options: Any) -> None:  # noqa: ANN401 - argparse's own
        super().__init__(*given, **options)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # -25mm and -5,10 are values, too

    def add_argument(self, *names: str, **options: Any) -> argparse.Action:  # noqa: ANN401 - argparse's own
        """Declare an argument. What is given must not be empty: to Path, that would be the current folder, and to others as if nothing was given."""
        return super().add_argument(*names, **_with_reader(options))

    def add_argument_group(self, *given: Any, **options: Any) -> Any:  # noqa: ANN401 - argparse's own
        """Begin a titled group of arguments, which are read as the parser's own."""
        return _reading_alike(super().add_argument_group(*given, **options))

    def add_mutually_exclusive_group(self, **options: Any) -> Any:  # noqa: ANN401 - argparse's own
        """Begin a group of arguments that exclude each other, which are read as the parser's own."""
        return _reading_alike(super().add_mutually_exclusive_group(**options))

    def format_help(self) -> str:
        """Return the help text."""
        examples, self.description = self.description or "", None
        try:
            return f"{as_found(examples)}\n{super().format_help()}"
        finally:
            self.description = examples

    def print_help(self, file: "SupportsWrite[str] | None" = None) -> None:
        """Print the help text. Unlike argparse's own method, this does not hide a failure to write it."""
        print(self.format_help(), end="", file=file)

    def parse_known_args(  # type: ignore[override]  # of one type only
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse, and refuse what is left over: the verb's own parser knows best what its options are called.

        `help` and `help VERB` are read as the same with `--help`.
        """
        words = list(sys.argv[1:] if args is None else args)
        if words[:1] == ["help"] and self._subparsers is not None:
            words = [*words[1:2], "--help"]
        self._words = tuple(words)
        if self._subparsers is None:
            self._refuse_idle_dashes(words)
        options, rest = super().parse_known_args(words, namespace)
        if rest:
            self.error(self._unknown(rest))
        return options, rest

    def _refuse_idle_dashes(self, words: Sequence[str]) -> None:
        """Refuse `--option=--`. argparse takes these dashes out of the option's values, and gives it an empty list."""
        before = itertools.takewhile(lambda word: word != "--", words)
        if given := next((word for word in before if word.startswith("-") and word.endswith("=--")), ""):
            self.error(f"argument {given.partition('=')[0]}: expected one argument")

    def _unknown(self, rest: Sequence[str]) -> str:
        """Say what is wrong with arguments that nothing takes."""
        options = [word.partition("=")[0] for word in rest if word.startswith("-")]
        if options:
            return f"unknown option {options[0]}{_guess(options[0], self._option_string_actions)}"
        return f"nothing takes {' '.join(rest[:3])}{' ...' if rest[3:] else ''} (put patterns such as 'left*.jpg' in quotes)"

    def _is_unknown(self, word: str) -> bool:
        """Return whether a word is an option that this parser does not have, not even by its beginning."""
        if not re.match(r"--?[A-Za-z]", word):  # a value, such as -1
            return False
        name, known = word.partition("=")[0], self._option_string_actions
        return word[:2] not in known and not any(option.startswith(name) for option in known)

    def error(self, message: str) -> NoReturn:
        """Say in one line of plain words what argparse found wrong.

        An unknown option goes before what is missing: the one may be the other, misspelt.

        Raises:
            SettingsError: always.
        """
        if message.startswith(_MISSING) and (unknown := [word for word in self._words if self._is_unknown(word)]):
            message = self._unknown(unknown)
        refusal = SettingsError(f"{_plain(' '.join(message.split()))}", f"see {self.prog} --help")
        refusal.program = self.prog
        raise refusal


def _guess(word: str, known: Iterable[str]) -> str:
    """What was probably meant, in brackets; empty if nothing is near."""
    import difflib  # noqa: PLC0415 - only for mistakes; a start does not pay for it

    close = difflib.get_close_matches(word, list(known), 1, cutoff=0.65)
    return f" (did you mean {close[0]}?)" if close else ""


def _path(text: str) -> Path:
    """Read a path."""
    if not text:
        raise argparse.ArgumentTypeError("is empty (name a file or folder; . is the current folder)")
    return Path(text)


def _text(text: str) -> str:
    """Read a text."""
    if not text:
        raise argparse.ArgumentTypeError("is empty (give a value)")
    return text


_READERS: Final[dict[Any, Callable[[str], Any]]] = {Path: _path, str: _text, int: whole_number, float: decimal_number}
"""What reads the values of arguments that are declared with one of Python's own types."""


def _with_reader(options: dict[str, Any]) -> dict[str, Any]:
    """Return how an argument is declared, with what reads its values."""
    if options.get("action", "store") not in {"store", "append"}:
        return options
    kind = options.get("type", str)
    return {**options, "type": _READERS.get(kind, kind)}


def _reading_alike(group: Any) -> Any:  # noqa: ANN401 - argparse's groups
    """Have a group of arguments read their values as the parser's own do: argparse's groups do not ask the parser."""
    declare = group.add_argument
    group.add_argument = lambda *names, **options: declare(*names, **_with_reader(options))
    return group


def _no_choice(name: str, given: str, choices: Sequence[str]) -> str:
    """Say that a value is none of those there are."""
    if name == "VERB":
        verb = given.strip("'")
        listed = f" (the verbs are {', '.join(choices)})"
        return f"unknown verb {verb}{_guess(verb, choices) or listed}"
    listed = " or ".join(filter(None, (", ".join(choices[:-1]), choices[-1])))
    return f"{name} is {given}, but must be {listed}"


def _plain(message: str) -> str:
    """Put argparse's own messages into plain words."""
    if found := re.fullmatch(r"argument (\S+): invalid choice: (.*?) \(choose from (.*)\)", message):
        return _no_choice(found[1], found[2], re.findall(r"[^\s,']+", found[3]))
    if found := re.fullmatch(r"argument (\S+): invalid (decimal|whole)_number value: (.*)", message):
        kind = "a whole number, such as 30" if found[2] == "whole" else "a number without a unit, such as 1.5"
        return f"{found[1]} is {found[3]}, but must be {kind}"
    if found := re.fullmatch(r"argument (\S+): expected (?:one|at least one|\d+) arguments?", message):
        return f"{found[1]} needs a value"
    if found := re.fullmatch(r"argument (.+?): (is empty .*)", message):
        return f"{found[1]} {found[2]}"
    if found := re.fullmatch(rf"{_MISSING}(.*)", message):
        return f"missing: {found[1]}"
    return message


class _VersionAction(argparse.Action):
    """Prints the versions and exits. Unlike argparse's own action, this does not hide a failure to write them."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(all_versions())
        parser.exit()


def add_version_option(parser: argparse.ArgumentParser) -> None:
    """Add `--version`."""
    parser.add_argument(
        "--version", action=_VersionAction, nargs=0, help="print the versions of package, wire and files"
    )


class _ManualAction(argparse.Action):
    """Prints the man page, or what completes command lines in a shell, and exits."""

    def __call__(self, parser: argparse.ArgumentParser, _: object, shell: Any, *__: object) -> None:  # noqa: ANN401 - argparse's own
        from common.program.manual import completion, man_page  # noqa: PLC0415 - a start does not pay for it

        print(completion(parser, shell) if shell else man_page(parser), end="")
        parser.exit()


def add_manual_options(parser: argparse.ArgumentParser) -> None:
    """Add `--man` and `--completion`.

    Args:
        parser: the command's own parser.
    """
    parser.add_argument("--man", action=_ManualAction, nargs=0, help="print the man page")
    parser.add_argument(
        "--completion",
        action=_ManualAction,
        choices=("bash", "zsh", "fish"),
        help="print a script that completes command lines in this shell",
    )


def run_command(
    parser: argparse.ArgumentParser, arguments: Sequence[str] | None, command: Callable[[argparse.Namespace], int]
) -> int:
    """Run one command from its arguments to its exit code, and flush everything it prints.

    An error is one line on stderr; `--debug` shows the traceback instead. A full disk behind stdout is such an error. A reader that has closed
    its end (`| head -1`) is not: the command stays silent and keeps its exit code, or exits with 0 if it was cut short while printing.

    Args:
        parser: defines `--debug`, and the verbs if there are any.
        arguments: without the program's name; None: those of the process.
        command: takes the options, returns the exit code; prints its output when it is done.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a device or link cannot be had or stdout cannot be written, 4 bad data, 129, 130, 131 and 143 ended by a signal.
    """
    words = sys.argv[1:] if arguments is None else arguments
    options = argparse.Namespace(debug="--debug" in words)  # before they are read: to read them may already fail
    code = 0
    mend_streams()
    try:
        code = _ran(parser, arguments, command, options)
        if sys.stdout is not None:  # a process may be started without one
            sys.stdout.flush()
    except BrokenPipeError:
        _forget_stdout()
    except OSError as error:
        _forget_stdout()
        if options.debug or error.errno not in _WRITE_FAILURES or error.filename is not None:
            raise
        _say(f"{parser.prog}: error: stdout cannot be written ({error.strerror}): make room, or send it elsewhere")
        return _UNAVAILABLE
    return code


def _ran(
    parser: argparse.ArgumentParser,
    arguments: Sequence[str] | None,
    command: Callable[[argparse.Namespace], int],
    options: argparse.Namespace,
) -> int:
    try:
        return command(parser.parse_args(arguments, options))
    except SystemExit as leaving:  # argparse, after --help
        return leaving.code if isinstance(leaving.code, int) else 0
    except TandemError as error:
        if options.debug and not error.program:
            raise
        _say(f"{error.program or parser.prog}: error: {error}")
        return error.exit_code
    except ImportError as error:
        missing = package_error(error)
        if options.debug or missing is None:
            raise
        _say(f"{parser.prog}: error: {missing}")
        return missing.exit_code
    except KeyboardInterrupt as error:
        number = error.number if isinstance(error, interrupts.StopRequested) else signal.SIGINT
        if not interrupts.is_heard():
            interrupts.leave(number)  # saying so would block, and the interpreter's end too
        word, code = interrupts.ENDINGS[number]
        _say(f"{parser.prog}: {word}")
        return code
    except Exception as error:
        if options.debug or not is_out_of_memory(error):
            raise
        _say(f"{parser.prog}: error: memory ran out{words_of(error)}: {remedy_of(vars(options))}")
        return CHECK_FAILED


def _say(line: str) -> None:
    with contextlib.suppress(OSError):  # if stderr is gone too, the exit code must suffice
        print(fitted(line, sys.stderr), file=sys.stderr)


def _forget_stdout() -> None:
    """Send what is still buffered nowhere. The interpreter flushes once more at its end, and would complain in its own words."""
    with contextlib.suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
