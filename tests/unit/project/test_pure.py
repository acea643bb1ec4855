"""The list of pure modules in pyproject.toml is complete, and correct as far as source text shows. import-linter checks what they import."""

import ast
import importlib
import re
from pathlib import Path

import pytest

from tests.support.pure import ROOT, pure_modules

PURE = pure_modules()

FILES = {
    "exists", "is_dir", "is_file", "iterdir", "lstat", "mkdir", "read_bytes", "read_text", "stat", "unlink",
    "write_bytes", "write_text",
}  # fmt: skip
"""Methods that would ask the disk about a path that was passed in."""


@pytest.mark.parametrize("name", PURE)
def test_a_pure_module_only_computes(name: str) -> None:
    """The module exists and can be imported; it neither opens a file nor prints, and asks no path about the disk."""
    importlib.import_module(name)
    calls = [node.func for node in ast.walk(tree(PURE[name])) if isinstance(node, ast.Call)]
    assert {"open", "print", "input"}.isdisjoint(call.id for call in calls if isinstance(call, ast.Name))
    assert FILES.isdisjoint(call.attr for call in calls if isinstance(call, ast.Attribute))


def test_what_says_that_it_is_pure_is_on_the_list() -> None:
    """Every module and package whose docstring says Pure is on the list of those that are checked and measured."""
    files = [file for top in ("board_agent", "common", "phone_host") for file in (ROOT / top).rglob("*.py")]
    say_so = {file for file in files if re.search(r"\bPure\b", ast.get_docstring(tree(file)) or "")}
    assert len(say_so) > 40
    assert say_so <= set(PURE.values())


def tree(file: Path) -> ast.Module:
    """A module's source, parsed."""
    return ast.parse(file.read_text(encoding="utf-8"))
