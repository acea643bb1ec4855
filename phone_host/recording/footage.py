"""Frames of both cameras with their stamps, kept for a while: from a board and the own camera, or from folders kept by an earlier run.

In a folder a frame's name is its stamp: `board/<ns>.jpg` and `host/<ns>.jpg`, ns on the host's clock.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common import now
from common.camera.base import Camera
from common.camera.imagefile import SUFFIXES, load
from common.errors import DataError, UnavailableError
from common.frame import Frame, PixelFormat
from common.link.base import Link
from common.protocol.message import FrameMessage, Pacing
from phone_host.calibration.timing.shots import Shot
from phone_host.model import BoardFrame
from phone_host.output.atomic import write_bytes
from phone_host.output.listed import ListedFolder
from phone_host.stereo.raw_images import EncodedImage
from phone_host.stream.own_camera import Source
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.receiver import Receiver
from phone_host.stream.reception import refusal_text
from phone_host.sync.fifo import FifoSettings

_STEP_S: Final = 0.05
_ENOUGH_BYTES: Final = 400 * 1024 * 1024
"""Half a minute of raw 640x480 images of both cameras; the memory of a phone."""

_SLOTS: Final = 4


@dataclass(frozen=True, slots=True)
class Footage:
    """What both cameras took.

    Attributes:
        board: frames of the board's camera, in order.
        host: frames of the host's camera, in order.
    """

    board: tuple[Shot, ...]
    host: tuple[Shot, ...]


class _Keeper(PairQueue):
    """Keeps every frame instead of pairing it."""

    def __init__(self) -> None:
        super().__init__(FifoSettings(), None, 1)
        self.board: list[Shot] = []
        self.host: list[Shot] = []
        self.kept_bytes = 0

    def free_slots(self) -> int:
        """There is always room."""
        return _SLOTS

    def add_board(self, frame: BoardFrame) -> int:
        """Keep a frame of the board."""
        self._keep(self.board, frame.marks.exposed_ns, frame.message, "board")
        return frame.marks.exposed_ns

    def add_host(self, frame: Frame) -> None:
        """Keep a frame of the own camera, once the board's have begun."""
        if self.board:
            self._keep(self.host, frame.exposed.ns, frame, "host")

    def _keep(self, shots: list[Shot], exposed_ns: int, frame: Frame | FrameMessage, whose: str) -> None:
        name = f"{whose} frame {frame.sequence}"
        image = EncodedImage(bytes(frame.payload), frame.pixel_format, frame.width_px, frame.height_px, name)
        if self.kept_bytes < _ENOUGH_BYTES and (not shots or exposed_ns > shots[-1].exposed_ns):
            shots.append(Shot(exposed_ns, image))
            self.kept_bytes += len(image.payload)


class _Unmoved:
    """A listener to whom nothing of the board matters."""

    def session_began(self) -> None:
        """See BoardListener."""

    def frame_arrived(self, exposed_ns: int, index: int | None) -> None:
        """See BoardListener."""


def film(
    links: Sequence[Link],
    camera: Camera,
    seconds: float,
    wait_ns: int | None,
    *,
    stop: Callable[[], bool],
    advance: Callable[[float], None],
) -> Footage:
    """Keep what both cameras take.

    Args:
        links: open links to the board; closed by this.
        camera: the own camera, open; closed by this.
        seconds: how long, from the board's first frame on.
        wait_ns: an absent board is waited for this long; None for ever.
        stop: ends it earlier.
        advance: told the share that is done, 0 to 1.

    Raises:
        UnavailableError: no board, or it does not talk to this host.
        DataError: a camera shows images on demand and so has no stamps.
    """
    keeper = _Keeper()
    source = Source(camera, keeper.add_host)
    if source.on_demand:
        camera.close()
        for link in links:
            link.close()
        raise DataError("a camera with pace=demand has no time of its own", "use pace=clock")
    receiver = Receiver(links, now.random_id(), keeper, _Unmoved())
    receiver.start()
    source.start()
    waiting = threading.Event()
    began_ns = now.monotonic_ns()
    try:
        while not stop():
            now_ns = now.monotonic_ns()
            for failure in (receiver.failure, source.failure):
                if failure is not None:
                    raise failure
            if receiver.hello is not None and receiver.hello.camera.pacing is Pacing.DEMAND:
                raise DataError("the board's camera has pace=demand and so no time of its own", "use pace=clock")
            if keeper.board:
                done = (now_ns - keeper.board[0].exposed_ns) / 1e9 / seconds
                advance(min(1.0, done))
                if done >= 1.0 or receiver.ended or source.ended or keeper.kept_bytes >= _ENOUGH_BYTES:
                    break
            elif wait_ns is not None and now_ns - began_ns > wait_ns:
                if receiver.refused is not None:
                    raise UnavailableError(*refusal_text(receiver.refused))
                raise UnavailableError(f"no board within {wait_ns / 1e9:g} s", "start board-agent there, check --link")
            waiting.wait(_STEP_S)
    finally:
        source.stop()
        receiver.stop()
    return Footage(tuple(keeper.board), tuple(keeper.host))


def keep(footage: Footage, folder: Path) -> None:
    """Write frames into the folders `board` and `host`; raw ones are left out, they have no file format.

    Raises:
        OSError: the folder cannot be written to.
        UnavailableError: images that an earlier call did not write are there.
    """
    for side, shots in (("board", footage.board), ("host", footage.host)):
        suffixes = {PixelFormat.MJPEG: ".jpg", PixelFormat.PNG: ".png"}
        named = [(shot, f"{shot.exposed_ns}{suffixes.get(shot.image.pixel_format, '')}") for shot in shots]
        files = {name: shot for shot, name in named if "." in name}
        listed = ListedFolder(folder / side, r"-?[0-9]+\.(jpg|png)")
        listed.add(*files)
        listed.close()
        for name, shot in files.items():
            write_bytes(folder / side / name, bytes(shot.image.payload))


def read(folder: Path) -> Footage:
    """Read what `keep` wrote.

    Raises:
        DataError: a folder is missing or empty, or a name is no stamp.
    """
    sides = []
    for side in ("board", "host"):
        try:
            paths = [path for path in (folder / side).iterdir() if path.suffix.lower() in SUFFIXES]
        except OSError as error:
            raise DataError(
                f"{folder / side} cannot be read ({error.strerror})", "give a folder kept by --keep"
            ) from None
        shots = []
        for path in paths:
            if not path.stem.isdecimal():
                raise DataError(f"{path}: the name is no stamp", "name each image by its exposure in ns")
            image = load(path)
            encoded = EncodedImage(image.payload, image.pixel_format, image.width_px, image.height_px, str(path))
            shots.append(Shot(int(path.stem), encoded))
        sides.append(tuple(sorted(shots, key=lambda shot: shot.exposed_ns)))
    return Footage(*sides)
