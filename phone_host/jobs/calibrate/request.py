"""What a calibration can be told: from pictures, live, or by another program."""

import argparse
import math
import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from common.places import resolved
from common.program.request import Request, given_words, option, part
from phone_host.jobs.options import ImageOptions, PairOptions
from phone_host.jobs.units import baseline_mm, length_mm, square_mm
from phone_host.model import Side
from phone_host.output.rig_files.imported import RigKind

Sizes = tuple[tuple[int, int], tuple[int, int]]
"""Width and height of the left and of the right images, px."""

EXPORTS: Final = tuple(kind.value for kind in RigKind if kind is not RigKind.RIG)

_SIZE: Final = re.compile(r"([1-9]\d{0,5})x([1-9]\d{0,5})", re.ASCII)
_OF_LIVE: Final = frozenset({"link", "camera", "views", "sound", "snapshots", "wait", "tolerance", "keys"})
_OF_IMPORT: Final = frozenset({"unit", "size"})
_WITH_IMPORT: Final = _OF_IMPORT | {"import", "export", "board_side", "baseline", "out"}
_OF_ONE_RUN: Final = _OF_LIVE | {"live", "out"}


def _sizes_px(text: str, option: str) -> Sizes:
    sizes = [(int(found[1]), int(found[2])) for part in text.split(",") if (found := _SIZE.fullmatch(part.strip()))]
    if len(sizes) != text.count(",") + 1 or len(sizes) > 2:
        raise SettingsError(f"{option} is {text!r}", "give width and height in px, such as 640x480")
    return sizes[0], sizes[-1]


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateRequest(Request):
    """What calibrate can be told."""

    images: tuple[str, ...] = option(
        nargs="*",
        metavar="LEFT RIGHT",
        help="pictures of the left and of the right camera: two folders or two globs; each left picture is paired with the"
        " right one that has the same number in its name. Pictures are turned upright by their EXIF orientation."
        " Or a recording, FILE.mcap: its stillest pair of each second, at most a hundred, written to views/ beside --out. With --live:"
        " two folders for the pictures it takes (default: views/left and views/right beside --out)",
    )
    live: bool = option(
        "--live",
        page=False,
        action="store_true",
        help="take the pictures now, from both cameras: says what to show, takes each view by itself, ends when it is enough",
    )
    cameras: PairOptions = part(PairOptions, "for --live: ", "cameras and links")
    most_views: int = option(
        "--views",
        group="cameras and links",
        type=int,
        default=25,
        metavar="N",
        help="for --live: take at most so many views, 5 to 99; 3 with --from (default 25)",
    )
    sound: bool = option(
        "--sound",
        page=False,
        group="cameras and links",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="for --live: speak, if the system has a speech program, else ring the terminal's bell (default: yes)",
    )
    snapshots: Path | None = option(
        "--snapshots",
        page=False,
        group="cameras and links",
        type=Path,
        metavar="DIR",
        help="for --live: folder for guide.json and guide.svg, what is shown just now",
    )
    board: str | None = option(
        "--board",
        metavar="9x6",
        help="inner corners of the chessboard: columns x rows. Without it they are found in the pictures. Boards with marks, of"
        " which a part is enough: charuco:10x8:25mm:18mm:5x5 (squares, their side, a mark's side, ArUco family) or"
        " aprilgrid:6x6:30mm:9mm (tags, their side, the gap)",
    )
    square_mm: float | None = option(
        "--square",
        read=lambda text, _: square_mm(text),
        metavar="25mm",
        help="side of one square: 25mm, 2.5cm or 0.025m; a number alone means mm. Measure it on paper with a ruler; on a"
        " screen it is its pixels times the width of a pixel, such as '120px*0.1794mm'",
    )
    baseline_m: float | None = option(
        "--baseline",
        group="calibration",
        read=lambda text, _: baseline_mm(text) / 1000,
        metavar="80mm",
        help="distance of the two lenses, as you measure it with a ruler: it shows whether --square is right",
    )
    earlier: Path | None = option(
        "--from",
        page=False,
        type=Path,
        metavar="rig.yaml",
        help="add these pictures to those of an earlier calibration; --board and --square are then as they were",
    )
    pose_only: bool = option(
        "--pose-only",
        page=False,
        group="calibration",
        action="store_true",
        help="with --from: keep its lenses, compute only how the cameras stand to each other, from these pictures alone",
    )
    imported: tuple[Path, ...] | None = option(
        "--import",
        page=False,
        nargs="+",
        type=Path,
        metavar="FILE",
        help="in place of pictures: a calibration of ROS (left.yaml right.yaml), Kalibr, OpenCV (YAML or XML, one file or two),"
        " COLMAP (cameras.txt images.txt), EuRoC (two sensor.yaml), Middlebury, ETH3D or KITTI (calib.txt), a rig.yaml, or the"
        " folder that holds them; which it is, the content tells",
    )
    unit_m: float | None = option(
        "--unit",
        page=False,
        group="other programs",
        read=lambda text, name: length_mm(text, name, "1mm") / 1000,
        metavar="1mm",
        help="for --import: what 1 in the file's lengths is, where that is not 1 m, such as 25mm for squares",
    )
    sizes_px: Sizes | None = option(
        "--size",
        page=False,
        group="other programs",
        read=_sizes_px,
        metavar="WxH",
        help="for --import: size of the images in px where the files do not state it; WxH,WxH if left and right differ",
    )
    exports: tuple[str, ...] = option(
        "--export",
        page=False,
        action="append",
        choices=EXPORTS,
        default=[],
        metavar="KIND",
        help=f"also write the calibration as files of another program, into a folder KIND beside --out: {', '.join(EXPORTS)};"
        " may be repeated",
    )
    board_side: Side | None = option(
        "--board-side",
        group="cameras and links",
        read=lambda text, _: Side(text),
        choices=("left", "right"),
        help="which of the two is the board's camera (default left, or as in --from)",
    )
    pictures: ImageOptions = part(ImageOptions, group="pictures")
    out: Path = option(
        "--out",
        type=Path,
        required=True,
        metavar="rig.yaml",
        help="file for the calibration; report.json and the page index.html are written beside it",
    )

    @property
    def measured_m(self) -> float:
        """The baseline as the user measured it, m; NaN: not told."""
        return math.nan if self.baseline_m is None else self.baseline_m

    def require_pictures(self) -> None:
        """Check that a calibration from pictures has some or takes them, and nothing that belongs to --import or to --live alone.

        Raises:
            SettingsError: they are missing, or an option has no meaning.
        """
        if not self.images and not self.live:
            raise SettingsError(
                "neither pictures nor --live nor --import is given",
                "give LEFT RIGHT --square 25mm, --live --camera URI --square 25mm, or --import FILE",
            )
        for name, (flag, *_) in self._words.items():
            if name in _OF_LIVE and not self.live:
                raise SettingsError(f"{flag} without --live", "add --live to take the pictures now, or leave it out")
            if name in _OF_IMPORT:
                raise SettingsError(f"{flag} without --import", "leave it out")

    def require_import_alone(self) -> None:
        """Check that nothing is given beside --import that only pictures have.

        Raises:
            SettingsError: an option, or a folder of pictures.
        """
        given = ["pictures"] if self.images else []
        given += [words[0] for name, words in self._words.items() if name not in _WITH_IMPORT]
        for flag in given:
            raise SettingsError(f"--import and {flag} contradict each other", "give pictures of a board, or --import")

    def again(self, left: str, right: str) -> str:
        """Return the command that calibrates from the pictures of a live calibration as it was done; empty: the earlier calibration holds them now.

        Args:
            left: folder of its left pictures.
            right: folder of the right ones.
        """
        if self.earlier is not None and not self.pose_only and resolved(self.earlier) == resolved(self.out):
            return ""
        words = [word for name, each in self._words.items() if name not in _OF_ONE_RUN for word in each]
        return shlex.join(["phone-host", "calibrate", left, right, *words, "--out", str(self.out)])

    @property
    def _words(self) -> dict[str, list[str]]:
        """The options that are not as usual."""
        return given_words(CalibrateRequest, self.given)
