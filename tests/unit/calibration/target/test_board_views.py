"""Boards in image files: photographs are turned upright, one that is turned otherwise than its side is named, and HEIC is told."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from common.errors import DataError
from common.orientation import UPRIGHT, Orientation
from phone_host.calibration.target.board_views import BoardViews, look_for_boards
from phone_host.calibration.target.corners import find_corners
from phone_host.calibration.target.pairs import Reason
from phone_host.model import Image
from phone_host.stereo.view_files import pair_files
from tests.support.boards import BOARD, poses, render_pair
from tests.support.oriented import oriented
from tests.support.pictures import encoded
from tests.support.rigs import small_rig

_PAIRS = [render_pair(small_rig(), pose) for pose in poses(3, seed=8, depth_m=(0.45, 0.5))]
"""Three views of a board, as both cameras would see them if they were mounted upright."""


def _stored(image: Image, turns: int) -> Image:
    """The image as a sensor stores it that stands turned anticlockwise by so many quarters."""
    return np.ascontiguousarray(np.rot90(image, turns))


def _look(
    folder: Path, left: Callable[[int, Image], bytes], mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT)
) -> BoardViews:
    """Search three pairs; `left` makes the left image's file."""
    for side in ("left", "right"):
        (folder / side).mkdir()
    for index, pair in enumerate(_PAIRS):
        (folder / "left" / f"{index}.png").write_bytes(left(index, pair[0]))
        (folder / "right" / f"{index}.png").write_bytes(encoded(".png", pair[1]))
    files = pair_files(str(folder / "left"), str(folder / "right"))
    return look_for_boards(files, BOARD, lambda: None, mounted=mounted)


def _require_upright(views: BoardViews) -> None:
    """Corners and size are those of the upright images."""
    height, width = _PAIRS[0][0].shape
    assert views.sizes_px[0] == (width, height)
    assert [pair.name for pair in views.pairs] == ["0", "1", "2"]
    for pair, images in zip(views.pairs, _PAIRS, strict=True):
        np.testing.assert_allclose(pair.left_px, find_corners(images[0], BOARD), atol=0.02)


def test_photographs_with_exif_orientation_are_upright(tmp_path: Path) -> None:
    """A phone held upright stores its images lying, with orientation 6: corners and size are those of the upright image, and the turn is told."""
    views = _look(tmp_path, lambda _, image: oriented(".png", _stored(image, 1), 6))
    _require_upright(views)
    assert views.turned == (Orientation(90), UPRIGHT)


def test_a_camera_that_is_mounted_turned_is_turned_back(tmp_path: Path) -> None:
    """--rotate-left 270 undoes what a camera without EXIF does that stands turned clockwise."""
    views = _look(tmp_path, lambda _, image: encoded(".png", _stored(image, -1)), (Orientation(270), UPRIGHT))
    _require_upright(views)
    assert views.turned == (UPRIGHT, UPRIGHT)


@pytest.mark.parametrize(("orientation", "word"), [(3, "turned by 180 degrees"), (6, "turned by 90 degrees")])
def test_a_photograph_that_is_turned_otherwise_is_named(tmp_path: Path, orientation: int, word: str) -> None:
    """Of one side's images one has another EXIF orientation: it is rejected by name, even if its size is the same."""
    views = _look(tmp_path, lambda index, image: oriented(".png", image, orientation if index == 1 else 1))
    [rejected] = views.rejected
    assert (rejected.name, rejected.reason) == ("1", Reason.TURNED)
    assert f"1.png is {word} by its EXIF header, the others are not turned" in rejected.detail


def test_an_upright_photograph_among_lying_ones_is_named(tmp_path: Path) -> None:
    """Without any EXIF, its size tells."""
    views = _look(tmp_path, lambda index, image: encoded(".png", _stored(image, 1) if index == 2 else image))
    [rejected] = views.rejected
    assert (rejected.name, rejected.reason) == ("2", Reason.TURNED)
    assert "2.png" in rejected.detail
    assert "held another way" in rejected.detail


def test_a_folder_of_heic_says_how_to_convert_it(tmp_path: Path) -> None:
    """Not one image can be read, and the remedy is the first one's."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        (tmp_path / side / "IMG_1.HEIC").write_bytes(b"\0\0\0\x18ftypheic\0\0\0\0mif1heic" + b"\0" * 64)
    files = pair_files(str(tmp_path / "left"), str(tmp_path / "right"))
    with pytest.raises(DataError, match=r"IMG_1.HEIC is a HEIC image.*convert it"):
        look_for_boards(files, BOARD, lambda: None)


def test_a_view_given_twice_counts_once(tmp_path: Path) -> None:
    """Two pairs of the very same pictures: the second is rejected, and named with the first."""
    for side, images in zip(("left", "right"), zip(*_PAIRS, strict=True), strict=True):
        (tmp_path / side).mkdir()
        for number, index in enumerate((0, 1, 0)):
            (tmp_path / side / f"{number}.png").write_bytes(encoded(".png", images[index]))
    views = look_for_boards(pair_files(str(tmp_path / "left"), str(tmp_path / "right")), BOARD, lambda: None)
    assert [pair.name for pair in views.pairs] == ["0", "1"]
    (rejected,) = views.rejected
    assert (rejected.name, rejected.reason, rejected.detail) == ("2", Reason.REPEATED, "its images are those of 0")


def test_a_folder_of_what_cannot_be_read_is_given_up_early(tmp_path: Path) -> None:
    """Of 60 empty pairs 50 are read; the first cause is told, and the bar has moved as far."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for number in range(60):
            (tmp_path / side / f"{number}.png").touch()
    steps: list[int] = []
    files = pair_files(str(tmp_path / "left"), str(tmp_path / "right"))
    with pytest.raises(DataError, match=r"none of the first 50 pairs can be read: .*0\.png is empty"):
        look_for_boards(files, BOARD, lambda: steps.append(1))
    assert len(steps) == 50
