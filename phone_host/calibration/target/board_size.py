"""Finds out which chessboard the images show: how many inner corners, by a vote of some of them.

The detector grows a lattice from its strongest corners as far as it goes. Glare, a hand or a cut edge end it early in some
images; what many images agree on, weighted by its corners, is a board or a part of one. So the detector that looks for a size
is asked whether it fits, and whether a larger one does (`board_fits`). Sizes are compared without regard to which count comes first,
because a board may be held either way.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError, SettingsError, TandemError
from common.imagesize.head import MOST_PIXELS, size_text
from common.words import counted
from phone_host.calibration.target.board_fits import ENOUGH, Fits, Inner, side_by_side
from phone_host.calibration.target.corners import Board, Corners
from phone_host.calibration.target.marks_seen import SeenMarks, find_marks, require_marks
from phone_host.calibration.target.small_picture import shrunk
from phone_host.model import Image
from phone_host.stereo.images import decode_file, open_image, to_grey
from phone_host.stereo.view_files import ViewFiles

_SEARCHED_PX: Final = 800
"""Longer side. Of 174 images of four real rigs 133 give the right size so, in 15 to 40 ms each."""

_SEED: Final = (3, 3)
"""The smallest lattice from which the detector may grow; what is no larger may be any pattern."""

_USUAL_WAY: Final = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
_OTHER_WAY: Final = _USUAL_WAY | cv2.CALIB_CB_EXHAUSTIVE
"""Of 20 images of a board of 14x10 this way finds 17 whole, the usual one none; of 122 images of boards up to 9x6 it finds 70, the usual one 103."""

_ALL_WHITE: Final = 0.8
"""Share of white among the squares beyond the outermost corners: half of them are black beside inner corners."""

_MARGIN, _LEAST_MARGIN = 1.25, 0.65
"""So many squares beside the outermost corners is the margin, be it half a square wide; so much of it must be seen. Fingers may lie on the rest; of a row of
squares about half is white."""

_SAMPLE: Final = 24
"""At most so many images are asked: 12 photographs of 12 MPx take 1.5 s on two cores."""

_BATCH: Final = 6
_MARKED: Final = 4
"""So many images are searched for coded marks."""

_CLEAR_VOTES, _CLEAR_SHARE = 4, 0.6
"""With so many images, and this share of all corners, the vote is over."""

_LEAST_VOTES: Final = 2
_LEAST_SHARE: Final = 0.5
"""Below, the images do not agree. Of a real rig with a small, dark board the right size has three quarters."""

_TRIED: Final = 4
"""So many of the sizes that images show are looked for, if they do not agree."""

_ANY_SIDE_M: Final = 0.01

_USUAL_SIZES: Final[tuple[Inner, ...]] = ((9, 6), (8, 6), (7, 6), (7, 5), (8, 5), (9, 7), (10, 7), (8, 7), (11, 8))
"""Of the boards that OpenCV, ROS, MATLAB and Kalibr give away and describe, and of the boards of chess."""


@dataclass(frozen=True, slots=True)
class Vote:
    """What some images show.

    Attributes:
        asked: how many images were searched.
        sizes: how many images show which lattice.
    """

    asked: int
    sizes: Counter[Inner]

    @property
    def leader(self) -> Inner | None:
        """The size on which the images agree; None if they do not."""
        if not self.sizes:
            return None
        best = self.ranked[0]
        is_clear = self.sizes[best] >= min(_LEAST_VOTES, self.asked) and self._share(best) >= _LEAST_SHARE
        return best if is_clear else None

    @property
    def is_over(self) -> bool:
        """Whether more images would hardly change it."""
        best = self.leader
        return best is not None and self.sizes[best] >= _CLEAR_VOTES and self._share(best) >= _CLEAR_SHARE

    @property
    def ranked(self) -> list[Inner]:
        """All sizes, the one that most corners show first."""
        return sorted(self.sizes, key=self._weight, reverse=True)

    def _weight(self, size: Inner) -> int:
        return self.sizes[size] * _area(size)

    def _share(self, size: Inner) -> float:
        return self._weight(size) / sum(map(self._weight, self.sizes))


def size_seen(grey: Image, way: int = _USUAL_WAY) -> Inner | None:
    """Return the inner corners of the chessboard in an image; None if there is none.

    Returns:
        The two counts, the larger first. It may be a part of the board.
    """
    return _size_of(_lattice(small_for_sizes(grey), way))


def whole_size_seen(grey: Image) -> Inner | None:
    """Return the inner corners of the chessboard in an image, the larger count first, if its white margin is seen on all four sides.

    A board that reaches beyond the image, or that a hand covers, looks like a smaller one. On the side where it is cut there are more
    squares, a hand or nothing beside the outermost corners instead of a black-and-white row and then the margin.
    """
    small = small_for_sizes(grey)
    grid = _lattice(small)
    size = _size_of(grid)
    if size is None:
        return None
    limit = _grey_between(small, grid)
    sides = (grid, grid[::-1], grid.transpose(1, 0, 2), grid[:, ::-1].transpose(1, 0, 2))
    margins = (_levels(small, side[0] + _MARGIN * (side[0] - side[1])) for side in sides)
    return size if all((levels > limit).mean() >= _LEAST_MARGIN for levels in margins) else None


def size_in_pictures(pictures: Sequence[Image]) -> Inner | None:
    """Return the inner corners of the chessboard that pictures show, as `size_in_files` counts them; None if they do not tell."""
    seen = [_Seen(small, _size_of(_lattice(small))) for small in map(small_for_sizes, pictures)]
    vote = Vote(len(seen), Counter(each.size for each in seen if each.size is not None))
    return _fitting(vote, _fits_of(seen), None)


def small_for_sizes(grey: Image) -> Image:
    """Return an image as small as it is searched for a board of unknown size."""
    return shrunk(grey, min(1.0, _SEARCHED_PX / max(grey.shape)))[0]


def _lattice(grey: Image, way: int = _USUAL_WAY) -> Corners:
    """Return the corners that hang together, (rows, columns, 2) px; empty: there are none."""
    found, corners, meta = cv2.findChessboardCornersSBWithMeta(grey, _SEED, flags=way)
    if not found or meta is None:
        return np.empty((0, 0, 2))
    return inner_lattice(grey, np.asarray(corners, np.float64).reshape(*meta.shape[:2], 2))


def inner_lattice(grey: Image, grid: Corners) -> Corners:
    """Return a lattice (R, C, 2), px, without outer rows that are no inner corners: the detector may take the outermost squares' own corners for some.

    Beyond inner corners lie black and white squares in turns, beyond those the white margin alone.
    """
    limit = _grey_between(grey, grid)
    for _ in range(4):  # each side comes first in turn
        grid = np.rot90(grid)
        if len(grid) > 2:
            middles = (grid[:2, :-1] + grid[:2, 1:]) / 2
            beyond = _levels(grey, middles[0] + 0.5 * (middles[0] - middles[1]))
            grid = grid[1:] if (beyond > limit).mean() > _ALL_WHITE else grid
    return grid


def _grey_between(grey: Image, grid: Corners) -> float:
    """Return the grey level between black and white squares."""
    squares = _levels(grey, (grid[:-1, :-1] + grid[1:, 1:]) / 2)
    return float(np.percentile(squares, 10) + np.percentile(squares, 90)) / 2


def _size_of(grid: Corners) -> Inner | None:
    size = max(grid.shape[:2]), min(grid.shape[:2])
    return None if size[1] < _SEED[1] or size == _SEED else size


def _levels(grey: Image, points: Corners) -> NDArray[np.float64]:
    """Return grey levels at some points; 0 outside of the image."""
    x, y = np.rint(points.reshape(-1, 2)).astype(int).T
    height, width = grey.shape
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    return np.where(inside, grey[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)], 0).astype(np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """An image, small, and which lattice it shows; None: none."""

    image: Image
    size: Inner | None


@dataclass(frozen=True, slots=True, eq=False)
class _Decided:
    """What some images show, and which board that is; None: it cannot be told."""

    vote: Vote
    size: Inner | None
    fits: Fits


def _asked(images: Iterator[Path], look: Callable[[Path], _Seen | None]) -> tuple[Vote, list[_Seen]]:
    """Ask images, the most different first, until the answer is clear."""
    result, every = Vote(0, Counter()), list[_Seen]()
    for batch in _batches(images):
        every += [each for each in side_by_side(look, batch) if each is not None]
        result = Vote(result.asked + len(batch), Counter(each.size for each in every if each.size is not None))
        if result.is_over:
            break
    return result, every


def _decided(files: ViewFiles, most_pixels: int, given: Inner | None = None) -> _Decided:
    """Ask the images; if they show boards and do not agree, ask them again another way; then try what most boards have."""
    result, seen = _asked(_sample(files), lambda path: _seen_in(path, most_pixels, _USUAL_WAY))
    fits = _fits_of(seen)
    size = _fitting(result, fits, given)
    if size is not None or result.sizes.total() < _LEAST_SHARE * result.asked:
        return _Decided(result, size, fits)
    other, other_seen = _asked(_sample(files), lambda path: _seen_in(path, most_pixels, _OTHER_WAY))
    size = _fitting(other, _fits_of(other_seen), given)
    if size is None:
        held = [each for each in _USUAL_SIZES if fits.holds(each)]
        size = fits.grown(max(held, key=_area)) if held else None
    return _Decided(result, size, fits)


def _fits_of(seen: list[_Seen]) -> Fits:
    best = sorted(seen, key=lambda each: 0 if each.size is None else -_area(each.size))
    return Fits([each.image for each in best[:ENOUGH]])


def _fitting(result: Vote, fits: Fits, given: Inner | None) -> Inner | None:
    """Return the largest size that fits most images, of those that images show; else the one on which they agree."""
    leader = result.leader
    shown = [leader] if leader is not None and fits.holds(leader) else result.ranked[:_TRIED]
    if result.sizes and (len(shown) > 1 or not result.is_over):  # what few images show may be a small part
        shown = [*shown, *_USUAL_SIZES]
    held = [size for size in (*shown, *([given] if given is not None else [])) if fits.holds(size)]
    held = [size for size in held if size == leader or fits.count(size) >= min(_LEAST_VOTES, result.asked)]
    if held:
        return fits.grown(max(held, key=_area))
    return None if leader is None else fits.grown(leader)


def _area(size: Inner) -> int:
    return size[0] * size[1]


def size_in_files(files: ViewFiles, most_pixels: int = MOST_PIXELS) -> Inner:
    """Find out which chessboard the images show: its inner corners, the larger count first.

    Raises:
        DataError: the images show none, do not agree, or none of them is an image.
    """
    # First: the corners of a ChArUco board look like those of a chessboard, until a hand hides some.
    marks = _marks_in(files, most_pixels)
    if marks is not None:
        raise DataError(
            f"these images show no chessboard, but {marks.words}", "name that board with --board; see --help"
        )
    decided = _decided(files, most_pixels)
    if decided.size is not None:
        return decided.size
    result = decided.vote
    if not result.sizes:
        _require_an_image(list(_sample(files))[:_SAMPLE], most_pixels)
        raise DataError(
            f"no chessboard is seen in {counted(result.asked, 'image')}",
            "take pictures with the whole board sharp and evenly lit, with a white margin around it",
        )
    likely = result.ranked[:3]
    seen = " ".join(f"{size_text(size)} ({result.sizes[size]})" for size in likely)
    raise DataError(
        f"the images do not agree on the board's size: inner corners {seen}",
        f"count them and name them, such as --board {size_text(likely[0])}, and show the whole board in each picture",
    )


def require_size(files: ViewFiles, given: Inner, most_pixels: int = MOST_PIXELS) -> None:
    """Check in some images that a chessboard has the size that was given, columns and rows of inner corners; what cannot be told passes.

    Raises:
        SettingsError: the images show another board.
    """
    wanted = max(given), min(given)
    decided = _decided(files, most_pixels, wanted)
    shown, fits = decided.size, decided.fits
    if shown is None or shown == wanted:
        return
    if decided.vote.sizes.total() <= decided.vote.asked / _CLEAR_VOTES:
        return  # most images show nothing: a few may be wrong
    is_part = wanted[0] <= shown[0] and wanted[1] <= shown[1]  # it is found, too, and that proves nothing
    # The full search takes the outermost squares' own corners for inner ones: it is asked only where nothing better is known.
    if not is_part and (
        fits.rivals(wanted, shown) or (not fits.holds(shown) and fits.shows(Board(*given, _ANY_SIDE_M)))
    ):
        return
    raise SettingsError(
        f"these boards have {size_text(shown)} inner corners, --board says {size_text(given)}",
        f"give --board {size_text(shown)}, or leave --board out",
    )


def require_marks_of(files: ViewFiles, board: Board, most_pixels: int = MOST_PIXELS) -> Board:
    """Check in some images that the marks are those of the board that was given; what cannot be told passes.

    Returns:
        The board, with the arrangement of its marks as the images show it.

    Raises:
        SettingsError: the images show another board of marks.
    """
    return require_marks(_marks_in(files, most_pixels), board)


def _marks_in(files: ViewFiles, most_pixels: int) -> SeenMarks | None:
    return find_marks(side_by_side(lambda path: _small(path, most_pixels), list(_sample(files))[:_MARKED]))


def _seen_in(path: Path, most_pixels: int, way: int) -> _Seen | None:
    image = _small(path, most_pixels)
    if image is None:
        return None
    small = small_for_sizes(image)
    return _Seen(small, size_seen(small, way))


def _small(path: Path, most_pixels: int) -> Image | None:
    """Decode an image no larger than needed; None if it cannot be read: whoever reads all of them says so."""
    try:
        file = open_image(path, most_pixels)
        reduction = max((each for each in (1, 2, 4, 8) if max(file.size_px) / each >= _SEARCHED_PX), default=1)
        return to_grey(decode_file(file, reduction))
    except TandemError:
        return None


def _require_an_image(paths: list[Path], most_pixels: int) -> None:
    """Say what is wrong with the first file if none of them can be read."""
    if all(_small(path, most_pixels) is None for path in paths):
        decode_file(open_image(paths[0], most_pixels))


def _batches(images: Iterator[Path]) -> Iterator[list[Path]]:
    """Give at most `_SAMPLE` images, some at a time."""
    sample = [path for path, _ in zip(images, range(_SAMPLE), strict=False)]
    for start in range(0, len(sample), _BATCH):
        yield sample[start : start + _BATCH]


def _sample(files: ViewFiles) -> Iterator[Path]:
    """Give images of both sides, spread over the series whatever its length: neighbours look alike."""
    paths = [path for _, left, right in files.pairs for path in (left, right)]
    step = next((each for each in (7, 11, 13, 17, 19, 23) if len(paths) % each), 1)
    yield from (paths[index * step % len(paths)] for index in range(len(paths)))
