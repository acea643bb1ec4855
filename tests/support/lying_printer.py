"""A printer on a TCP port that lies: what it says to each line is a function of the test. It judges what it was told at the end.

It does nothing of a print; it only remembers what came, so that a test sees whether the lines that cool have arrived.
"""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from select import select

Answer = Callable[[str, int], bytes]
"""Takes a line as it came and how many came before; gives the bytes that the printer says to it."""


class LyingPrinter:
    """The printer.

    Attributes:
        uri: for --printer.
        lines: that came, as they came.

    Args:
        answer: what it says to each line.
        chatter: said again and again, whatever comes.
        is_slow: whether it says one byte after the other, as a slow USB port does.
    """

    def __init__(self, answer: Answer, chatter: bytes = b"", *, is_slow: bool = False) -> None:
        self._answer, self._chatter, self._is_slow = answer, chatter, is_slow
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.uri = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self.lines: list[str] = []
        self.is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def is_told_to_cool(self) -> bool:
        """Whether the lines that switch nozzle and bed off came behind the last that heats."""
        texts = "\n".join(self.lines).rpartition("M104 S2")[2]
        return "M104 S0" in texts and "M140 S0" in texts

    def stop(self) -> None:
        """Switch it off."""
        self.is_over.set()
        self._thread.join(10)
        self._listener.close()

    def _run(self) -> None:
        while not select([self._listener], [], [], 0.05)[0]:
            if self.is_over.is_set():
                return
        connection, _ = self._listener.accept()
        with connection, suppress(OSError):
            connection.sendall(b"start\n")
            self._talk(connection)

    def _talk(self, connection: socket.socket) -> None:
        waiting = b""
        while not self.is_over.is_set():
            if self._chatter:
                with suppress(OSError):  # a host that has said goodbye may still have sent its last lines
                    connection.sendall(self._chatter)
            if not select([connection], [], [], 0.05)[0]:
                continue
            data = connection.recv(4096)
            if not data:
                return
            *lines, waiting = (waiting + data).split(b"\n")
            for line in lines:
                self.lines.append(line.decode("ascii", "replace"))
                with suppress(OSError):
                    self._say(connection, self._answer(self.lines[-1], len(self.lines)))

    def _say(self, connection: socket.socket, said: bytes) -> None:
        if not self._is_slow:
            connection.sendall(said)
            return
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in said:
            connection.sendall(bytes([byte]))
            self.is_over.wait(0.001)


@contextmanager
def lying_printer(answer: Answer, chatter: bytes = b"", *, is_slow: bool = False) -> Iterator[LyingPrinter]:
    """A printer that is on while the block runs."""
    made = LyingPrinter(answer, chatter, is_slow=is_slow)
    try:
        yield made
    finally:
        made.stop()
