"""Keeps frames of both cameras with their stamps for a while: from a board and the own camera, from folders of an earlier run, or from a recording.

In a folder a frame's file name is its stamp: `board/<ns>.jpg` and `host/<ns>.jpg`, ns on the host's clock. The files are as the
cameras gave them; `board/orientation` holds the options that make them upright, such as `rotate=180&flip=h`, if there are any.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Final, Protocol
from urllib.parse import parse_qsl

from common import now
from common.camera.base import Camera
from common.camera.imagefile import SUFFIXES, load
from common.errors import DataError, SettingsError
from common.files import read_whole
from common.frame import Frame, PixelFormat, SpoiledImageError
from common.link.base import Link
from common.orientation import UPRIGHT, Orientation, orientation_of
from common.protocol.message import CameraDescription, FrameMessage
from common.recording.opened import open_recorded
from common.recording.recorded import Recorded
from phone_host.calibration.time_offset.shots import Shot
from phone_host.model import BoardFrame, Side
from phone_host.output.atomic import write_bytes
from phone_host.output.result_files import replacing_results
from phone_host.recording.both_sides import encoded, topics_of
from phone_host.recording.clock_messages import boot_of
from phone_host.stereo.raw_images import EncodedImage
from phone_host.stream.await_board import BoardPatience, await_board
from phone_host.stream.demand_clock import DemandClock, has_own_time
from phone_host.stream.frame_sink import FrameSink
from phone_host.stream.own_camera import OwnCamera
from phone_host.stream.receiver import Receiver
from phone_host.sync.clock import ClockEstimate

_STEP_S: Final = 0.05


class Taker(FrameSink, Protocol):
    """Takes the frames of both cameras."""

    @property
    def begun_ns(self) -> int | None:
        """When the board's first frame came or was exposed, CLOCK_MONOTONIC; None: none has come."""

    @property
    def is_full(self) -> bool:
        """Whether it takes no more."""

    def add_host(self, frame: Frame) -> None:
        """Take a frame of this machine's camera."""

    def clock(self, estimate: ClockEstimate | None, boot_id: str, at_ns: int) -> None:
        """Take note of what is known of the board's clock, and of which boot it is."""


def take_frames(
    links: Sequence[Link],
    camera: Camera,
    taker: Taker,
    seconds: float,
    wait_ns: int | None,
    *,
    stop: Callable[[], bool],
    advance: Callable[[float], None],
) -> None:
    """Take the frames of both cameras.

    Args:
        links: open links to the board; this function closes them.
        camera: the own camera, open; this function closes it.
        taker: takes the frames.
        seconds: for how long, from the board's first frame on; infinite: until it is stopped.
        wait_ns: how long to wait for an absent board; None means for ever.
        stop: asked repeatedly; True ends it early.
        advance: called with the share that is done, 0 to 1.

    Raises:
        UnavailableError: there is no board, or it does not talk to this host.
        DataError: the board shows images on demand and so has no time stamps.
        SettingsError: the same of the own camera.
    """
    pacing = camera.description.pacing
    if not has_own_time(pacing):
        camera.close()
        for link in links:
            link.close()
        raise SettingsError("--camera has pace=demand, and so no clock", "give it fps= or pace=clock")
    own = OwnCamera(camera, taker.add_host, DemandClock(pacing))
    receiver = Receiver(links, now.random_id(), taker)

    def frames_came() -> bool:
        _check(receiver, own)
        return taker.begun_ns is not None

    receiver.start()
    own.start()
    waiting = Event()
    try:
        has_begun = await_board(receiver, BoardPatience(wait_ns, now.monotonic_ns()), frames_came, stop)
        while has_begun and not stop():
            _check(receiver, own)
            taker.clock(receiver.estimate, boot_of(receiver.hello), now.monotonic_ns())
            done = (now.monotonic_ns() - (taker.begun_ns or 0)) / 1e9 / seconds
            advance(min(1.0, done))
            if done >= 1.0 or receiver.ended or own.ended or taker.is_full:
                break
            waiting.wait(_STEP_S)
    finally:
        own.stop()
        receiver.stop()


def take_alone(
    camera: Camera, taker: Taker, seconds: float, *, stop: Callable[[], bool], advance: Callable[[float], None]
) -> None:
    """Take the frames of the own camera only, while the board records its own.

    Args:
        camera: the own camera, open; this function closes it.
        taker: takes the frames.
        seconds: for how long; infinite: until it is stopped.
        stop: asked repeatedly; True ends it early.
        advance: called with the share that is done, 0 to 1.
    """
    own = OwnCamera(camera, taker.add_host, DemandClock(camera.description.pacing))
    waiting, begun_ns = Event(), now.monotonic_ns()
    own.start()
    try:
        while not (stop() or own.ended or taker.is_full):
            if own.failure is not None:
                raise own.failure
            done = (now.monotonic_ns() - begun_ns) / 1e9 / seconds
            advance(min(1.0, done))
            if done >= 1.0:
                return
            waiting.wait(_STEP_S)
    finally:
        own.stop()


def _check(receiver: Receiver, own: OwnCamera) -> None:
    """Raise a thread's failure, and DataError for a board whose stamps are not times."""
    for failure in (receiver.failure, own.failure):
        if failure is not None:
            raise failure
    hello = receiver.hello
    if hello is not None and not has_own_time(hello.camera.pacing):
        raise DataError("the board's camera has pace=demand and so has no clock", "give it fps= or pace=clock")


_ENOUGH_BYTES: Final = 400 * 1024 * 1024
"""Half a minute of raw 640x480 images of both cameras; limited by a phone's memory."""

_ORIENTATION: Final = "orientation"
_MOST_LETTERS: Final = 100


@dataclass(frozen=True, slots=True)
class Footage:
    """The frames of both cameras.

    Attributes:
        board: frames of the board's camera, in order.
        host: frames of the host's camera, in order.
    """

    board: tuple[Shot, ...]
    host: tuple[Shot, ...]


class _Keeper:
    """Keeps every frame of both cameras: the frame sink for the board's frames, and the receiver of the own camera's.

    Args:
        own: how the own camera's images become upright; a board's frame says that itself.
    """

    def __init__(self, own: Orientation) -> None:
        self._own = own
        self.board: list[Shot] = []
        self.host: list[Shot] = []
        self.kept_bytes = 0

    def begin(self, camera: CameraDescription) -> None:
        """See FrameSink; frames of a later session are appended to those of the one before."""

    def change_period(self, board_period_ns: int) -> None:
        """See FrameSink."""

    def void(self) -> None:
        """See FrameSink."""

    def room(self) -> None:
        """There is always room."""

    def objection(self, frame: BoardFrame) -> None:
        """Every frame is wanted."""

    def tick(self) -> None:
        """See FrameSink."""

    @property
    def begun_ns(self) -> int | None:
        """When the board's first frame was exposed."""
        return self.board[0].exposed_ns if self.board else None

    @property
    def is_full(self) -> bool:
        """Whether memory for more is not allowed."""
        return self.kept_bytes >= _ENOUGH_BYTES

    def clock(self, estimate: ClockEstimate | None, boot_id: str, at_ns: int) -> None:
        """The stamps are all that counts."""

    def add_board(self, frame: BoardFrame) -> None:
        """Keep a frame of the board."""
        self._keep(self.board, frame.marks.exposed_ns, frame.message, "board", frame.orientation)

    def add_host(self, frame: Frame) -> None:
        """Keep a frame of the own camera, once the board's have begun."""
        if self.board:
            self._keep(self.host, frame.exposed.ns, frame, "host", self._own)

    def _keep(
        self,
        shots: list[Shot],
        exposed_ns: int,
        frame: Frame | FrameMessage,
        whose: str,
        orientation: Orientation,
    ) -> None:
        name = f"{whose} frame {frame.sequence}"
        image = EncodedImage(
            payload=bytes(frame.payload),
            pixel_format=frame.pixel_format,
            width_px=frame.width_px,
            height_px=frame.height_px,
            name=name,
            orientation=orientation,
        )
        if self.kept_bytes < _ENOUGH_BYTES and (not shots or exposed_ns > shots[-1].exposed_ns):
            shots.append(Shot(exposed_ns, image))
            self.kept_bytes += len(image.payload)


def film(
    links: Sequence[Link],
    camera: Camera,
    seconds: float,
    wait_ns: int | None,
    *,
    stop: Callable[[], bool],
    advance: Callable[[float], None],
) -> Footage:
    """Keep the frames of both cameras.

    Args:
        links: open links to the board; this function closes them.
        camera: the own camera, open; this function closes it.
        seconds: how long to record, from the board's first frame on.
        wait_ns: how long to wait for an absent board; None means for ever.
        stop: asked repeatedly; True ends the recording early.
        advance: called with the share that is done, 0 to 1.

    Raises:
        UnavailableError: there is no board, or it does not talk to this host.
        DataError: the board shows images on demand and so has no time stamps.
        SettingsError: the same of the own camera.
    """
    keeper = _Keeper(camera.description.orientation)
    take_frames(links, camera, keeper, seconds, wait_ns, stop=stop, advance=advance)
    return Footage(tuple(keeper.board), tuple(keeper.host))


def keep(footage: Footage, folder: Path) -> None:
    """Write frames into the folders `board` and `host`; raw frames are left out, because they have no file format.

    Raises:
        OSError: the folder cannot be written to.
        UnavailableError: the folder holds images that an earlier call did not write.
    """
    with ExitStack() as stack:  # both are whole before one of them replaces what was kept before
        for side, shots in (("board", footage.board), ("host", footage.host)):
            suffixes = {PixelFormat.MJPEG: ".jpg", PixelFormat.PNG: ".png"}
            named = [(shot, f"{shot.exposed_ns}{suffixes.get(shot.image.pixel_format, '')}") for shot in shots]
            files = {name: shot for shot, name in named if "." in name}
            turn = str(shots[0].image.orientation) if shots else ""
            names = [*files, *([_ORIENTATION] if turn else [])]
            place = stack.enter_context(replacing_results(folder / side, rf"-?[0-9]+\.(jpg|png)|{_ORIENTATION}", names))
            if turn:
                write_bytes(place / _ORIENTATION, turn.encode())
            for name, shot in files.items():
                write_bytes(place / name, bytes(shot.image.payload))


def read(folder: Path) -> Footage:
    """Read what `keep` wrote.

    Raises:
        DataError: a folder is missing or empty, or a name is not a stamp.
    """
    sides = []
    for side in ("board", "host"):
        try:
            paths = [path for path in (folder / side).iterdir() if path.suffix.lower() in SUFFIXES]
        except OSError as error:
            raise DataError(
                f"{folder / side} cannot be read ({error.strerror})", "give a folder kept by --keep"
            ) from None
        shots, orientation = [], _orientation(folder / side / _ORIENTATION)
        for path in paths:
            if not path.stem.isdecimal():
                raise DataError(f"{path}: the name is not a time stamp", "name each image by its exposure in ns")
            image = load(path)
            encoded = EncodedImage(
                payload=image.payload,
                pixel_format=image.pixel_format,
                width_px=image.width_px,
                height_px=image.height_px,
                name=str(path),
                orientation=orientation,
            )
            shots.append(Shot(int(path.stem), encoded))
        sides.append(tuple(sorted(shots, key=lambda shot: shot.exposed_ns)))
    return Footage(*sides)


def read_recording(file: Path) -> Footage:
    """Read the frames of a recording. Their bytes stay on the disk; spoiled ones are left out.

    Raises:
        DataError: it cannot be read, or is no recording of two cameras.
    """
    recorded = open_recorded(file)
    topics, board = topics_of(recorded, file), Side(recorded.about.board_side)
    return Footage(_shots(recorded, topics[board], "board"), _shots(recorded, topics[board.other], "host"))


def _shots(recorded: Recorded, topic: str, whose: str) -> tuple[Shot, ...]:
    camera = recorded.camera(topic)
    shots: list[Shot] = []
    for shown in sorted(recorded.images[topic], key=lambda each: each.image.stamp_ns):
        with suppress(SpoiledImageError):
            shots.append(Shot(shown.image.stamp_ns, encoded(shown, camera, f"{whose} frame {shown.sequence}")))
    return tuple(shots)


def _orientation(path: Path) -> Orientation:
    """Read how a folder's images become upright; without the file they are."""
    try:
        text = read_whole(path, _MOST_LETTERS).decode("ascii", "replace").strip()
        return orientation_of(dict(parse_qsl(text, keep_blank_values=True)), str(path))
    except FileNotFoundError:
        return UPRIGHT
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "check its permissions") from None
    except SettingsError as error:
        raise DataError(error.problem, error.remedy) from None
