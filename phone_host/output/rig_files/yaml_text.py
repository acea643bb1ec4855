"""Reads the part of YAML in which calibrations are written. Pure.

Block maps and lists by indentation, lists and maps in brackets (over several lines, too), words with and without
quotes, comments, tags such as !!opencv-matrix (skipped). What calibrations have no use for is refused: anchors and
aliases (a few lines of them grow to gigabytes), texts over several lines, several documents. Numbers stay words; who
wants one checks it. OpenCV's own parser needs its own first line and ends the process on some broken texts.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from common.errors import DataError
from phone_host.output.rig_files.tree import Tree

_MOST_LEVELS: Final = 32
_REMEDY: Final = "give it as the program wrote it"
_KEY: Final = re.compile(r"""(?:"([^"]*)"|'([^']*)'|([A-Za-z_][\w./-]*))\s*:(?:\s+(.*)|(?=[\[{"'])(.*)|$)""")
_ITEM: Final = re.compile(r"-(?:\s+(.*))?")
_TAG: Final = re.compile(r"!\S*\s*")
_OPENING: Final = "[{"
_CLOSING: Final = "]}"


def read_yaml(text: str, file: str) -> Tree:
    """Read a YAML text.

    Args:
        text: the whole file.
        file: its name, for errors.

    Returns:
        Its value: maps, lists and words.

    Raises:
        DataError: it is not of the part of YAML that is read here; names the line.
    """
    lines = list(_logical_lines(text, file))
    if not lines:
        raise DataError(f"{file} holds nothing", _REMEDY)
    reader = _Blocks(lines, file)
    tree = reader.block(lines[0].indent, 0)
    reader.require_end()
    return tree


@dataclass(frozen=True, slots=True)
class _Line:
    """A line without its comment, joined with those that its brackets reach over."""

    number: int
    indent: int
    text: str


def _problem(file: str, number: int, what: str) -> DataError:
    return DataError(f"{file}: line {number} {what}", _REMEDY)


def _logical_lines(text: str, file: str) -> Iterator[_Line]:
    begun, parts, depth, indent = 0, list[str](), 0, 0
    for number, whole in enumerate(text.removeprefix("\ufeff").splitlines(), start=1):
        line, change = _without_comment(whole, file, number)
        words = line.strip()
        if not words or (not parts and (words.startswith("%") or words == "...")):
            continue
        if not parts and words == "---":
            if begun:
                raise _problem(file, number, "begins a second document")
            continue
        if not parts:
            begun, indent = number, len(line) - len(line.lstrip(" "))
            if line[indent] == "\t":
                raise _problem(file, number, "is indented by a tab")
        parts.append(words)
        depth += change
        if depth < 0:
            raise _problem(file, number, "closes a bracket that is not open")
        if depth == 0:
            yield _Line(begun, indent, " ".join(parts))
            parts = []
    if parts:
        raise _problem(file, begun, "opens a bracket that is never closed")


def _without_comment(line: str, file: str, number: int) -> tuple[str, int]:
    """Return a line without its comment, and how many brackets more it opens than it closes."""
    quote, depth = "", 0
    for at, mark in enumerate(line):
        if quote:
            quote = "" if mark == quote else quote
        elif mark in "\"'" and (at == 0 or line[at - 1] in " [{,:"):
            quote = mark
        elif mark == "#" and (at == 0 or line[at - 1] in " \t"):
            return line[:at].rstrip(), depth
        else:
            depth += (mark in _OPENING) - (mark in _CLOSING)
    if quote:
        raise _problem(file, number, "opens a quote that is never closed")
    return line.rstrip(), depth


class _Blocks:
    """Reads maps and lists by their indentation, from the first line on."""

    def __init__(self, lines: list[_Line], file: str) -> None:
        self._lines, self._file, self._at = lines, file, 0

    def _here(self) -> _Line | None:
        return self._lines[self._at] if self._at < len(self._lines) else None

    def require_end(self) -> None:
        """Check that no line is left."""
        line = self._here()
        if line is not None:
            raise _problem(self._file, line.number, "stands at no level of the text above it")

    def block(self, indent: int, level: int) -> Tree:
        """Read what begins at the current line, at this indentation."""
        line = self._lines[self._at]
        if level > _MOST_LEVELS:
            raise _problem(self._file, line.number, f"lies more than {_MOST_LEVELS} levels deep")
        if _ITEM.fullmatch(line.text):
            return self._list(indent, level)
        if _KEY.fullmatch(line.text):
            return self._map(indent, level)
        self._at += 1
        return self._value(line.text, line.number)

    def _map(self, indent: int, level: int) -> dict[str, Tree]:
        found: dict[str, Tree] = {}
        while (line := self._here()) is not None and line.indent == indent:
            match = _KEY.fullmatch(line.text)
            if match is None:
                raise _problem(self._file, line.number, "is no `key: value`")
            key = match[1] or match[2] or match[3] or ""
            if key in found:
                raise _problem(self._file, line.number, f"has the key {key} a second time")
            self._at += 1
            found[key] = self._inner(_TAG.sub("", match[4] or match[5] or "", count=1), line, level, is_map=True)
        return found

    def _list(self, indent: int, level: int) -> list[Tree]:
        found: list[Tree] = []
        while (line := self._here()) is not None and line.indent == indent:
            match = _ITEM.fullmatch(line.text)
            if match is None:
                break  # a list may stand at the indentation of its key; who reads that map goes on
            rest = _TAG.sub("", match[1] or "", count=1)
            if rest and (_KEY.fullmatch(rest) or _ITEM.fullmatch(rest)):
                # The rest of the line begins an inner map or list, at its own column.
                column = indent + len(line.text) - len(rest)
                self._lines[self._at] = _Line(line.number, column, rest)
                found.append(self.block(column, level + 1))
                continue
            self._at += 1
            found.append(self._inner(rest, line, level, is_map=False))
        return found

    def _inner(self, text: str, line: _Line, level: int, *, is_map: bool) -> Tree:
        """Read the value behind a key or a dash: on the same line, or on the lines that follow and belong to it."""
        if text:
            return self._value(text, line.number)
        following = self._here()
        if following is None:
            return ""
        is_list_of_key = is_map and following.indent == line.indent and _ITEM.fullmatch(following.text)
        if following.indent > line.indent or is_list_of_key:
            return self.block(following.indent, level + 1)
        return ""

    def _value(self, text: str, number: int) -> Tree:
        return _Brackets(text, self._file, number).whole()


class _Brackets:
    """Reads one value on one line: a word, or lists and maps in brackets."""

    def __init__(self, text: str, file: str, number: int) -> None:
        self._text, self._file, self._number, self._at = text, file, number, 0

    def whole(self) -> Tree:
        """Read the value that fills the line."""
        if self._text[:1] in _OPENING:
            tree = self._part(0)
            self._skip_spaces()
            if self._at < len(self._text):
                raise self._problem("goes on behind its last bracket")
            return tree
        return self._plain(self._text)

    def _problem(self, what: str) -> DataError:
        return _problem(self._file, self._number, what)

    def _skip_spaces(self) -> None:
        while self._text[self._at : self._at + 1] in {" ", "\t"}:
            self._at += 1

    def _peek(self) -> str:
        self._skip_spaces()
        return self._text[self._at : self._at + 1]

    def _part(self, level: int) -> Tree:
        if level > _MOST_LEVELS:
            raise self._problem(f"nests more than {_MOST_LEVELS} brackets")
        match self._peek():
            case "[":
                return self._list(level)
            case "{":
                return self._map(level)
            case _:
                return self._word(",]}")

    def _list(self, level: int) -> list[Tree]:
        found: list[Tree] = []
        self._at += 1
        while self._peek() != "]":
            found.append(self._part(level + 1))
            self._separate("]")
        self._at += 1
        return found

    def _map(self, level: int) -> dict[str, Tree]:
        found: dict[str, Tree] = {}
        self._at += 1
        while self._peek() != "}":
            key = self._word(":,]}")
            if self._peek() != ":":
                raise self._problem("has a key without a value")
            if key in found:
                raise self._problem(f"has the key {key} a second time")
            self._at += 1
            found[key] = "" if self._peek() in {",", "}"} else self._part(level + 1)
            self._separate("}")
        self._at += 1
        return found

    def _separate(self, closing: str) -> None:
        mark = self._peek()
        if mark == ",":
            self._at += 1
        elif mark != closing:
            raise self._problem(f"lacks a comma or {closing}")

    def _word(self, ends: str) -> str:
        quote = self._peek()
        if quote and quote in "\"'":
            end = self._text.find(quote, self._at + 1)
            if end < 0:
                raise self._problem("opens a quote that is never closed")
            word = self._text[self._at + 1 : end]
            self._at = end + 1
            return word
        begun = self._at
        while self._at < len(self._text) and self._text[self._at] not in ends:
            self._at += 1
        return str(self._plain(self._text[begun : self._at].strip()))

    def _plain(self, text: str) -> str:
        if text[:1] in {"&", "*", "|", ">"}:
            raise self._problem(f"begins a value with {text[0]}, which no calibration needs")
        if len(text) > 1 and text[0] in "\"'" and text[-1] == text[0]:
            return text[1:-1]
        return text
