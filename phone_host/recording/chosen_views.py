"""Chooses pictures from a recording: pairs of its own images at moments at which nothing moved, as folders that calibrate and quality read.

A picture is named by the second at which it was taken, counted from the first pair: the seconds of `sessions cut`.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from common.errors import DataError, UnavailableError
from common.frame import SpoiledImageError
from common.protocol.message import CameraDescription
from common.recording.layout import camera_name
from common.recording.opened import open_recorded
from common.recording.recorded import Recorded, Shown, period_ns, size_px
from common.recording.stamps import pairs_of_two
from phone_host.diagnostics.run_rules import state_of
from phone_host.model import Image, Side
from phone_host.output.atomic import write_bytes, write_text
from phone_host.output.cameras_json import CAMERAS_NAME, cameras_text
from phone_host.output.listed import ListedFolder
from phone_host.recording.both_sides import encoded, topics_of
from phone_host.stereo.images import to_grey
from phone_host.stereo.raw_images import decode_frame
from phone_host.stereo.view_files import SUFFIXES

CAMERAS: Final = "cameras.json"
_NAMES: Final = r"[0-9]{2,6}\.png|cameras\.json"


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """The two images of a view.

    Attributes:
        name: of the view.
        left: (H, W) grey or (H, W, 3) BGR, uint8, upright.
        right: the same.
    """

    name: str
    left: Image
    right: Image


class ViewFolders:
    """Writes the views of one calibration. What an earlier one left there stays until this one has views and is closed; other pictures are refused.

    Args:
        left: folder for the left images.
        right: folder for the right ones.
        are_taken_live: whether each view is worth something alone, because nobody can take it again; else all appear together.

    Raises:
        UnavailableError: a folder holds pictures that an earlier one did not write.
        OSError: as the operating system reports it.
    """

    def __init__(self, left: Path, right: Path, *, are_taken_live: bool) -> None:
        self.left, self.right = left, right
        for folder in (left, right):
            _require_no_others(folder)
        self._left, self._right = ListedFolder(left, _NAMES), ListedFolder(right, _NAMES)
        self._are_taken_live, self._has_failed, self._count = are_taken_live, False, 0
        try:
            for listed in (self._left, self._right):
                listed.open()
            for listed in (self._left, self._right):
                if not are_taken_live or self._left.earlier or self._right.earlier:
                    listed.stage()
        except BaseException:
            self._release()
            raise

    def write(self, pictures: Pictures) -> None:
        """Write a view.

        Raises:
            OSError: as the operating system reports it.
        """
        self._has_failed = True  # until both are written
        for listed, image in ((self._left, pictures.left), (self._right, pictures.right)):
            name = f"{pictures.name}.png"
            listed.add(name)
            write_bytes(listed.place / name, cv2.imencode(".png", image)[1].tobytes())
            if self._are_taken_live:
                listed.spare_staged()
        self._count += 1
        self._has_failed = False

    def close(self, cameras: str) -> None:
        """Close both folders.

        Args:
            cameras: content of cameras.json, from which rig.yaml gets to know its cameras; empty: none.

        Raises:
            OSError: as the operating system reports it; the earlier views are there then.
        """
        try:
            if cameras:
                self._left.add(CAMERAS)
                write_text(self._left.place / CAMERAS, cameras)
            for listed in (self._left, self._right) if self._count else ():
                if not self._has_failed:
                    listed.publish()
                elif self._are_taken_live:
                    listed.keep_staged()
        finally:
            self._release()

    def abandon(self) -> None:
        """Close both folders; the earlier views stay, and of these none that was not published."""
        self._release()

    def _release(self) -> None:
        try:
            self._left.close()
        finally:
            self._right.close()


def _require_no_others(folder: Path) -> None:
    try:
        names = [path.name for path in folder.iterdir()]
    except FileNotFoundError:
        return
    others = [name for name in names if Path(name).suffix.lower() in SUFFIXES and not re.fullmatch(_NAMES, name)]
    if others:
        raise UnavailableError(
            f"{folder} holds other pictures ({others[0]})", "name two new folders for the views as LEFT and RIGHT"
        )


_SMALL_PX: Final = (160, 120)
"""Enough to see that something moves, and little enough that noise is not seen."""

NS: Final = 1_000_000_000
_LEAST_NS: Final = NS
"""A person who shows a board holds each pose for about two seconds."""

MOST: Final = 100
"""More views add nothing to a calibration, and cost a minute."""


@dataclass(frozen=True, slots=True)
class ChosenViews:
    """Where the pictures are.

    Attributes:
        left: folder of the left ones.
        right: folder of the right ones.
        board_side: which view the board's camera gave; None: not told.
    """

    left: Path
    right: Path
    board_side: Side | None


class _Stream:
    """The images of one side that have its camera's full size, in the order of their exposure.

    Raises:
        SpoiledImageError: the first image is none.
    """

    def __init__(self, recorded: Recorded, topic: str) -> None:
        self.camera: CameraDescription = recorded.camera(topic)
        full_px = self.camera.width_px, self.camera.height_px
        whole = [shown for shown in recorded.images[topic] if _size(shown) == full_px]
        self.shown = sorted(whole, key=lambda shown: shown.image.stamp_ns)
        self.stamps_ns = [shown.image.stamp_ns for shown in self.shown]

    def decoded(self, place: int, most_pixels: int, reduction: int = 1) -> Image:
        shown = self.shown[place]
        name = f"image {shown.sequence} of {self.camera.name}"
        return decode_frame(encoded(shown, self.camera, name), most_pixels, reduction)


def choose_views(
    file: Path, folder: Path, most_pixels: int, advance: Callable[[float], None] = lambda _: None
) -> ChosenViews:
    """Write the stillest pair of each second, at most a hundred, into `left` and `right`.

    Args:
        file: the recording.
        folder: of both.
        most_pixels: an image that claims more is passed over.
        advance: called with the share that is done, 0 to 1.

    Raises:
        UnavailableError: the folders hold other pictures.
        DataError: the recording cannot be read, is no recording of two cameras, or has no two images of one moment.
        OSError: the folders cannot be written to.
    """
    recorded = open_recorded(file)
    topics = topics_of(recorded, file)
    left, right = (_Stream(recorded, topics[side]) for side in (Side.LEFT, Side.RIGHT))
    most_ns = max(period_ns(left.shown), period_ns(right.shown)) // 2
    pairs = pairs_of_two(left.stamps_ns, right.stamps_ns, most_ns)
    chosen = _chosen(left, right, pairs, most_pixels, advance)
    if not chosen:
        raise DataError(f"{file} has no two images of the same moment", "look at it: phone-host sessions info")
    views = ViewFolders(folder / Side.LEFT.value, folder / Side.RIGHT.value, are_taken_live=False)
    try:
        for place in chosen:
            at, mate = pairs[place]
            second = (left.stamps_ns[at] - left.stamps_ns[pairs[0][0]]) // NS
            pictures = left.decoded(at, most_pixels), right.decoded(mate, most_pixels)
            views.write(Pictures(f"{second:03d}", *pictures))
    except BaseException:
        views.abandon()
        raise
    views.close(_cameras(recorded, left.camera, right.camera))
    board_side = Side(recorded.about.board_side) if recorded.is_ours else None
    return ChosenViews(views.left, views.right, board_side)


def _chosen(
    left: _Stream, right: _Stream, pairs: list[tuple[int, int]], most_pixels: int, advance: Callable[[float], None]
) -> list[int]:
    """Return the places of the pairs that are worth a picture; spoiled images are none."""
    whole: list[int] = []
    changes: list[float] = []
    before: list[Image] = []
    for place, (at, mate) in enumerate(pairs):
        try:
            small = [_small(left.decoded(at, most_pixels, 4)), _small(right.decoded(mate, most_pixels, 4))]
        except SpoiledImageError:
            continue
        whole.append(place)
        changes.append(
            max((float(np.mean(cv2.absdiff(a, b))) for a, b in zip(before, small, strict=False)), default=math.nan)
        )
        before = small
        advance((place + 1) / len(pairs))
    return [whole[place] for place in stillest([left.stamps_ns[pairs[place][0]] for place in whole], changes)]


def stillest(stamps_ns: Sequence[int], changes: Sequence[float]) -> list[int]:
    """Return the places of one moment for each second: the one at which least moved.

    A camera's rows are not exposed at once, and two cameras not at one moment: what moves then is bent, or stands in two places.

    Args:
        stamps_ns: of the moments, ascending.
        changes: how much each image differs from the one before; NaN: it cannot be told. As many as moments.

    Returns:
        Ascending; at most `MOST`: of a longer film one for each hundredth of it.
    """
    if not stamps_ns:
        return []
    begin_ns = stamps_ns[0]
    every_ns = max(_LEAST_NS, -(-(stamps_ns[-1] - begin_ns + 1) // MOST))
    best: dict[int, tuple[float, int]] = {}
    for place, at_ns in enumerate(stamps_ns):
        around = [change for change in changes[place : place + 2] if not math.isnan(change)]
        found = max(around, default=math.inf), place
        slot = (at_ns - begin_ns) // every_ns
        best[slot] = min(found, best.get(slot, found))
    return [place for _, place in best.values()]


def _cameras(recorded: Recorded, left: CameraDescription, right: CameraDescription) -> str:
    """Return cameras.json: the run's own, which also knows what was held, else what is told of both; empty: nothing is."""
    if CAMERAS_NAME in recorded.attachments:
        return bytes(recorded.attachments[CAMERAS_NAME]).decode("utf-8", "replace")
    is_told = all(camera_name(side.value) in recorded.metadata for side in Side)
    return cameras_text(state_of(left, ()), state_of(right, ())) if is_told else ""


def _small(image: Image) -> Image:
    return np.asarray(cv2.resize(to_grey(image), _SMALL_PX, interpolation=cv2.INTER_AREA), np.uint8)


def _size(shown: Shown) -> tuple[int, int]:
    try:
        return size_px(shown.image)
    except SpoiledImageError:
        return 0, 0
