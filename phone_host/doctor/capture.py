"""Films with a camera and checks what it gives: the shell around `camera_check`."""

import math
import queue
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common import now
from common.camera.base import Camera, software_of
from common.diagnostic import Diagnostic
from common.doctor.finding import ok, warn
from common.errors import DataError, TandemError, UnavailableError
from common.frame import Frame
from common.protocol.message import CameraDescription
from phone_host.doctor.camera_check.check import CaptureCheck, Plan, Progress, Stage
from phone_host.doctor.camera_check.look import Reading, look
from phone_host.doctor.camera_check.words import findings_of
from phone_host.model import CameraModel, Image, Rig, Side
from phone_host.model.capture import CaptureReport, CaptureSource
from phone_host.output.atomic import write_text
from phone_host.output.capture_json import capture_path, capture_text
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.stereo.images import to_grey
from phone_host.stereo.raw_images import EncodedImage, decode_frame
from phone_host.stereo.scaled_rig import fits_rig, scaled_camera
from phone_host.stream.demand_clock import DemandClock, has_own_time
from phone_host.stream.own_camera import OwnCamera

_WAITING: Final = 90
"""Frames that may wait to be decoded: three seconds. Beyond that this machine is too slow, and the newest are dropped."""

_SILENCE_S: Final = 8.0
"""Webcams start within 2 s, servers in the network within 5."""

_TICK_S: Final = 0.2


def source_of(camera: Camera) -> CaptureSource:
    """Return whose images a camera's are."""
    said = camera.description
    width_px, height_px = said.upright_px
    return CaptureSource(camera=said.identity, software=software_of(camera), width_px=width_px, height_px=height_px)


def lens_for(rig: Rig | None, source: CaptureSource) -> CameraModel | None:
    """Return the calibrated lens of the host's camera for a size of images; None: it is not known for that size."""
    if rig is None:
        return None
    side = rig.board_side.other
    own = rig.right if side is Side.RIGHT else rig.left
    size_px = (source.width_px, source.height_px)
    return scaled_camera(own, size_px, side) if fits_rig((own.width_px, own.height_px), size_px) else None


def film_capture(
    camera: Camera, rig: Rig | None, plan: Plan, stopped: Callable[[], bool], tell: Callable[[Progress], None]
) -> CaptureReport:
    """Film, and check on the way.

    Args:
        camera: the open camera; this function closes it.
        rig: the calibration whose lens is used; None: there is none.
        plan: how long it takes.
        stopped: asked often; True ends it early.
        tell: called with each frame.

    Returns:
        What was found, as far as it got.

    Raises:
        UnavailableError: no frame came, or the camera failed.
        DataError: the camera has no time of its own.
    """
    said = camera.description
    if not has_own_time(said.pacing):
        camera.close()
        raise DataError(
            "this camera shows images on demand, so they have no time", "replay:PATH?fps=30 shows them as a film"
        )
    source = source_of(camera)
    asked_hz = 1e9 / said.period_ns if said.period_ns else math.nan
    filming = _Filming(camera, CaptureCheck(source, asked_hz, lens_for(rig, source), plan))
    return filming.run(stopped, tell)


@dataclass(frozen=True, slots=True)
class CheckedCapture:
    """What a check came to.

    Attributes:
        report: the figures.
        findings: the same in words, and where it is kept.
    """

    report: CaptureReport
    findings: list[Diagnostic]


def check_capture(
    camera: Camera,
    calibration: Path | None,
    elsewhere: Path,
    whole_s: float,
    *,
    stopped: Callable[[], bool],
    tell: Callable[[Progress], None],
) -> CheckedCapture:
    """Film, check, and keep the report beside the calibration; without one, in another folder.

    Args:
        camera: the open camera; this function closes it.
        calibration: rig.yaml; None: there is none.
        elsewhere: folder for the report of a check without a calibration; made if need be.
        whole_s: how long it takes, s.
        stopped: asked often; True ends it early, and nothing is kept.
        tell: called with each frame.

    Raises:
        TandemError: the camera failed, or the calibration cannot be read.
    """
    try:
        rig = None if calibration is None else read_own_rig(calibration)
    except TandemError:
        camera.close()
        raise
    plan = Plan(whole_s, min(8.0, whole_s / 6), whole_s * 2 / 3)
    report = film_capture(camera, rig, plan, stopped, tell)
    findings = findings_of(report)
    if not stopped():
        findings.append(_kept(report, capture_path(calibration, elsewhere)))
    return CheckedCapture(report, findings)


def _kept(report: CaptureReport, path: Path) -> Diagnostic:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, capture_text(report))
    except OSError as error:
        problem = f"{path} cannot be written ({error.strerror or error})"
        return warn("capture", problem, "choose a calibration in a folder of your own")
    return ok("capture", f"kept in {path}")


class _Filming:
    """A check of an open camera: frames come in one thread, are looked at in another, and this one lets both work."""

    def __init__(self, camera: Camera, check: CaptureCheck) -> None:
        self._said, self._check = camera.description, check
        self._frames: queue.Queue[tuple[Frame, int]] = queue.Queue(_WAITING)
        self._own = OwnCamera(camera, self._put, DemandClock(self._said.pacing))
        self._looking: list[Future[Reading]] = []

    def run(self, stopped: Callable[[], bool], tell: Callable[[Progress], None]) -> CaptureReport:
        """Film until all is done or somebody stops it."""
        with ThreadPoolExecutor(1, "look") as looks:
            self._own.start()
            try:
                while not stopped() and self._check.progress.stage is not Stage.DONE and self._step(looks):
                    tell(self._check.progress)
            finally:
                self._own.stop()
            while self._looking and not stopped():
                self._take(_TICK_S)
                tell(self._check.progress)
            looks.shutdown(wait=False, cancel_futures=True)
        if self._own.failure is not None:
            raise self._own.failure
        return self._check.report

    def _take(self, patience_s: float) -> None:
        """Take what was seen meanwhile."""
        done, waiting = wait(self._looking, patience_s, FIRST_COMPLETED)
        self._looking = [each for each in self._looking if each in waiting]
        for each in done:
            self._check.take(each.result())

    def _put(self, frame: Frame) -> None:
        if not self._frames.full():
            self._frames.put((frame, now.monotonic_ns()))

    def _step(self, looks: ThreadPoolExecutor) -> bool:
        """Take a frame; tell whether more will come."""
        try:
            frame, arrived_ns = self._frames.get(timeout=_SILENCE_S if not self._own.ended else 0.0)
        except queue.Empty:
            if self._own.ended or self._own.failure is not None:
                return False
            raise UnavailableError(
                f"{self._said.name} gives no image",
                "check whether another program uses it, and whether it is awake and in front",
            ) from None
        if (luma := _luma(frame, self._said)) is not None:
            arrived_ns = max(arrived_ns, frame.grabbed.ns)
            window = self._check.add(luma, frame.exposed.ns, arrived_ns, frame.exposure_ns)
            if window is not None:
                self._looking.append(looks.submit(look, window))
        self._take(0.0)
        return True


def _luma(frame: Frame, said: CameraDescription) -> Image | None:
    """Decode a frame; None: it is spoiled."""
    image = EncodedImage(
        payload=bytes(frame.payload),
        pixel_format=frame.pixel_format,
        width_px=frame.width_px,
        height_px=frame.height_px,
        name=f"frame {frame.sequence}",
        orientation=said.orientation,
    )
    try:
        return to_grey(decode_frame(image))
    except TandemError:
        return None
