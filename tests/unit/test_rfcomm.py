"""RFCOMM where there is no Bluetooth, and units that fill its frames. The link itself is tested in the guest (tests/vm/test_bluetooth.py)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import SettingsError, UnavailableError
from common.link.factory import open_link, parse_link
from common.link.rfcomm import FRAME_BYTES
from common.protocol.pacing import fill
from tests.support.devices import MissingError, adapters


@pytest.mark.parametrize(
    "uri", ["rfcomm://*/1", "rfcomm://AA:BB:CC:DD:EE:FF/1?connect=1", "rfcomm://my%20board?connect=1"]
)
def test_a_machine_without_bluetooth_says_so(uri: str) -> None:
    """Without Bluetooth in Python, in the kernel, or in the machine either side gets one line with the remedy, and exit 3."""
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


def test_what_cannot_be_dialled_or_listened_on() -> None:
    """To dial takes a device, to listen none or an adapter's address."""
    with pytest.raises(SettingsError):
        open_link(parse_link("rfcomm://*/1?connect=1", listens_by_default=True))
    with pytest.raises(SettingsError):
        open_link(parse_link("rfcomm://board/1?bind=1", listens_by_default=False))


@given(st.integers(100, 4096), st.integers(1, 1008))
def test_units_fill_frames(unit_bytes: int, frame_bytes: int) -> None:
    """A unit is so many whole frames, or an even part of one that is not much larger than it was to be."""
    filled = fill(unit_bytes, frame_bytes)
    if unit_bytes >= frame_bytes:
        assert filled % frame_bytes == 0
        assert unit_bytes - frame_bytes < filled <= unit_bytes
    else:
        assert unit_bytes <= filled < 2 * unit_bytes
        assert frame_bytes - frame_bytes // filled * filled < frame_bytes // filled


def test_units_of_a_bluetooth_link() -> None:
    """The smallest unit is a third of RFCOMM's frame, which leaves it in three equal parts; the largest is four frames."""
    assert fill(267, FRAME_BYTES) == 336
    assert fill(4096, FRAME_BYTES) == 4 * FRAME_BYTES
