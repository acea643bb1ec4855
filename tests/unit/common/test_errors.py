"""What a user reads when something is wrong."""

from hypothesis import given
from hypothesis import strategies as st

from common.errors import SettingsError


@given(st.text())
def test_an_error_is_one_line_whatever_it_quotes(name: str) -> None:
    """Names and values from strangers cannot break an error's line or command the terminal; printable text is left as it is."""
    said = str(SettingsError(f"key {name} is unknown", "mend it"))
    assert len(said.splitlines()) == 1
    assert said.isprintable()
    assert not name.isprintable() or name in said
