"""Finds the board in the image files of both sides: every pair is read, searched, and kept or rejected with its reason."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from common.errors import DataError
from common.imagesize.head import MOST_PIXELS
from phone_host.calibration.board_pairs import BoardPair, Reason, Rejected
from phone_host.calibration.target import Board, Corners, agree, find_corners
from phone_host.model import Image
from phone_host.stereo.images import read_image
from phone_host.stereo.view_files import ViewFiles

Size = tuple[int, int]


@dataclass(frozen=True, slots=True)
class BoardViews:
    """What was found in the images.

    Attributes:
        pairs: corners of the pairs whose board was found in both images.
        rejected: all others.
        sizes_px: width and height of the left and of the right images.
    """

    pairs: tuple[BoardPair, ...]
    rejected: tuple[Rejected, ...]
    sizes_px: tuple[Size, Size]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Seen:
    name: str
    sizes: tuple[Size, Size]
    left: Corners
    right: Corners


def look_for_boards(
    files: ViewFiles, board: Board, advance: Callable[[], None], most_pixels: int = MOST_PIXELS
) -> BoardViews:
    """Read all pairs and find the board in them.

    Args:
        files: the pairs of files.
        board: what to look for.
        advance: called after each pair, for a progress bar.
        most_pixels: an image that claims more is refused.

    Returns:
        The corners, and the pairs rejected.

    Raises:
        DataError: no image could be read.
    """
    rejected = [_alone(path, "left") for path in files.left_alone] + [
        _alone(path, "right") for path in files.right_alone
    ]
    seen: list[_Seen] = []
    first_problem = ""
    for name, left, right in files.pairs:
        try:
            images = read_image(left, most_pixels), read_image(right, most_pixels)
        except DataError as error:
            first_problem = first_problem or error.problem
            rejected.append(Rejected(name, Reason.UNREADABLE, error.problem))
        else:
            sizes = _size(images[0]), _size(images[1])
            seen.append(
                _Seen(name=name, sizes=sizes, left=find_corners(images[0], board), right=find_corners(images[1], board))
            )
        advance()
    if not seen:
        raise DataError(
            f"no pair of images could be read ({first_problem})"
            if first_problem
            else "no pair of images could be read",
            f"look at {files.pairs[0][1]}" if files.pairs else "check names",
        )
    sizes_px = (_usual([each.sizes[0] for each in seen]), _usual([each.sizes[1] for each in seen]))
    pairs = []
    for each in seen:
        problem = _problem(each, sizes_px)
        if problem is None:
            pairs.append(BoardPair(each.name, each.left, agree(each.left, each.right, board)))
        else:
            rejected.append(problem)
    return BoardViews(tuple(pairs), tuple(rejected), sizes_px)


def _problem(seen: _Seen, sizes_px: tuple[Size, Size]) -> Rejected | None:
    for side, size, usual in zip(("left", "right"), seen.sizes, sizes_px, strict=True):
        if size != usual:
            return Rejected(
                seen.name,
                Reason.OTHER_SIZE,
                f"the {side} image is {size[0]}x{size[1]} px, the others are {usual[0]}x{usual[1]}",
            )
    match len(seen.left) > 0, len(seen.right) > 0:
        case True, True:
            return None
        case False, True:
            return Rejected(seen.name, Reason.NOT_FOUND_LEFT, "the board is not seen whole and sharp in the left image")
        case True, False:
            return Rejected(
                seen.name, Reason.NOT_FOUND_RIGHT, "the board is not seen whole and sharp in the right image"
            )
        case _:
            return Rejected(seen.name, Reason.NOT_FOUND_BOTH, "the board is not seen whole and sharp in either image")


def _alone(path: Path, side: str) -> Rejected:
    return Rejected(path.name, Reason.NO_PARTNER, f"the {side} image has no partner on the other side")


def _size(image: Image) -> Size:
    return image.shape[1], image.shape[0]


def _usual(sizes: list[Size]) -> Size:
    return Counter(sizes).most_common(1)[0][0]
