"""One USB cable as network card and serial port: the package's gadget on the kernel's dummy controller, with its host end in the same machine."""

import hashlib
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from common.doctor.network_checks import ACCESS_POINT, CABLE_BOARD
from phone_host.discovery.udev_rule import RULES, UsbBoard, write_rule
from tests.support.programs import ledgers, lines, until
from tests.vm.conftest import CAMERA
from tests.vm.contract import run_contract
from tests.vm.doctor import doctor
from tests.vm.extension import extension
from tests.vm.guest import NETWORK_CARD, OPEN_TO_ALL, Guest
from tests.vm.stream import Film, Skew, check_journal, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(1800)  # the first test boots the board and runs the contract suite there

GADGET = "board-gadget"
BOARD_END = "/dev/tandemscan-host"
HOST_END = "/dev/tandemscan-board"
CONTROLLER = "dummy_udc.0"
GADGETS = "/sys/kernel/config/usb_gadget"
OURS = f"{GADGETS}/tandemscan"


@pytest.fixture(scope="module")
def cabled(guest: Guest, tmp_path_factory: pytest.TempPathFactory) -> Guest:
    """The board with its gadget up, and the host's end of the cable under its stable names."""
    guest.sh(f"systemctl start {GADGET}")
    assert guest.show("ConditionResult", GADGET) == "no", "without a controller there is nothing to do"
    rules = tmp_path_factory.mktemp("rules") / RULES.name
    write_rule(
        UsbBoard(
            device="ttyACM0", vendor="1d6b", product="0104", serial=_serial_number(guest), manufacturer="tandemscan"
        ),
        rules,
    )
    guest.put(rules, "/etc/udev/rules.d")
    guest.sh("udevadm control --reload; modprobe -a dummy_hcd cdc_acm cdc_ncm")
    guest.sh(f"systemctl start {GADGET}")
    _await_ends(guest)
    return guest


@pytest.fixture
def serving(cabled: Guest, webcam: Webcam) -> Iterator[Guest]:
    """The board's service on the gadget's serial port; afterwards it is up and has never shown a traceback."""
    assert webcam.plugged
    cabled.configure(CAMERA, f"serial:{BOARD_END}")
    cabled.until("StatusText", "waiting for a host", "the service has opened the port")
    yield cabled
    check_journal(cabled)


def _serial_number(guest: Guest) -> str:
    """The gadget's serial number, derived by deploy/board/usb-gadget from the machine's id."""
    return hashlib.sha256(f"tandemscan-serial-{guest.sh('cat /etc/machine-id').strip()}".encode()).hexdigest()[:12]


def _await_ends(guest: Guest) -> None:
    until(
        lambda: guest.code(f"test -e {BOARD_END} && test -e {HOST_END}") == 0, "both ends of the cable have their names"
    )


def test_the_contract_on_gadget_serial(cabled: Guest) -> None:
    """The serial link keeps the links' contract on a cable's real devices: order, integrity, sizes, restarts, back-pressure."""
    cabled.sh("systemctl stop board-agent")  # it may have the port
    told = run_contract(cabled, "gadget")
    assert re.match(r"\d\d passed", told), told


def test_pairs_over_gadget_serial(serving: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """30 pairs come over the cable's serial port: correct images, delays that add up, every frame counted."""
    with (
        extension(serving, "tty", HOST_END) as link,
        streaming(serving, film.right, tmp_path / "out", (), link) as stream,
    ):
        stream.more(30, "over the serial port")
        report = stream.finish(skew)
    assert {ledger["link"] for ledger in ledgers(tmp_path / "out")} == {"serial"}
    assert [session["tail"] for session in report["sessions"]] == ["known"]


def test_the_port_is_the_services_alone(cabled: Guest) -> None:
    """The board's end belongs to root and the service's group; nobody else may read or write there."""
    assert cabled.sh(f"stat -L -c '%U %G %a' {BOARD_END}").split() == ["root", "tandemscan", "660"]


def test_a_cable_pulled_and_replugged(serving: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """If the cable is pulled while streaming, twice, the same session of the same process resumes once it is plugged in again."""
    process = serving.show("MainPID")
    with (
        extension(serving, "tty", HOST_END) as link,
        streaming(serving, film.right, tmp_path / "out", (), link) as stream,
    ):
        for _ in range(2):
            stream.more(10, "before the pull")
            lost = stream.receiver.stderr.count("board_gone")
            serving.sh(f"echo > {OURS}/UDC")
            serving.until("StatusText", "waiting for a host", "the board gives the host up")
            stream.until_said("board_gone", "the host gives the board up", lost + 1)
            assert serving.code(f"test -e {HOST_END}") != 0
            serving.sh(f"echo {CONTROLLER} > {OURS}/UDC")
            stream.more(10, "after the plug")
        report = stream.finish(skew)
    assert len(report["sessions"]) == 1
    assert serving.show("MainPID") == process


def test_a_pulled_cable_gives_way_to_the_network_and_takes_over_again(
    cabled: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """The stream moves to TCP when the cable is pulled and returns once it is plugged in: one session, every frame counted, each pair correct."""
    assert webcam.plugged
    cabled.configure(CAMERA, f"serial:{BOARD_END}", OPEN_TO_ALL)
    cabled.until("StatusText", "waiting for a host", "the service has opened both links")
    out = tmp_path / "out"
    with (
        _slow_network(cabled),
        extension(cabled, "tty", HOST_END) as link,
        streaming(cabled, film.right, out, ("--link", cabled.link), link) as stream,
    ):
        until(lambda: _newest(out) == {"serial"}, "ten pairs in a row over the cable")
        cabled.sh(f"echo > {OURS}/UDC")
        until(lambda: _newest(out) == {"tcp"}, "ten pairs in a row over the network")
        cabled.sh(f"echo {CONTROLLER} > {OURS}/UDC")
        until(lambda: _newest(out) == {"serial"}, "ten pairs in a row over the cable again")
        report = stream.finish(skew)
    (session,) = report["sessions"]
    assert session["tail"] == "known"
    assert session["received"] == sum(tally["frames"] for tally in report["links"])
    assert report["switches"] >= 2
    sequences = [ledger["sequence"] for ledger in ledgers(out)]
    assert sequences == sorted(set(sequences)), "a frame was paired twice or out of order"
    for source, target in (("serial", "tcp"), ("tcp", "serial")):
        assert f"link_switched source={source} target={target}" in stream.receiver.stderr
    check_journal(cabled)


@contextmanager
def _slow_network(guest: Guest) -> Iterator[None]:
    """A frame over the network takes a second: the path to the cable's far end, which lies in the guest, accounts for half of it."""
    guest.sh(f"tc qdisc add dev {NETWORK_CARD} root netem rate 150kbit")
    try:
        yield
    finally:
        guest.sh(f"tc qdisc del dev {NETWORK_CARD} root")


def _newest(out: Path) -> set[str]:
    """The links of the ten newest pairs; none while there are fewer."""
    return {ledger["link"] for ledger in ledgers(out)[-10:]} if lines(out / "delays.jsonl") >= 10 else set()


def _bring_up(guest: Guest) -> None:
    """Bring the host's card up, as its network manager does, until it has a carrier.

    usbnet loses the gadget's report that it is connected if that comes while it works off an earlier change of the link, 1 time in 60 here: dummy_hcd
    asks for the next report at once, a real controller after 32 ms. The gadget repeats its report when its own card is brought up again.
    """
    guest.sh("ip link set tandemscan0 up")
    heard = "timeout 5 sh -c 'until grep -q 1 /sys/class/net/tandemscan0/carrier; do sleep 0.1; done'"
    if guest.code(heard) != 0:
        card = guest.sh(f"cat {OURS}/functions/ncm.0/ifname").strip()
        guest.sh(f"ip link set {card} down; ip link set {card} up")
        assert guest.code(heard) == 0, "the card has heard the gadget's repeated report"


def test_the_card_is_silent_while_the_host_selects_it(cabled: Guest) -> None:
    """The board sends nothing unasked on the cable: a frame sent while the host's driver selects the interface anew would hold up all later ones."""
    card = cabled.sh(f"cat {OURS}/functions/ncm.0/ifname").strip()
    sent = f"cat /sys/class/net/{card}/statistics/tx_packets"
    before = cabled.sh(sent)
    cabled.sh(f"echo > {OURS}/UDC; echo {CONTROLLER} > {OURS}/UDC")
    _await_ends(cabled)
    _bring_up(cabled)
    time.sleep(3)  # the first frame would leave at once
    assert cabled.sh(sent) == before


@dataclass(frozen=True, slots=True)
class Way:
    """A way between board and phone.

    Attributes:
        board, phone: the addresses of both ends.
        link: what the board's settings say.
    """

    board: str
    phone: str
    link: str


WAYS = {
    "cable": Way(CABLE_BOARD, "192.168.7.1", f"tcp://{CABLE_BOARD}:5555?insecure=1"),
    "access point": Way(ACCESS_POINT, "10.42.0.77", OPEN_TO_ALL),
}
"""The cable's two cards stand for the radio of the board's own Wi-Fi. The phone's hotspot is the board's second card in every other test here."""


@contextmanager
def _phone_at_the_end(guest: Guest, way: Way) -> Iterator[None]:
    """A network namespace with the cable's host end, as a phone has it."""
    _bring_up(guest)
    card = guest.sh(f"cat {OURS}/functions/ncm.0/ifname").strip()
    until(lambda: "0.0.0.0%" + card + ":67" in guest.sh("ss -lun"), "addresses are offered on the cable")
    moved = way.board != CABLE_BOARD
    if moved:
        guest.sh(f"ip addr flush dev {card}; ip addr add {way.board}/24 dev {card}")
    guest.sh("ip netns add phone && ip link set tandemscan0 netns phone && ip -n phone link set tandemscan0 up")
    guest.sh(f"ip -n phone addr add {way.phone}/24 dev tandemscan0")
    try:
        yield
    finally:
        guest.sh("ip netns del phone")
        if moved:
            guest.sh(f"ip addr flush dev {card}; ip addr add {CABLE_BOARD}/24 dev {card}")
        until(lambda: guest.code("test -e /sys/class/net/tandemscan0") == 0, "the host's end is back")


@contextmanager
def _dialled_from_the_phone(guest: Guest, board: str) -> Iterator[str]:
    """A link of this machine by which one dials the board's link as the phone does."""
    guest.put(Path(__file__).with_name("way_in.py"), "/srv")
    carrier = guest.popen(f"exec python3 -u /srv/way_in.py phone 6000 {board} 5555")
    try:
        assert carrier.stdout is not None
        assert carrier.stdout.readline() == b"ready\n"
        with guest.forwarded(6000) as port:
            yield f"tcp://127.0.0.1:{port}"
    finally:
        carrier.kill()
        with carrier:  # closes its pipes and waits
            pass


def _judged_there(guest: Guest, host: str) -> str:
    """What the host's doctor says of the way, asked in the phone's namespace."""
    ask = (
        "from common.doctor.network_probe import examine_network as e; from common.link.factory import parse_link as p;"
        f" print(*e(p('tcp://{host}:5555', listens_by_default=False)))"
    )
    return guest.sh(
        f"cd /usr/lib/tandemscan && ip netns exec phone python3 -P -c \"import sys; sys.path[0:0] = ['.']; {ask}\""
    )


@pytest.mark.parametrize(
    "way",
    [
        WAYS["cable"],
        pytest.param(
            WAYS["access point"], marks=pytest.mark.skipif("WALK" not in os.environ, reason="make walk has the time")
        ),
    ],
    ids=WAYS,
)
def test_a_phone_pairs_over_each_way(serving: Guest, way: Way, film: Film, skew: Skew, tmp_path: Path) -> None:
    """As docs/phone.md says: the doctors of both ends find the way sound, and pairs come over it."""
    with _phone_at_the_end(serving, way):
        serving.configure(CAMERA, way.link)
        _, checks = doctor(serving)
        assert f"tcp://{way.board}:5555 (" in checks["network"]["finding"]
        assert f"which is {way.phone} there" in _judged_there(serving, way.board)
        with (
            _dialled_from_the_phone(serving, way.board) as link,
            streaming(serving, film.right, tmp_path / "out", (), link) as stream,
        ):
            stream.more(10, "over the way")
            report = stream.finish(skew)
    assert len(report["sessions"]) == 1


def test_no_login_prompt_on_the_port(cabled: Guest) -> None:
    """A getty started for the port does not run; without the gadget's marker file, and on the console, it does."""
    prompt = "serial-getty@ttyGS0"
    cabled.sh(f"systemctl stop board-agent; systemctl start {prompt}")
    assert cabled.show("ConditionResult", prompt) == "no"
    assert cabled.show("ActiveState", prompt) == "inactive"
    cabled.sh(f"mv /run/board-gadget/ttyGS0 /run/board-gadget/unsaid; systemctl start {prompt}")
    assert cabled.show("ConditionResult", prompt) == "yes"
    assert cabled.show("ActiveState", prompt) == "active"
    cabled.sh(f"systemctl stop {prompt}; mv /run/board-gadget/unsaid /run/board-gadget/ttyGS0")
    cabled.sh("udevadm trigger --action=add --settle /dev/ttyGS0")  # a prompt reserves the port for root
    assert cabled.show("ActiveState", "serial-getty@ttyS0") == "active"


def test_a_stop_leaves_nothing_though_the_port_is_open(serving: Guest) -> None:
    """Stopped while the service has the port open, the gadget leaves no trace, and the service finds it again after a new start."""
    process = serving.show("MainPID")
    serving.sh(f"systemctl stop {GADGET}")
    assert (
        serving.sh(
            f"ls {GADGETS} /dev | grep -e tandemscan -e ttyGS -e retired; ls /run/board-gadget 2>/dev/null; true"
        )
        == ""
    )
    serving.sh(f"systemctl start {GADGET}")
    _await_ends(serving)
    until(
        lambda: serving.code(f"ls -l /proc/{process}/fd | grep -q $(readlink -f {BOARD_END})") == 0,
        "the service has the port again",
    )


def test_the_images_own_gadget_gives_way_and_gets_its_controller_back(cabled: Guest) -> None:
    """If another gadget has the only controller, ours takes its place, says so, and gives it back when it stops."""
    other = f"{GADGETS}/image"
    cabled.sh(f"systemctl stop {GADGET}")
    parts = f"{other}/strings/0x409 {other}/configs/c.1 {other}/functions/ncm.other"
    cabled.sh(
        f"mkdir -p {parts} && ln -s {other}/functions/ncm.other {other}/configs/c.1/ && echo {CONTROLLER} > {other}/UDC"
    )
    try:
        cabled.sh(f"systemctl start {GADGET}")
        _await_ends(cabled)
        assert cabled.sh(f"cat {OURS}/UDC").strip() == CONTROLLER
        assert "in place of image" in cabled.journal(GADGET)
        cabled.sh(f"systemctl stop {GADGET}")
        assert cabled.sh(f"cat {other}/UDC").strip() == CONTROLLER
    finally:
        cabled.sh(f"echo > {other}/UDC; rm {other}/configs/c.1/ncm.other; rmdir {parts} {other}")
    cabled.sh(f"systemctl start {GADGET}")
    _await_ends(cabled)


def test_a_controller_that_a_module_holds_is_named(cabled: Guest) -> None:
    """A controller held by an old gadget module cannot be taken: one line names both and the remedy, with exit 3."""
    cabled.sh(f"systemctl stop {GADGET} && modprobe g_serial")
    try:
        assert cabled.code(f"systemctl start {GADGET}") != 0
        assert cabled.show("ExecMainStatus", GADGET) == "3"
        assert f"{CONTROLLER} is held by g_serial: unload that module" in cabled.journal(GADGET)
    finally:
        cabled.sh(f"modprobe -r g_serial; systemctl reset-failed {GADGET}; systemctl start {GADGET}")
    _await_ends(cabled)
