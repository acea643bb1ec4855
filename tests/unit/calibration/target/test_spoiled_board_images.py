"""Any calibration image may be spoiled: each gives one clear line of its own, and the other pairs are used."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from common.plain_text import printable
from phone_host.calibration.target.board_views import BoardViews, look_for_boards
from phone_host.calibration.target.corners import find_corners
from phone_host.calibration.target.pairs import Reason
from phone_host.model import Image
from phone_host.stereo.view_files import pair_files
from tests.support.boards import BOARD, poses, render_pair
from tests.support.oriented import oriented
from tests.support.pictures import encoded
from tests.support.rigs import small_rig

_PAIRS: Final = [render_pair(small_rig(), pose) for pose in poses(3, seed=8, depth_m=(0.45, 0.5))]


def _cmyk(image: Image) -> bytes:
    """A JPEG as print shops save it: four inks in scans of their own, inverted as Adobe does, so that without black ink each is a grey image."""
    inks, black = encoded(".jpg", image), encoded(".jpg", np.full_like(image, 255))
    start, scan = inks.index(b"\xff\xc0"), inks.index(b"\xff\xda")
    frame = inks[start + 2 :][: int.from_bytes(inks[start + 2 : start + 4], "big")]
    four = b"".join(bytes([number, 0x11, 0]) for number in (1, 2, 3, 4))
    length = (8 + len(four)).to_bytes(2, "big")
    adobe = b"\xff\xee\x00\x0eAdobe\x00\x64\x00\x00\x00\x00\x00"
    head = inks[:2] + adobe + inks[2:start] + b"\xff\xc0" + length + frame[2:7] + b"\x04" + four
    tables = inks[start + 2 + len(frame) : scan]
    scans = [
        b"\xff\xda\x00\x08\x01" + bytes([number, 0]) + b"\x00\x3f\x00" + jpeg[jpeg.index(b"\xff\xda") + 10 : -2]
        for number, jpeg in ((1, inks), (2, inks), (3, inks), (4, black))
    ]
    return head + tables + b"".join(scans) + b"\xff\xd9"


_KINDS: Final[dict[str, tuple[Callable[[Image], bytes], Reason | None, str]]] = {
    "empty": (lambda _: b"", Reason.UNREADABLE, ""),
    "truncated": (lambda image: encoded(".png", image)[:3000], Reason.UNREADABLE, ""),
    "wrong size": (
        lambda image: encoded(".png", image[:, :-40].copy()),
        Reason.OTHER_SIZE,
        "px, the others are",
    ),
    "16 bit": (lambda image: encoded(".png", image.astype(np.uint16) * 256), None, ""),
    "CMYK": (_cmyk, None, ""),
    "EXIF-rotated": (
        lambda image: oriented(".png", image, 3),
        Reason.TURNED,
        "turned by 180 degrees by its EXIF header",
    ),
    "text": (lambda _: b"this is no image\n" * 40, Reason.UNREADABLE, ""),
}


def _look(folder: Path, side: str, index: int, content: bytes) -> BoardViews:
    for name, pictures in zip(("left", "right"), zip(*_PAIRS, strict=True), strict=True):
        (folder / name).mkdir()
        for number, image in enumerate(pictures):
            (folder / name / f"{number}.png").write_bytes(encoded(".png", image))
    (folder / side / f"{index}.png").write_bytes(content)
    files = pair_files(str(folder / "left"), str(folder / "right"))
    return look_for_boards(files, BOARD, lambda: None)


@pytest.mark.parametrize("kind", list(_KINDS))
@pytest.mark.parametrize(("side", "index"), [("left", 0), ("left", 2), ("right", 0), ("right", 1)])
def test_each_kind_of_spoiled_image_is_one_line(tmp_path: Path, kind: str, side: str, index: int) -> None:
    """Its pair is rejected by name with one printable line that names the file; the others stay. 16 bit and CMYK are read as what they show."""
    make, reason, said = _KINDS[kind]
    views = _look(tmp_path, side, index, make(_PAIRS[index][0 if side == "left" else 1]))
    if reason is None:
        assert len(views.pairs) == 3
        assert views.rejected == ()
        found = next(pair for pair in views.pairs if pair.name == str(index))
        true = find_corners(_PAIRS[index][0], BOARD)
        np.testing.assert_allclose(found.left_px, true, atol=0.1)
        return
    assert sorted(pair.name for pair in views.pairs) == sorted({"0", "1", "2"} - {str(index)})
    [rejected] = views.rejected
    assert (rejected.name, rejected.reason) == (str(index), reason)
    assert f"{index}.png" in rejected.detail
    assert said in rejected.detail
    assert "\n" not in rejected.detail
    assert printable(rejected.detail) == rejected.detail


def test_the_content_counts_not_the_name(tmp_path: Path) -> None:
    """A JPEG under the name of a PNG is read."""
    views = _look(tmp_path, "left", 0, encoded(".jpg", _PAIRS[0][0]))
    assert len(views.pairs) == 3
