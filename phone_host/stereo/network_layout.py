"""Finds out how a stereo network takes its two images and where it gives the disparity, from the shapes that its file declares."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from common.errors import DataError

ELEMENTS: Final = {"tensor(float)": "float32", "tensor(float16)": "float16", "tensor(uint8)": "uint8"}
"""ONNX's names of the number types that are understood, and numpy's."""

_GREY, _RGB = 1, 3


class Declared(Protocol):
    """What a network's file says of one of its inputs or outputs."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def type(self) -> str:
        """The type of its numbers, as `tensor(float)`."""

    @property
    def shape(self) -> Sequence[int | str | None]:
        """Its axes; a name or None: the size is free."""


@dataclass(frozen=True, slots=True)
class Layout:
    """How a network is fed.

    Attributes:
        inputs: names of the inputs: the left image's and the right one's, or one that takes both.
        channels: of one image: 1 grey, 3 red green blue.
        channels_first: whether the channels come before rows and columns, or after them.
        height_px: rows that it takes; 0: any.
        width_px: columns that it takes; 0: any.
        element: numpy's name of the number type.
        output: name of the output with the disparity.
    """

    inputs: tuple[str, ...]
    channels: int
    channels_first: bool
    height_px: int
    width_px: int
    element: str
    output: str


def layout_of(name: str, inputs: Sequence[Declared], outputs: Sequence[Declared]) -> Layout:
    """Read a network's declarations.

    Args:
        name: of the file, for error messages.
        inputs: in the file's order; left before right, unless their names say otherwise.
        outputs: in the file's order.

    Raises:
        DataError: it does not take two images and give one map in a form that is understood.
    """
    if len(inputs) not in {1, 2}:
        raise DataError(
            f"{name} takes {len(inputs)} inputs", "give a network that takes two images, or both in one input"
        )
    shapes = [tuple(size if isinstance(size, int) and size > 0 else 0 for size in each.shape) for each in inputs]
    said = " and ".join(_said(each) for each in inputs)
    remedy = "give a network for images of shape 1 x channels x rows x columns, or with the channels last"
    if any(len(shape) != 4 or shape[0] > 1 for shape in shapes) or len(set(shapes)) > 1:
        raise DataError(f"{name} takes {said}", remedy)
    elements = {ELEMENTS.get(each.type, "") for each in inputs}
    if len(elements) > 1 or "" in elements:
        raise DataError(f"{name} takes {said}", "give a network that takes float, float16 or uint8 numbers")
    images = 2 if len(inputs) == 1 else 1
    _, first, middle, last = shapes[0]
    known = {_GREY * images, _RGB * images}
    if first in known:
        channels, channels_first, size = first, True, (middle, last)
    elif last in known:
        channels, channels_first, size = last, False, (first, middle)
    else:
        raise DataError(f"{name} takes {said}", remedy)
    return Layout(
        inputs=_left_then_right([each.name for each in inputs]),
        channels=channels // images,
        channels_first=channels_first,
        height_px=size[0],
        width_px=size[1],
        element=next(iter(elements)),
        output=_map_among(name, outputs),
    )


def _left_then_right(names: Sequence[str]) -> tuple[str, ...]:
    """The names, exchanged if they say that the right image comes first."""
    if len(names) == 2 and "right" in names[0].lower() and "left" in names[1].lower():
        return names[1], names[0]
    return tuple(names)


def _map_among(name: str, outputs: Sequence[Declared]) -> str:
    """The output that may be a map: the one that is called so, else the last, which networks refine longest."""
    maps = [each for each in outputs if _may_be_map(each)]
    if not maps:
        said = " and ".join(_said(each) for each in outputs)
        raise DataError(f"{name} gives {said}", "give a network whose output is one disparity for each pixel")
    called = [each for each in maps if "disp" in each.name.lower()]
    return called[0].name if len(called) == 1 else maps[-1].name


def _may_be_map(output: Declared) -> bool:
    """Whether two axes may be rows and columns and all others are 1 or free."""
    if output.type not in ELEMENTS:
        return False
    long = [size for size in output.shape if isinstance(size, int) and size > 1]
    # A network that states no shape at all for its output has none here, either; the result's own shape will tell.
    return len(long) <= 2 and len(output.shape) in {0, 2, 3, 4}


def _said(declared: Declared) -> str:
    """A declaration in words."""
    axes = " x ".join(str(size) if isinstance(size, int) else "any" for size in declared.shape) or "no axes"
    return f"{declared.name} ({declared.type} of {axes})"
