"""The demo of a scan: a rendered thing on the mat, a board-agent process and the host on this machine; the model is compared with the thing."""

import itertools
import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic, Severity
from phone_host.demo.demonstration import open_demo
from phone_host.jobs.scan import prepare_scan
from phone_host.model import Side
from phone_host.output.axes import Axes
from phone_host.run.host_settings import EndReason
from phone_host.run.scan_job import FinishedScan
from phone_host.scan.mat import USUAL_MAT, parse_mat
from phone_host.scan.mesh import Mesh
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scene.film import prepare_folder, write_image
from phone_host.scene.object_scene import JPEG_QUALITY, ObjectScene
from phone_host.scene.solid import Solid
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.match_tandem import matching_threads
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import disparities_for_near
from phone_host.subprocesses.board_process import board_process

_COVERED_M: Final = 0.002
"""True surface with a point of the model so near is covered: somewhat more than the distance of the model's points."""

_SPACING_M: Final = 0.001
_STANDS_M: Final = 0.0005
"""What lies lower than this stands on the mat, and no camera sees it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelErrors:
    """A model against the truth; NaN: there is no model.

    Attributes:
        points: of the model, where some view saw the surface; only these are compared.
        mean_mm: mean distance of its points from the true surface.
        median_mm: their median distance.
        p95_mm: the 95th percentile.
        coverage: share of the true surface, but for what it stands on, with the model within 2 mm.
        volume_percent: how much larger the model's volume is; negative: smaller; NaN: the model is open.
    """

    points: int
    mean_mm: float = math.nan
    median_mm: float = math.nan
    p95_mm: float = math.nan
    coverage: float
    volume_percent: float = math.nan

    @property
    def sentence(self) -> str:
        """In words."""
        volume = "" if math.isnan(self.volume_percent) else f"; its volume is off by {self.volume_percent:+.1f} %"
        return (
            f"against the true surface: {self.mean_mm:.2f} mm off on average, 95 % of it within {self.p95_mm:.2f} mm,"
            f" {self.coverage * 100:.0f} % of what does not stand on the mat is there{volume}"
        )


def model_errors(model: ScanModel, solid: Solid) -> ModelErrors:
    """Compare a model with the truth.

    Args:
        model: in the axes of the solid.
        solid: the truth.
    """
    used = np.unique(model.mesh.triangles)
    points = model.mesh.points_m[used[model.seen[used]]].astype(np.float64)
    if not len(points):
        return ModelErrors(points=0, coverage=0.0)
    volume_m3 = _volume_m3(model.mesh) if model.is_closed else math.nan
    off_mm = np.abs(solid.signed_distance(points)) * 1000.0
    truth = solid.surface(_SPACING_M)
    truth = truth.where(truth.points[2] > _STANDS_M)
    covered = _near(truth.points.T, points)
    return ModelErrors(
        points=len(points),
        mean_mm=float(off_mm.mean()),
        median_mm=float(np.median(off_mm)),
        p95_mm=float(np.percentile(off_mm, 95)),
        coverage=float(truth.areas_m2[covered].sum() / truth.areas_m2.sum()),
        volume_percent=100.0 * (volume_m3 / solid.volume_m3(_SPACING_M) - 1.0),
    )


def _volume_m3(mesh: Mesh) -> float:
    """Return the volume of a closed mesh: the sum of the tetrahedra between its triangles and the origin."""
    a, b, c = (mesh.points_m[mesh.triangles[:, corner]].astype(np.float64) for corner in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def _near(points: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points (N, 3) have one of the others (M, 3) within the distance that counts as covered.

    All are put into cells as wide as that distance, so only the cells beside a point's own can hold what is near.
    """
    low = np.minimum(points.min(axis=0), others.min(axis=0)) - 2 * _COVERED_M
    cells = np.floor((others - low) / _COVERED_M).astype(np.int64)
    own = np.floor((points - low) / _COVERED_M).astype(np.int64)
    size = np.maximum(cells.max(axis=0), own.max(axis=0)) + 2
    factors = np.array([size[1] * size[2], size[2], 1])
    keys = cells @ factors
    order = np.argsort(keys, kind="stable")
    keys, others = keys[order], others[order]
    near = np.zeros(len(points), dtype=np.bool_)
    for step in itertools.product((-1, 0, 1), repeat=3):
        wanted = (own + step) @ factors
        first, end = np.searchsorted(keys, wanted), np.searchsorted(keys, wanted, side="right")
        for shift in range(int((end - first).max(initial=0))):
            left = np.flatnonzero(~near & (first + shift < end))
            apart = points[left] - others[first[left] + shift]
            near[left] |= (apart**2).sum(axis=1) <= _COVERED_M**2
    return near


NEAR_M: Final = 0.25
"""Nearest depth searched: the thing begins 0.35 m before the cameras, and the mat's lower edge at 0.28 m."""


@dataclass(frozen=True, slots=True)
class Pictures:
    """Folders of both cameras' images."""

    left: Path
    right: Path


def render_pictures(
    scene: ObjectScene, folder: Path, advance: Callable[[], None], stop: Callable[[], bool]
) -> Pictures | None:
    """Render all views into two folders of JPEGs, the cameras beside each other in two threads.

    Args:
        scene: the thing and its views.
        folder: receives the folders `left` and `right`.
        advance: called after each image.
        stop: asked before each image; True ends the work.

    Returns:
        The folders; None: it was stopped.

    Raises:
        OSError: a folder cannot be written to.
        UnavailableError: an image that is none of them lies in a folder.
    """
    views = scene.setting.views
    folders = {side: folder / side.value for side in Side}
    for each in folders.values():
        prepare_folder(each, views)
    ended = Event()

    def render_all(side: Side) -> None:
        for number in range(views):
            if ended.is_set() or stop():
                ended.set()
                return
            write_image(folders[side], number, views, scene.image(number, side), JPEG_QUALITY)
            advance()

    with ThreadPoolExecutor(len(folders)) as threads, _set_at_end(ended):
        for camera in [threads.submit(render_all, side) for side in folders]:
            camera.result()
        if ended.is_set():
            return None
    return Pictures(folders[Side.LEFT], folders[Side.RIGHT])


@contextmanager
def _set_at_end(event: Event) -> Iterator[None]:
    """Set an event when a block ends, also by an error: then what else goes on ends, too."""
    try:
        yield
    finally:
        event.set()


class ScanDemo:
    """One scan with both programs.

    Attributes:
        live: takes the pairs.

    Args:
        scene: what the pictures show.
        pictures: of both cameras.
        out: folder for results.
        sockets: folder of this user alone, in which the two programs meet.
        matcher: that computes depth.
    """

    def __init__(self, scene: ObjectScene, pictures: Pictures, out: Path, sockets: Path, matcher: MatcherName) -> None:
        self._scene, self._pictures, self._matcher = scene, pictures, matcher
        rectifier = Rectifier(scene.rig)
        near = disparities_for_near(rectifier.geometry, NEAR_M, rectifier.rectification.width_px)
        core = StereoCore(MatchSettings(matcher, near), rectifier)
        wanted = ScanWanted(mat=parse_mat(USUAL_MAT), threads=matching_threads())
        self._address = f"ipc://{sockets}/board"
        opened = open_demo(f"replay:{pictures.right}", self._address, core, None)
        scan = prepare_scan(opened, opened.found, wanted, Axes.MAT, out, tell=lambda _: None)
        self.live, self._host = scan.live, scan.host

    def run(self, stop: Callable[[], bool], watch: Callable[[], None] | None) -> EndReason:
        """Scan until the last view, or until it is stopped.

        Args:
            stop: asked repeatedly; True ends the run early.
            watch: called several times a second.

        Raises:
            UnavailableError: the board process did not start, or died.
        """
        with board_process(f"replay:{self._pictures.left}", self._address) as board:

            def stopped() -> bool:
                if not self.live.counts[0]:
                    board.check()  # once all is sent, it ends by itself
                return stop()

            return self._host.run(stopped, watch)

    def finished(self) -> tuple[FinishedScan, ModelErrors]:
        """Make the model, and compare it with the thing. The run has ended."""
        scan = self.live.finished(self._host.snapshot(), self._matcher.value, Axes.MAT)
        errors = model_errors(scan.model, self._scene.solid)
        return scan, errors


def with_truth(scan: FinishedScan, errors: ModelErrors) -> FinishedScan:
    """Return a scan whose report tells the comparison."""
    remarks = (Diagnostic(errors.sentence, severity=Severity.NOTE), *scan.report.remarks)
    return replace(scan, report=replace(scan.report, remarks=remarks))
