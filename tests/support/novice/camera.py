"""The camera `novice:FOLDER?side=left&seed=3[&fps=15][&phase=0.5][&board=charuco][&steered=0]`: what one of two webcams sees of a board that somebody holds.

It is another package's camera: registered as an entry point of `tandemscan.cameras` (see `registered`). Frame k is exposed around
(k + phase) / fps of CLOCK_MONOTONIC and painted, by a thread of its own, as soon as that is over. FOLDER holds the plan of the hands; both
cameras read it for every frame. A frame whose successor is due already is skipped and counted.
"""

import json
import os
import threading
import time
from collections import deque
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from common import now
from common.camera.base import CameraHealth, Grab, Mode, Offers, Skipped
from common.camera.factory import CameraRequest
from common.errors import SettingsError, UnavailableError
from common.frame import Frame, PixelFormat
from common.protocol.message import CameraDescription, Pacing, Steering
from common.stamp import Stamp
from phone_host.geometry.se3 import SE3
from phone_host.model import Image, Side
from tests.support.novice.hands import Plan, motion, read_plan
from tests.support.novice.painter import Moment, Painter
from tests.support.novice.scene import board_of, novice_scene

PLAN: Final = "plan.npy"
_FAR_FUTURE: Final = 2**63 - 1
_KEPT: Final = 4
"""Frames that wait for a reader: as many as a driver has buffers."""

_PATIENCE_S: Final = 0.005
_REST_NS, _RESTART_SIGMA_NS = 400_000_000, 1.5e6
"""A webcam that is restarted sends nothing for so long, and misses the moment by so much."""

_REPORT_EVERY: Final = 75


class NoviceCamera:
    """One of the two cameras.

    Args:
        request: path: the folder of the plan; options: side, seed, fps, phase, board, steered.

    Raises:
        SettingsError: an option is missing or unusable.
        UnavailableError: nobody holds the board: there is no plan.
    """

    def __init__(self, request: CameraRequest) -> None:
        options = dict(request.options)
        try:
            self._side, seed = Side(options["side"]), int(options["seed"])
            fps, phase = float(options.get("fps", "15")), options.get("phase")
            board, is_steered = board_of(options.get("board", "chessboard")), options.get("steered", "1") == "1"
        except (KeyError, ValueError) as error:
            raise SettingsError(f"camera {request.uri!r}: {error}", "give novice:FOLDER?side=left&seed=3") from None
        self._folder, self._clock = Path(request.path), request.clock
        if not (self._folder / PLAN).exists():
            raise UnavailableError(f"{self._folder / PLAN} does not exist", "let somebody hold the board first")
        scene = novice_scene(seed)
        self._scene, self._eye = scene, scene.eye(self._side)
        self._to_camera = (
            SE3.identity() if self._side is Side.LEFT else SE3(scene.rig.R_right_left, scene.rig.t_right_left_m)
        )
        self._phase = self._eye.phase if phase is None else float(phase)
        self._period_ns = round(1e9 / fps)
        self._painter = Painter(self._eye, board, seed)
        self._middle_m = board.points_m().mean(axis=0)
        self._plan: tuple[int, Plan] = (-1, Plan(()))
        self._ready: deque[Grab] = deque()
        self._lock = threading.Lock()
        self._sequence, self._skipped, self._times_ms = 0, 0, list[float]()
        self.pollable: int | None = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.description = CameraDescription(
            name=f"novice {self._side.value}",
            width_px=self._eye.model.width_px,
            height_px=self._eye.model.height_px,
            pixel_format=PixelFormat.MJPEG,
            period_ns=self._period_ns,
            pacing=Pacing.CLOCK,
            steering=Steering.RESTART if is_steered else Steering.NONE,
        )
        self.offers = Offers()
        self._restarts, self._rests_until_ns = np.random.default_rng([17, seed, self._eye.model.width_px]), 0
        self._watched, self._closed = threading.Event(), threading.Event()
        self._watched.set()
        self._thread = threading.Thread(target=self._run, name="novice-camera", daemon=True)
        self._thread.start()

    @property
    def health(self) -> CameraHealth:
        """How many frames were skipped."""
        return CameraHealth(missed=self._skipped, period_ns=self._period_ns)

    def due_ns(self, now_ns: int) -> int:
        """Only `pollable` counts."""
        del now_ns
        return _FAR_FUTURE

    def read(self, now_ns: int) -> list[Grab]:
        """Return what was painted since the last call."""
        del now_ns
        assert self.pollable is not None
        with self._lock:
            try:
                os.eventfd_read(self.pollable)
            except BlockingIOError:
                return []
            grabs = list(self._ready)
            self._ready.clear()
        return grabs

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Ignore the call."""

    def anchor(self, exposed_ns: int, index: int) -> None:
        """Ignore the call."""

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Rest, and begin again later within the period, as exactly as webcams do."""
        off_ns = self._restarts.normal(0, _RESTART_SIGMA_NS)
        self._phase += (later_ns + off_ns) / self._period_ns
        self._rests_until_ns = now_ns + _REST_NS

    def pause(self) -> None:
        """Paint no more."""
        self._watched.clear()

    def resume(self, now_ns: int) -> None:
        """Paint again."""
        del now_ns
        self._watched.set()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._watched.set()
        self._thread.join()
        if self.pollable is not None:
            os.close(self.pollable)
            self.pollable = None
        self._report()

    def painted(self, exposed_s: float) -> Image:
        """Paint what is exposed around a moment.

        Args:
            exposed_s: the middle of the exposure, CLOCK_MONOTONIC, s.
        """
        plan, half_s = self._newest_plan(), self._eye.exposure_s / 2
        count = self._painter.moments_for(self._pose(plan, exposed_s - half_s), self._pose(plan, exposed_s + half_s))
        shares = (np.arange(count) + 0.5) / count * 2 - 1
        grip = plan.grip(exposed_s)
        return self._painter.paint(
            tuple(Moment(self._pose(plan, exposed_s + half_s * float(share)), grip) for share in shares)
        )

    def _pose(self, plan: Plan, at_s: float) -> SE3:
        return self._to_camera @ motion(plan.at(at_s) + self._scene.unrest.at(at_s), self._middle_m)

    def _newest_plan(self) -> Plan:
        path = self._folder / PLAN
        version = path.stat().st_mtime_ns
        if version != self._plan[0]:
            self._plan = (version, read_plan(path))
        return self._plan[1]

    def _run(self) -> None:
        cv2.setNumThreads(1)
        half_ns = round(self._eye.exposure_s * 5e8)
        index = self._index_at(now.monotonic_ns())
        while not self._closed.is_set():
            if not self._watched.is_set():
                self._watched.wait()
                index = self._index_at(now.monotonic_ns())
            if (rest_ns := self._rests_until_ns - now.monotonic_ns()) > 0:
                time.sleep(rest_ns / 1e9)
                index = self._index_at(now.monotonic_ns())
            index += 1
            exposed_ns = self._time_of(index)
            self._sleep_until(exposed_ns + half_ns)
            while len(self._ready) >= _KEPT and not self._closed.is_set():
                time.sleep(_PATIENCE_S)
            if (newest := self._index_at(now.monotonic_ns() - half_ns)) > index:
                self._skipped += newest - index
                self._put(Skipped(self._sequence, newest - index), newest - index)
                index, exposed_ns = newest, self._time_of(newest)
            started = time.perf_counter()
            payload = cv2.imencode(
                ".jpg", self.painted(exposed_ns / 1e9), [cv2.IMWRITE_JPEG_QUALITY, self._eye.quality]
            )[1].tobytes()
            self._times_ms.append(1e3 * (time.perf_counter() - started))
            self._put(self._frame(exposed_ns, payload), 1)
            if len(self._times_ms) % _REPORT_EVERY == 0:
                self._report()

    def _frame(self, exposed_ns: int, payload: bytes) -> Frame:
        return Frame(
            sequence=self._sequence,
            exposed=Stamp(exposed_ns, self._clock),
            grabbed=Stamp(now.monotonic_ns(), self._clock),
            width_px=self._eye.model.width_px,
            height_px=self._eye.model.height_px,
            pixel_format=PixelFormat.MJPEG,
            exposure_ns=round(self._eye.exposure_s * 1e9),
            payload=payload,
        )

    def _put(self, grab: Grab, count: int) -> None:
        with self._lock:
            self._ready.append(grab)
            self._sequence += count
            if self.pollable is not None:
                os.eventfd_write(self.pollable, 1)

    def _sleep_until(self, when_ns: int) -> None:
        while (left_ns := when_ns - now.monotonic_ns()) > 0 and not self._closed.is_set():
            time.sleep(min(left_ns / 1e9, 0.1))

    def _time_of(self, index: int) -> int:
        return round((index + self._phase) * self._period_ns)

    def _index_at(self, now_ns: int) -> int:
        return int((now_ns - round(self._phase * self._period_ns)) // self._period_ns)

    def _report(self) -> None:
        if self._times_ms:
            values = {
                "painted": len(self._times_ms),
                "skipped": self._skipped,
                "paint_ms": round(float(np.median(self._times_ms)), 1),
            }
            (self._folder / f"{self._side.value}.json").write_text(json.dumps(values))


def open_camera(request: CameraRequest) -> NoviceCamera:
    """Open one of the two cameras: what the entry point names."""
    return NoviceCamera(request)


def registered(folder: Path) -> dict[str, str]:
    """Install the camera for child processes.

    Args:
        folder: for the distribution's metadata; it must not be that of another test.

    Returns:
        The environment variables of a process that knows the scheme `novice`.
    """
    metadata = folder / "novice_camera-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: novice_camera\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(
        "[tandemscan.cameras]\nnovice = tests.support.novice.camera:open_camera\n"
    )
    checkout = Path(__file__).parents[3]
    return {"PYTHONPATH": os.pathsep.join([str(folder), str(checkout)])}
