"""Correct pairs from $SCAN_DATA for bench_trust, rectified and through rigs, and the mistakes that people make with them."""

import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from phone_host.diagnostics.codes import Code
from phone_host.model import CameraModel, Rig
from phone_host.output.rig_yaml import read_rig
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import disparities_for_near
from tests.bench.depth_scenes import Image

Pair = tuple[Image, Image]

_NEAREST_BASELINES: Final = 2
"""Some of the given chessboards were held so near."""


@dataclass(frozen=True, slots=True, eq=False)
class GivenPair:
    """A pair that is as it should be.

    Attributes:
        name: folder and image.
        left: as its camera gave it.
        right: the same.
        disparities: how far to search, px; 0 with a rig.
        rig: of unrectified images.
    """

    name: str
    left: Image
    right: Image
    disparities: int = 0
    rig: Rig | None = None

    def core(self) -> StereoCore:
        """The core that a user would run."""
        return _rig_core(self.rig) if self.rig is not None else _flat_core(self.disparities)


@lru_cache(maxsize=64)
def _flat_core(disparities: int) -> StereoCore:
    return StereoCore(MatchSettings(MatcherName.SGBM, disparities))


@lru_cache(maxsize=16)
def _rig_core(rig: Rig) -> StereoCore:
    rectifier = Rectifier(rig)
    count = disparities_for_near(
        rectifier.geometry, rectifier.geometry.baseline_m * _NEAREST_BASELINES, rectifier.rectification.width_px
    )
    return StereoCore(MatchSettings(MatcherName.SGBM, count), rectifier)


def given_pairs(data: Path) -> Iterator[GivenPair]:
    """Read all pairs."""
    for name, count in (("tsukuba", 16), ("cones", 64)):
        folder = data / "middlebury_v2" / name
        yield GivenPair(name, _read(folder / "imL.png"), _read(folder / "imR.png"), count)
    for name in ("Art", "Dolls", "Moebius"):
        folder = data / "middlebury_2005" / name
        yield GivenPair(name, _read(folder / "view1.png"), _read(folder / "view5.png"), 80)
    folder = data / "middlebury_2014_q" / "Motorcycle"
    yield GivenPair("Motorcycle", _read(folder / "motorcycle_left.png"), _read(folder / "motorcycle_right.png"), 64)
    folder = data / "middlebury_v3_trainingQ_images"
    for name in ("ArtL", "MotorcycleE", "PianoL", "Pipes", "Playtable"):
        left, right = (_read(folder / f"image_{n}" / f"{name}.png") for n in (0, 1))
        yield GivenPair(f"v3 {name}", left, right, 96)
    folder = data / "eth3d_two_view_gt" / "playground"
    yield GivenPair("playground", _read(folder / "im0.png"), _read(folder / "im1.png"), 32)
    left, right = (_read(data / "opencv_aloe" / f"aloe{side}.jpg") for side in "LR")
    yield GivenPair("Aloe", left, right, 224)
    folder = data / "kitti_odometry_clips" / "KITTI_sequence_1"
    for file in sorted((folder / "image_l").iterdir()):
        yield GivenPair(f"kitti {file.stem}", _read(file), _read(folder / "image_r" / file.name), 96)
    yield from _through_rigs(data)


def _through_rigs(data: Path) -> Iterator[GivenPair]:
    folder = data / "euroc_v101_static" / "mav0"
    rig = _euroc_rig(folder)
    for left in sorted((folder / "cam0" / "data").iterdir()):
        yield GivenPair(f"euroc {left.stem[-10:]}", _read(left), _read(folder / "cam1" / "data" / left.name), rig=rig)
    folder = data / "stereopi_rig"
    rig = _calibrated(folder / "pairs" / "left_*.png", folder / "pairs" / "right_*.png", "9x6")
    for name in ("scene_640x240_1", "photo"):
        both = _read(folder / "scenes" / f"{name}.png")
        yield GivenPair(f"stereopi {name}", both[:, :320].copy(), both[:, 320:].copy(), rig=rig)
    folder = data / "simplestereo_rig1"
    rig = _calibrated(folder / "calib" / "*_L.png", folder / "calib" / "*_R.png", "7x6")
    yield GivenPair("simplestereo", _read(folder / "left.png"), _read(folder / "right.png"), rig=rig)
    for left in sorted((folder / "calib").glob("*_L.png")):
        right = left.with_name(left.name.replace("_L", "_R"))
        yield GivenPair(f"simplestereo board {left.stem}", _read(left), _read(right), rig=rig)
    folder = data / "opencv_stereo_calib"
    rig = _calibrated(folder / "left*.jpg", folder / "right*.jpg", "9x6")
    for left in sorted(folder.glob("left*.jpg")):
        right = left.with_name(left.name.replace("left", "right"))
        yield GivenPair(f"opencv board {left.stem}", _read(left), _read(right), rig=rig)
    folder = data / "sourishg_rig" / "calib_imgs" / "1"
    rig = _calibrated(folder / "left*.jpg", folder / "right*.jpg", "9x6")
    for left in sorted(folder.glob("left*.jpg"))[::3]:
        right = left.with_name(left.name.replace("left", "right"))
        yield GivenPair(f"sourishg board {left.stem}", _read(left), _read(right), rig=rig)


def _calibrated(left: Path, right: Path, board: str) -> Rig:
    """Calibrate with the product, as its user would."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "rig.yaml"
        command = [sys.executable, "-m", "phone_host.cli", "calibrate", str(left), str(right), "--board", board]
        done = subprocess.run(
            [*command, "--square", "25mm", "--out", str(out)], capture_output=True, text=True, check=False
        )
        if not out.exists():
            raise FileNotFoundError(done.stderr)
        return read_rig(out)


def _euroc_rig(folder: Path) -> Rig:
    models, poses = [], []
    for camera in ("cam0", "cam1"):
        text = (folder / camera / "sensor.yaml").read_text()
        pose, focal, lens = (
            [float(part) for part in re.search(rf"{key}:\s*\[([^\]]*)\]", text, re.DOTALL).group(1).split(",")]  # type: ignore[union-attr]
            for key in ("data", "intrinsics", "distortion_coefficients")
        )
        fx, fy, cx, cy = focal
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        models.append(CameraModel(width_px=752, height_px=480, matrix=matrix, distortion=np.array(lens)))
        poses.append(np.array(pose).reshape(4, 4))
    between = np.linalg.inv(poses[1]) @ poses[0]
    return Rig(left=models[0], right=models[1], R_right_left=between[:3, :3], t_right_left_m=between[:3, 3])


def _read(path: Path) -> Image:
    image = cv2.imread(str(path))
    if image is None:
        raise FileNotFoundError(path)
    return np.asarray(image, np.uint8)


def _random(image: Image) -> np.random.Generator:
    return np.random.default_rng(int(image[::7, ::7].sum()) & 0xFFFFFFFF)


def noisy(image: Image, sigma: float) -> Image:
    """Add a sensor's noise."""
    noise = _random(image).normal(0, sigma, image.shape)
    return np.asarray(np.clip(image + noise, 0, 255), np.uint8)


def jpeg(image: Image, quality: int) -> Image:
    """Compress and decode again."""
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert done
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)


def glow(image: Image) -> Image:
    """What a finger on the lens leaves: a soft reddish light without structure."""
    height, width = image.shape[:2]
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    light = np.clip(70 - 30 * x + 20 * y, 0, 255)
    return noisy(np.asarray(np.dstack([light * 0.5, light * 0.6, light]), np.uint8), 3.0)


def black(image: Image) -> Image:
    """What a lens cap leaves: noise about the black level."""
    noise = _random(image).normal(3.0, 3.0, image.shape)  # seeded by what the camera would have seen: no two are alike
    return np.asarray(np.clip(noise, 0, 255), np.uint8)


def dim(image: Image) -> Image:
    """The image of a camera with far too little light: between a 25th and a tenth of what it was."""
    share = float(_random(image).uniform(0.04, 0.1))
    return noisy(np.asarray(image * share + 2, np.uint8), 1.5)


def blurred(image: Image, sigma_px: float) -> Image:
    """An image out of focus; sigma at 640 px of width, varied by a third."""
    sigma_px *= float(_random(image).uniform(0.75, 1.35)) * image.shape[1] / 640
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), np.uint8)


def turned(image: Image, quarters: int) -> Image:
    """The image turned clockwise, at its old size: what does not fit is cut, what is missing repeats the border."""
    height, width = image.shape[:2]
    turns = {1: cv2.ROTATE_90_CLOCKWISE, 2: cv2.ROTATE_180, 3: cv2.ROTATE_90_COUNTERCLOCKWISE}
    done = np.asarray(cv2.rotate(image, turns[quarters]), np.uint8)
    aside, down = max(0, width - done.shape[1]), max(0, height - done.shape[0])
    half = aside // 2, down // 2
    done = np.asarray(
        cv2.copyMakeBorder(done, half[1], down - half[1], half[0], aside - half[0], cv2.BORDER_REPLICATE), np.uint8
    )
    x, y = (done.shape[1] - width) // 2, (done.shape[0] - height) // 2
    return done[y : y + height, x : x + width].copy()


def _both(change: Callable[[Image], Image]) -> Callable[[Image, Image], Pair]:
    return lambda left, right: (change(left), change(right))


def _flip(image: Image, axis: int) -> Image:
    return np.asarray(cv2.flip(image, axis), np.uint8)


def rolled(image: Image, angle_deg: float, zoom: float) -> Image:
    """The image of a camera that was turned about its axis or zoomed after the calibration."""
    height, width = image.shape[:2]
    move = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), angle_deg, zoom)
    flags, border = cv2.INTER_CUBIC, cv2.BORDER_REPLICATE
    return np.asarray(cv2.warpAffine(image, move, (width, height), flags=flags, borderMode=border), np.uint8)


def pattern(image: Image, shift_px: int) -> Image:
    """What a camera sees of a wall of regular checks, of a size that depends on the image's: a period of 2 squares."""
    height, width = image.shape[:2]
    square = max(3, width // 100)
    y, x = np.mgrid[:height, :width]
    checks = ((x + shift_px) // square + y // square) % 2 * 180 + 30
    return noisy(np.asarray(np.dstack([checks] * 3), np.uint8), 3.0)


_EXCHANGED: Final = frozenset({Code.SWAPPED})
_TURNED: Final = frozenset({Code.TURNED})
_QUARTER: Final = frozenset({Code.TURNED_BY_QUARTER})
_MIRRORED: Final = frozenset({Code.MIRRORED})
_SAME: Final = frozenset({Code.SAME_IMAGE})
_COVERED: Final = frozenset({Code.COVERED})
_DARK: Final = frozenset({Code.DARK})
_ROWS: Final = frozenset({Code.VERTICAL_ERROR})
_REPEATED: Final = frozenset({Code.AMBIGUOUS})
_UNFOCUSED: Final = frozenset({Code.UNFOCUSED})

PATTERN: Final = "repeated pattern"

MISTAKES: Final[dict[str, tuple[frozenset[Code], Callable[[Image, Image], Pair]]]] = {
    "swapped": (_EXCHANGED, lambda left, right: (right, left)),
    "both on their heads": (_EXCHANGED | _TURNED, _both(lambda image: turned(image, 2))),
    "both mirrored": (_EXCHANGED | _MIRRORED, _both(lambda image: _flip(image, 1))),
    "right on its head": (_TURNED, lambda left, right: (left, turned(right, 2))),
    "left on its head": (_TURNED, lambda left, right: (turned(left, 2), right)),
    "right turned by a quarter": (_QUARTER, lambda left, right: (left, turned(right, 1))),
    "left turned by three quarters": (_QUARTER, lambda left, right: (turned(left, 3), right)),
    "both turned by a quarter": (_QUARTER, _both(lambda image: turned(image, 1))),
    "right mirrored": (_MIRRORED, lambda left, right: (left, _flip(right, 1))),
    "left mirrored": (_MIRRORED, lambda left, right: (_flip(left, 1), right)),
    "right mirrored top to bottom": (_MIRRORED, lambda left, right: (left, _flip(right, 0))),
    "same image": (_SAME, lambda left, _: (left, left)),
    "same image, noise and JPEG": (_SAME, lambda left, _: (noisy(left, 4), jpeg(noisy(_dimmer(left), 5), 60))),
    "right covered, black": (_COVERED, lambda left, right: (left, black(right))),
    "left covered, glow": (_COVERED, lambda left, right: (glow(left), right)),
    "both covered": (_COVERED, lambda left, right: (black(left), black(_flip(right, 0)))),
    "right dark": (_DARK, lambda left, right: (left, dim(right))),
    "both dark": (_DARK, _both(dim)),
    "right unfocused": (_UNFOCUSED, lambda left, right: (left, blurred(right, 5.0))),
    "left unfocused": (_UNFOCUSED, lambda left, right: (blurred(left, 7.0), right)),
    "right rolled by a degree": (_ROWS, lambda left, right: (left, rolled(right, 1.0, 1.0))),
    "right zoomed by 2 %": (_ROWS, lambda left, right: (left, rolled(right, 0.0, 1.02))),
    PATTERN: (_REPEATED, lambda left, right: (pattern(left, 0), pattern(right, left.shape[1] // 30))),
    "both unfocused": (_UNFOCUSED, _both(lambda image: blurred(image, 6.0))),
}
"""Each mistake with its right names. Without a rig, both cameras on their heads and both images mirrored look like exchanged images. The sentence says so."""


def _dimmer(image: Image) -> Image:
    return np.asarray(image * 0.85, np.uint8)


OTHER_SCENE: Final = "another scene"
SHORT_SEARCH: Final = "search too short"

_QUARTER_OF_SEARCH: Final = 4
"""In most scenes a quarter of the search that they need leaves most features out."""


def short_core(pair: GivenPair) -> StereoCore:
    """The core of a user who searches a quarter of what the scene needs, at least as far as any matcher does."""
    return _flat_core(max(4, pair.disparities // _QUARTER_OF_SEARCH))


def other_scene(left: Image, right: Image) -> Pair:
    """Pair the left image with another scene's right one, at the size that is wanted.

    Args:
        left: stays.
        right: of another scene, scaled to the left one's size.
    """
    size = (left.shape[1], left.shape[0])
    return left, np.asarray(cv2.resize(right, size, interpolation=cv2.INTER_AREA), np.uint8)
