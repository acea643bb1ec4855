"""What `board-agent pair` does: asks the running agent to take in a new host, and follows what becomes of it."""

from collections.abc import Iterator
from typing import Final

import zmq

from common import now
from common.errors import UnavailableError
from common.keys import KeyFolder
from common.link.pairing_door import CONTROL_PREFIX, DoorState

_ASK_NS: Final = 500_000_000
_SILENCE_NS: Final = 5_000_000_000
"""An agent on the smallest board answers within one round of its loop, a second at most."""


def follow(keys: KeyFolder, seconds: float) -> Iterator[DoorState]:
    """Keep the door open and give its state whenever that has changed, until a host was taken in.

    Args:
        keys: the running agent's folder.
        seconds: for so long; then it ends without a host.

    Raises:
        UnavailableError: no agent with a secured link uses this folder, or nobody came.
    """
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    try:
        yield from _follow(context, keys, seconds)
    finally:
        context.destroy(linger=0)


def _follow(context: "zmq.Context[zmq.Socket[bytes]]", keys: KeyFolder, seconds: float) -> Iterator[DoorState]:
    poller, doors = zmq.Poller(), []
    for path in keys.path.glob(f"{CONTROL_PREFIX}*"):
        door = context.socket(zmq.DEALER)
        door.setsockopt(zmq.LINGER, 0)
        door.setsockopt(zmq.IMMEDIATE, 1)  # nothing is kept for an agent that has gone
        door.connect(f"ipc://{path}")
        doors.append(door)
        poller.register(door, zmq.POLLIN)
    began_ns = heard_ns = now.monotonic_ns()
    deadline_ns = began_ns + round(seconds * 1e9)
    shown = {id(door): DoorState("", "", "", "", 0) for door in doors}
    while (now_ns := now.monotonic_ns()) < deadline_ns:
        if not doors or now_ns - heard_ns > _SILENCE_NS:
            raise UnavailableError(
                f"no running board-agent with a secured link uses the keys in {keys.path}",
                "start it with a link such as tcp://*:5555 and a camera plugged in; for the service use sudo",
            )
        for door in doors:
            if door.poll(0, zmq.POLLOUT):
                door.send(b"", zmq.DONTWAIT)
        until_ns = now_ns + _ASK_NS
        while (left_ns := until_ns - now.monotonic_ns()) > 0:
            ready = dict(poller.poll(left_ns // 1_000_000 + 1))
            for door in (door for door in doors if door in ready):
                heard_ns = now.monotonic_ns()
                state = DoorState.decode(door.recv(zmq.DONTWAIT))
                if state != shown[id(door)]:
                    shown[id(door)] = state
                    yield state
                if state.paired:
                    return
    raise UnavailableError(
        f"no host has paired within {seconds:g} s",
        "run `phone-host pair --link tcp://BOARD:5555` on the host meanwhile",
    )
