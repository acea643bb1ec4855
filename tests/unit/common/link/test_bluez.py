"""The code that talks to BlueZ, where there is none: one line each. The guest tests it with bluetoothd (tests/vm/test_bluetooth.py)."""

import subprocess
import sys
from pathlib import Path

import pytest

_WITHOUT_LIBRARY = (
    "import sys; sys.modules['dbus_fast'] = None\n"  # what Python does for a package that is not installed
)

_PUBLISH = """
import logging, threading
from common.link.bluez import PublishedRecord
logging.basicConfig(format="%(message)s")
told = threading.Event()
class Heard(logging.Handler):
    def emit(self, record):
        told.set()
logging.getLogger().addHandler(Heard())
record = PublishedRecord(1)
assert told.wait(60)
record.close()
assert threading.active_count() == 1
"""

_LOOK_UP = """
from common.errors import UnavailableError
from common.link.bluez import address_of
try:
    address_of("my board")
except UnavailableError as error:
    print(error, file=sys.stderr)
"""


def _said(script: str, bus: Path) -> list[str]:
    """Run a script with another system bus; return its lines on stderr."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "import sys\n" + script],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[4],
        env={"DBUS_SYSTEM_BUS_ADDRESS": f"unix:path={bus}"},
    )
    return done.stderr.splitlines()


@pytest.mark.parametrize(
    ("begin", "problem", "remedy"),
    [
        (_WITHOUT_LIBRARY, "dbus-fast is not installed", "apt install python3-dbus-fast"),
        ("", "D-Bus does not answer (No such file or directory)", "start dbus"),
    ],
)
def test_what_is_missing_is_told_in_one_line(begin: str, problem: str, remedy: str, tmp_path: Path) -> None:
    """Without dbus-fast, or without a bus, the record's thread says so once, with the remedy, and ends when told to; a name cannot be looked up."""
    (line,) = _said(begin + _PUBLISH, tmp_path / "nobus")
    assert "bluetooth_record_missing channel=1 " in line
    assert problem in line
    assert remedy in line
    assert "address" in line
    (line,) = _said(begin + _LOOK_UP, tmp_path / "nobus")
    assert "'my board'" in line
    assert problem in line
    assert remedy in line
    assert "address" in line
