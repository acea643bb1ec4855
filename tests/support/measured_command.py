"""Runs `phone-host` as a process of its own, and measures the memory that it takes."""

import subprocess
import sys

_MEASURED = (
    "import sys; from phone_host.cli import main; code = main(sys.argv[1:]); "
    "print(open('/proc/self/status').read().partition('VmHWM:')[2].split()[0]); sys.exit(code)"
)
"""Of this program alone: what getrusage tells also holds the memory of the one that started it."""


def run_measured(*words: str) -> tuple[int, str, list[str], int]:
    """Run `phone-host`.

    Args:
        words: the arguments.

    Returns:
        The exit code, what it printed, the lines of its errors, and its greatest memory, bytes.
    """
    ended = subprocess.run(
        [sys.executable, "-c", _MEASURED, *words], capture_output=True, text=True, timeout=60, check=False
    )
    printed, _, peak = ended.stdout.rstrip().rpartition("\n")
    return ended.returncode, printed, ended.stderr.splitlines(), 1024 * int(peak)
