"""A dialled connection: its news wakes whoever waits for it, whenever the news came."""

import socket
from pathlib import Path

import zmq

from common.errors import UnavailableError
from common.link.base import Broken
from common.link.waiter import Waiter
from common.link.zeromq import ZeroMqDialer
from common.link.zeromq_socket import Dialled
from tests.support.keys import acquainted
from tests.support.programs import until

NEVER = 2**63 - 1


def test_news_from_before_the_first_wait_wakes_who_waits() -> None:
    """If a peer hung up before anybody waited, the monitor's descriptor alone reports it."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    with socket.create_server(("127.0.0.1", 0)) as server:
        sock = context.socket(zmq.DEALER)
        dialled = Dialled(sock, f"tcp://127.0.0.1:{server.getsockname()[1]}", "", "frames")
        for _ in range(3):  # a client that dials again has noted that the previous connection failed
            accepted, _ = server.accept()
            with accepted:
                accepted.recv(64)
        descriptor = dialled.news.fileno()
        told = Waiter([descriptor]).wait(10_000)
        sock.disable_monitor()
        context.destroy(linger=0)
    assert told == [descriptor]


def test_both_lanes_of_a_link_that_is_refused_are_dialled_again(tmp_path: Path) -> None:
    """When both lanes were turned away before anybody looked, a waiter on descriptors alone learns of both, so both are dialled again."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    open_door = context.socket(zmq.ROUTER)
    address = f"tcp://127.0.0.1:{open_door.bind_to_random_port('tcp://127.0.0.1')}"
    keys = acquainted(tmp_path, address)[1]
    dialler = ZeroMqDialer(address, keys, keys.peers()[0])
    try:
        lanes = dialler.connections.values()
        until(lambda: all(lane.news.has_news() for lane in lanes), "both lanes have news")
        waiter = Waiter([lane.news for lane in lanes])
        refusals = receive(dialler)
        while any(lane.due_ns == NEVER for lane in lanes):
            assert waiter.wait(10_000), "news wakes"
            refusals += receive(dialler)
        assert refusals
    finally:
        dialler.close()
        context.destroy(linger=0)


def receive(dialler: ZeroMqDialer) -> int:
    """Look once; return how many refusals were reported, one or none."""
    try:
        assert not [incoming for incoming in dialler.receive() if not isinstance(incoming, Broken)]
    except UnavailableError:
        return 1
    return 0
