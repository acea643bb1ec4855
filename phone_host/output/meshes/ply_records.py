"""The records of a PLY file, binary of either byte order or text, whatever their properties. Pure.

What a file claims to hold is compared with its length before anything is made room for.
Source: Greg Turk, "The PLY Polygon File Format", 1994.
"""

import io
import re
from array import array
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[Any]

_TYPES: Final = {
    **dict.fromkeys(("char", "int8"), "i1"), **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"), **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"), **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"), **dict.fromkeys(("double", "float64"), "f8"),
}  # fmt: skip
_ORDERS: Final = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
_END: Final = re.compile(rb"(?<=[\r\n])end_header[ \t]*(?:\r?\n|\r|$)", re.IGNORECASE)
_MAX_HEADER: Final = 1 << 16
_MAX_AT_ONCE: Final = 1 << 14


class ShortError(ValueError):
    """Raised where a file holds less than it claims, or no number where one must be. The file's fault."""


@dataclass(frozen=True, slots=True)
class Property:
    """What each record of an element holds once, or as a list.

    Attributes:
        name: in lower case.
        kind: numpy's letter and size, such as f4.
        count_kind: the same of the number before a list; empty: it is no list.
    """

    name: str
    kind: str
    count_kind: str


@dataclass(frozen=True, slots=True)
class Element:
    """One kind of record."""

    name: str
    count: int
    properties: tuple[Property, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """A property of all records.

    Attributes:
        values: one for each record, or the lists one behind another.
        counts: (records,) lengths of the lists; None: it is no list.
        kind: numpy's letter and size, as the header says.
    """

    values: Numbers
    counts: Numbers | None
    kind: str


Table = dict[str, Column]


def read_records(content: bytes) -> dict[str, Table]:
    """Return the columns of each element of a PLY file, by the elements' and their properties' names in lower case.

    Args:
        content: of the file; it may come from anybody.

    Raises:
        LookupError: it has no header of a PLY file.
        ShortError: it holds less than its header names.
    """
    end = _END.search(content, 0, _MAX_HEADER)
    if content[:3].lower() != b"ply" or end is None:
        raise LookupError("no header")
    order, elements = _header(content[: end.start()].decode("latin-1"))
    data = np.frombuffer(content, np.uint8) if order else _numbers(content[end.end() :])
    cells, at = _Cells(data, order), end.end() if order else 0
    tables = {}
    for element in elements:
        tables[element.name], at = _read(cells, element, at)
    return tables


def is_text(content: bytes) -> bool:
    """Return whether the header says that numbers follow as text."""
    return b"format ascii" in content[:_MAX_HEADER].lower()


def _header(head: str) -> tuple[str, list[Element]]:
    order, elements = None, list[Element]()
    try:
        for line in head.splitlines()[1:]:
            words = line.lower().split()
            match words[:1]:
                case ["format"]:
                    order = _ORDERS[words[1]]
                case ["element"]:
                    elements.append(Element(words[1], int(words[2]), ()))
                case ["property"]:
                    last = elements[-1]
                    is_list = words[1] == "list"
                    kinds = (_TYPES[words[3]], _TYPES[words[2]]) if is_list else (_TYPES[words[1]], "")
                    elements[-1] = Element(last.name, last.count, (*last.properties, Property(words[4 if is_list else 2], *kinds)))  # fmt: skip
                case [] | ["comment" | "obj_info"]:
                    continue
                case _:
                    raise LookupError(line)
    except (IndexError, ValueError) as error:
        raise LookupError("a line of the header") from error
    if order is None or any(element.count < 0 for element in elements):
        raise LookupError("no format, or a count below zero")
    return order, elements


def _numbers(body: bytes) -> Numbers:
    """Return the numbers of a text, as far as there are any."""
    numbers = array("d")
    try:
        for line in io.BytesIO(body):
            numbers.extend(map(float, line.split()))
    except ValueError:
        pass  # behind the last record anything may stand; where a record ends early, that is told
    return np.frombuffer(numbers, np.float64) if numbers else np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class _Cells:
    """What records are made of: the numbers of a text, or the bytes of a binary file.

    Attributes:
        data: (N,) float64 of a text, uint8 of a binary file.
        order: of the bytes, as numpy writes it; empty: a text.
    """

    data: Numbers
    order: str

    def width(self, kind: str) -> int:
        """Return how many cells a number takes."""
        return int(kind[1]) if self.order else 1

    def length(self, at: int, kind: str) -> int:
        """Return the number that stands before a list."""
        if not self.order:
            number = float(self.data[at])
            return int(number) if number.is_integer() else -1
        held = self.data[at : at + self.width(kind)].tobytes()
        return int.from_bytes(held, "little" if self.order == "<" else "big", signed=kind[0] == "i")

    def block(self, begin: int, kind: str, step: int, shape: tuple[int, int]) -> Numbers:
        """Return a view of (rows, columns) numbers, the rows `step` cells apart."""
        held = self.order + kind if self.order else "f8"
        size = self.data.itemsize
        return np.ndarray(shape, held, self.data.data, begin * size, (step * size, self.width(kind) * size))

    def gather(self, begins: Numbers, kind: str, length: int) -> Numbers:
        """Copy (rows, length) numbers from their places."""
        cells = self.data[begins[:, np.newaxis] + np.arange(length * self.width(kind))]
        return cells.view(self.order + kind) if self.order else cells


def _read(cells: _Cells, element: Element, at: int) -> tuple[Table, int]:
    """Return an element's columns, and where the next one begins."""
    least = sum(cells.width(each.count_kind or each.kind) for each in element.properties)
    if element.count * least > len(cells.data) - at:
        raise ShortError(f"{element.count} records of {element.name}")
    if not element.count:
        return {each.name: Column(np.zeros(0), np.zeros(0, np.int64) if each.count_kind else None, each.kind) for each in element.properties}, at  # fmt: skip
    return _read_uniform(cells, element, at) or _read_ragged(cells, element, at)


def _read_uniform(cells: _Cells, element: Element, at: int) -> tuple[Table, int] | None:
    """Read records whose lists are all as long as the first one's; None: they are not. Nothing is copied."""
    lengths, ends = _row(cells, element, at)
    step, rows = ends[-1] - at, element.count
    if at + rows * step > len(cells.data):
        return None
    table = {}
    for each, length, end in zip(element.properties, lengths, ends[1:], strict=True):
        width = cells.width(each.kind)
        begin = end - length * width
        values = cells.block(begin, each.kind, step, (rows, length))
        counts = None
        if each.count_kind:
            head = cells.block(begin - cells.width(each.count_kind), each.count_kind, step, (rows, 1))
            if (head != length).any():
                return None
            counts = np.full(rows, length)
        table[each.name] = Column(values.reshape(-1) if counts is not None else values[:, 0], counts, each.kind)
    return table, at + rows * step


def _row(cells: _Cells, element: Element, at: int) -> tuple[list[int], list[int]]:
    """Return the length of each property of the record that begins here (1 where it is no list), and where it begins and each one ends."""
    lengths, ends = [], [at]
    for each in element.properties:
        length = 1
        if each.count_kind:
            if at + cells.width(each.count_kind) > len(cells.data):
                raise ShortError(element.name)
            length = cells.length(at, each.count_kind)
            at += cells.width(each.count_kind)
        at += length * cells.width(each.kind)
        if length < 0 or at > len(cells.data):
            raise ShortError(element.name)
        lengths.append(length)
        ends.append(at)
    return lengths, ends


def _read_ragged(cells: _Cells, element: Element, at: int) -> tuple[Table, int]:
    """Read records of unlike lengths, one after another."""
    begins = [array("q") for _ in element.properties]
    counts = [array("q") for _ in element.properties]
    for _ in range(element.count):
        lengths, ends = _row(cells, element, at)
        at = ends[-1]
        for index, each in enumerate(element.properties):
            counts[index].append(lengths[index])
            begins[index].append(ends[index + 1] - lengths[index] * cells.width(each.kind))
    table = {}
    for each, begin, count in zip(element.properties, begins, counts, strict=True):
        lengths_of = np.frombuffer(count, np.int64)
        values = _gather(cells, each.kind, np.frombuffer(begin, np.int64), lengths_of)
        table[each.name] = Column(values, lengths_of if each.count_kind else None, each.kind)
    return table, at


def _gather(cells: _Cells, kind: str, begins: Numbers, counts: Numbers) -> Numbers:
    """Copy lists of unlike lengths from their places to one behind another."""
    places = np.cumsum(counts) - counts
    values = np.empty(int(counts.sum()), kind if cells.order else "f8")
    for length in np.unique(counts[counts > 0]).tolist():
        rows = np.flatnonzero(counts == length)
        step = max(1, _MAX_AT_ONCE // length)
        for first in range(0, len(rows), step):
            part = rows[first : first + step]
            values[places[part, np.newaxis] + np.arange(length)] = cells.gather(begins[part], kind, length)
    return values
