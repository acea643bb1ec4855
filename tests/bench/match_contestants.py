"""What bench_matcher times: our matchers and OpenCV's on one pair, and both chains from two JPEGs to coloured points.

Every contestant is ready before the clock starts: matchers, maps and buffers are made once, as in a live run.
"""

import functools
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel, RectifiedPair, Rig
from phone_host.output.ply import packed_points
from phone_host.scene.scene import demo_scene, matched_rig, rectified_cameras
from phone_host.scene.scene_model import Look
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import decode_files, examine
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import matcher_named
from phone_host.stereo.rectifier import Rectifier
from tests.bench.depth_accuracy import three_way
from tests.bench.depth_rooms import view_of
from tests.bench.depth_scenes import Image

Run = Callable[[], object]

MODES: Final = {
    "3WAY": cv2.StereoSGBM_MODE_SGBM_3WAY,
    "HH4": cv2.StereoSGBM_MODE_HH4,
    "MODE_SGBM": cv2.StereoSGBM_MODE_SGBM,
}
"""OpenCV's semi-global matchers, by the names that the tables use."""

THREADS: Final = 2
_QUALITY: Final = 80


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """One image size and search range, with its pair.

    Attributes:
        width_px: 640 or 1280.
        disparities: N, px.
        left: (H, W, 3), the demo's still life by one webcam.
        right: the same by another.
    """

    width_px: int
    disparities: int
    left: Image
    right: Image

    @property
    def name(self) -> str:
        """As a table tells it."""
        return f"{self.width_px}x{self.left.shape[0]}, {self.disparities} disparities"

    @property
    def grey(self) -> RectifiedPair:
        """The pair in grey."""
        left, right = (
            np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8) for image in (self.left, self.right)
        )
        return RectifiedPair(left, right)


@functools.cache
def setting(width_px: int) -> Setting:
    """Render the pair of one size: 640x480 with 64 disparities, or 1280x720 with 128."""
    scene, view = demo_scene().at(0.0), view_of(width_px)
    images = [
        render(scene, model, pose, Look(noise_sigma=1.5, seed=seed))
        for seed, (model, pose) in enumerate(rectified_cameras(view), 1)
    ]
    return Setting(width_px, width_px // 10, images[0], images[1])


def matches(where: Setting, ours: tuple[str, ...], modes: tuple[str, ...]) -> dict[str, Run]:
    """The whole `match` of our matchers, and one bare pass of OpenCV's modes, on the grey pair.

    Args:
        where: the pair.
        ours: names of our matchers.
        modes: keys of MODES.
    """
    pair = where.grey
    runs: dict[str, Run] = {}
    for name in ours:
        matcher = create_matcher(MatchSettings(matcher_named(name), where.disparities))
        runs[name] = lambda matcher=matcher: matcher.match(pair)  # type: ignore[misc]
    for name in modes:
        engine = three_way(where.disparities, mode=MODES[name])
        runs[name] = lambda engine=engine: engine.compute(pair.left, pair.right)  # type: ignore[misc]
    return runs


def _jpeg(image: Image) -> bytes:
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    assert done
    return bytes(data.tobytes())


def _rig(where: Setting) -> Rig:
    """The two cameras that took the pair."""
    own = matched_rig()
    (left, _), _ = rectified_cameras(view_of(where.width_px))
    # A trace of distortion, so that both chains really rectify.
    model = CameraModel(
        width_px=left.width_px,
        height_px=left.height_px,
        matrix=left.matrix,
        distortion=np.array([1e-4, 0.0, 0.0, 0.0, 0.0]),
    )
    return replace(own, left=model, right=model)


def our_chain(where: Setting, name: str) -> Run:
    """Two JPEGs -> decoded, rectified, matched, reprojected, cut -> coloured vertices as they stand in a PLY file."""
    left, right = _jpeg(where.left), _jpeg(where.right)
    core = StereoCore(MatchSettings(matcher_named(name), where.disparities), Rectifier(_rig(where)))

    def run() -> object:
        done = core.compute(*decode_files(examine(left, "left"), examine(right, "right")), time.perf_counter_ns)
        assert done.cloud is not None
        return packed_points(done.cloud, done.pair.left)

    return run


def sample_chain(where: Setting) -> Run:
    """The same as OpenCV's samples do it (samples/python/stereo_match.py), with 3WAY on the grey images.

    Both JPEGs are decoded and remapped in colour; the disparity becomes points by `reprojectImageTo3D`; a mask chooses
    the points and their colours; `hstack` joins them. Nothing is written.
    """
    left, right = (np.frombuffer(_jpeg(image), np.uint8) for image in (where.left, where.right))
    rectifier = Rectifier(_rig(where))
    made, geometry = rectifier.rectification, rectifier.geometry
    size = (made.width_px, made.height_px)
    rig = rectifier.rig
    eye = np.eye(3)
    matrix = np.array(
        [[geometry.focal_px, 0, geometry.cx_px], [0, geometry.focal_px, geometry.cy_px], [0, 0, 1]], np.float64
    )
    maps = [
        cv2.initUndistortRectifyMap(model.matrix, model.distortion, eye, matrix, size, cv2.CV_16SC2)
        for model in (rig.left, rig.right)
    ]
    # Q of stereoRectify: (x, y, d, 1) -> homogeneous point.
    back = np.array(
        [
            [1, 0, 0, -geometry.cx_px],
            [0, 1, 0, -geometry.cy_px],
            [0, 0, 0, geometry.focal_px],
            [0, 0, 1 / geometry.baseline_m, 0],
        ]
    )
    engine = three_way(where.disparities)

    def run() -> object:
        images = [np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR)) for data in (left, right)]
        straight: list[NDArray[Any]] = [
            np.asarray(cv2.remap(image, *both, cv2.INTER_LINEAR)) for image, both in zip(images, maps, strict=True)
        ]
        greys = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in straight]
        disparity = engine.compute(*greys).astype(np.float32) / np.float32(16)
        points = cv2.reprojectImageTo3D(disparity, back)
        colours = cv2.cvtColor(straight[0], cv2.COLOR_BGR2RGB)
        mask = disparity > disparity.min()
        return np.hstack([points[mask].reshape(-1, 3), colours[mask].reshape(-1, 3)])

    return run


@dataclass(frozen=True, slots=True)
class Times:
    """Medians of one contestant's runs, ms."""

    wall_ms: float
    cpu_ms: float


def interleaved(runs: Mapping[str, Run], count: int) -> dict[str, Times]:
    """Time contestants in turns, so that whatever disturbs the machine meets all of them.

    Args:
        runs: by name.
        count: of runs of each, after two that warm up.

    Returns:
        The medians. CPU time is that of all threads.
    """
    taken: dict[str, list[tuple[int, int]]] = {name: [] for name in runs}
    names = list(runs)
    for number in range(count + 2):
        # Another one begins each time, so that none always runs in the wake of the same one.
        for name in (*names[number % len(names) :], *names[: number % len(names)]):
            began = time.perf_counter_ns(), time.process_time_ns()
            runs[name]()
            ended = time.perf_counter_ns(), time.process_time_ns()
            if number >= 2:
                taken[name].append((ended[0] - began[0], ended[1] - began[1]))
    return {
        name: Times(*(float(np.median([pair[which] for pair in pairs])) / 1e6 for which in (0, 1)))
        for name, pairs in taken.items()
    }
