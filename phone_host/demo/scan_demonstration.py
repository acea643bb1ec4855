"""The demo of a scan: a rendered thing on the mat, a board-agent process and the host on this machine; the model is compared with the thing."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event
from typing import Final

from common import now
from common.camera.factory import open_camera
from common.diagnostic import Diagnostic, Severity
from common.link.factory import open_link, parse_link
from common.stamp import HOST_CLOCK
from phone_host.demo.scan_truth import ModelErrors, model_errors
from phone_host.model import Side
from phone_host.output.axes import Axes
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.live_scan import LiveScan
from phone_host.run.scan_files import FinishedScan
from phone_host.scan.mat import USUAL_MAT, parse_mat
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scene.film import prepare_folder, write_image
from phone_host.scene.object_scene import JPEG_QUALITY, ObjectScene
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.match_tandem import matching_threads
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import disparities_for_near
from phone_host.subprocesses.board_process import board_process

NEAR_M: Final = 0.25
"""Nearest depth searched: the thing begins 0.35 m before the cameras, and the mat's lower edge at 0.28 m."""

_BOARD_PATIENCE_NS: Final = 10_000_000_000


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
        self.live = LiveScan(wanted, Side.LEFT, out, waits=True, is_timeless=True)
        self._address = f"ipc://{sockets}/board"
        camera = open_camera(f"replay:{pictures.right}", HOST_CLOCK, now.monotonic_ns())
        link = open_link(parse_link(self._address, listens_by_default=False))
        settings = HostSettings(wait_ns=_BOARD_PATIENCE_NS, out=None, save_every=0)
        self._host = Host(settings, camera, [link], core, [self.live.sink])

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
