"""RFCOMM on a machine without Bluetooth, and units that fill its frames. The link itself is tested in the guest (tests/vm/test_bluetooth.py)."""

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import SettingsError, UnavailableError
from common.link.factory import open_link, parse_link
from common.link.rfcomm_socket import FRAME_BYTES
from common.protocol.pacing import fill
from tests.support.devices import MissingError, adapters


@pytest.mark.parametrize(
    "uri", ["rfcomm://*/1", "rfcomm://AA:BB:CC:DD:EE:FF/1?connect=1", "rfcomm://my%20board?connect=1"]
)
def test_a_machine_without_bluetooth_says_so(uri: str) -> None:
    """If Python, the kernel or the machine lacks Bluetooth, either side prints one line with the remedy and exits with 3."""
    try:
        if adapters():
            pytest.skip("this machine has Bluetooth")
    except MissingError:
        pass
    with pytest.raises(UnavailableError, match="Bluetooth") as caught:
        open_link(parse_link(uri, listens_by_default=True))
    assert caught.value.exit_code == 3
    assert "\n" not in str(caught.value)
    assert caught.value.remedy


@pytest.mark.parametrize("link", ["rfcomm://*", "rfcomm://my%20board?connect=1"])
def test_a_python_without_bluetooth_says_so(link: str, tmp_path: Path) -> None:
    """With a Python built without Bluetooth sockets, board-agent run prints one line that says so and what to do, and exits with 3."""
    (tmp_path / "1.pgm").write_bytes(b"P5 2 2 255\nabcd")
    script = f"""
import socket, sys
vars(socket).pop("AF_BLUETOOTH", None)  # as in such a build
from board_agent.cli import main
sys.exit(main(["run", "--camera", "replay:{tmp_path}?fps=10&loop=1", "--link", "{link}"]))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, cwd=Path(__file__).parents[4]
    )
    assert done.returncode == 3, done.stderr
    assert done.stderr.splitlines()[-1] == (
        "board-agent: error: this Python was built without Bluetooth: use the system's own, or build one with libbluetooth-dev installed"
    )
    assert "Traceback" not in done.stderr


def test_what_cannot_be_dialled_or_listened_on() -> None:
    """Dialling needs a device; listening needs nothing or an adapter's address."""
    with pytest.raises(SettingsError):
        open_link(parse_link("rfcomm://*/1?connect=1", listens_by_default=True))
    with pytest.raises(SettingsError):
        open_link(parse_link("rfcomm://board/1?bind=1", listens_by_default=False))


@given(st.integers(100, 4096), st.integers(1, 1008))
def test_units_fill_frames(unit_bytes: int, frame_bytes: int) -> None:
    """A unit is a whole number of frames, or an even part of one that is not much larger than requested."""
    filled = fill(unit_bytes, frame_bytes)
    if unit_bytes >= frame_bytes:
        assert filled % frame_bytes == 0
        assert unit_bytes - frame_bytes < filled <= unit_bytes
    else:
        assert unit_bytes <= filled < 2 * unit_bytes
        assert frame_bytes - frame_bytes // filled * filled < frame_bytes // filled


def test_units_of_a_bluetooth_link() -> None:
    """The smallest unit is a third of RFCOMM's frame, which is sent as three equal parts; the largest is four frames."""
    assert fill(267, FRAME_BYTES) == 336
    assert fill(4096, FRAME_BYTES) == 4 * FRAME_BYTES
