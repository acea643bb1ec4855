"""The page's gate: who may ask for what, by Host, Origin, token and cookie."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phone_host.web.gate import Asked, Gate, Kind, Passed, Refusal, is_loopback

TOKEN = "a-token-of-some-length"
GATE = Gate(frozenset({"192.168.1.5", "fd00::2", "0.0.0.0", "Laptop.local".lower()}), TOKEN, is_https=False, port=8765)
READ = Asked(method="GET", kind=Kind.READ, peer="127.0.0.1", host="127.0.0.1:8765")
COMMAND = replace(READ, method="POST", kind=Kind.COMMAND)
FAR = replace(READ, peer="192.168.1.9", host="192.168.1.5:8765")
COOKIE = GATE.set_cookie.partition(";")[0]


@pytest.mark.parametrize("host", ["127.0.0.1:8765", "localhost:8765", "LOCALHOST", "[::1]:8765", "localhost:9000"])
def test_reading_on_loopback_is_open(host: str) -> None:
    """Every name of loopback may be read without a token, through a forwarded port, too."""
    assert GATE.judge(replace(READ, host=host)) == Passed(is_known=False)


@pytest.mark.parametrize(
    "host",
    ["", "evil.example", "evil.example:8765", "127.0.0.1.evil.example", "localhost.evil.example:8765", "127.0.0.1@evil", "0.0.0.0:8765",
     "[::1", "::1", "127.0.0.1:123456", "localhost:8765/x", "127.0.0.1:8765\n", "10.0.0.1"],
)  # fmt: skip
def test_a_strange_host_is_refused(host: str) -> None:
    """A name that is not ours is refused even if its address is (DNS rebinding), with the token, too."""
    assert GATE.judge(replace(READ, host=host)) is Refusal.HOST
    assert GATE.judge(replace(COMMAND, host=host, authorization=f"Bearer {TOKEN}")) is Refusal.HOST


@pytest.mark.parametrize(
    "origin",
    [
        "null",
        "http://evil.example",
        "https://127.0.0.1:8765",
        "http://127.0.0.1",
        "http://127.0.0.1:9999",
        "http://localhost:8765",
        "x",
    ],
)
def test_a_foreign_origin_is_refused(origin: str) -> None:
    """Only the very origin of the page may ask; another port or name of this machine may not, even with the token."""
    assert GATE.judge(replace(READ, origin=origin)) is Refusal.ORIGIN
    assert GATE.judge(replace(COMMAND, origin=origin, authorization=f"Bearer {TOKEN}")) is Refusal.ORIGIN


def test_its_own_origin_passes() -> None:
    """The page itself may read and, with the token, command."""
    own = "http://127.0.0.1:8765"
    assert GATE.judge(replace(READ, origin=own, site="same-origin")) == Passed(is_known=False)
    commanding = replace(COMMAND, origin=own, authorization=f"bearer {TOKEN} ")
    assert GATE.judge(commanding) == Passed(is_known=True)


def test_another_site_may_lead_a_person_here_and_no_more() -> None:
    """A link elsewhere opens the page; an image, a script or a request of another site or port is refused."""
    visit = replace(READ, kind=Kind.OPEN, site="cross-site", mode="navigate")
    assert GATE.judge(visit) == Passed(is_known=False)
    assert GATE.judge(replace(visit, mode="no-cors")) is Refusal.ORIGIN
    assert GATE.judge(replace(visit, kind=Kind.READ)) is Refusal.ORIGIN
    assert GATE.judge(replace(READ, site="same-site", mode="no-cors")) is Refusal.ORIGIN
    assert GATE.judge(replace(visit, method="POST")) is Refusal.ORIGIN


def test_commands_need_the_token_in_a_header() -> None:
    """On loopback, too; the cookie, which other ports of this host get, and a token in the URL do not do."""
    assert GATE.judge(COMMAND) is Refusal.TOKEN
    assert GATE.judge(replace(COMMAND, cookie=COOKIE)) is Refusal.TOKEN
    assert GATE.judge(replace(COMMAND, token=TOKEN)) is Refusal.TOKEN
    assert GATE.judge(replace(COMMAND, authorization=f"Basic {TOKEN}")) is Refusal.TOKEN
    assert GATE.judge(replace(COMMAND, authorization="Bearer ")) is Refusal.TOKEN
    assert GATE.judge(replace(COMMAND, authorization="Bearer \udcff")) is Refusal.TOKEN
    assert GATE.judge(replace(READ, method="DELETE")) is Refusal.TOKEN
    assert GATE.judge(replace(COMMAND, authorization=f"Bearer {TOKEN}")) == Passed(is_known=True)


def test_elsewhere_reading_needs_the_cookie_or_the_token() -> None:
    """Off loopback everything is closed; the first URL opens the page only, the cookie and the header all that is read."""
    assert GATE.judge(FAR) is Refusal.TOKEN
    assert GATE.judge(replace(FAR, token=TOKEN)) is Refusal.TOKEN
    assert GATE.judge(replace(FAR, kind=Kind.OPEN, token=TOKEN)) == Passed(is_known=True)
    assert GATE.judge(replace(FAR, kind=Kind.OPEN, token=TOKEN[:-1])) is Refusal.TOKEN
    assert GATE.judge(replace(FAR, cookie=COOKIE)) == Passed(is_known=True)
    assert GATE.judge(replace(FAR, cookie=f'a="; {GATE.cookie_name}=no; {COOKIE}')) == Passed(is_known=True)
    assert GATE.judge(replace(FAR, cookie=COOKIE + "0")) is Refusal.TOKEN
    assert GATE.judge(replace(FAR, authorization=f"Bearer {TOKEN}")) == Passed(is_known=True)
    assert GATE.judge(replace(FAR, host="[fd00::2]:8765", peer="fd00::9", cookie=COOKIE)) == Passed(is_known=True)


def test_loopback_is_both_ends() -> None:
    """A name of loopback from afar, and a near peer by a name of the network, need the token."""
    assert GATE.judge(replace(FAR, host="localhost:8765")) is Refusal.TOKEN
    assert GATE.judge(replace(READ, host="laptop.local:8765")) is Refusal.TOKEN
    assert GATE.judge(replace(READ, peer="")) is Refusal.TOKEN


def test_the_cookie_is_not_the_token_and_belongs_to_one_token() -> None:
    """Who sees the cookie cannot command; another token's cookie opens nothing; by https it is bound to the host."""
    assert TOKEN not in GATE.set_cookie
    assert "HttpOnly; SameSite=Strict" in GATE.set_cookie
    assert "Secure" not in GATE.set_cookie
    safe = Gate(frozenset({"192.168.1.5"}), TOKEN, is_https=True, port=8765)
    assert safe.set_cookie.startswith("__Host-")
    assert safe.set_cookie.endswith("; Secure")
    other = Gate(frozenset({"192.168.1.5"}), "another token", is_https=False, port=8765)
    assert other.judge(replace(FAR, cookie=COOKIE)) is Refusal.TOKEN
    assert safe.judge(replace(FAR, origin="http://192.168.1.5:8765")) is Refusal.ORIGIN


@settings(max_examples=30)
@given(st.text(max_size=60), st.text(max_size=60), st.text(max_size=60), st.text(max_size=60))
def test_no_text_in_the_headers_opens_a_command(cookie: str, authorization: str, token: str, origin: str) -> None:
    """Whatever a stranger writes, it is a refusal, never an error."""
    for asked in (COMMAND, FAR):
        tried = replace(asked, cookie=cookie, authorization=authorization, token=token, origin=origin)
        assert isinstance(GATE.judge(tried), Refusal)


@pytest.mark.parametrize(
    ("host", "near"),
    [("localhost", True), ("127.0.0.1", True), ("127.8.9.1", True), ("::1", True), ("[::1]", True), ("::ffff:127.0.0.1", True),
     ("0.0.0.0", False), ("::", False), ("192.168.1.5", False), ("::ffff:192.168.1.5", False), ("fe80::1%eth0", False), ("laptop", False), ("", False)],
)  # fmt: skip
def test_what_loopback_is(host: str, near: bool) -> None:  # noqa: FBT001
    """Addresses and the one name that mean this machine only."""
    assert is_loopback(host) is near
