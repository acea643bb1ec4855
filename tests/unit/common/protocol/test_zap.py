"""The ZAP handler's messages, against RFC 27."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import ProtocolError
from common.protocol.zap import ZapRequest, allow, deny, read_request

KEY = bytes(range(32))


def test_a_curve_request_is_read() -> None:
    """The parts are where RFC 27 puts them: version, id, domain, address, identity, mechanism, key."""
    request = read_request([b"1.0", b"7", b"domain", b"192.0.2.1", b"name", b"CURVE", KEY])
    assert request == ZapRequest(b"7", "192.0.2.1", KEY)


@pytest.mark.parametrize("rest", [[b"NULL"], [b"PLAIN", b"user", b"password"], [b"CURVE", KEY[:31]], [b"CURVE"]])
def test_other_mechanisms_have_no_key(rest: list[bytes]) -> None:
    """A caller without a whole key has no key, and so is known under no name."""
    assert read_request([b"1.0", b"7", b"", b"192.0.2.1", b"", *rest]).key == b""


def test_answers_are_those_of_the_rfc() -> None:
    """The answer is version, id, status, text, user id and metadata; 200 admits, 400 does not."""
    request = ZapRequest(b"7", "192.0.2.1", KEY)
    assert allow(request, "phone") == [b"1.0", b"7", b"200", b"OK", b"phone", b""]
    assert deny(request) == [b"1.0", b"7", b"400", b"unknown key", b"", b""]


@given(st.lists(st.binary(max_size=40), max_size=9))
def test_any_parts_are_read_or_refused(parts: list[bytes]) -> None:
    """Every input gives a request or a ProtocolError, nothing else."""
    try:
        assert len(read_request(parts).key) in {0, 32}
    except ProtocolError:
        assert len(parts) < 6 or parts[0] != b"1.0"
