"""What the page's server is started with. Light: nothing of the server is imported."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from phone_host.web.gate import is_loopback

DEFAULT_HOST: Final = "127.0.0.1"
DEFAULT_PORT: Final = 8765
"""Fixed, because a browser's permissions belong to an origin, and an origin has a port."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Credentials:
    """What https needs.

    Attributes:
        chain: file with the certificate and its key, PEM.
        authority: certificate of the authority that signed it, PEM.
        fingerprint: SHA-256 of the authority's certificate, as browsers show it.
        names: names and addresses for which the certificate is valid.
        is_new_authority: whether the authority was made just now, so that browsers do not know it yet.
    """

    chain: Path
    authority: bytes
    fingerprint: str
    names: tuple[str, ...]
    is_new_authority: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PageSettings:
    """Settings of the page's server.

    Attributes:
        host: name or address to listen on.
        port: 0: any that is free.
        names: further names and addresses under which browsers reach it.
        token: the secret in the first URL; empty: a new one.
        credentials: for https; None: http, on loopback only.
        page: folder of the page's files; None: the package's own.
        values: JSON schemas of what commands take, by name, for the API's description.
    """

    host: str = DEFAULT_HOST
    port: int = DEFAULT_PORT
    names: tuple[str, ...] = ()
    token: str = ""
    credentials: Credentials | None = None
    page: Path | None = None
    values: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse a page that others could read on their way.

        Raises:
            SettingsError: it would listen beyond loopback without https.
        """
        if self.credentials is None and not is_loopback(self.host):
            raise SettingsError(
                f"{self.host!r} is not an address that only this machine reaches",
                "give 127.0.0.1:PORT, or add --lan for a page that other machines reach by https",
            )

    @property
    def known_as(self) -> frozenset[str]:
        """Names and addresses that may stand in a Host header, beside those of loopback."""
        certified = () if self.credentials is None else self.credentials.names
        return frozenset(name.lower() for name in (self.host, *self.names, *certified))


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What strangers may use up.

    Attributes:
        connections: open at once; beyond, the one that was idle longest is closed for a new one.
        viewers: WebSockets and event streams at once, of those without the token; as many again for those with it.
        requests_per_s: of one address, those without the token; as many again for those with it.
        requests_burst: how many may come at once.
        body_bytes: of a request.
        message_bytes: of a viewer's message.
        messages_per_s: of a viewer.
        idle_s: how long a connection may take for a request, and how long it may wait between two.
        silent_s: how long a viewer may leave a pair without acknowledgement, or take for a message.
        downloads: large answers under way at once, of those without the token; as many again for those with it.
        commands: commands under way at once, but for `stop`.
        cameras: WebSockets of browsers that give their cameras at once, of those without the cookie; as many again for those with it.
        frame_bytes: of a message of such a browser; the luma of 1920x1080 takes half of it.
        words_per_s: text messages of such a browser.
        hello_s: how long it may take for its first one.
    """

    connections: int = 96
    viewers: int = 8
    requests_per_s: float = 100.0
    requests_burst: int = 300
    body_bytes: int = 16_384
    message_bytes: int = 4096
    messages_per_s: float = 100.0
    idle_s: float = 15.0
    silent_s: float = 60.0
    downloads: int = 6
    commands: int = 4
    cameras: int = 6
    frame_bytes: int = 4 << 20
    words_per_s: float = 50.0
    hello_s: float = 2.0


LIMITS: Final = Limits()

SECURITY_HEADERS: Final[Mapping[str, str]] = {
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Embedder-Policy": "require-corp",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Permissions-Policy": "camera=(self), geolocation=(), microphone=()",
}


def content_policy(script_hashes: tuple[str, ...]) -> str:
    """Return the page's Content-Security-Policy: everything from here, nothing inline but what has these hashes.

    Args:
        script_hashes: SHA-256 of inline scripts, base64.
    """
    scripts = " ".join(["'self'", *(f"'sha256-{text}'" for text in script_hashes)])
    return (
        f"default-src 'none'; script-src {scripts}; style-src 'self'; img-src 'self' blob: data:; media-src 'self' blob:; "
        "connect-src 'self'; worker-src 'self' blob:; font-src 'self'; manifest-src 'self'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    )
