"""A slot for learned matchers: runs a stereo network from an ONNX file with onnxruntime, on the processor.

The project ships no network. One that is dropped in must take two rectified images and give one disparity for each pixel
of the left one, in pixels of its input; the shapes that its file declares say the rest. Around it:

- An image that fits into the network's size is extended to it at the right and below, by its last column and row, so no
  pixel changes; a larger one is reduced to it, and the disparity enlarged back. A network without a size of its own gets
  the image extended to a multiple of 32 px, which is what the usual five halvings need.
- Networks answer everywhere. What the right image cannot show (d > x), what lies outside 0 <= d < N, what is no number,
  and rows in which nothing changes get no value. With `check=yes` the mirrored pair is matched, too, and a value counts
  only where the right view's agrees within a pixel, as in the default matcher.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError, SettingsError, UnavailableError
from phone_host.model import Disparity, Epipolar, Image, RectifiedPair
from phone_host.stereo.filters import told_rows
from phone_host.stereo.match_sgbm import mirrored
from phone_host.stereo.matcher_names import Check, Levels, NetworkMatcher, Sign
from phone_host.stereo.matcher_protocol import check_pair, grey
from phone_host.stereo.working import to_full_size

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


_MULTIPLE_PX: Final = 32
_AGREEMENT_PX: Final = 1.0
_MEAN: Final = np.array([0.485, 0.456, 0.406], np.float32)
_DEVIATION: Final = np.array([0.229, 0.224, 0.225], np.float32)
"""ImageNet's, red green blue, of levels 0 to 1."""

Planes = NDArray[Any]


@lru_cache(maxsize=2)
def _opened(path: str, _changed_ns: int) -> Any:  # noqa: ANN401 - onnxruntime has no types
    """Load a network. Kept, because one matcher is made for each image size; a file that changed is loaded anew."""
    try:
        import onnxruntime  # noqa: PLC0415 - 27 MB that only these matchers need
    except ImportError as error:
        raise UnavailableError(
            f"matcher onnx:{path} needs the package onnxruntime ({error})", "pip install onnxruntime"
        ) from None
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 4  # it would write to stderr itself; its errors arrive as exceptions
    try:
        return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise DataError(
            f"matcher onnx:{path} cannot be loaded ({_first_line(error)})", "give a network in ONNX format"
        ) from error


def _first_line(error: Exception) -> str:
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


class OnnxMatcher:
    """A network behind the protocol of matchers.

    Args:
        name: file and options.
        disparities: N >= 1, px: values outside 0 <= d < N are dropped.

    Raises:
        SettingsError: there is no such file.
        UnavailableError: onnxruntime is not installed.
        DataError: the file is no network, or one of another kind.
    """

    def __init__(self, name: NetworkMatcher, disparities: int) -> None:
        path = Path(name.path).expanduser()
        try:
            changed_ns = path.stat().st_mtime_ns
            if path.is_dir():
                raise IsADirectoryError(21, "it is a folder")
        except OSError as error:
            raise SettingsError(
                f"matcher {name.value} cannot be read ({error.strerror})", "give onnx:PATH, a network in ONNX format"
            ) from None
        self._name, self._disparities = name, disparities
        self._session = _opened(str(path), changed_ns)
        self._layout = layout_of(path.name, self._session.get_inputs(), self._session.get_outputs())

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair; see `Matcher.match`.

        Raises:
            DataError: the network fails on images of this size, or gives a map of another size.
        """
        check_pair(pair)
        found = self._run(pair.left, pair.right)
        trusted = np.isfinite(found) & (found >= 0) & (found < self._disparities)
        trusted &= found <= np.arange(found.shape[1], dtype=np.float32)
        trusted &= (told_rows(grey(pair.left)) & told_rows(grey(pair.right)))[:, np.newaxis]
        if self._name.check is Check.YES:
            # The right view is the left view of the mirrored and swapped pair.
            right = self._run(mirrored(pair.right), mirrored(pair.left))[:, ::-1]
            trusted &= _agree(np.where(trusted, found, np.float32(0)), right)
        return np.where(trusted, found, np.float32(np.nan))

    def _run(self, left: Image, right: Image) -> Disparity:
        """Run the network once; the result has the images' size and its values are px of them, unchecked."""
        height, width = left.shape[:2]
        size = net_width, net_height = _network_size(self._layout, width, height)
        fed = [_planes(image, size, self._layout, self._name.levels) for image in (left, right)]
        if len(self._layout.inputs) == 1:
            fed = [np.concatenate(fed, axis=1 if self._layout.channels_first else 3)]
        try:
            (result,) = self._session.run([self._layout.output], dict(zip(self._layout.inputs, fed, strict=True)))
        except Exception as error:
            raise DataError(
                f"matcher {self._name.value} failed on images of {width}x{height} ({_first_line(error)})",
                "give a network for images of this size",
            ) from error
        values = np.asarray(result, np.float32)
        if values.size != net_width * net_height:
            shape = " x ".join(str(length) for length in values.shape)
            raise DataError(
                f"matcher {self._name.value} gave {shape} values for images of {net_width}x{net_height}",
                "give a network whose output is one disparity for each pixel",
            )
        values = np.where(np.isfinite(values), values, np.float32(np.nan)).reshape(net_height, net_width)
        if self._name.sign is Sign.FLOW:
            values = -values
        if width <= net_width and height <= net_height:
            return np.ascontiguousarray(values[:height, :width])
        return to_full_size(values, width, height, Epipolar.LEFT)


def _network_size(layout: Layout, width: int, height: int) -> tuple[int, int]:
    """Width and height at which the network runs on images of this size, px."""
    own = (layout.width_px, layout.height_px)
    return tuple(  # type: ignore[return-value]  # two, as given
        fixed or -(-length // _MULTIPLE_PX) * _MULTIPLE_PX for fixed, length in zip(own, (width, height), strict=True)
    )


def _planes(image: Image, size: tuple[int, int], layout: Layout, levels: Levels) -> Planes:
    """Bring one image to the network's size, colours, levels, number type and order of axes."""
    width, height = size
    if layout.channels == 1:
        image = grey(image)[..., np.newaxis]
    else:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB if image.ndim == 2 else cv2.COLOR_BGR2RGB), np.uint8)
    right, below = width - image.shape[1], height - image.shape[0]
    if right >= 0 and below >= 0:
        image = np.pad(image, ((0, below), (0, right), (0, 0)), mode="edge")
    else:
        resized = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        image = np.asarray(resized, np.uint8).reshape(height, width, layout.channels)
    planes: Planes = image if layout.element == "uint8" else _levels(image, levels).astype(layout.element)
    if layout.channels_first:
        planes = planes.transpose(2, 0, 1)
    return np.ascontiguousarray(planes[np.newaxis])


def _levels(image: Image, levels: Levels) -> NDArray[np.float32]:
    """The grey levels as a network of floating-point numbers takes them."""
    values = image.astype(np.float32)
    if levels is Levels.BYTES:
        return values
    values /= np.float32(255)
    if levels is Levels.IMAGENET:
        # A grey network has one channel: the mean of the three.
        mean, deviation = (_MEAN, _DEVIATION) if values.shape[2] == 3 else (_MEAN.mean(), _DEVIATION.mean())
        return np.asarray((values - mean) / deviation, np.float32)
    return values


def _agree(left: Disparity, right: Disparity) -> NDArray[np.bool_]:
    """Find the left pixels whose matching right pixel has the same disparity, to within a pixel.

    Args:
        left: (H, W) float32, px, all in 0 <= d <= x.
        right: (H, W) float32, px; anything.
    """
    columns = np.arange(left.shape[1], dtype=np.float32)
    there = np.clip(np.rint(columns - left), 0, left.shape[1] - 1).astype(np.intp)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(np.take_along_axis(right, there, 1) - left) <= _AGREEMENT_PX, np.bool_)
