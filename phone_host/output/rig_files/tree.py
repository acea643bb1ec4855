"""The values of a YAML or XML text, and checked access to them. Every error names the file and the key. Pure."""

import math
import re
from dataclasses import dataclass
from typing import Final
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.words import counted

Tree = str | list["Tree"] | dict[str, "Tree"]
"""A scalar as it is written, a list, or a map."""

_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?", re.ASCII)
_LARGEST_NUMBER: Final = 1e9
"""As in rig.yaml: beyond it sums of squares may overflow."""

_LARGEST_IMAGE_PX: Final = 100_000
_SHOWN: Final = 40


@dataclass(frozen=True, slots=True)
class Node:
    """One value of a file.

    Attributes:
        file: the file's name, for errors.
        key: how the value is reached from the top, such as "cam0.intrinsics"; empty: the whole file.
        tree: the value.
    """

    file: str
    key: str
    tree: Tree

    def problem(self, what: str, remedy: str) -> DataError:
        """Return an error that names file and key."""
        return DataError(f"{self.file}: {self.key} {what}" if self.key else f"{self.file} {what}", remedy)

    def has(self, key: str) -> bool:
        """Return whether this is a map that holds a key with a value."""
        return isinstance(self.tree, dict) and self.tree.get(key, "") != ""

    def child(self, key: str) -> "Node":
        """Return what a map holds under a key.

        Raises:
            DataError: it is missing.
        """
        inner = Node(self.file, f"{self.key}.{key}" if self.key else key, "")
        if not (isinstance(self.tree, dict) and self.has(key)):
            raise inner.problem("is missing", "add it, or export the calibration anew")
        return Node(inner.file, inner.key, self.tree[key])

    def first_of(self, *keys: str) -> "Node":
        """Return what a map holds under the first of several names of one thing.

        Raises:
            DataError: it has none of them; the first is named.
        """
        return self.child(next((key for key in keys if self.has(key)), keys[0]))

    def word(self) -> str:
        """Read a word.

        Raises:
            DataError: it is a list or a map.
        """
        if not isinstance(self.tree, str):
            raise self.problem("is no word", "write one word")
        return self.tree

    def numbers(self, *counts: int) -> tuple[float, ...]:
        """Read a list of numbers, or numbers with spaces between them.

        Args:
            counts: how many there may be; none: any number.

        Raises:
            DataError: it is no such list, or a number is not finite.
        """
        found = self.tree.split() if isinstance(self.tree, str) else self.tree
        if not isinstance(found, list) or any(not isinstance(each, str) for each in found):
            raise self.problem("is no list of numbers", "write it as [1.0, 2.0]")
        if counts and len(found) not in counts:
            raise self.problem(f"has {counted(len(found), 'value')}", f"it must have {' or '.join(map(str, counts))}")
        return tuple(self._number(str(each)) for each in found)

    def number(self) -> float:
        """Read one finite number.

        Raises:
            DataError: it is none.
        """
        return self._number(self.word())

    def _number(self, text: str) -> float:
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if not abs(value) <= _LARGEST_NUMBER:
            shown = repr(text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "...")
            raise self.problem(f"holds {shown}", "it must be a finite number with a decimal point")
        return value

    def matrix(self, rows: int, columns: int) -> NDArray[np.float64]:
        """Read a matrix: a map of rows, cols and data, a list of rows, or all its numbers in one list, row by row.

        Returns:
            (rows, columns) float64.

        Raises:
            DataError: it has another shape, or a number is not finite.
        """
        if isinstance(self.tree, dict):
            stated = tuple(int(self.child(key).whole()) for key in ("rows", "cols"))
            if stated != (rows, columns):
                raise self.problem(f"is {stated[0]}x{stated[1]}", f"it must be {rows}x{columns}")
            values = self.child("data").numbers(rows * columns)
        elif isinstance(self.tree, list) and self.tree and isinstance(self.tree[0], list):
            if len(self.tree) != rows:
                raise self.problem(f"has {len(self.tree)} rows", f"it must be {rows}x{columns}")
            values = tuple(number for row in self.tree for number in Node(self.file, self.key, row).numbers(columns))
        else:
            values = self.numbers(rows * columns)
        return np.array(values, np.float64).reshape(rows, columns)

    def values(self) -> tuple[float, ...]:
        """Read a list of any length, or a matrix of one row or column, also as numpy's `tolist` writes it.

        Raises:
            DataError: it is neither, or a number is not finite.
        """
        if isinstance(self.tree, dict):
            return self.child("data").numbers()
        rows = self.tree if isinstance(self.tree, list) else []
        if rows and all(isinstance(row, list) for row in rows):
            if len(rows) == 1:
                return Node(self.file, self.key, rows[0]).numbers()
            return tuple(number for row in rows for number in Node(self.file, self.key, row).numbers(1))
        return self.numbers()

    def whole(self) -> int:
        """Read an image's width or height, or any other whole number above 0.

        Raises:
            DataError: it is none, or more than any image has.
        """
        return self._whole(self.number())

    def _whole(self, value: float) -> int:
        if not (1 <= value <= _LARGEST_IMAGE_PX and value == int(value)):
            raise self.problem(f"holds {value:g}", "it must be a whole number above 0")
        return int(value)

    def size_px(self) -> tuple[int, int]:
        """Read width and height, px.

        Raises:
            DataError: they are no image size.
        """
        width, height = (self._whole(value) for value in self.numbers(2))
        return width, height


_MOST_LEVELS: Final = 32
_REMEDY: Final = "give it as cv2.FileStorage wrote it"


def read_xml(text: str, file: str) -> Tree:
    """Read an XML text of OpenCV's FileStorage, whose own reader ends the process on some broken texts.

    Declarations are refused before anything is parsed: FileStorage has none, and entities can grow to gigabytes.

    Returns:
        Its values: maps, lists and words.

    Raises:
        DataError: it is no XML, or declares something.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise DataError(f"{file} declares a document type", _REMEDY)
    try:
        root = ET.fromstring(text.removeprefix("\ufeff").encode())  # noqa: S314  # nothing is declared: see above
    except (ET.ParseError, LookupError, ValueError) as error:
        raise DataError(f"{file} is no XML ({error})", _REMEDY) from error
    return _tree(root, file, 0)


def _tree(element: ET.Element, file: str, level: int) -> Tree:
    if level > _MOST_LEVELS:
        raise DataError(f"{file} nests more than {_MOST_LEVELS} levels deep", _REMEDY)
    if not len(element):
        return (element.text or "").strip().strip('"')
    if all(child.tag == "_" for child in element):
        return [_tree(child, file, level + 1) for child in element]
    found: dict[str, Tree] = {}
    for child in element:
        if child.tag in found:
            raise DataError(f"{file} has the key {child.tag} twice", _REMEDY)
        found[child.tag] = _tree(child, file, level + 1)
    return found
