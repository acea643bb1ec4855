"""The command's first moment: from here on Ctrl-C ends it with one line and 130, even while its imports run."""

import sys

from common.program.interrupts import leave_at_once


def main() -> int:
    """Start board-agent; return its exit code."""
    leave_at_once()
    from board_agent.cli import main as command  # noqa: PLC0415 - importing it is what must be interruptible

    return command()


if __name__ == "__main__":
    sys.exit(main())
