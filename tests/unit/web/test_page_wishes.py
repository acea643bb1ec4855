"""What viewers and programs may say: only what is meant, in bounds; anything else is nothing."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from phone_host.web.frames import View
from phone_host.web.rates import Rate, Rates
from phone_host.web.source import Command, Do
from phone_host.web.wishes import Ack, MeasureRequest, Want, read_command, read_measure, read_number, read_wish


def test_wishes_are_read() -> None:
    """Acknowledgements and wants, with rate and width in bounds and each view once."""
    assert read_wish('{"kind":"ack","number":3}') == Ack(3)
    asked = '{"kind":"want","views":["disparity","left","left"],"width":641,"hz":1e6}'
    assert read_wish(asked) == Want((View.LEFT, View.DISPARITY), 800, 30.0)
    assert read_wish('{"kind":"want","views":[],"hz":1e-9}') == Want((), 640, 0.1)


@pytest.mark.parametrize(
    "text",
    ["", "x", "[]", "null", "{}", '{"kind":"feed"}', '{"kind":"ack"}', '{"kind":"ack","number":-1}', '{"kind":"ack","number":1.5}', '{"kind":"ack","number":true}',
     '{"kind":["ack"],"number":1}', '{"kind":"want"}', '{"kind":"want","views":"left"}', '{"kind":"want","views":["up"]}', '{"kind":"want","views":[[]]}',
     '{"kind":"want","views":["left"],"hz":0}', '{"kind":"want","views":["left"],"hz":NaN}', '{"kind":"want","views":["left"],"hz":-1}',
     '{"kind":"want","views":["left"],"width":"640"}', '{"kind":"ack","number":' + "9" * 5000 + "}", "[" * 100_000],
)  # fmt: skip
def test_nonsense_is_nothing(text: str) -> None:
    """Nothing is understood that was not meant."""
    assert read_wish(text) is None


def test_commands_are_read() -> None:
    """A command with its values, or without."""
    assert read_command('{"do":"stop"}') == Command(do=Do.STOP)
    assert read_command(b'{"do":"set","values":{"near":"300"}}') == Command(do=Do.SET, values={"near": "300"})


@pytest.mark.parametrize(
    "said",
    [{}, {"do": "format"}, {"do": ["run"]}, {"do": "run", "more": 1}, {"do": "set", "values": []}, {"do": "set", "values": {"a": 1}},
     {"do": "set", "values": {"a": "\x1b[2J"}}, {"do": "set", "values": {"a\n": "b"}}, {"do": "set", "values": {"a": "b" * 1001}},
     {"do": "set", "values": {str(number): "" for number in range(65)}}],
)  # fmt: skip
def test_what_is_no_command(said: object) -> None:
    """Unknown words, other types, control characters, and too much of anything."""
    assert read_command(json.dumps(said)) is None


def test_points_are_read() -> None:
    """One or two points, of a result or of the newest."""
    assert read_measure('{"points":[[1,2.5]]}') == MeasureRequest(((1.0, 2.5),), None)
    assert read_measure('{"points":[[0,0],[9,9]],"number":4}') == MeasureRequest(((0.0, 0.0), (9.0, 9.0)), 4)
    assert read_measure('{"points":[[0,0]],"number":null}') == MeasureRequest(((0.0, 0.0),), None)


@pytest.mark.parametrize(
    "said",
    [{}, {"points": []}, {"points": [[1]]}, {"points": [[1, "2"]]}, {"points": [[1, 2]] * 3}, {"points": [[1, 1e6]]}, {"points": [{}]}, {"points": [[1, True]]},
     {"points": [[1, 2]], "number": "4"}, {"points": [[1, 2]], "x": 0}, {"points": [[1, float("inf")]]}],
)  # fmt: skip
def test_what_are_no_points(said: object) -> None:
    """Wrong counts and types, and places outside any image."""
    assert read_measure(json.dumps(said)) is None


@pytest.mark.parametrize(("text", "number"), [("0", 0), ("17", 17), ("", None), ("-1", None), ("1.5", None), ("\u0663", None), ("9" * 40, None)])  # fmt: skip
def test_numbers_of_an_address(text: str, number: int | None) -> None:
    """Plain digits are a number; signs, points, other scripts' digits, and what is too long are none."""
    assert read_number(text) == number


@given(st.binary(max_size=300))
def test_no_bytes_are_an_error(data: bytes) -> None:
    """Whatever comes, it is read as nothing, not as an error."""
    assert read_command(data) is None
    assert read_measure(data) is None


def test_a_rate_holds() -> None:
    """After the burst, so many a second pass, and a pause fills the burst again."""
    rate = Rate(10.0, 3, 0.0)  # in steps of 1/128 s, which floats hold exactly
    assert [rate.take(0.0) for _ in range(5)] == [True, True, True, False, False]
    assert sum(rate.take(step / 128) for step in range(1, 129)) == 10
    assert [rate.take(100.0) for _ in range(4)] == [True, True, True, False]


def test_each_asker_has_a_rate_of_its_own() -> None:
    """One that asks too often takes nothing from another; very many are forgotten, the oldest first."""
    rates = Rates(1.0, 1)
    assert [rates.take("a", 0.0), rates.take("a", 0.0), rates.take("b", 0.0)] == [True, False, True]
    for number in range(600):
        rates.take(number, 0.0)
    assert rates.take("a", 0.0)
    assert not rates.take(599, 0.0)
