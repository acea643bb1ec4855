"""What printers' servers say of themselves: read without belief, and answered as their standards want it."""

import json
import math

import pytest

from common.errors import UnavailableError
from phone_host.discovery.found import Announcement
from phone_host.printers.printer_uri import FoundPrinter, printers_of
from phone_host.printers.prusalink import digest_header
from phone_host.printers.server_answer import Answer, Value


@pytest.mark.parametrize("body", [b"", b"[1]", b'"text"', b"{", b"\xff", b"[" * 100_000])
def test_an_answer_that_is_no_object_is_told_in_one_line(body: bytes) -> None:
    """Whatever the bytes are: the server is named, and nothing else is thrown."""
    with pytest.raises(UnavailableError, match="the printer gives an unexpected kind of answer"):
        Answer("the printer", 200, body).json()
    assert Answer("the printer", 500, body).words == "answer 500"


def test_each_value_is_of_its_type_or_nothing() -> None:
    """A text where a number is expected is no number, and the other way round; what is missing is nothing, however deep."""
    body = {
        "text": "two\nlines\x00 ",
        "number": 1.5,
        "true": True,
        "list": ["a", 2, "b" * 300],
        "vast": 10**400,
        "long": "y" * 900,
    }
    said = Answer("", 200, json.dumps(body).encode()).json()
    assert said["text"].text == "two lines"
    assert len(said["long"].text) == 200
    assert said["number"].number == 1.5
    assert said["list"].texts == ("a",)
    assert said["list"].parts[1].number == 2
    assert said.keys == tuple(body)
    for wrong in (said["number"], said["none"]["deeper"], said["true"], said["list"]):
        assert wrong.text == ""
    for wrong in (said["text"], said["none"]["deeper"], said["true"], said["list"], said["vast"], Value(math.inf)):
        assert math.isnan(wrong.number)
    for wrong in (said["text"], said["none"], said["number"]):
        assert (wrong.texts, wrong.parts, wrong.keys) == ((), (), ())


CHALLENGE = (
    'Digest realm="http-auth@example.org", qop="auth, auth-int", algorithm={}, nonce="7ypf/xlj9XXwfDPEoM4URrv/xwf94BcCAzFZH4GiTo0v",'
    ' opaque="FQhe/qaU925kfnzjCev0ciny7QMkPqMAFRtzCUYo5tdS"'
)
CLIENT = "f2/wE4q74E6zIJEtWaHKaf5wv/H5QzzpXusqGemxURZJ"


@pytest.mark.parametrize(
    ("algorithm", "response"),
    [
        ("MD5", "8ca523f5e9506fed4657c9700eebdbec"),
        ("SHA-256", "753927fa0e85d155564e2e272a28d1802ca10daf4496794697cf8db5856cb6c1"),
    ],
)
def test_a_challenge_is_answered_as_in_the_standard(algorithm: str, response: str) -> None:
    """The examples of RFC 7616, section 3.9.1."""
    asked = ("GET", "/dir/index.html")
    header = digest_header(CHALLENGE.format(algorithm), "Mufasa", "Circle of Life", asked, CLIENT)
    assert f'response="{response}"' in header
    assert "qop=auth," in header


def test_an_old_challenge_is_answered_without_a_nonce_of_the_client() -> None:
    """The example of RFC 2069 as its errata correct it: no quality of protection is offered."""
    challenge = 'Digest realm="testrealm@host.com", nonce="dcd98b7102dd2f0e8b11d0f600bfb0c093"'
    header = digest_header(challenge, "Mufasa", "CircleOfLife", ("GET", "/dir/index.html"), CLIENT)
    assert 'response="1949323746fe6a43ef61f9606e7febea"' in header
    assert "cnonce" not in header


@pytest.mark.parametrize(
    ("challenge", "user"),
    [
        ('Basic realm="x"', "a"),
        ("", "a"),
        ('Digest realm="x"', "a"),
        (CHALLENGE.format("SHA-512"), "a"),
        (CHALLENGE.format("MD5"), 'a"b'),
    ],
)
def test_what_is_no_challenge_is_not_answered(challenge: str, user: str) -> None:
    """Another scheme, no nonce, an unknown hash, or a name that would break the header."""
    assert digest_header(challenge, user, "secret", ("GET", "/"), CLIENT) == ""


def test_printers_are_told_by_their_service_or_their_name() -> None:
    """Each once and sorted; a web page of something else is none, and a name's unprintable characters are blanks."""
    heard = [
        Announcement("_octoprint._tcp.local.", "Ender\n3", "10.0.0.9", 80),
        Announcement("_octoprint._tcp.local.", "the same again", "10.0.0.9", 80),
        Announcement("_http._tcp.local.", "My PrusaLink", "10.0.0.2", 8080),
        Announcement("_http._tcp.local.", "a lamp", "10.0.0.3", 80),
    ]
    assert printers_of(heard) == [
        FoundPrinter("octoprint://10.0.0.9:80", "Ender 3"),
        FoundPrinter("prusalink://10.0.0.2:8080", "My PrusaLink"),
    ]
