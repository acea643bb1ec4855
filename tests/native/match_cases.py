"""Pairs for the matcher's entry in the library, past the checks of `match_tandem`: of any size, content and stride, in memory of just their size."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.native.library import Library, MatchJob
from phone_host.stereo.match_tandem import GREATEST_SEARCH
from tests.support.planes import noise, plane

Bytes = NDArray[np.uint8]
CONTENTS: Final = ("noise", "shifted", "flat", "rows", "columns", "two levels", "halves", "ramp")


@dataclass(frozen=True, slots=True, kw_only=True)
class Stored:
    """An image as it lies in memory.

    Attributes:
        memory: (B,) uint8: just the bytes from the image's first to its last, so that a sanitizer sees what lies outside.
        offset: of row 0 in it, bytes.
        stride: from row to row, bytes; negative: the last row comes first.
    """

    memory: Bytes
    offset: int
    stride: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchCase:
    """What the library is asked.

    Attributes:
        left: image.
        right: image of the same size.
        width: px.
        height: px.
        disparities: N, at least 1; more than the width is allowed.
        threads: any number.
        guide: whether what the images do not support is dropped, and surfaces are completed.
    """

    left: Stored
    right: Stored
    width: int
    height: int
    disparities: int
    threads: int = 1
    guide: bool = False


def stored(image: Bytes, pitch: int, *, upside_down: bool) -> Stored:
    """Lay an image out with `pitch` bytes from row to row, the last row first if `upside_down`.

    With less than the width, rows share memory: the image is what was written last. 0: every row is the same.
    """
    height, width = image.shape
    memory = np.full((height - 1) * pitch + width, 99, np.uint8)
    rows = np.lib.stride_tricks.as_strided(memory, (height, width), (pitch, 1))
    rows[:] = image[::-1] if upside_down else image
    return Stored(
        memory=memory, offset=(height - 1) * pitch if upside_down else 0, stride=-pitch if upside_down else pitch
    )


def content(kind: str, width: int, height: int, random: np.random.Generator) -> tuple[Bytes, Bytes]:
    """Make the two images of a pair."""
    left = random.integers(0, 256, (height, width), np.uint8)
    right = random.integers(0, 256, (height, width), np.uint8)
    match kind:
        case "shifted":
            right = np.roll(left, -int(random.integers(0, width)), axis=1)
        case "flat":
            left[:], right[:] = random.integers(0, 256, 2, np.uint8)
        case "rows":
            left, right = left[:, :1].repeat(width, axis=1), right[:, :1].repeat(width, axis=1)
        case "columns":
            left, right = left[:1].repeat(height, axis=0), right[:1].repeat(height, axis=0)
        case "two levels":
            left, right = left // 128 * 255, right // 128 * 255
        case "halves":
            left[: height // 2], right[:, : width // 2] = 255, 0
        case "ramp":
            left[:] = np.linspace(0, 255, width)
            right[:] = np.linspace(255, 0, width)
        case _:
            pass
    return left, right


def random_size(random: np.random.Generator) -> tuple[int, int, int]:
    """Choose width, height and N: mostly of up to 70 px and 80 disparities, now and then far from square or with a vast search."""
    width, height = (int(side) for side in random.integers(1, 71, 2))
    disparities = int(random.integers(1, 81))
    match int(random.integers(0, 16)):
        case 0:
            width, height = int(random.integers(100, 1500)), int(random.integers(1, 6))
        case 1:
            # Two strips of rows and more.
            width, height = int(random.integers(1, 12)), int(random.integers(257, 700))
        case 2:
            width, height = (int(side) for side in random.integers(1, 20, 2))
            disparities = int(random.integers(1, GREATEST_SEARCH + 1))
        case 3:
            # As large as a guide that is a quarter of the size.
            width, height, disparities = int(random.integers(200, 400)), int(random.integers(30, 90)), width
        case _:
            pass
    return width, height, disparities


def random_stored(image: Bytes, random: np.random.Generator) -> Stored:
    """Lay an image out with rows padded or packed, and now and then overlapping, either way up."""
    width = image.shape[1]
    overlapping = random.integers(0, 8) == 0
    pitch = int(random.integers(0, width)) if overlapping else width + int(random.integers(0, 9))
    return stored(image, pitch, upside_down=bool(random.integers(0, 2)))


def random_case(random: np.random.Generator) -> MatchCase:
    """Make a case of any content, size and strides, with or without the guide."""
    width, height, disparities = random_size(random)
    left, right = (
        random_stored(image, random) for image in content(str(random.choice(CONTENTS)), width, height, random)
    )
    return MatchCase(
        left=left,
        right=right,
        width=width,
        height=height,
        disparities=disparities,
        threads=int(random.choice((-1, 0, 1, 2, 3, 8, 1000))),
        guide=bool(random.integers(0, 2)),
    )


def fixed_cases() -> Iterator[MatchCase]:
    """Cases for other processors, each without the guide and with it."""
    for case in unguided_cases():
        yield case
        yield replace(case, guide=True)


def unguided_cases() -> Iterator[MatchCase]:
    """All contents, sizes around every register's, two strips of rows, a plane with noise, tiles before a bare wall."""
    random = np.random.default_rng(20)
    sizes = ((1, 1, 1), (1, 9, 64), (9, 1, 5), (15, 8, 16), (16, 17, 33), (31, 5, 80), (64, 16, 63), (65, 33, 64))
    for (width, height, disparities), kind in zip(sizes, CONTENTS, strict=True):
        left, right = (
            stored(image, width + 3, upside_down=bool(turn))
            for turn, image in enumerate(content(kind, width, height, random))
        )
        yield MatchCase(left=left, right=right, width=width, height=height, disparities=disparities, threads=2)
    pair = plane(width_px=150, height_px=290, seed=31).pair
    images = [
        np.clip(image + random.normal(0, 2, image.shape), 0, 255).astype(np.uint8) for image in (pair.left, pair.right)
    ]
    images[0][100:150, 40:90] = 255
    left, right = (stored(image, 150, upside_down=False) for image in images)
    case = MatchCase(left=left, right=right, width=150, height=290, disparities=48, threads=3)
    yield case
    yield replace(case, disparities=129)
    yield tiles(random)
    left = stored(noise(120, 40, 6), 120, upside_down=False)
    yield MatchCase(left=left, right=left, width=120, height=40, disparities=100)


def tiles(random: np.random.Generator) -> MatchCase:
    """Make a case that the guide decides: a board of equal tiles on a bare wall, textured at its edge, by two noisy sensors."""
    wide = noise(230, 130, seed=8)
    wide[12:-12, 30:-30] = 140
    y, x = np.indices(wide.shape)
    wide[40:90, 60:170] = np.where((x // 9 + y // 9) % 2, 200, 60)[40:90, 60:170]
    left, right = (
        stored(
            np.clip(np.rint(view + random.normal(0, 2, view.shape)), 0, 255).astype(np.uint8), 210, upside_down=False
        )
        for view in (wide[:, :210], wide[:, 20:])
    )
    return MatchCase(left=left, right=right, width=210, height=130, disparities=64, threads=2)


def result_of(library: Library, case: MatchCase) -> tuple[NDArray[np.float32], Bytes]:
    """Match a case; workspace and results are in memory of just their size, too. Returns disparity and confidence."""
    disparity = np.empty((case.height, case.width), np.float32)
    confidence = np.empty((case.height, case.width), np.uint8)
    job = MatchJob(
        left=case.left.memory.ctypes.data + case.left.offset,
        right=case.right.memory.ctypes.data + case.right.offset,
        left_stride=case.left.stride,
        right_stride=case.right.stride,
        disparity=disparity.ctypes.data,
        confidence=confidence.ctypes.data,
        width=case.width,
        height=case.height,
        disparities=case.disparities,
        threads=case.threads,
        guide=int(case.guide),
    )
    workspace = np.full(library.match_bytes(job), 0xA5, np.uint8)  # what an earlier pair left must not matter
    job.workspace, job.workspace_bytes = workspace.ctypes.data, workspace.size
    library.run(job)
    return disparity, confidence
