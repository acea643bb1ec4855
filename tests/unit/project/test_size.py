"""What counts as code and what as prose in the table of sizes."""

from tests.docs.size import Size, measured, room_of

_MODULE = '''"""Two words."""

import os  # one comment here

NAMES = (
    "a",

    "b",
)
"""Of nobody."""


def f() -> str:
    """Return it."""
    return """
    text
    """
'''


def test_code_is_what_is_neither_comment_nor_docstring() -> None:
    """Blank lines, comments and docstrings are no code, the lines of other strings are."""
    assert measured("a.py", _MODULE) == Size(files=1, lines=17, code=9, words=9)


def test_other_files_count_as_what_they_are() -> None:
    """Markdown counts its words, C its lines, a picture nothing."""
    assert measured("a.md", "# One\n\ntwo three\n") == Size(words=4)
    assert measured("a.c", "int a;\nint b;\n") == Size(other=2)
    assert measured("a.png", "") == Size()


def test_a_room_is_the_package_that_holds_the_file() -> None:
    """Packages below a program are rooms of their own, single files belong to the program."""
    assert room_of("phone_host/scan/mesh/a.py") == "phone_host/scan"
    assert room_of("phone_host/cli.py") == "phone_host"
    assert room_of("tests/unit/test_a.py") == "tests/unit"
    assert room_of("README.md") == "(top)"
