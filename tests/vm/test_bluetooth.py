"""RFCOMM between two of the kernel's virtual Bluetooth controllers; each test gets a guest of its own, since a test may leave the stack in disarray."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.programs import until
from tests.vm.air import AIR, DAEMON, SWITCH_ON
from tests.vm.conftest import CAMERA, READOUT_MS, restored
from tests.vm.contract import run_contract
from tests.vm.extension import extension
from tests.vm.guest import Guest
from tests.vm.machine import Snapshot
from tests.vm.stream import FPS, Film, Stream, check_journal, streaming, webcam_skew
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(1800)  # the first test boots the board and runs the contract suite there

BOARD, HOST = "00:AA:01:00:00:00", "00:AA:01:01:00:01"
"""Addresses that btvirt assigns."""

_BOARD_SEEN, _HOST_SEEN = "/org/bluez/hci1/dev_00_AA_01_00_00_00", "/org/bluez/hci0/dev_00_AA_01_01_00_01"
"""The daemon's names for each adapter as the other one sees it."""

CHANNEL = 1


@pytest.fixture
def radio(snapshot: Snapshot) -> Iterator[Guest]:
    """A board with two controllers, without bluetoothd."""
    with restored(snapshot) as guest:
        guest.sh(f"{AIR}{SWITCH_ON}")
        yield guest
        assert "list_del corruption" not in guest.console


@pytest.fixture
def serving(radio: Guest, film: Film) -> Iterator[tuple[Guest, Webcam]]:
    """The board's service on a channel of the first controller, with its webcam plugged in."""
    camera = Webcam(film.frames, FPS, READOUT_MS * 1_000_000)
    try:
        camera.plug(radio)
        radio.configure(CAMERA, f"rfcomm://*/{CHANNEL}?unpaired=1")
        radio.until("StatusText", "waiting for a host", "the service listens")
        yield radio, camera
        check_journal(radio)
    finally:
        camera.close()


def test_the_contract_on_rfcomm(radio: Guest) -> None:
    """The RFCOMM link keeps the links' contract: order, integrity, sizes, restarts, back-pressure, half-open peers."""
    told = run_contract(radio, "rfcomm")
    assert re.match(r"\d\d passed", told), told


def test_pairs_over_rfcomm_and_an_adapter_that_goes_and_comes(
    serving: tuple[Guest, Webcam], film: Film, tmp_path: Path
) -> None:
    """Pairs are correct over RFCOMM; after the adapters are switched off and on, in either order, the same session of the same process resumes."""
    guest, camera = serving
    process = guest.show("MainPID")
    far_end = ("rfcomm", HOST, BOARD, str(CHANNEL))
    with extension(guest, *far_end) as link, streaming(guest, film.right, tmp_path / "out", (), link) as stream:
        stream.more(30, "over RFCOMM")
        # btvirt does not tell one controller that the other has gone, as a radio does after its supervision timeout, and the kernel
        # then takes the old connection for the new one: so the two are switched off one after the other.
        for adapters in ("hci0 hci1", "hci1 hci0"):
            _switch_off_and_on(guest, adapters, stream)
            stream.more(10, f"after {adapters} came back")
        report = stream.finish(webcam_skew(camera.late_ns))
    assert len(report["sessions"]) == 1
    assert guest.show("MainPID") == process


def _switch_off_and_on(guest: Guest, adapters: str, stream: Stream) -> None:
    lost = stream.receiver.stderr.count("board_gone")
    guest.sh(f"for h in {adapters}; do hciconfig $h down; done")
    guest.until("StatusText", "waiting for a host", "the board gives the host up")
    stream.until_said("board_gone", "the host gives the board up", lost + 1)
    guest.sh(SWITCH_ON)


def test_a_paired_host_finds_the_board_by_name_and_a_forgotten_one_is_refused(
    snapshot: Snapshot, film: Film, tmp_path: Path
) -> None:
    """Two adapters are paired by bluetoothd; a host then finds board and channel by the board's name, and pairs are correct over the encrypted link; once forgotten, it is told to pair."""
    with restored(snapshot) as guest:
        guest.sh(AIR)
        guest.put(Path(__file__).with_name("pair.py"), "/srv")
        guest.put(Path(__file__).with_name("far_end.py"), "/srv")
        guest.sh(DAEMON)
        guest.sh(f"timeout 60 python3 -u /srv/pair.py {HOST} {BOARD}")
        camera = Webcam(film.frames, FPS, READOUT_MS * 1_000_000)
        try:
            camera.plug(guest)
            guest.configure(CAMERA, "rfcomm://*/7")
            guest.until("StatusText", "waiting for a host", "the service listens")
            until(lambda: "bluetooth_record_published channel=7" in guest.journal(), "the channel is published")
            guest.sh(f"busctl set-property org.bluez {_BOARD_SEEN} org.bluez.Device1 Alias s 'bench board'")
            with (
                extension(guest, "dial", "rfcomm://Bench%20Board") as link,
                streaming(guest, film.right, tmp_path / "out", (), link) as stream,
            ):
                stream.more(30, "over RFCOMM, encrypted")
                connections = guest.sh("hcitool con").splitlines()[1:]
                assert len(connections) == 2
                assert all("AUTH ENCRYPT" in connection for connection in connections), connections
                stream.finish(webcam_skew(camera.late_ns))
        finally:
            camera.close()
        for adapter, device in (("hci0", _HOST_SEEN), ("hci1", _BOARD_SEEN)):
            guest.sh(f"busctl call org.bluez /org/bluez/{adapter} org.bluez.Adapter1 RemoveDevice o {device}")
        # With no known device it would not even answer.
        guest.sh("busctl set-property org.bluez /org/bluez/hci0 org.bluez.Adapter1 Discoverable b true")
        guest.sh(f"setsid python3 -u /srv/far_end.py dial rfcomm://{BOARD} </dev/null >/srv/refused 2>&1 &")
        remedy = "pair the two devices with bluetoothctl"  # the radio may first have to find its way: that is a line of its own
        until(lambda: remedy in guest.sh("cat /srv/refused"), "a stranger is told")
        assert guest.sh("cat /srv/refused").count(remedy) == 1
        check_journal(guest)
        assert "list_del corruption" not in guest.console


def test_the_record_is_published_and_published_again(snapshot: Snapshot) -> None:
    """With bluetoothd the host finds the channel by asking the board; a restarted daemon is told again; a stopped service withdraws the record."""
    ask = f"""
import socket, sys
sys.path.insert(0, "/usr/lib/tandemscan")
from common.link.sdp import PSM, channel_in, query
for own, other in (("{HOST}", "{BOARD}"), ("{BOARD}", "{HOST}")):
    asking = socket.socket(socket.AF_BLUETOOTH, socket.SOCK_SEQPACKET, socket.BTPROTO_L2CAP)
    asking.settimeout(20)
    asking.bind((own, 0))
    asking.connect((other, PSM))
    asking.send(query())
    print(channel_in(asking.recv(65536)))
"""
    with restored(snapshot) as radio:

        def found() -> set[str]:
            return set(radio.sh("timeout 50 python3 -P /srv/ask.py 2>/dev/null || echo nobody").split())

        radio.sh(AIR)
        radio.write("/srv/ask.py", ask)
        radio.sh("mkdir /srv/frames && printf 'P5 2 2 255\nabcd' >/srv/frames/1.pgm")
        radio.configure("replay:/srv/frames?fps=10&loop=1", "rfcomm://*/7")
        radio.until("StatusText", "waiting for a host", "the service listens")
        until(lambda: "bluetooth_record_missing" in radio.journal(), "the missing daemon is told")
        radio.sh(DAEMON)
        until(lambda: "7" in found(), "the channel is found by asking")
        radio.sh("systemctl stop board-agent")
        until(lambda: found() == {"0"}, "a service that has stopped is not found")
        radio.sh("systemctl start board-agent")
        until(lambda: "7" in found(), "the channel is found again")
        told = radio.journal().count("bluetooth_record_published")
        radio.sh("systemctl restart bluetooth")
        until(lambda: radio.journal().count("bluetooth_record_published") > told, "a restarted daemon is told")
        assert "Traceback" not in radio.journal()
