"""A real board in a thread of the test's process: its agent, with a camera and a link of the test."""

import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager

from board_agent.agent import Agent
from board_agent.rate_control import RateControl
from common import now
from common.camera.base import Camera
from common.link.base import Link
from common.link.factory import open_link, parse_link


@contextmanager
def board_of(camera: Camera, link: str | Link, control: RateControl | None = None) -> Iterator[Agent]:
    """A board with that camera for the length of a block; the link, or its address, is closed in the end, the camera is not."""
    opened = open_link(parse_link(link, listens_by_default=True)) if isinstance(link, str) else link
    reader, writer = socket.socketpair()
    with closing(opened), reader, writer:
        agent = Agent(camera, [opened], now.random_id(), now.boot_id(), reader, control=control)
        thread = threading.Thread(target=agent.run)
        thread.start()
        try:
            yield agent
        finally:
            writer.send(b"\0")
            thread.join()
