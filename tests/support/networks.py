"""Writes tiny stereo networks as ONNX files, byte by byte: protocol buffers need no package, and no weights are shipped.

The network is the paper's idea in seven operators: for each d the right image is moved by d, its absolute difference to
the left one is averaged over a window, and the d of least average wins.
Source of the field numbers: onnx/onnx.proto (ModelProto, GraphProto, NodeProto, TensorProto, ValueInfoProto), ONNX 1.16.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

Axis = int | str
"""A length, or the name of a free one."""


class Element(IntEnum):
    """TensorProto.DataType."""

    FLOAT = 1
    UINT8 = 2
    INT64 = 7
    FLOAT16 = 10


def _varint(number: int) -> bytes:
    number &= (1 << 64) - 1
    parts = bytearray()
    while True:
        low, number = number & 0x7F, number >> 7
        parts.append(low | (0x80 if number else 0))
        if not number:
            return bytes(parts)


def _whole(place: int, number: int) -> bytes:
    return _varint(place << 3) + _varint(number)


def _bytes(place: int, content: bytes | str) -> bytes:
    data = content.encode() if isinstance(content, str) else content
    return _varint(place << 3 | 2) + _varint(len(data)) + data


def _attribute(name: str, value: float | str | Sequence[int]) -> bytes:
    """AttributeProto: f = 2, i = 3, s = 4, ints = 8, type = 20."""
    if isinstance(value, str):
        content = _bytes(4, value) + _whole(20, 3)
    elif isinstance(value, float):
        content = _varint(2 << 3 | 5) + struct.pack("<f", value) + _whole(20, 1)
    elif isinstance(value, int):
        content = _whole(3, value) + _whole(20, 2)
    else:
        content = b"".join(_whole(8, one) for one in value) + _whole(20, 7)
    return _bytes(5, _bytes(1, name) + content)


def value_info(name: str, element: Element, axes: Sequence[Axis]) -> bytes:
    """ValueInfoProto of a tensor."""
    dims = b"".join(_bytes(1, _whole(1, axis) if isinstance(axis, int) else _bytes(2, axis)) for axis in axes)
    return _bytes(1, name) + _bytes(2, _bytes(1, _whole(1, element) + _bytes(2, dims)))


@dataclass
class Graph:
    """A network in the making."""

    nodes: list[bytes] = field(default_factory=list)
    constants: list[bytes] = field(default_factory=list)
    inputs: list[bytes] = field(default_factory=list)
    outputs: list[bytes] = field(default_factory=list)

    def add(self, kind: str, inputs: Sequence[str], **attributes: float | str | Sequence[int]) -> str:
        """Add an operator; returns the name of its result."""
        result = f"v{len(self.nodes)}"
        self.name(kind, inputs, result, **attributes)
        return result

    def name(self, kind: str, inputs: Sequence[str], result: str, **attributes: float | str | Sequence[int]) -> None:
        """Add an operator whose result has a given name."""
        parts = [_bytes(1, one) for one in inputs] + [_bytes(2, result), _bytes(4, kind)]
        self.nodes.append(b"".join(parts + [_attribute(key, value) for key, value in attributes.items()]))

    def whole(self, *numbers: int) -> str:
        """Add a constant of whole numbers."""
        name = f"c{len(self.constants)}"
        content = b"".join(number.to_bytes(8, "little", signed=True) for number in numbers)
        self.constants.append(_whole(1, len(numbers)) + _whole(2, Element.INT64) + _bytes(8, name) + _bytes(9, content))
        return name

    def number(self, value: float) -> str:
        """Add a constant."""
        name = f"c{len(self.constants)}"
        self.constants.append(_whole(2, Element.FLOAT) + _bytes(8, name) + _bytes(9, struct.pack("<f", value)))
        return name

    def write(self, path: Path) -> Path:
        """Write the ONNX file."""
        graph = b"".join(_bytes(1, node) for node in self.nodes) + _bytes(2, "tiny")
        graph += b"".join(_bytes(5, constant) for constant in self.constants)
        graph += b"".join(_bytes(11, one) for one in self.inputs) + b"".join(_bytes(12, one) for one in self.outputs)
        path.write_bytes(_whole(1, 8) + _bytes(7, graph) + _bytes(8, _bytes(1, "") + _whole(2, 13)))
        return path


@dataclass(frozen=True, kw_only=True)
class Form:
    """How a tiny network takes its images.

    Attributes:
        channels: of one image.
        channels_first: their place.
        stacked: both images in one input.
        size: rows and columns; names: any.
        element: number type.
        names: of the inputs.
        sign: 1: gives the disparity; -1: its opposite.
        disparities: N.
    """

    channels: int = 1
    channels_first: bool = True
    stacked: bool = False
    size: tuple[Axis, Axis] = ("rows", "columns")
    element: Element = Element.FLOAT
    names: tuple[str, str] = ("first", "second")
    sign: int = 1
    disparities: int = 12


def block_network(path: Path, form: Form = Form()) -> Path:
    """Write a network that matches blocks of 5 x 5 pixels."""
    graph = Graph()
    count = form.channels * (2 if form.stacked else 1)
    axes = (1, count, *form.size) if form.channels_first else (1, *form.size, count)
    axis = 1 if form.channels_first else 3
    names = ("both",) if form.stacked else form.names
    graph.inputs = [value_info(name, form.element, axes) for name in names]
    floats = [graph.add("Cast", [name], to=int(Element.FLOAT)) for name in names]
    if form.stacked:
        halves = ((0, form.channels), (form.channels, count))
        floats = [graph.add("Slice", [floats[0], *(graph.whole(n) for n in (*ends, axis))]) for ends in halves]
    elif "right" in names[0]:
        floats.reverse()
    if not form.channels_first:
        floats = [graph.add("Transpose", [one], perm=[0, 3, 1, 2]) for one in floats]
    left, right = (graph.add("ReduceMean", [one], axes=[1], keepdims=1) for one in floats)
    costs = [
        graph.add("AveragePool", [_difference(graph, left, right, d)], kernel_shape=[5, 5], pads=[2, 2, 2, 2])
        for d in range(form.disparities)
    ]
    least = graph.add("ArgMin", [graph.add("Concat", costs, axis=1)], axis=1, keepdims=1)
    found = graph.add("Cast", [least], to=int(Element.FLOAT))
    graph.name("Mul", [found, graph.number(float(form.sign))], "disparity")
    graph.outputs = [value_info("disparity", Element.FLOAT, (1, 1, *form.size))]
    return graph.write(path)


def _difference(graph: Graph, left: str, right: str, d: int) -> str:
    """|left(x) - right(x - d)|; beyond the right image's border there is nothing alike."""
    moved = right
    if d:
        cut = graph.add("Slice", [right, graph.whole(0), graph.whole(-d), graph.whole(3)])
        moved = graph.add("Pad", [cut, graph.whole(0, 0, 0, d, 0, 0, 0, 0), graph.number(1e4)])
    return graph.add("Abs", [graph.add("Sub", [left, moved])])
