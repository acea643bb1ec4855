"""Rectified pairs with ground truth from $SCAN_DATA for bench_depth, degraded as two cheap, unlike cameras would."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Values = NDArray[np.float32]

_DIM: Final = (0.7, 20)
"""Gain and offset of the darker camera."""

_MARGIN_PX: Final = 2
_STEP: Final = 16
"""StereoSGBM searches a multiple of 16."""


def _jpeg(image: Image) -> Image:
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 80])
    assert done
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)


def _lower(image: Image) -> Image:
    move = np.array([[1, 0, 0], [0, 1, 0.5]])
    size = (image.shape[1], image.shape[0])
    return np.asarray(
        cv2.warpAffine(image, move, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE), np.uint8
    )


def _darker(image: Image) -> Image:
    gain, offset = _DIM
    return np.asarray(np.clip(gain * image.astype(np.float32) + offset, 0, 255), np.uint8)


CASES: Final[dict[str, Callable[[Image, Image], tuple[Image, Image]]]] = {
    "clean": lambda left, right: (left, right),
    "JPEG 80": lambda left, right: (_jpeg(left), _jpeg(right)),
    "0.5 px too low": lambda left, right: (left, _lower(right)),
    "all, and darker": lambda left, right: (_jpeg(left), _jpeg(_darker(_lower(right)))),
}


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A rectified pair and its ground truth.

    Attributes:
        name: folder.
        left: (H, W, 3).
        right: the same.
        truth: (H, W), disparity, px; NaN: unknown, or not seen by both.
        cases: names of `CASES`.
    """

    name: str
    left: Image
    right: Image
    truth: Values
    cases: tuple[str, ...]

    @property
    def disparities(self) -> int:
        """How far to search, px."""
        return int(np.ceil((np.nanmax(self.truth) + _MARGIN_PX) / _STEP)) * _STEP


def scenes(data: Path) -> Iterator[Scene]:
    """Read all available scenes."""
    everything = tuple(CASES)
    for name, scale in (("tsukuba", 16), ("cones", 4)):
        folder = data / "middlebury_v2" / name
        both = _read(folder / "nonocc.png", cv2.IMREAD_GRAYSCALE) == 255
        truth = np.where(both, _coarse(folder / "groundtruth.png", scale), np.nan)
        yield Scene(name, _read(folder / "imL.png"), _read(folder / "imR.png"), truth, everything)
    for name in ("Art", "Dolls", "Moebius"):
        folder = data / "middlebury_2005" / name
        truth = _seen_by_both(_coarse(folder / "disp1.png", 3), _coarse(folder / "disp5.png", 3))
        yield Scene(name, _read(folder / "view1.png"), _read(folder / "view5.png"), truth, ("clean",))
    folder = data / "middlebury_2014_q" / "Motorcycle"
    with np.load(folder / "motorcycle_disp.npz") as archive:
        truth = _known(archive["arr_0"].astype(np.float32))
    left, right = (_read(folder / f"motorcycle_{side}.png") for side in ("left", "right"))
    yield Scene("Motorcycle", left, right, truth, everything)
    folder = data / "eth3d_two_view_gt" / "playground"
    truth = _known(_read(folder / "disp0.pfm", cv2.IMREAD_UNCHANGED).astype(np.float32))
    yield Scene("playground", _read(folder / "im0.png"), _read(folder / "im1.png"), truth, everything)
    folder = data / "opencv_aloe"
    truth = _coarse(folder / "aloeGT.png", 1)
    yield Scene("Aloe", _read(folder / "aloeL.jpg"), _read(folder / "aloeR.jpg"), truth, ("clean",))


def _read(path: Path, flags: int = cv2.IMREAD_COLOR) -> Image:
    image = cv2.imread(str(path), flags)
    if image is None:
        raise FileNotFoundError(path)
    return image  # type: ignore[return-value]  # of a PFM: float32


def _known(truth: Values) -> Values:
    return np.where(np.isfinite(truth) & (truth > 0), truth, np.float32(np.nan))


def _coarse(path: Path, scale: int) -> Values:
    """Ground truth stored as grey levels, 0 = unknown."""
    return _known(_read(path, cv2.IMREAD_GRAYSCALE).astype(np.float32) / np.float32(scale))


def _seen_by_both(left: Values, right: Values) -> Values:
    """The left ground truth where the right one agrees within a pixel."""
    rows, columns = np.indices(left.shape)
    there = np.rint(columns - np.nan_to_num(left, nan=-1)).astype(int)
    inside = (there >= 0) & (there < left.shape[1])
    other = right[rows, np.where(inside, there, 0)]
    return np.where(inside & (np.abs(left - other) <= 1), left, np.float32(np.nan))
