"""delay-bench: its options, and its command, which is imported only when it runs."""

import argparse
import importlib
import sys
from collections.abc import Sequence

from common.program.commandline import ExamplesFirstParser, add_version_option, run_command
from common.program.interrupts import interruptible
from common.program.invocation import as_found
from phone_host.bench.arguments import EXAMPLES, NEXT_STEPS, add_arguments


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a link, a process or stdout is not available, 4 nothing was measured,
        130 interrupted.
    """
    given = sys.argv[1:] if arguments is None else arguments
    return run_command(parser(), given, _run if given else _next_steps)


def parser() -> argparse.ArgumentParser:
    """Make the parser with all options."""
    made = ExamplesFirstParser("delay-bench", description=EXAMPLES)
    add_version_option(made)
    add_arguments(made)
    made.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    made.add_argument("--debug", action="store_true", help="show tracebacks")
    return made


def _next_steps(_: argparse.Namespace) -> int:
    """Say what can be done: a bare name must not start minutes of work."""
    print(as_found(NEXT_STEPS), end="")
    return 0


def _run(options: argparse.Namespace) -> int:
    """Import what the options ask for, and run it. The only place that imports by name."""
    if options.emulate == "list":
        module = "profile_list"
    else:
        module = "command"
        importlib.import_module("numpy")  # before OpenCV, as in phone_host/cli.py
    command = importlib.import_module(f"phone_host.bench.{module}")
    from phone_host.output.folder_lock import command_locks  # noqa: PLC0415 - the help needs none

    with interruptible(), command_locks():
        code: int = command.run(options)
    return code


if __name__ == "__main__":
    sys.exit(main())
