"""Images of one camera that have several sizes: no recording of them is made without a word."""

from pathlib import Path

import pytest

from common.recording.opened import open_recorded
from phone_host.cli import main
from tests.support import foreign_recordings as other
from tests.support.foreign_recordings import COMPRESSED, HEIGHT, WIDTH, picture

_ODD = picture(0, 2)[:-8, :-8]


def _folders(folder: Path, odd_side: int, odd_number: int) -> list[str]:
    """Two folders with four pictures each, one of which is smaller."""
    for side in (0, 1):
        (folder / str(side)).mkdir()
        for number in range(4):
            image = _ODD if (side, number) == (odd_side, odd_number) else picture(side, number)
            (folder / str(side) / f"{number:04}.png").write_bytes(other.png(image))
    return [str(folder / "0"), str(folder / "1")]


@pytest.mark.parametrize("odd_side", [0, 1])
@pytest.mark.parametrize("odd_number", [0, 2, 3])
def test_a_picture_of_another_size_is_refused(
    tmp_path: Path, odd_side: int, odd_number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line names the picture, its size and that of the others, wherever it stands; nothing is written."""
    out = tmp_path / "out.mcap"
    folders = _folders(tmp_path, odd_side, odd_number)
    assert main(["sessions", "import", *folders, "--fps", "10", "--out", str(out)]) == 4
    [line] = capsys.readouterr().err.splitlines()
    name = Path(folders[odd_side]) / f"{odd_number:04}.png"
    assert f"{name} is {WIDTH - 8}x{HEIGHT - 8}, but 3 of the 4 images beside it are {WIDTH}x{HEIGHT}" in line
    assert not out.exists()


def test_cameras_may_have_different_sizes(tmp_path: Path) -> None:
    """The left camera's images have another size than the right camera's: they are imported."""
    for side, shape in (("left", (24, 32)), ("right", (16, 24))):
        (tmp_path / side).mkdir()
        for number in range(3):
            image = picture(0, number)[: shape[0], : shape[1]]
            (tmp_path / side / f"{number:04}.png").write_bytes(other.png(image))
    out = tmp_path / "out.mcap"
    assert main(["sessions", "import", str(tmp_path), "--fps", "10", "--out", str(out)]) == 0


@pytest.mark.parametrize("odd_number", [0, 2])
def test_messages_of_another_size_are_left_out(
    tmp_path: Path, odd_number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a topic that holds one image of another size, the others are imported, and the number of those that are not is reported with both sizes."""
    sent = other.stereo(
        lambda side, number, at_ns: other.compressed(
            "png", other.png(_ODD if (side, number) == (0, odd_number) else picture(side, number)), at_ns
        ),
        COMPRESSED,
    )
    path, out = other.file_of(tmp_path, sent), tmp_path / "out.mcap"
    assert main(["sessions", "import", str(path), "--out", str(out)]) == 0
    words = f"1 image of /cam0/image left out: {WIDTH - 8}x{HEIGHT - 8} instead of {WIDTH}x{HEIGHT}"
    assert words in capsys.readouterr().out
    assert [len(shown) for _, shown in sorted(open_recorded(out).images.items())] == [3, 4]
