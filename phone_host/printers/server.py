"""What every printer's server can be asked, in one way; each kind has a module of its own."""

import json
import logging
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Final, Protocol

from common.byte_order_mark import UTF_8_MARK
from common.errors import DataError, SettingsError, UnavailableError
from phone_host.printers.door import Heat
from phone_host.printers.printer_uri import ServerUri
from phone_host.printers.server_answer import Answer
from phone_host.printers.server_talk import ORDER_S, ServerTalk

_PIECE: Final = 1 << 16
_BOUNDARY: Final = "tandemscan-7d1f4c0b9e"
_log = logging.getLogger(__name__)


class Condition(Enum):
    """What a server says of its printer."""

    READY = "ready"
    PRINTING = "printing"
    PAUSED = "paused"
    BUSY = "busy"
    DONE = "done"
    CANCELLED = "cancelled"
    ERROR = "error"
    OFFLINE = "offline"

    @property
    def is_active(self) -> bool:
        """Whether a print goes on."""
        return self in {Condition.PRINTING, Condition.PAUSED, Condition.BUSY}


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerState:
    """What a server says.

    Attributes:
        condition: of the printer.
        share: of its print that is done, 0..1.
        seconds_left: of it, s; NaN: it does not know.
        heat: temperatures.
        is_hot: whether any heater shall be warm.
        words: its own, of errors; empty: none.
    """

    condition: Condition
    share: float = 0.0
    seconds_left: float = math.nan
    heat: Heat = field(default_factory=Heat)
    is_hot: bool = False
    words: str = ""


class PrintServer(Protocol):
    """A server before a printer.

    Every method raises ServerLostError when it does not answer, SettingsError when it wants another key.
    """

    title: str
    """Its name for messages."""

    def state(self) -> ServerState:
        """Return what it says of the printer now."""

    def start(self, gcode: Path, name: str, sent: Callable[[float], None]) -> None:
        """Hand a file over and start it.

        Args:
            gcode: the file.
            name: for it there.
            sent: called with the share that was sent; what it raises ends the transfer.

        Raises:
            UnavailableError: the server refuses it.
        """

    def pause(self) -> None:
        """Pause the print. A refusal is logged."""

    def go_on(self) -> None:
        """Go on with it. A refusal is logged."""

    def cancel(self) -> None:
        """End the print. A refusal changes nothing: it may be over already, and the state tells."""

    def cool(self) -> bool:
        """Switch the heaters off; return whether the server can do that at all.

        Raises:
            UnavailableError: the server refuses it.
        """

    def hurry(self) -> None:
        """Break off what is asked just now, and wait little from now on: the process ends next. A signal's handler may call it."""

    def halt(self) -> str:
        """Stop everything at once; return what has to be done before the next print. Empty: the server cannot do that."""


def size_bytes(gcode: Path) -> int:
    """Return how long a file is as it is sent: without a byte order mark, which a printer would take for a command.

    Raises:
        DataError: it cannot be read.
    """
    try:
        return gcode.stat().st_size - _mark_bytes(gcode)
    except OSError as error:
        raise _unreadable(gcode, error) from None


def _mark_bytes(gcode: Path) -> int:
    with gcode.open("rb") as file:
        return len(UTF_8_MARK) if file.read(len(UTF_8_MARK)) == UTF_8_MARK else 0


def _unreadable(gcode: Path, error: OSError) -> DataError:
    return DataError(f"{gcode} cannot be read ({error.strerror})", "give the file that a slicer wrote")


def pieces(gcode: Path, sent: Callable[[float], None]) -> Iterator[bytes]:
    """Yield a file in pieces, telling the share that was sent before each: so what `sent` raises ends the transfer before it is whole.

    Raises:
        DataError: it cannot be read.
    """
    try:
        size, done = max(size_bytes(gcode), 1), 0
        with gcode.open("rb") as file:
            file.seek(_mark_bytes(gcode))
            while piece := file.read(_PIECE):
                sent(min(done / size, 1.0))
                yield piece
                done += len(piece)
    except OSError as error:
        raise _unreadable(gcode, error) from None


@dataclass(frozen=True, slots=True)
class Form:
    """A form with one file, as browsers send it (RFC 7578)."""

    head: bytes
    tail: bytes

    @property
    def content_type(self) -> str:
        """Its header."""
        return f"multipart/form-data; boundary={_BOUNDARY}"

    def size(self, gcode: Path) -> int:
        """Return its length with the file in it, bytes."""
        return len(self.head) + size_bytes(gcode) + len(self.tail)

    def body(self, gcode: Path, sent: Callable[[float], None]) -> Iterator[bytes]:
        """Yield it with the file in it."""
        yield self.head
        yield from pieces(gcode, sent)
        yield self.tail


def form_of(name: str, fields: dict[str, str]) -> Form:
    """Make a form."""
    head = "".join(
        f'--{_BOUNDARY}\r\nContent-Disposition: form-data; name="{key}"\r\n\r\n{value}\r\n'
        for key, value in fields.items()
    )
    head += (
        f'--{_BOUNDARY}\r\nContent-Disposition: form-data; name="file"; filename="{name}"\r\n'
        "Content-Type: application/octet-stream\r\n\r\n"
    )
    return Form(head.encode(), f"\r\n--{_BOUNDARY}--\r\n".encode())


def require_good(answer: Answer, what: str) -> None:
    """Refuse an answer that is an error.

    Raises:
        UnavailableError: it is.
    """
    if not answer.is_good:
        raise UnavailableError(f"{answer.server} refuses {what}: {answer.words}", "look at its own page")


def note_refusal(answer: Answer, what: str) -> None:
    """Log an answer that is an error."""
    if not answer.is_good:
        _log.warning("print refused=%s status=%d words=%r", what, answer.status, answer.words)


class KeyedServer:
    """What all servers have in common: they are asked with a key.

    Attributes:
        title: see PrintServer.

    Args:
        uri: where it is.
        key: for it; empty: none.
        where: the server shows its key.
    """

    def __init__(self, uri: ServerUri, key: str, where: str) -> None:
        self._talk, self._key, self._where = ServerTalk(uri), key, where
        self._example = f'"{uri.text}" = "KEY"'
        self.title = self._talk.server

    def hurry(self) -> None:
        """See PrintServer."""
        self._talk.hurry()

    def _headers(self) -> dict[str, str]:
        return {"X-Api-Key": self._key} if self._key else {}

    def _accepted(self, answer: Answer) -> Answer:
        """Return an answer that wants no other key.

        Raises:
            SettingsError: it does.
        """
        if answer.status not in {401, 403}:
            return answer
        if self._key:
            raise SettingsError(
                f"{answer.server} does not take the key of the settings file", f"copy it again: {self._where}"
            )
        raise SettingsError(
            f"{answer.server} wants a key",
            f"write {self._example} into the table [printers] of the settings file; {self._where}",
        )

    def _asked(self, target: str) -> Answer:
        return self._accepted(self._talk.ask("GET", target, self._headers()))

    def _ordered(self, target: str, command: Mapping[str, object]) -> Answer:
        headers = {**self._headers(), "Content-Type": "application/json"}
        return self._accepted(self._talk.ask("POST", target, headers, json.dumps(command).encode(), ORDER_S))

    def _given(self, target: str, form: Form, gcode: Path, sent: Callable[[float], None]) -> Answer:
        """Hand a file over in a form; see `PrintServer.start`."""
        headers = {**self._headers(), "Content-Type": form.content_type}
        answer = self._talk.hand_over("POST", target, headers, form.body(gcode, sent), form.size(gcode))
        require_good(self._accepted(answer), "the file")
        return answer
