"""Decides who may ask the page's server for what. Pure.

A browser runs scripts of strangers, and on a phone every app reaches loopback. So on every request:
the Host header must be one of our names (else a stranger's name that now resolves to us, DNS rebinding, would be an
origin of ours); an Origin must be that same host; a browser that says which site asks (Fetch Metadata) must say ours.
Reading on loopback needs nothing more. Commands need the token, in a header: a page of another origin cannot send
it, and no other port of this host receives it, as it would receive a cookie (RFC 6265, section 8.5). Elsewhere, reading
needs the cookie or the token.
"""

import hashlib
import hmac
import ipaddress
import re
from dataclasses import dataclass
from enum import Enum
from typing import Final

_HOST: Final = re.compile(r"(?P<name>\[[0-9A-Fa-f:.]{2,45}\]|[A-Za-z0-9._-]{1,253})(?::(?P<port>[0-9]{1,5}))?\Z")
_LOOPBACK_NAMES: Final = frozenset({"localhost", "127.0.0.1", "[::1]"})
_READING: Final = frozenset({"GET", "HEAD"})
_OWN_SITE: Final = frozenset({"same-origin", "none", ""})
"""Values of Sec-Fetch-Site: of our page, typed by a person, or not a browser that says so."""


class Kind(Enum):
    """What is asked for."""

    OPEN = "open"
    """The page itself, to which a person may come from anywhere."""
    READ = "read"
    COMMAND = "command"


class Refusal(Enum):
    """Why a request is refused."""

    HOST = "host"
    ORIGIN = "origin"
    TOKEN = "token"  # noqa: S105 - a reason, not a token


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A request, as far as the gate looks at it. An absent header is empty.

    Attributes:
        method: GET, POST, ...
        kind: what is asked for.
        peer: address of the other end.
        host: header Host.
        origin: header Origin.
        site: header Sec-Fetch-Site.
        mode: header Sec-Fetch-Mode.
        cookie: header Cookie.
        authorization: header Authorization.
        token: the token of the URL.
    """

    method: str
    kind: Kind
    peer: str
    host: str
    origin: str = ""
    site: str = ""
    mode: str = ""
    cookie: str = ""
    authorization: str = ""
    token: str = ""


@dataclass(frozen=True, slots=True)
class Passed:
    """The gate lets a request pass.

    Attributes:
        is_known: whether it carries the token or the cookie: it is one of the user's own.
    """

    is_known: bool


class Gate:
    """Judges requests.

    Args:
        names: names and addresses, lower case, that may stand in a Host header beside those of loopback.
        token: the secret of the first URL.
        is_https: whether the server speaks https.
        port: which it listens on.
    """

    def __init__(self, names: frozenset[str], token: str, *, is_https: bool, port: int) -> None:
        self._names = _LOOPBACK_NAMES | {_as_host(name) for name in names if not _is_wildcard(name)}
        self._token, self._scheme, self._port = token, "https" if is_https else "http", port
        self._cookie = hmac.digest(token.encode(), b"cookie of the page", hashlib.sha256).hex()
        # Two servers on one host share their cookies: the port keeps them apart. __Host-: only by https, for this host.
        self.cookie_name: Final = f"{'__Host-' if is_https else ''}tandemscan-{port}"

    @property
    def set_cookie(self) -> str:
        """The Set-Cookie header for a browser that came with the token."""
        secure = "; Secure" if self._scheme == "https" else ""
        return f"{self.cookie_name}={self._cookie}; Path=/; HttpOnly; SameSite=Strict; Max-Age=34560000{secure}"

    def judge(self, asked: Asked) -> Passed | Refusal:
        """Say whether a request may pass."""
        host = _HOST.match(asked.host)
        if host is None or host["name"].lower() not in self._names:
            return Refusal.HOST
        if asked.origin and asked.origin.lower() != f"{self._scheme}://{asked.host.lower()}":
            return Refusal.ORIGIN
        if asked.site not in _OWN_SITE and not _is_visit(asked):
            return Refusal.ORIGIN
        has_token = self._has_token(asked)
        if asked.kind is Kind.COMMAND or asked.method not in _READING:
            return Passed(is_known=True) if has_token else Refusal.TOKEN
        is_known = has_token or self._has_cookie(asked.cookie)
        is_near = is_loopback(asked.peer) and host["name"].lower() in _LOOPBACK_NAMES
        return Passed(is_known) if is_known or is_near else Refusal.TOKEN

    def is_token(self, text: str) -> bool:
        """Whether a text is the token; takes the same time for every text of its length."""
        return _is_same(text, self._token)

    def _has_token(self, asked: Asked) -> bool:
        scheme, _, given = asked.authorization.partition(" ")
        in_header = scheme.lower() == "bearer" and self.is_token(given.strip())
        # In a URL it would be written to logs and histories: there it only opens the page.
        in_url = asked.kind is Kind.OPEN and asked.token != "" and self.is_token(asked.token)
        return in_header or in_url

    def _has_cookie(self, header: str) -> bool:
        # Not http.cookies: it gives up at the first odd cookie, which any other port of this host may have set.
        given = (part.strip().partition("=") for part in header.split(";"))
        return any(name == self.cookie_name and _is_same(value, self._cookie) for name, _, value in given)


def is_loopback(host: str) -> bool:
    """Whether a name or an address means this machine only.

    Args:
        host: such as localhost, 127.0.0.1 or ::1.
    """
    if host.lower() == "localhost":
        return True
    try:
        address = ipaddress.ip_address(host.strip("[]").partition("%")[0])
    except ValueError:
        return False
    mapped = getattr(address, "ipv4_mapped", None)
    return (mapped or address).is_loopback


def _is_same(given: str, secret: str) -> bool:
    return hmac.compare_digest(given.encode(errors="replace"), secret.encode())


def _is_visit(asked: Asked) -> bool:
    """Whether a person comes to the page from another site: what that site can't read, and what changes nothing."""
    return asked.kind is Kind.OPEN and asked.mode == "navigate" and asked.method in _READING


def _is_wildcard(name: str) -> bool:
    try:
        return ipaddress.ip_address(name.strip("[]")).is_unspecified
    except ValueError:
        return False


def _as_host(name: str) -> str:
    """Write a name or an address as it stands in a Host header."""
    return f"[{name.lower()}]" if ":" in name and not name.startswith("[") else name.lower()
