"""Finds the board in the image files of both sides: every pair is read, searched, and kept or rejected with its reason."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from common.errors import DataError
from common.imagesize.head import MOST_PIXELS
from common.imagesize.head import size_text as px_text
from common.orientation import UPRIGHT, Flip, Orientation
from common.program.out_of_memory import noted_if_out_of_memory
from phone_host.calibration.target.board_fits import side_by_side
from phone_host.calibration.target.corners import Board, Corners, agree, find_corners
from phone_host.calibration.target.pairs import BoardPair, FileCorners, Reason, Rejected
from phone_host.calibration.target.sharpness import BoardLook, SeenLook, look_at
from phone_host.calibration.target.small_picture import PREVIEW_PX, shrunk_to, small_jpeg, small_size
from phone_host.model import CameraModel, Rectification, Rig, Side
from phone_host.model.calibration_series import RectifiedView
from phone_host.stereo.images import decode_file, open_image, to_grey
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_points
from phone_host.stereo.scaled_rig import scaled_rig
from phone_host.stereo.view_files import ViewFiles

_FIRST: Final = 50
"""If so many pairs cannot be read, none is searched any more: their folder holds something else."""

Size = tuple[int, int]
Mounted = tuple[Orientation, Orientation]
"""How the left and the right camera are mounted."""


@dataclass(frozen=True, slots=True)
class ViewPictures:
    """What both images of a pair look like: its name, and small JPEG files."""

    name: str
    left: bytes
    right: bytes


@dataclass(frozen=True, slots=True)
class BoardViews:
    """What was found in the images.

    Attributes:
        pairs: corners of the pairs whose board was found in both images.
        rejected: all others.
        sizes_px: width and height of the upright left and right images.
        turned: by which turn and mirroring the left and the right images became upright, as their EXIF headers say.
        looks: how sharp the board is in each image, and how much light has washed out.
        in_order: the corners in all pictures of both sides, where they were paired by order and the counts differ.
        pictures: of the pairs whose images could be read.
    """

    pairs: tuple[BoardPair, ...]
    rejected: tuple[Rejected, ...]
    sizes_px: tuple[Size, Size]
    turned: Mounted = (UPRIGHT, UPRIGHT)
    in_order: tuple[tuple[FileCorners, ...], tuple[FileCorners, ...]] = ((), ())
    looks: tuple[SeenLook, ...] = ()
    pictures: tuple[ViewPictures, ...] = ()


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Seen:
    """What was found in one image."""

    file: str
    size_px: Size
    turned: Orientation
    corners: Corners
    look: BoardLook
    picture: bytes


_Look = Callable[[Path, int], _Seen]
"""Looks at an image of the left (0) or the right (1) side; raises DataError."""

_SeenPair = tuple[str, _Seen, _Seen]
"""Name, left and right."""


def look_for_boards(
    files: ViewFiles,
    board: Board,
    advance: Callable[[], None],
    most_pixels: int = MOST_PIXELS,
    mounted: Mounted = (UPRIGHT, UPRIGHT),
) -> BoardViews:
    """Read all pairs and find the board in them, several pairs at a time.

    Args:
        files: the pairs of files.
        board: what to look for.
        advance: called after each pair, for a progress bar.
        most_pixels: an image that claims more is refused.
        mounted: how the two cameras are mounted; applied after what the images' headers say.

    Raises:
        DataError: no image could be read.
    """

    def look(path: Path, index: int) -> _Seen:
        with noted_if_out_of_memory(str(path)):
            return _look(path, board, most_pixels, mounted[index])

    seen, failures = _read(files, look, advance)
    rejected = [_alone(path, side.value) for side, alone in _unpaired(files) for path in alone]
    rejected += [Rejected(name, Reason.UNREADABLE, error.problem) for name, error in failures]
    every = _every_file(files, seen, look)
    if not seen:
        if failures:
            raise failures[0][1]
        raise DataError("no image has a partner on the other side", "give both images of a pair the same number")
    known: dict[bytes, str] = {}
    usual = _usual([left for _, left, _ in seen]), _usual([right for _, _, right in seen])
    pairs = []
    for name, left_seen, right_seen in seen:
        problem = _problem(name, (left_seen, right_seen), usual, board)
        problem = problem or _repeated(name, (left_seen, right_seen), known)
        if problem is None:
            pairs.append(BoardPair(name, left_seen.corners, agree(left_seen.corners, right_seen.corners, board)))
        else:
            rejected.append(problem)
    return BoardViews(
        tuple(pairs),
        tuple(rejected),
        (usual[0].size_px, usual[1].size_px),
        (usual[0].turned, usual[1].turned),
        every,
        tuple(SeenLook(each.file, side, each.look) for _, *both in seen for side, each in zip(Side, both, strict=True)),
        tuple(ViewPictures(name, left.picture, right.picture) for name, left, right in seen),
    )


def _unpaired(files: ViewFiles) -> tuple[tuple[Side, Sequence[Path]], ...]:
    return (Side.LEFT, files.left_alone), (Side.RIGHT, files.right_alone)


def _read(
    files: ViewFiles, look: _Look, advance: Callable[[], None]
) -> tuple[list[_SeenPair], list[tuple[str, DataError]]]:
    """Look at all pairs, several at a time.

    Returns:
        Those whose images could be read, and why the others could not.

    Raises:
        DataError: the first ones cannot be read, and there are many more.
    """

    def both(pair: tuple[str, Path, Path]) -> tuple[_Seen, _Seen] | DataError:
        try:
            return look(pair[1], 0), look(pair[2], 1)
        except DataError as error:
            return error

    looked = side_by_side(both, files.pairs[:_FIRST], advance)
    failures = [each for each in looked if isinstance(each, DataError)]
    if len(failures) == _FIRST < len(files.pairs):
        raise DataError(
            f"none of the first {_FIRST} pairs can be read: {failures[0].problem}",
            "give pictures, or mend that one first",
        )
    looked += side_by_side(both, files.pairs[_FIRST:], advance)
    named = [(name, found) for (name, _, _), found in zip(files.pairs, looked, strict=True)]
    return (
        [(name, *found) for name, found in named if not isinstance(found, DataError)],
        [(name, found) for name, found in named if isinstance(found, DataError)],
    )


def _every_file(
    files: ViewFiles, seen: list[_SeenPair], look: _Look
) -> tuple[tuple[FileCorners, ...], tuple[FileCorners, ...]]:
    """Return the corners of all files of both sides, if they were paired by order and the counts differ; else nothing."""
    alone = files.left_alone, files.right_alone
    if files.by_number or files.by_name or not any(alone):
        return (), ()
    nothing = np.empty((0, 2))
    sides = []
    for index, side_alone in enumerate(alone):
        known = {each[index].file: each[index].corners for each in ((left, right) for _, left, right in seen)}
        paired = [(left, right)[index] for _, left, right in files.pairs]
        found = [FileCorners(path.name, known.get(path.name, nothing)) for path in paired]
        for path in side_alone:
            try:
                found.append(FileCorners(path.name, look(path, index).corners))
            except DataError:  # it cannot be read: nothing is known of it
                found.append(FileCorners(path.name, nothing))
        sides.append(tuple(found))
    return sides[0], sides[1]


def _look(path: Path, board: Board, most_pixels: int, mounted: Orientation) -> _Seen:
    """Read one image and find the board in it. Of the pixels only a small picture is kept: 50 megapixels take 150 MB."""
    file = open_image(path, most_pixels, mounted)
    grey = to_grey(decode_file(file))
    corners = find_corners(grey, board)
    return _Seen(
        file=path.name,
        size_px=file.size_px,
        turned=file.head.orientation,
        corners=corners,
        look=look_at(grey, corners, board),
        picture=small_jpeg(grey, PREVIEW_PX),
    )


def _problem(name: str, pair: tuple[_Seen, _Seen], usual: tuple[_Seen, _Seen], board: Board) -> Rejected | None:
    for side, seen, others in zip(("left", "right"), pair, usual, strict=True):
        unlike = _unlike(seen, others, side)
        if unlike is not None:
            return Rejected(name, *unlike)
    lacking = (
        "the board is not seen whole and sharp" if board.marks is None else "too few of the board's marks are seen"
    )
    match len(pair[0].corners) > 0, len(pair[1].corners) > 0:
        case True, True:
            return None
        case False, True:
            return Rejected(name, Reason.NOT_FOUND_LEFT, f"{lacking} in the left image")
        case True, False:
            return Rejected(name, Reason.NOT_FOUND_RIGHT, f"{lacking} in the right image")
        case _:
            return Rejected(name, Reason.NOT_FOUND_BOTH, f"{lacking} in either image")


def _repeated(name: str, pair: tuple[_Seen, _Seen], known: dict[bytes, str]) -> Rejected | None:
    """Say which pair before showed the board in exactly these places; None if none did: then it is remembered."""
    first = known.setdefault(pair[0].corners.tobytes() + pair[1].corners.tobytes(), name)
    return None if first == name else Rejected(name, Reason.REPEATED, f"its images are those of {first}")


def _unlike(seen: _Seen, others: _Seen, side: str) -> tuple[Reason, str] | None:
    """Say how an image differs from most of its side, in orientation or size; None if it does not."""
    what, own_px, usual_px = f"the {side} image {seen.file}", px_text(seen.size_px), px_text(others.size_px)
    if seen.turned != others.turned:
        turns = turn_text(seen.turned), turn_text(others.turned)
        return Reason.TURNED, f"{what} is {turns[0]} by its EXIF header, the others are {turns[1]}"
    if seen.size_px == others.size_px:
        return None
    if seen.size_px == others.size_px[::-1]:
        return Reason.TURNED, f"{what} is {own_px} px, the others are {usual_px}: the camera was held another way"
    return Reason.OTHER_SIZE, f"{what} is {own_px} px, the others are {usual_px}"


def turn_text(orientation: Orientation) -> str:
    """Return what is done to images with this orientation, such as "turned by 90 degrees and mirrored"."""
    parts = [f"turned by {orientation.rotate_deg} degrees"] if orientation.rotate_deg else []
    parts += ["mirrored"] if orientation.flip is not Flip.NONE else []
    return " and ".join(parts) or "not turned"


def _alone(path: Path, side: str) -> Rejected:
    return Rejected(path.name, Reason.NO_PARTNER, f"the {side} image has no partner on the other side")


def _usual(seen: list[_Seen]) -> _Seen:
    """Return one of the images whose size and orientation most images have."""
    usual = Counter((each.size_px, each.turned) for each in seen).most_common(1)[0][0]
    return next(each for each in seen if (each.size_px, each.turned) == usual)


_MOST_PX: Final = 640
"""Longer side of the images that are rectified, px: enough for a page, and rectifying 12 megapixels takes a second."""


def fullest(pairs: list[BoardPair], rig: Rig, rectification: Rectification) -> BoardPair:
    """Return the pair whose board fills most of both rectified images and is whole in them."""

    def filled(pair: BoardPair) -> tuple[float, float]:
        shares, areas = [], []
        for corners, model, turn in (
            (pair.left_px, rig.left, rectification.R_left),
            (pair.right_px, rig.right, rectification.R_right),
        ):
            seen = corners[np.isfinite(corners).all(axis=1)]
            at = rectify_points(seen, model, turn, rectification.geometry)
            inside = np.all((at > 0) & (at < (rectification.width_px - 1, rectification.height_px - 1)), axis=1)
            shares.append(float(inside.sum()) / len(corners))
            areas.append(float(np.prod(np.ptp(at, axis=0))))
        return round(min(shares), 2), min(areas)

    return max(pairs, key=filled)


def rectified_view(
    files: tuple[Path, Path],
    pair: BoardPair,
    rig: Rig,
    mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT),
    most_pixels: int = MOST_PIXELS,
) -> RectifiedView | None:
    """Rectify one pair at a small size.

    Returns:
        The pair; None if a file has gone, or the rig cannot be rectified so small.
    """
    sizes = [small_size((model.width_px, model.height_px), _MOST_PX) for model in (rig.left, rig.right)]
    try:
        images = [
            shrunk_to(decode_file(open_image(path, most_pixels, turn)), size)
            for path, turn, size in zip(files, mounted, sizes, strict=True)
        ]
        small = scaled_rig(replace(rig, is_cropped=False), sizes[0], sizes[1])
        rectifier = Rectifier(small)
    except DataError:
        return None
    rectified = rectifier.rectify(images[0], images[1])
    made, geometry = rectifier.rectification, rectifier.geometry
    seen = np.isfinite(pair.left_px).all(axis=1) & np.isfinite(pair.right_px).all(axis=1)
    corners = [
        rectify_points(_scaled(own_px[seen], own, model), model, turn, geometry)
        for own_px, own, model, turn in (
            (pair.left_px, rig.left, small.left, made.R_left),
            (pair.right_px, rig.right, small.right, made.R_right),
        )
    ]
    return RectifiedView(
        name=pair.name,
        left=small_jpeg(rectified.left, _MOST_PX),
        right=small_jpeg(rectified.right, _MOST_PX),
        size_px=(made.width_px, made.height_px),
        left_px=corners[0],
        right_px=corners[1],
        is_vertical=made.epipolar.is_vertical,
    )


def _scaled(corners_px: Corners, own: CameraModel, small: CameraModel) -> Corners:
    """Return corners in a smaller copy of their image; pixel centres are integers."""
    scale = np.array([small.width_px / own.width_px, small.height_px / own.height_px])
    return np.asarray((corners_px + 0.5) * scale - 0.5, np.float64)
