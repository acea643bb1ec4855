"""Single keys of a settings file are changed, and everything else stays as its owner wrote it."""

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import SettingsError
from common.program.settings_file import Value, changed

OWN = """# my board
link = [
  "tcp://a:1",  # on the cable
  "tcp://b:2",
]
camera = "v4l2:auto"  # on the desk
fifo = "2:block"

[other]
camera = 3
[page]
near = "300"
far = "900"
[last]
"""


def test_a_key_is_changed_where_it_stood_and_the_rest_stays() -> None:
    """A list over several lines, a value, a new key and the table are replaced; comments and other tables stay."""
    made = changed(OWN, {"link": ("tcp://c:3",), "camera": None, "budget": 30.0}, "page", {"near": "400"})
    assert made == (
        '# my board\nlink = ["tcp://c:3"]\nfifo = "2:block"\nbudget = 30.0\n\n[other]\ncamera = 3\n[last]\n\n[page]\nnear = "400"\n'
    )


def test_an_empty_file_begins_with_what_is_set() -> None:
    """Without a file there are only the keys; with nothing in the table there is no table."""
    assert changed("", {"interpolate": True, "fifo": "1:block"}, "page", {}) == 'interpolate = true\nfifo = "1:block"\n'


@settings(max_examples=40)
@given(
    values=st.dictionaries(
        st.sampled_from(["link", "camera", "fifo", "budget", "interpolate"]),
        st.none() | st.text(max_size=9) | st.booleans() | st.integers(-99, 99) | st.tuples(st.text(max_size=3)),
    ),
    content=st.dictionaries(st.text(max_size=5), st.text(max_size=9), max_size=3),
)
def test_whatever_is_set_is_read_again(values: dict[str, Value | None], content: dict[str, str]) -> None:
    """The new file means the old one with the keys and the table changed, whatever characters the texts hold."""
    expected = tomllib.loads(OWN)
    expected.pop("page")
    for key, value in values.items():
        expected.pop(key, None)
        if value is not None:
            expected[key] = list(value) if isinstance(value, tuple) else value
    if content:
        expected["page"] = content
    try:
        made = changed(OWN, values, "page", content)
    except SettingsError:  # halves of letters are no text of a file
        assert any("\ud800" <= letter <= "\udfff" for letter in repr((values, content)))
        return
    assert tomllib.loads(made) == expected


@pytest.mark.parametrize("text", ["a = ", '"camera" = "x"\n', "page = { near = '1' }\n"])
def test_a_file_that_cannot_be_changed_is_left_alone(text: str) -> None:
    """What is no TOML, or written in a way that a line's change would spoil, is refused."""
    with pytest.raises(SettingsError):
        changed(text, {"camera": "v4l2:auto"}, "page", {"near": "1"})
