"""Pictures taken from both cameras, or chosen from a recording: left/NN.png and right/NN.png, upright, lossless, as `calibrate` reads them."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2

from common.errors import UnavailableError
from phone_host.model import Image
from phone_host.output.atomic import write_bytes, write_text
from phone_host.output.listed import ListedFolder
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
