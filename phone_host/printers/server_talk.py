"""Requests to a printer's server: one connection each, every one with a time limit, no answer larger than a page of it."""

import http.client
import socket
import ssl
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Final

from common.errors import UnavailableError
from phone_host.printers.printer_uri import ServerUri
from phone_host.printers.server_answer import Answer

_CONNECT_S: Final = 5.0
ANSWER_S: Final = 10.0
"""Of the whole answer; a server on a Raspberry Pi answers within one."""

ORDER_S: Final = 3.0
"""Of an order to end a print or to cool: it is given again soon, and one that gets no answer must not keep the next one back."""

_HURRIED_S: Final = 1.5
_LAST_ASKS: Final = 4
"""The end of the print, cold heaters, and a state of two answers."""

LEAVING_S: Final = _CONNECT_S + _LAST_ASKS * _HURRIED_S + 1.0
"""From `hurry` until the last orders have gone: a connection that is being made, then one request after the other; and a second of a busy machine."""

_STORED_S: Final = 120.0
"""Until a server has written a file that it has got, to a card or a stick."""

_MOST_BYTES: Final = 1 << 20
_MOVED: Final = frozenset({301, 302, 303, 307, 308})
_FAILURES: Final[tuple[tuple[type[Exception], str, str], ...]] = (
    (ssl.SSLCertVerificationError, "has a certificate that this machine does not trust", "install its certificate authority on this machine"),
    (ssl.SSLError, "does not speak https", "leave ?tls=1 out"),
    (TimeoutError, "does not answer", "see whether it is on, and whether both are in one network"),
    (ConnectionRefusedError, "refuses the connection", "see whether it is running, and at which port"),
    (socket.gaierror, "has no address", "check its name, or give its number"),
    (UnicodeError, "has no address", "check its name, or give its number"),
    (ConnectionResetError, "hangs up without an answer", "check the port, and whether it needs ?tls=1"),
    (http.client.HTTPException, "does not speak HTTP", "check the port, and whether it needs ?tls=1"),
)  # fmt: skip
"""What each failure means, the most specific ones first."""


class ServerLostError(UnavailableError):
    """Raised when a server does not answer. Nobody's fault; it may be back at any time."""


class ServerTalk:
    """Asks one server."""

    def __init__(self, uri: ServerUri) -> None:
        self._uri = uri
        self._is_hurried = False
        self._under_way: socket.socket | None = None
        host = f"[{uri.host}]" if ":" in uri.host else uri.host
        self.server = f"{uri.kind.title} at {host}:{uri.port}"

    def hurry(self) -> None:
        """Break the request off that is under way, and wait little for those that follow: the process ends next. It takes no lock."""
        self._is_hurried = True
        if (under_way := self._under_way) is not None:
            with suppress(OSError):
                under_way.shutdown(socket.SHUT_RDWR)

    def ask(
        self, method: str, target: str, headers: Mapping[str, str], body: bytes = b"", patience_s: float = ANSWER_S
    ) -> Answer:
        """Ask for something small.

        Raises:
            ServerLostError: there is no answer.
            UnavailableError: the answer is elsewhere, or beyond all measure.
        """
        end_s = time.monotonic() + patience_s
        with self._client(patience_s) as client, _limit(client, self._hurried(end_s - time.monotonic())):
            client.request(method, target, body or None, {**_USUAL, **headers})
            return self._answer(client)

    def hand_over(
        self, method: str, target: str, headers: Mapping[str, str], body: Iterable[bytes], size_bytes: int
    ) -> Answer:
        """Send something large.

        Args:
            method: of HTTP.
            target: path and query.
            headers: beside the usual ones.
            body: in pieces. What it raises ends the request.
            size_bytes: of all of them.

        Raises:
            ServerLostError: there is no answer.
            UnavailableError: the answer is elsewhere, or beyond all measure.
        """
        with self._client() as client:
            client.request(method, target, body, {**_USUAL, **headers, "Content-Length": str(size_bytes)})
            with _limit(client, self._hurried(_STORED_S)):
                client.sock.settimeout(_STORED_S)
                return self._answer(client)

    def _hurried(self, patience_s: float) -> float:
        return min(patience_s, _HURRIED_S) if self._is_hurried else patience_s

    @contextmanager
    def _client(self, patience_s: float = _CONNECT_S) -> Iterator[http.client.HTTPConnection]:
        uri, connect_s = self._uri, self._hurried(min(patience_s, _CONNECT_S))
        if uri.is_secure:
            context = ssl.create_default_context()
            client: http.client.HTTPConnection = http.client.HTTPSConnection(
                uri.host, uri.port, timeout=connect_s, context=context
            )
        else:
            client = http.client.HTTPConnection(uri.host, uri.port, timeout=connect_s)
        try:
            client.connect()
            self._under_way = client.sock
            yield client
        except (OSError, http.client.HTTPException, ValueError) as error:
            raise self._failed(error) from None
        finally:
            self._under_way = None
            client.close()

    def _answer(self, client: http.client.HTTPConnection) -> Answer:
        with client.getresponse() as response:  # the client itself no longer closes it
            if response.status in _MOVED:
                there = "".join(each for each in response.getheader("Location") or "elsewhere" if each.isprintable())
                raise UnavailableError(f"{self.server} has moved to {there[:200]}", "give the new address")
            body = response.read(_MOST_BYTES + 1)
            if len(body) > _MOST_BYTES:
                raise UnavailableError(
                    f"{self.server} gives an answer that does not end", "check which server is there"
                )
            challenges = response.headers.get_all("WWW-Authenticate") or []
            digest = next((each for each in challenges if each.strip().lower().startswith("digest")), "")
            return Answer(self.server, response.status, body, digest)

    def _failed(self, error: Exception) -> ServerLostError:
        for kind, problem, remedy in _FAILURES:
            if isinstance(error, kind):
                return ServerLostError(f"{self.server} {problem}", remedy)
        why = getattr(error, "strerror", None) or "no reason given"
        return ServerLostError(f"{self.server} cannot be reached ({why})", "check the address and the network")


_USUAL: Final = {"Accept": "application/json", "User-Agent": "tandemscan", "Connection": "close"}


@contextmanager
def _limit(client: http.client.HTTPConnection, patience_s: float) -> Iterator[None]:
    """Limit a whole exchange: single bytes could come in time without an end.

    Raises:
        TimeoutError: the time is up.
    """
    late = threading.Event()
    sock = client.sock  # the client drops it after reading the answer's head

    def give_up() -> None:
        late.set()  # first, because an interrupted answer reads like a complete one
        with suppress(OSError):
            sock.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(patience_s, give_up)
    timer.daemon = True
    timer.start()
    try:
        yield
    except (OSError, http.client.HTTPException, UnavailableError):
        if late.is_set():
            raise TimeoutError from None
        raise
    finally:
        timer.cancel()
    if late.is_set():
        raise TimeoutError
