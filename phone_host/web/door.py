"""What every request passes: the gate, the rates, and the words for what went wrong. A shell around `gate`."""

import logging
from collections.abc import Mapping
from typing import Final

from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from common import now
from common.diagnostic import Diagnostic, Severity, diagnostic_of
from common.errors import TandemError
from phone_host.output.json_text import json_text
from phone_host.report.json_result import problem_values
from phone_host.web.connections import Connections
from phone_host.web.gate import Asked, Gate, Kind, Passed, Refusal
from phone_host.web.rates import Rate, Rates
from phone_host.web.settings import SECURITY_HEADERS, Limits

_LOG: Final = logging.getLogger(__name__)

KNOWN: Final = web.RequestKey("known", bool)
"""Whether a request is one of the user's own: it carries the token or the cookie."""

_REFUSALS: Final[Mapping[Refusal, tuple[int, Diagnostic]]] = {
    Refusal.HOST: (
        421,
        Diagnostic("this page is not known by that name", "open the address that phone-host printed", Severity.FAIL),
    ),
    Refusal.ORIGIN: (
        403,
        Diagnostic(
            "another site may not ask this page for anything", "open the address that phone-host printed", Severity.FAIL
        ),
    ),
    Refusal.TOKEN: (
        401,
        Diagnostic(
            "this needs the token of the first address", "open the address that phone-host printed", Severity.FAIL
        ),
    ),
}
_TOO_OFTEN: Final = Diagnostic("too many requests", "wait a second", Severity.FAIL)
_TROUBLES: Final[Mapping[int, Diagnostic]] = {
    404: Diagnostic("there is nothing at this address", "see /api/openapi.json", Severity.FAIL),
    405: Diagnostic("this address is not asked in this way", "see /api/openapi.json", Severity.FAIL),
    408: Diagnostic("the request took too long", "send it faster", Severity.FAIL),
    413: Diagnostic("the request is too long", "send less", Severity.FAIL),
    503: Diagnostic("too much is asked for at once", "try again in a moment", Severity.FAIL),
}
_TOLD_ALONG: Final = ("Allow", "Retry-After")
_BAD: Final = Diagnostic("the request could not be read", "see /api/openapi.json", Severity.FAIL)
_OURS: Final = Diagnostic("the program itself failed", "see its log", Severity.FAIL)


def problem(status: int, trouble: Diagnostic, headers: Mapping[str, str] | None = None) -> web.Response:
    """Make an answer that says what is wrong and what to do."""
    return web.Response(
        status=status,
        text=json_text(problem_values(trouble)),
        content_type="application/json",
        headers={"Cache-Control": "no-store", **(headers or {})},
    )


class Door:
    """Lets requests in.

    Args:
        gate: judges them.
        limits: of their rate.
        connections: told what is being answered.
        policy: the page's Content-Security-Policy.
    """

    def __init__(self, gate: Gate, limits: Limits, connections: Connections, policy: str) -> None:
        self._gate, self._connections = gate, connections
        self._headers = {**SECURITY_HEADERS, "Content-Security-Policy": policy, "Server": "phone-host"}
        self._rates = Rates(limits.requests_per_s, limits.requests_burst)
        self._complaints = Rate(1.0, 5, 0.0)

    async def dress(self, _request: web.Request, response: web.StreamResponse) -> None:
        """Give every answer the headers that keep other sites away from it."""
        response.headers.update(self._headers)

    def middleware(self) -> Middleware:
        """Return the function that aiohttp calls with each request."""

        @web.middleware
        async def enter(request: web.Request, handler: Handler) -> web.StreamResponse:
            transport = request.transport
            self._connections.answering(transport, 1)
            try:
                return self._refused(request) or await self._answered(request, handler)
            finally:
                self._connections.answering(transport, -1)

        return enter

    def _refused(self, request: web.Request) -> web.Response | None:
        verdict = self._gate.judge(asked_of(request))
        if isinstance(verdict, Refusal):
            if not self._rates.take((request.remote, False), now.monotonic_ns() / 1e9):
                return problem(429, _TOO_OFTEN, {"Retry-After": "1"})
            status, trouble = _REFUSALS[verdict]
            return problem(status, trouble, {"WWW-Authenticate": "Bearer"} if status == 401 else None)
        assert isinstance(verdict, Passed)
        request[KNOWN] = verdict.is_known
        # The user's own requests have a rate of their own: an app beside the browser shares its address.
        if not self._rates.take((request.remote, verdict.is_known), now.monotonic_ns() / 1e9):
            return problem(429, _TOO_OFTEN, {"Retry-After": "1"})
        return None

    async def _answered(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        try:
            return await handler(request)
        except web.HTTPException as error:
            headers = {name: error.headers[name] for name in _TOLD_ALONG if name in error.headers}
            return problem(error.status, _TROUBLES.get(error.status, _BAD), headers)
        except TandemError as error:
            return problem(409, diagnostic_of(error))
        except (ConnectionError, TimeoutError):
            raise  # the peer is gone
        except Exception:  # noqa: BLE001 - one answer fails, the server lives on
            if self._complaints.take(now.monotonic_ns() / 1e9):
                _LOG.exception("page: answer failed, path=%r", request.path)
            return problem(500, _OURS)


def asked_of(request: web.Request) -> Asked:
    """Return what the gate looks at."""
    said = request.headers
    commands = request.method not in {"GET", "HEAD"}
    kind = Kind.COMMAND if commands else Kind.OPEN if request.path == "/" else Kind.READ
    return Asked(
        method=request.method,
        kind=kind,
        peer=request.remote or "",
        # A target with a host of its own overrides the header (RFC 9112, section 3.2.2). No browser sends one to a server.
        host=said.get("Host", "") if request.raw_path.startswith("/") else "",
        # Whoever says it twice says something that is not ours.
        origin=", ".join(said.getall("Origin", ())),
        site=", ".join(said.getall("Sec-Fetch-Site", ())),
        mode=said.get("Sec-Fetch-Mode", ""),
        cookie="; ".join(said.getall("Cookie", ())),
        authorization=said.get("Authorization", ""),
        token=request.query.get("token", ""),
    )
