"""Bluetooth's service discovery: the query, real answers, and anything that a hostile peer may answer."""

import random
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.link.sdp import SERVICE_UUID, channel_in, query, record_xml

_ANSWER = bytes.fromhex("0700010018001535133511090004350c35031901003505190003080700")
"""What bluetoothd 5.66 answered about a record with channel 7 (Debian 12, two virtual controllers)."""


def test_the_channel_in_a_real_answer() -> None:
    """The channel is found in what BlueZ answers."""
    assert channel_in(_ANSWER) == 7


def test_no_service_is_channel_0() -> None:
    """An answer without records, an error answer and silence all mean that the service is not there."""
    assert channel_in(bytes.fromhex("070001000500023500 00".replace(" ", ""))) == 0
    assert channel_in(bytes.fromhex("01000100020003")) == 0
    assert channel_in(b"") == 0


def test_the_question() -> None:
    """The query asks for attribute 4 of records of our UUID; lengths as in the core specification, volume 3, part B, 4.7.1."""
    asked = query()
    assert asked[0] == 6
    assert int.from_bytes(asked[3:5], "big") == len(asked) - 5
    assert SERVICE_UUID.bytes in asked
    assert asked.endswith(bytes.fromhex("ffff3503090004" + "00"))


@given(st.binary(max_size=300))
def test_any_answer_gives_a_channel_or_0(tail: bytes) -> None:
    """For any answer of a peer the result is a valid channel or 0."""
    for answer in (tail, b"\x07" + tail, _ANSWER[:7] + tail):
        assert 0 <= channel_in(answer) <= 30


def test_deep_nesting_is_cut_off() -> None:
    """Sequences nested a hundred deep are not followed to the end."""
    data = b""
    for _ in range(100):
        data = b"\x36" + len(data).to_bytes(2, "big") + data
    assert channel_in(b"\x07\0\1\0\0" + len(data).to_bytes(2, "big") + data + b"\0") == 0


def test_mutated_answers_never_crash() -> None:
    """Each of ten thousand answers with flipped bits gives a valid channel or 0."""
    chance = random.Random(4)
    for _ in range(10_000):
        spoiled = bytearray(_ANSWER)
        for _ in range(chance.randrange(1, 6)):
            spoiled[chance.randrange(len(spoiled))] ^= 1 << chance.randrange(8)
        assert 0 <= channel_in(bytes(spoiled)) <= 30


@pytest.mark.parametrize("channel", [1, 30])
def test_the_record_is_well_formed(channel: int) -> None:
    """The record is XML with our UUID and the channel as an eight-bit number."""
    record = ET.fromstring(record_xml(channel))
    assert [item.get("value") for item in record.iter("uint8")] == [f"0x{channel:02x}"]
    assert str(SERVICE_UUID) in {item.get("value") for item in record.iter("uuid")}
