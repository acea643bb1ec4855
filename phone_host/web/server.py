"""The page's server: a thread with an event loop of its own beside the pipeline. Light: aiohttp is imported at the start."""

import asyncio
import errno
import socket
import ssl
import threading
from typing import TYPE_CHECKING, Final
from urllib.parse import quote

from common.errors import SettingsError, TakenError, UnavailableError
from phone_host.web.gate import Gate
from phone_host.web.secret_files import new_token
from phone_host.web.settings import LIMITS, Limits, PageSettings
from phone_host.web.source import Source

if TYPE_CHECKING:
    from phone_host.web.serving import Serving

_BACKLOG: Final = 64
_SEND_BYTES: Final = 1 << 18
"""What the kernel keeps for a reader. Its own limit is some MB, which a slow reader would see minutes later."""
_STOP_S: Final = 5.0


class PageServer:
    """Serves the page until it is stopped.

    Args:
        source: the program behind the page.
        settings: where, and for whom.
        limits: what strangers may use up.
    """

    def __init__(self, source: Source, settings: PageSettings, limits: Limits = LIMITS) -> None:
        self._source, self._settings, self._limits = source, settings, limits
        self._token = settings.token or new_token()
        self._thread: threading.Thread | None = None
        self._listens = threading.Event()
        self._failure: BaseException | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ended: asyncio.Event | None = None
        self.port = settings.port

    @property
    def token(self) -> str:
        """The secret of the first URL."""
        return self._token

    @property
    def address(self) -> str:
        """Where the page is, without the token."""
        return self.url.partition("?")[0]

    @property
    def url(self) -> str:
        """The first address to open: it carries the token."""
        return self.url_at("")

    def url_at(self, name: str) -> str:
        """Return the first address to open from elsewhere.

        Args:
            name: a name or an address of this machine; empty: the one that the server listens on.
        """
        host = name or self._settings.host
        scheme = "http" if self._settings.credentials is None else "https"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{self.port}/?token={quote(self._token)}"

    def start(self) -> None:
        """Begin to serve; returns once it listens.

        Raises:
            SettingsError: the host has no address here.
            UnavailableError: the port is taken, or a package is missing.
        """
        try:
            from phone_host.web.serving import Serving  # noqa: PLC0415 - most commands never need aiohttp
        except ModuleNotFoundError as error:
            raise UnavailableError(
                f"the page needs the package {error.name}", f"install it: pip install {error.name}"
            ) from error
        listener = self._listener()
        self._thread = threading.Thread(target=self._run, args=(Serving, listener), name="page", daemon=True)
        self._thread.start()
        self._listens.wait()
        if self._failure is not None:
            self._thread.join()
            raise self._failure

    def stop(self) -> None:
        """Close all viewers and end. May be called again."""
        thread, self._thread = self._thread, None
        if thread is None or self._loop is None or self._ended is None:
            return
        self._loop.call_soon_threadsafe(self._ended.set)
        thread.join(_STOP_S)

    def _listener(self) -> socket.socket:
        host, port = self._settings.host.strip("[]"), self._settings.port
        try:
            family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[
                0
            ]
        except (OSError, UnicodeError) as error:
            raise SettingsError(
                f"{host} is no address of this machine", "use 127.0.0.1, or another of its own"
            ) from error
        listener = socket.socket(family, socket.SOCK_STREAM)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BYTES)
            listener.bind(address)
            listener.listen(_BACKLOG)
        except OSError as error:
            listener.close()
            raise _unavailable(host, port, error) from error
        self.port = listener.getsockname()[1]
        return listener

    def _run(self, serving: "type[Serving]", listener: socket.socket) -> None:
        try:
            asyncio.run(self._serve(serving, listener))
        except BaseException as error:  # noqa: BLE001 - told to the thread that started this one
            self._failure = error
        finally:
            listener.close()
            self._listens.set()

    async def _serve(self, serving: "type[Serving]", listener: socket.socket) -> None:
        self._loop, self._ended = asyncio.get_running_loop(), asyncio.Event()
        known_as, credentials = self._settings.known_as, self._settings.credentials
        gate = Gate(known_as, self._token, is_https=credentials is not None, port=self.port)
        served = serving(self._source, self._settings, self._limits, gate, self._tls())
        await served.start(listener)
        self._listens.set()
        try:
            await self._ended.wait()
        finally:
            await served.stop()

    def _tls(self) -> ssl.SSLContext | None:
        credentials = self._settings.credentials
        if credentials is None:
            return None
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        context.load_cert_chain(credentials.chain)
        return context


def _unavailable(host: str, port: int, error: OSError) -> UnavailableError:
    if error.errno == errno.EADDRINUSE:
        return TakenError(
            f"port {port} of {host} is taken",
            "end the program that has it, or give another port, such as 127.0.0.1:8766",
        )
    return UnavailableError(f"port {port} of {host} cannot be had ({error.strerror})", "give another address and port")
