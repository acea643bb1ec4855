"""The tables of docs/files.md of what is read from whom: each row names cases, and each case exists."""

import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

_DOCS = Path(__file__).parents[2] / "docs" / "files.md"
TABLES = {
    "Recordings of other programs": (
        "test_recordings",
        "test_bags",
        "test_image_folders",
        "test_picture_folders",
        "test_image_sizes",
        "test_damaged_recordings",
        "test_damaged_bags",
        "test_hostile_recordings",
    ),
    "Calibrations of other programs": ("test_calibrations", "test_calibration_kinds"),
}
"""Sections, and the modules whose cases their tables name."""


def _case_names(module: ModuleType) -> Iterator[str]:
    """Return the names of a module's tests and of their parameters."""
    for name, test in vars(module).items():
        if name.startswith("test_"):
            yield name
            for mark in getattr(test, "pytestmark", ()):
                if mark.name == "parametrize":
                    yield from (str(getattr(each, "id", each)) for each in mark.args[1])


@pytest.mark.parametrize("heading", TABLES)
def test_each_row_names_its_cases(heading: str) -> None:
    """The last column of each row names at least one case, and all that it names are in the modules of the section."""
    known = {name for module in TABLES[heading] for name in _case_names(import_module(f"tests.cases.{module}"))}
    text = _DOCS.read_text(encoding="utf-8").partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    rows = [line.strip("|").split("|") for line in text.splitlines() if line.startswith("| ")][1:]
    assert rows
    for row in rows:
        named = re.findall(r"`([^`]+)`", row[-1])
        assert named, row[0]
        assert set(named) <= known, row[0]
