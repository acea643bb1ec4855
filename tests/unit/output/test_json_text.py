"""JSON that every reader takes."""

import json
import math

from phone_host.output.json_text import json_number, json_text


def test_what_is_no_number_is_null_at_every_depth() -> None:
    """NaN and both infinities become null in dicts, lists and tuples; all else stays as it is."""
    value = {"a": math.nan, "b": [1.5, math.inf, {"c": (-math.inf, 0, True, "NaN", None)}]}
    assert json.loads(json_text(value)) == {"a": None, "b": [1.5, None, {"c": [None, 0, True, "NaN", None]}]}
    assert "NaN" not in json_text([math.nan], indent=2)


def test_a_number_is_rounded_and_what_is_none_is_null() -> None:
    """A finite number keeps the digits that are asked for, six at first; NaN and both infinities become None."""
    assert (json_number(1 / 3), json_number(2 / 3, 2), json_number(5)) == (0.333333, 0.67, 5)
    assert [json_number(value) for value in (math.nan, math.inf, -math.inf)] == [None, None, None]
