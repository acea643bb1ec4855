"""Folders of data sets as their authors laid them out: both cameras' pictures are taken, each with its time."""

from collections.abc import Callable
from pathlib import Path

import pytest

from common.recording.opened import open_recorded
from phone_host.cli import main
from tests.support import foreign_recordings as other
from tests.support.foreign_recordings import PERIOD_NS, ZERO_NS, picture

_COUNT = 3
_TIMES_NS = [ZERO_NS + number * PERIOD_NS for number in range(_COUNT)]
_COUNTED_NS = [number * PERIOD_NS for number in range(_COUNT)]


def _pictures(folders: tuple[Path, Path], names: list[str]) -> None:
    for side, folder in enumerate(folders):
        folder.mkdir(parents=True)
        for number, name in enumerate(names):
            (folder / f"{name}.png").write_bytes(other.png(picture(side, number)))


def _euroc(root: Path) -> None:
    _pictures((root / "cam0" / "data", root / "cam1" / "data"), [str(at) for at in _TIMES_NS])
    for name in ("cam0", "cam1"):
        rows = "".join(f"{at},{at}.png\r\n" for at in _TIMES_NS)
        (root / name / "data.csv").write_text("#timestamp [ns],filename\r\n" + rows)


def _kitti(left: str, right: str) -> Callable[[Path], None]:
    def make(root: Path) -> None:
        _pictures((root / left, root / right), [f"{number:06}" for number in range(_COUNT)])
        (root / "times.txt").write_text("".join(f"{at / 1e9:.6e}\n" for at in _COUNTED_NS))

    return make


def _ours(root: Path) -> None:
    _pictures((root / "left", root / "right"), [str(at) for at in _TIMES_NS])


FOLDERS: dict[str, tuple[Callable[[Path], None], list[int]]] = {
    "EuRoC, mav0": (_euroc, _TIMES_NS),
    "KITTI, image_0 and image_1": (_kitti("image_0", "image_1"), _COUNTED_NS),
    "KITTI, image_2 and image_3": (_kitti("image_2", "image_3"), _COUNTED_NS),
    "left and right": (_ours, _TIMES_NS),
}


@pytest.mark.parametrize("layout", FOLDERS)
def test_folders_of_data_sets_are_imported(tmp_path: Path, layout: str) -> None:
    """The name of the root is enough: every picture of both cameras is taken, byte for byte, with its time."""
    make, times_ns = FOLDERS[layout]
    make(tmp_path / "set")
    out = tmp_path / "out.mcap"
    assert main(["sessions", "import", str(tmp_path / "set"), "--out", str(out)]) == 0
    for side, topic in enumerate(("/left/image/compressed", "/right/image/compressed")):
        shown = open_recorded(out).images[topic]
        assert [each.image.stamp_ns for each in shown] == times_ns
        expected = [other.png(picture(side, number)) for number in range(_COUNT)]
        assert [bytes(each.image.payload) for each in shown] == expected
