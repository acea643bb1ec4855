"""One connection to an MJPEG server: opens it, judges the answer and reads the bytes.

Every refusal is one line with its remedy.
"""

import base64
import http.client
import socket
import ssl
import threading
from contextlib import suppress
from typing import Final

from common.errors import UnavailableError
from phone_host.camera.uris import HttpSettings

_READ_BYTES: Final = 65_536
"""More than a phone's JPEG at 720p, so one read takes everything that has come."""

_ANSWER_S: Final = 8.0
"""Time limit for the head of an answer, less than the time limit for a camera's start."""

_NO_STREAM: Final = (
    "text/",
    "application/json",
    "application/xml",
    "application/xhtml",
    "image/",
    "audio/",
    "video/mp4",
)
"""Content types that are certainly no stream. Any other is examined, since servers give MJPEG many names or none."""

_FAILURES: Final[tuple[tuple[type[Exception], str, str], ...]] = (
    (ssl.SSLCertVerificationError, "has a certificate that this machine does not trust", "give ?verify=0 to accept it"),
    (ssl.SSLError, "does not speak https", "give http:// in place of https://"),
    (TimeoutError, "does not answer", "check that phone and host are in the same network"),
    (ConnectionRefusedError, "refuses the connection", "start the server in the phone's app"),
    (socket.gaierror, "has no address", "give the number that the phone's app shows"),
    (ConnectionResetError, "hangs up without an answer", "check the port, and whether it needs https://"),
    (http.client.HTTPException, "does not speak HTTP", "check the port"),
)
"""What each failure means, the most specific ones first."""


class Connection:
    """An open stream of bytes.

    Args:
        settings: the server.
        patience_s: time limit for connecting and for each read of the answer.

    Raises:
        UnavailableError: the server cannot be reached, or its answer is not a stream.
    """

    def __init__(self, settings: HttpSettings, patience_s: float) -> None:
        self._settings = settings
        self._client = self._make(patience_s)
        self._response: http.client.HTTPResponse | None = None
        try:
            self._client.connect()
            self._sock: socket.socket = self._client.sock  # the client drops it after reading the answer's head
            self._client.request("GET", settings.target, headers=_headers(settings))
            self._response = self._answer()
            self._judge(self._response)
        except UnavailableError:
            self.close()
            raise
        except (OSError, http.client.HTTPException, ValueError) as error:
            self.close()
            raise self._failed(error) from None

    def _answer(self) -> http.client.HTTPResponse:
        """Return the head of the answer, within a total time limit: single bytes could come in time without an end."""
        late = threading.Event()

        def give_up() -> None:
            late.set()  # first, because an interrupted head reads like a complete one
            self.interrupt()

        timer = threading.Timer(_ANSWER_S, give_up)
        timer.daemon = True
        timer.start()
        try:
            return self._client.getresponse()
        finally:
            timer.cancel()
            if late.is_set():
                raise TimeoutError

    def read(self, patience_s: float) -> bytes:
        """Wait for bytes.

        Returns:
            The bytes that have come; empty at the end of the stream.

        Raises:
            OSError: nothing came within the patience, or the connection broke.
        """
        assert self._response is not None
        self._sock.settimeout(patience_s)
        try:
            return self._response.read1(_READ_BYTES)
        except (http.client.HTTPException, ValueError):  # invalid chunks; TLS that was shut down
            return b""

    def interrupt(self) -> None:
        """Make a thread that waits in `read` see the end of the stream. Safe from any thread."""
        with suppress(OSError):  # already broken
            self._sock.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close the connection. Only for the thread that reads."""
        with suppress(OSError):
            if self._response is not None:
                self._response.close()
            self._client.close()

    def _make(self, patience_s: float) -> http.client.HTTPConnection:
        settings = self._settings
        if not settings.secure:
            return http.client.HTTPConnection(settings.host, settings.port, timeout=patience_s)
        context = ssl.create_default_context()
        if not settings.verify:
            context.check_hostname = False
            context.verify_mode = ssl.CERT_NONE
        return http.client.HTTPSConnection(settings.host, settings.port, timeout=patience_s, context=context)

    def _failed(self, error: Exception) -> UnavailableError:
        shown = self._settings.shown
        for kind, problem, remedy in _FAILURES:
            if isinstance(error, kind):
                return UnavailableError(f"camera {shown} {problem}", remedy)
        why = getattr(error, "strerror", None) or error
        return UnavailableError(f"camera {shown} cannot be reached ({why})", "check the address and the network")

    def _judge(self, response: http.client.HTTPResponse) -> None:
        shown, status = self._settings.shown, response.status
        kind = (response.getheader("Content-Type") or "").split(";")[0].strip().lower()
        if status == http.client.UNAUTHORIZED:
            asked = response.headers.get_all("WWW-Authenticate") or []
            if asked and not any(one.strip().lower().startswith("basic") for one in asked):
                raise UnavailableError(
                    f"camera {shown} asks for a password by {asked[0].split()[0][:20]} authentication, only Basic is spoken here",
                    "switch its password off, or to Basic",
                )
            if self._settings.user:
                raise UnavailableError(
                    f"camera {shown} does not take this name and password",
                    "correct the name and password in the address",
                )
            raise UnavailableError(f"camera {shown} asks for a password", "give http://USER:PASSWORD@HOST:PORT/…")
        if status in {301, 302, 303, 307, 308}:
            there = response.getheader("Location") or "elsewhere"
            raise UnavailableError(f"camera {shown} has moved to {there[:200]}", "give the new address")
        if status == http.client.NOT_FOUND:
            raise UnavailableError(f"camera {shown} is not there (404)", "check the path; IP Webcam has /video")
        if status != http.client.OK:
            raise UnavailableError(f"camera {shown} answers {status}", "look at the app on the phone; it may be busy")
        if kind.startswith(_NO_STREAM) and kind != "image/x-mjpeg":
            what = "a web page" if kind == "text/html" else "single images" if kind.startswith("image/") else kind
            raise UnavailableError(
                f"camera {shown} gives {what}, no MJPEG stream", "give the video's own address; IP Webcam has /video"
            )


def _headers(settings: HttpSettings) -> dict[str, str]:
    headers = {"Accept": "*/*", "User-Agent": "tandemscan", "Connection": "close"}
    if settings.user:
        secret = base64.b64encode(f"{settings.user}:{settings.password}".encode()).decode("ascii")
        headers["Authorization"] = f"Basic {secret}"
    return headers
