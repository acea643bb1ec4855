"""The files of one processed pair. `stereo` and `run` write them by the same code, so that a name always means the same.

docs/files.md describes them.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import chain
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import CloudImage, Disparity, Processed
from phone_host.output.atomic import write_parts
from phone_host.output.axes import Axes
from phone_host.output.depth_png import write_depth
from phone_host.output.ply import write_ply
from phone_host.output.preview import depth_picture, disparity_picture, write_png
from phone_host.output.strips import strips


class PairFile(Enum):
    """A file of a pair, by its name."""

    LEFT = "left.png"
    RIGHT = "right.png"
    DISPARITY = "disparity.pfm"
    DISPARITY_VIEW = "disparity.png"
    CLOUD = "cloud.ply"
    XYZ = "xyz.pfm"
    DEPTH = "depth.png"
    DEPTH_VIEW = "depth_view.png"


_OF_DISPARITY: Final = frozenset({PairFile.DISPARITY, PairFile.DISPARITY_VIEW})
_OF_IMAGES: Final = frozenset({PairFile.LEFT, PairFile.RIGHT})

RUN_FILES: Final = (
    PairFile.LEFT,
    PairFile.RIGHT,
    PairFile.DISPARITY,
    PairFile.CLOUD,
    PairFile.DEPTH,
)
"""What a run saves of a pair."""

STEREO_FILES: Final = (
    # The slowest first, so that two threads end at about the same time.
    PairFile.CLOUD,
    PairFile.DEPTH,
    PairFile.XYZ,
    PairFile.DEPTH_VIEW,
    PairFile.DISPARITY_VIEW,
    PairFile.DISPARITY,
)
"""What `stereo` writes of a pair."""


_BESIDE: Final = ("report.json", "index.html")


def _pattern(files: Iterable[PairFile]) -> str:
    return "|".join(re.escape(name) for name in (*(file.value for file in files), *_BESIDE))


PAIR_NAMES: Final = _pattern(PairFile)
"""Pattern of the names that may lie in the folder of a pair, whichever verb wrote it."""

STEREO_NAMES: Final = _pattern(STEREO_FILES)
"""Pattern of the names that `stereo` writes for a pair."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenPair:
    """What was written of a pair.

    Attributes:
        files: names, sorted.
        points: points of cloud.ply; None without that file.
        not_in_depth_png: depths that a 16-bit picture in mm cannot hold.
    """

    files: tuple[str, ...]
    points: int | None = None
    not_in_depth_png: int = 0


def available(wanted: Sequence[PairFile], *, has_disparity: bool, has_cloud: bool) -> tuple[PairFile, ...]:
    """Return those of the wanted files that can be written."""

    def can_be(file: PairFile) -> bool:
        return file in _OF_IMAGES or (has_disparity if file in _OF_DISPARITY else has_cloud)

    return tuple(file for file in wanted if can_be(file))


def write_pair(
    folder: Path,
    processed: Processed,
    wanted: Sequence[PairFile],
    axes: Axes = Axes.CAMERA,
    run_all: Callable[[Callable[[PairFile], int], Iterable[PairFile]], Iterable[int]] = map,
) -> WrittenPair:
    """Write a pair's files, each whole or not at all.

    Args:
        folder: where to; it exists.
        processed: the pair.
        wanted: which files. Those for which the pair has no data are left out.
        axes: axes of cloud.ply and xyz.pfm.
        run_all: calls a function for each file, possibly in several threads (`ThreadPoolExecutor.map`).

    Returns:
        What was written.

    Raises:
        OSError: a file cannot be written.
    """
    files = available(
        wanted,
        has_disparity=processed.disparity is not None,
        has_cloud=processed.cloud is not None,
    )
    counts = dict(
        zip(files, run_all(lambda file: _write(folder / file.value, file, processed, axes), files), strict=True)
    )
    return WrittenPair(
        files=tuple(sorted(file.value for file in files)),
        points=counts.get(PairFile.CLOUD),
        not_in_depth_png=counts.get(PairFile.DEPTH, 0),
    )


def _write(path: Path, file: PairFile, processed: Processed, axes: Axes) -> int:
    """Write one file. Return the points of the cloud, or the depths that do not fit into depth.png; else 0."""
    pair, disparity, cloud = processed.pair, processed.disparity, processed.cloud
    if file in _OF_IMAGES:
        write_png(path, pair.left if file is PairFile.LEFT else pair.right)
        return 0
    if file in _OF_DISPARITY:
        assert disparity is not None
        if file is PairFile.DISPARITY:
            write_pfm(path, disparity)
        else:
            write_png(path, disparity_picture(disparity, processed.geometry))
        return 0
    assert cloud is not None
    match file:
        case PairFile.CLOUD:
            return write_ply(path, cloud, pair.left, axes)
        case PairFile.DEPTH:
            return write_depth(path, cloud)
        case PairFile.XYZ:
            write_xyz(path, cloud, axes)
        case _:
            write_png(path, depth_picture(cloud))
    return 0


def write_pfm(path: Path, disparity: Disparity) -> None:
    """Write a disparity map.

    Args:
        path: the file; it appears whole or not at all.
        disparity: (H, W) float32, px, NaN = none (any value that is not finite is written as +inf).

    Raises:
        OSError: the file cannot be written.
    """

    def row_strips() -> Iterator[memoryview]:
        for rows in _bottom_first(disparity):
            data = np.where(np.isfinite(rows), rows, np.float32(np.inf))
            yield np.ascontiguousarray(data, dtype="<f4").data.cast("B")

    height, width = disparity.shape
    write_parts(path, chain([f"Pf\n{width} {height}\n-1\n".encode()], row_strips()))


def write_xyz(path: Path, cloud: CloudImage, axes: Axes = Axes.CAMERA) -> None:
    """Write a cloud image: X, Y and Z of each pixel as the three channels.

    Args:
        path: the file; it appears whole or not at all.
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.
        axes: axes of the file's points.

    Raises:
        OSError: the file cannot be written.
    """
    height, width, _ = cloud.shape
    # Whole rows: numpy multiplies a last axis of length 3 at a tenth of this speed.
    signs = np.tile(axes.signs, width)

    def row_strips() -> Iterator[memoryview]:
        for rows in _bottom_first(np.ascontiguousarray(cloud).reshape(height, 3 * width)):
            yield np.multiply(rows, signs, dtype="<f4").data.cast("B")

    write_parts(path, chain([f"PF\n{width} {height}\n-1\n".encode()], row_strips()))


def _bottom_first(values: NDArray[np.float32]) -> Iterator[NDArray[np.float32]]:
    """Yield the rows in the file's order, some at a time."""
    upside_down = values[::-1]
    for rows in strips(*values.shape):
        yield np.ascontiguousarray(upside_down[rows])
