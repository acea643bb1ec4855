"""Reads YAML calibrations with PyYAML, as a tree of plain words. Pure.

PyYAML gives events; the tree is built from them here, because its own loaders accept what a calibration has no use for:
- an alias or an anchor is refused: a few lines of them grow to gigabytes;
- a key that stands twice in one map is refused: which value is meant cannot be known;
- nesting deeper than `_MAX_LEVELS` is refused before anything deeper is read.
Scalars stay the words of the file, so no number is reinterpreted (YAML 1.1 reads 1:30 as 90 and 010 as 8); `tree.Node`
checks those that are asked for. Tags such as !!opencv-matrix are skipped.
PyYAML is imported when a text is read: `run` and `doctor` load this module, and a host that imports no calibration does without it.
"""

import importlib
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import ModuleType
from typing import Final

from common.errors import DataError, UnavailableError
from phone_host.output.rig_files.tree import Tree

_MAX_LEVELS: Final = 32
_REMEDY: Final = "give it as the program wrote it"
_OPENCV_HEADER: Final = re.compile(r"%YAML:1\.0[^\n]*\n?")
_BLOCK_KEY: Final = re.compile(r"""^([ -]*[A-Za-z_][\w./-]*):(?=[\[{"'])""", re.MULTILINE)
_FLOW_KEY: Final = re.compile(r"([{,]\s*[A-Za-z_][\w./-]*):(?=[^\s,}])")
_STAMPED_KEY: Final = "header"
"""The key of a ROS message that differs between two messages of one camera."""


def read_yaml(text: str, file: str) -> Tree:
    """Read a YAML text.

    `ros2 topic echo` puts `---` behind every message, so a file may hold one message several times; they count as one
    if all but their headers agree.

    Returns:
        Its value: maps, lists and words.

    Raises:
        DataError: it is no YAML, or holds what a calibration has no use for; names the line.
        UnavailableError: PyYAML is not installed.
    """
    documents = list(_documents(_as_yaml(text.removeprefix("\ufeff")), file))
    if not documents:
        raise DataError(f"{file} holds nothing", _REMEDY)
    first = documents[0].tree
    for other in documents[1:]:
        if _without_header(other.tree) != _without_header(first):
            raise _problem(file, other.line, "begins a second document, which differs from the first")
    return first


def _pyyaml() -> ModuleType:
    try:
        return importlib.import_module("yaml")
    except ImportError:
        raise UnavailableError(
            "YAML of other programs needs PyYAML", "pip install PyYAML, or apt install python3-yaml"
        ) from None


def _without_header(tree: Tree) -> Tree:
    return {key: value for key, value in tree.items() if key != _STAMPED_KEY} if isinstance(tree, dict) else tree


def _as_yaml(text: str) -> str:
    """Turn OpenCV's dialect into YAML: its first line is no directive of YAML, and it writes no space behind a colon."""
    header = _OPENCV_HEADER.match(text)
    if header is None:
        return text
    body = _FLOW_KEY.sub(r"\1: ", _BLOCK_KEY.sub(r"\1: ", text[header.end() :]))
    return f"#{header[0]}" + body  # a comment in its place keeps the lines' numbers


def _problem(file: str, line: int, what: str) -> DataError:
    return DataError(f"{file}: line {line} {what}", _REMEDY)


@dataclass(slots=True)
class _Document:
    line: int
    tree: Tree = ""


@dataclass(slots=True)
class _Open:
    """A map or list whose end has not come yet, and the key that waits for its value."""

    tree: list[Tree] | dict[str, Tree]
    key: str | None = field(default=None)


def _documents(text: str, file: str) -> Iterator[_Document]:
    """Yield the documents of a text that hold anything."""
    yaml, document, levels = _pyyaml(), _Document(1), list[_Open]()
    # libyaml's parser where PyYAML was built with it (its wheels are; Termux's build is not): twenty times faster, same events.
    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
    try:
        for event in yaml.parse(text, Loader=loader):
            line = event.start_mark.line + 1
            match event:
                case yaml.DocumentStartEvent():
                    document = _Document(line)
                case yaml.DocumentEndEvent() if document.tree != "":
                    yield document
                case yaml.AliasEvent():
                    raise _problem(file, line, "has an alias, which no calibration needs")
                case yaml.NodeEvent(anchor=str()):
                    raise _problem(file, line, "has an anchor, which no calibration needs")
                case yaml.ScalarEvent(value=value):
                    _place(document, levels, value, file, line)
                case yaml.MappingStartEvent() | yaml.SequenceStartEvent():
                    if len(levels) >= _MAX_LEVELS:
                        raise _problem(file, line, f"lies more than {_MAX_LEVELS} levels deep")
                    tree: list[Tree] | dict[str, Tree] = {} if isinstance(event, yaml.MappingStartEvent) else []
                    _place(document, levels, tree, file, line)
                    levels.append(_Open(tree))
                case yaml.MappingEndEvent() | yaml.SequenceEndEvent():
                    levels.pop()
                case _:
                    pass  # begin and end of the stream, and of a document that holds nothing
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise _problem(file, mark.line + 1 if mark else 1, f"is no YAML: {error.problem or error.context}") from error
    except yaml.YAMLError as error:  # a character that no YAML may hold
        raise DataError(f"{file} is no YAML: it holds a control character", _REMEDY) from error


def _place(document: _Document, levels: list[_Open], value: Tree, file: str, line: int) -> None:
    """Put a value where the text has it: into the innermost open map or list, or at the top."""
    if not levels:
        document.tree = value
        return
    inner = levels[-1]
    if isinstance(inner.tree, list):
        inner.tree.append(value)
    elif inner.key is not None:
        inner.tree[inner.key], inner.key = value, None
    elif not isinstance(value, str):
        raise _problem(file, line, "has a key that is no word")
    elif value in inner.tree:
        raise _problem(file, line, f"has the key {value} a second time")
    else:
        inner.key = value
