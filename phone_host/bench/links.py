"""Starts the two ends of every interface that the delay benchmark measures on this machine; connects to boards elsewhere.

Shell: starts real processes and stops them again, whatever happens. If something is not available, it says why in
words.
"""

import fcntl
import socket
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common import now
from common.errors import UnavailableError
from common.keys import usual_keys
from common.link.factory import open_link, parse_link
from common.protocol.message import Pacing
from phone_host.accounts.link_account import LinkAccount
from phone_host.bench.cases import BOARD_SETS, Case, Interface, Size
from phone_host.bench.emulate import NOTHING
from phone_host.bench.relay import RelayAccount, RelayProcess, relay_process
from phone_host.stream.await_board import BoardPatience, await_board
from phone_host.stream.frame_sink import NoFrames
from phone_host.stream.receiver import Receiver
from phone_host.subprocesses.board_process import BoardAccount, BoardProcess, board_process, free_port

_CHANNEL: Final = 22
"""For the benchmark's own RFCOMM listener: in the range that profiles do not use on their own (channels 1 to 30 exist)."""

# The kernel's numbers, because a Python without Bluetooth has no names for them.
_AF_BLUETOOTH, _BTPROTO_HCI = 31, 1

# include/net/bluetooth/hci_sock.h: _IOR('H', 211, int), and the head of struct hci_dev_info (92 bytes): number, name, address.
_HCIGETDEVINFO: Final = 0x800448D3
_DEVICE_INFO: Final = struct.Struct("=H8s6s")


@dataclass(frozen=True, slots=True)
class Ends:
    """A case's link, ready to connect to.

    Attributes:
        address: link URI for the host.
        board: the board's process; None for a remote board.
        relay: the relay's process; None if there is none.
    """

    address: str
    board: BoardProcess | None
    relay: RelayProcess | None

    def check(self) -> None:
        """Raise UnavailableError if the board's process is gone."""
        if self.board is not None:
            self.board.check()

    def stop(self, seen: LinkAccount) -> tuple[BoardAccount, RelayAccount | None]:
        """Stop what was started.

        Args:
            seen: what the receiver saw; a remote board keeps running, and its account is what it reported for this
                time.
        """
        board = self.board.stop() if self.board is not None else _account_of(seen)
        return board, self.relay.stop() if self.relay is not None else None


@contextmanager
def open_ends(interface: Interface, camera: str, folder: Path) -> Iterator[Ends]:
    """Run both ends of an interface while a block runs.

    Raises:
        UnavailableError: the board's process or the relay did not start.
    """
    if interface.is_remote:
        yield Ends(interface.link, None, None)
    elif interface.link == "rfcomm":
        # A machine's own two adapters are normally not paired with each other.
        with board_process(camera, f"rfcomm://*/{_CHANNEL}?unpaired=1") as board:
            yield Ends(f"rfcomm://{_adapters()[0]}/{_CHANNEL}?unpaired=1", board, None)
    elif interface.link == "serial":
        # A line of two terminals needs a process that passes on the bytes, even if it adds nothing.
        profile = interface.profile or NOTHING
        with relay_process("serial", "-", folder, profile) as relay, board_process(camera, relay.board) as board:
            yield Ends(relay.host, board, relay)
    else:
        address = f"ipc://{folder / 'board'}" if interface.link == "ipc" else f"tcp://127.0.0.1:{free_port()}"
        with board_process(camera, address) as board:
            if interface.profile is None:
                yield Ends(address, board, None)
                return
            with relay_process(interface.link, address, folder, interface.profile) as relay:
                yield Ends(relay.host, board, relay)


def why_not_measurable(interface: Interface) -> str:
    """Say why an interface cannot be measured here; empty if it can, as far as is known without trying."""
    if interface.link != "rfcomm":
        return ""
    if len(adapters := _adapters()) < 2:
        there = "no Bluetooth adapter" if not adapters else "one Bluetooth adapter, and its two ends need two"
        return f"this machine has {there}; name a board instead, for example rfcomm://AA:BB:CC:DD:EE:FF/1"
    return ""


def ask_board(uri: str, patience_ns: int, stop: Callable[[], bool]) -> Case | None:
    """Ask a remote board what its camera shows; nothing else can be measured there.

    Returns:
        The case; None if `stop` ended it.

    Raises:
        UnavailableError: there is no board, it is busy, or it gives images only on demand.
    """
    link = open_link(parse_link(uri, listens_by_default=False), usual_keys())
    receiver = Receiver([link], now.random_id(), NoFrames())
    remedy = "start board-agent there, or check --links"
    patience = BoardPatience(patience_ns, now.monotonic_ns(), where=uri, remedy=remedy)
    receiver.start()
    try:
        await_board(receiver, patience, lambda: receiver.hello is not None, stop)
        hello = receiver.hello
    finally:
        receiver.stop()
    if hello is None:
        return None
    camera = hello.camera
    if camera.pacing is Pacing.DEMAND:
        raise UnavailableError(
            f"the board at {uri} shows images on demand", "start it with a camera, or a replay with fps="
        )
    rate_hz = max(1, round(1e9 / camera.period_ns))
    return Case(
        interface=Interface(uri),
        size=Size(camera.width_px, camera.height_px),
        quality_percent=BOARD_SETS,
        rate_hz=rate_hz,
    )


def _account_of(seen: LinkAccount) -> BoardAccount:
    """Return what a board that keeps running reported for the time in which this host was connected."""
    grabbed = sent = 0
    dropped: dict[str, int] = {}
    for account in seen.sessions:
        grabbed += account.latest.grabbed - account.first.grabbed
        sent += account.latest.sent - account.first.sent
        before = dict(account.first.dropped)
        for reason, count in account.latest.dropped:
            dropped[reason.value] = dropped.get(reason.value, 0) + count - before.get(reason, 0)
    return BoardAccount(grabbed, sent, tuple(sorted(dropped.items())))


def _adapters() -> list[str]:
    """Return the addresses of this machine's Bluetooth adapters; none if the kernel has no Bluetooth."""
    try:
        asker = socket.socket(_AF_BLUETOOTH, socket.SOCK_RAW, _BTPROTO_HCI)
    except OSError:
        return []
    addresses = []
    with asker:
        for path in sorted(Path("/sys/class/bluetooth").glob("hci*")):
            number = path.name.removeprefix("hci")
            if not number.isdigit():
                continue  # a connection, for example hci0:256
            info = bytearray(_DEVICE_INFO.pack(int(number), b"", b"") + bytes(76))
            with suppress(OSError):  # unplugged meanwhile
                fcntl.ioctl(asker, _HCIGETDEVINFO, info)
                _, _, address = _DEVICE_INFO.unpack_from(info)
                addresses.append(":".join(f"{byte:02X}" for byte in reversed(address)))
    return addresses
