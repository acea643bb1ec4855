"""The commands' first moment: from here on Ctrl-C ends them with one line and 130, even while their imports run."""

import sys

from common.program.interrupts import leave_at_once


def phone_host() -> int:
    """Start phone-host; return its exit code."""
    leave_at_once()
    from phone_host.cli import main  # noqa: PLC0415 - importing it is what must be interruptible

    return main()


def delay_bench() -> int:
    """Start delay-bench; return its exit code."""
    leave_at_once()
    from phone_host.bench.cli import main  # noqa: PLC0415 - as above

    return main()


if __name__ == "__main__":
    sys.exit(phone_host())
