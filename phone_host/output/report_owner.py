"""Whose report lies in a folder of results, and under which names it stays when another command writes its own there."""

from pathlib import Path
from typing import Final

from common.errors import DataError
from common.files import read_whole
from common.places import Kind, kind_of
from phone_host.output.json_text import json_value

REPORT: Final = "report.json"
PAGE: Final = "index.html"
_SHARED: Final = (REPORT, PAGE)
"""What every command calls alike; the other results of two commands have different names or are computed from the same input."""

_MAX_REPORT_BYTES: Final = 16 << 20
"""A longer file is no report of ours."""

_COMMAND: Final = "command"
"""The key under which a report names the verb that wrote it."""

_OWN_KEYS: Final = (
    ("truth", "demo"),
    ("ended", "run"),
    ("matcher", "stereo"),
    ("left_alone", "stereo"),
    ("verdict", "calibrate"),
    ("time_offset_ns", "calibrate-time"),
)
"""For reports before that key: one that only this verb's report has, or only with one of those before it."""

_VERBS: Final = frozenset({"quality", "scan", *(verb for _, verb in _OWN_KEYS)})
"""No other name in a report becomes part of a file's name."""


def report_owner(folder: Path) -> str:
    """Return the verb that wrote the report in a folder; empty if there is none, or it does not say."""
    try:
        content = json_value(read_whole(folder / REPORT, _MAX_REPORT_BYTES))
    except (OSError, DataError, ValueError):
        return ""
    if not isinstance(content, dict):
        return ""
    named = content.get(_COMMAND)
    if named is not None:
        return named if isinstance(named, str) and named in _VERBS else ""
    return next((command for key, command in _OWN_KEYS if key in content), "")


def names_of_other_report(folder: Path, command: str) -> dict[str, str]:
    """Return the files of another command's report, each with the name under which it stays beside this command's.

    Args:
        folder: the folder of results.
        command: the verb whose results go there; empty: it has no report.
    """
    owner = report_owner(folder) if command else ""
    if owner in {"", command}:
        return {}
    return {
        name: f"{Path(name).stem}-{owner}{Path(name).suffix}"
        for name in _SHARED
        if kind_of(folder / name) is not Kind.MISSING
    }
