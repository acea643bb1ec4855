"""A process whose parent closed its standard streams."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]

_TOLD = """
import os, sys
from common.program.commandline import mend_streams
from common.program.terminal import columns, rows, say
assert columns() == rows() == 0
mend_streams()
say("to nowhere: \\u2713 \\udcff")
assert columns() == rows() == 0
os.write(int(sys.argv[1]), str(os.open(os.devnull, os.O_RDONLY)).encode())
"""


def test_closed_streams_are_opened_to_nowhere() -> None:
    """Without stdin and stdout nothing fails, and a file that is opened later does not become one of them."""
    read, write = os.pipe()
    shell = 'exec "$0" -P -c "$1" "$2" <&- >&-'
    words = ["sh", "-c", shell, sys.executable, _TOLD, str(write)]
    done = subprocess.run(words, cwd=ROOT, pass_fds=(write,), stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert int(os.read(read, 10)) > 2
    for descriptor in (read, write):
        os.close(descriptor)
