"""A board that reboots has another clock; a board-agent that is merely restarted has the same one."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from board_agent.agent import Agent
from common import now
from common.camera.factory import open_camera
from common.link.factory import open_link, parse_link
from phone_host.stream.receiver import Receiver
from tests.support.pictures import jpeg
from tests.support.programs import until
from tests.support.unkept import Unkept


@contextmanager
def life(folder: Path, address: str, boot_id: str) -> Iterator[None]:
    """One life of a board-agent, on a machine with this boot id."""
    camera = open_camera(f"replay:{folder}?fps=20&loop=1", "board", now.monotonic_ns())
    link = open_link(parse_link(address, listens_by_default=True))
    reader, writer = socket.socketpair()
    with reader, writer:
        agent = Agent(camera, [link], now.random_id(), boot_id, reader)
        thread = threading.Thread(target=agent.run)
        thread.start()
        try:
            yield
        finally:
            writer.send(b"\0")
            thread.join()
    link.close()


def test_another_boot_is_another_clock(tmp_path: Path) -> None:
    """When the process comes back, the host keeps what it knows of the clock; when the machine has rebooted, it begins anew."""
    folder, address = tmp_path / "film", f"ipc://{tmp_path}/board"
    folder.mkdir()
    (folder / "0.jpg").write_bytes(jpeg())
    receiver = Receiver([open_link(parse_link(address, listens_by_default=False))], now.random_id(), Unkept())
    receiver.start()
    clocks = []
    try:
        for number, boot_id in enumerate(("first boot", "first boot", "second boot")):
            with life(folder, address, boot_id):
                until(lambda n=number: receiver.account.connects > n, "the host has met this life of the board")  # type: ignore[misc]
                until(lambda: receiver.estimate is not None and receiver.connected, "its clock is known")
                clocks.append(receiver._reception._border._clock)
            until(lambda: not receiver.connected, "the host has noticed its end")
    finally:
        receiver.stop()
    assert clocks[0] is clocks[1]
    assert clocks[2] is not clocks[0]
