"""Images that would take gigabytes, from a board, an HTTP camera and files: refused by name, memory stays normal, the run goes on."""

import json
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import cv2
import pytest

from common.frame import PixelFormat
from tests.support import bombs
from tests.support.board_thread import board_of
from tests.support.lying_board import Lie, LyingCamera
from tests.support.pictures import jpeg
from tests.support.programs import Program, board, host, lines, until

FPS = 20
SIZE = (640, 480)
_MOST_OF_NORMAL = 1.3

PNG = PixelFormat.PNG


@cache
def bomb_frames() -> list[Lie]:
    """All images that claim or take more than an image of 640x480."""
    texts = bombs.chunk(b"zTXt", b"a\0\0" + bombs.packed_zeros(7)) * 300
    large = bombs.black_png(12_000, 12_000)
    return [
        Lie(bombs.SMALL_BOMB),
        Lie(bombs.SMALL_BOMB, (16_384, 16_384)),
        Lie(bombs.claiming(jpeg(16, 8), 8000, 8000), (8000, 8000)),
        Lie(large, None, PNG),
        Lie(large, (12_000, 12_000), PNG),
        Lie(bombs.black_png(8000, 8000, bits=16, colour=6), (8000, 8000), PNG),
        Lie(bombs.black_png(8000, 8000, interlaced=True), (8000, 8000), PNG),
        Lie(bombs.black_png(*SIZE, bits=16, interlaced=True), None, PNG),
        Lie(bombs.black_png(*SIZE, extra=texts), None, PNG),
        Lie(bombs.with_scans(bombs.progressive(*SIZE), 300)),
        Lie(jpeg(8, 6), (8, 6)),
        Lie(jpeg(320, 240)),
        Lie(bytes(10), (16_384, 16_384), PixelFormat.GREY),
    ]


def peak_mb(program: Program) -> float:
    """The peak resident memory of a program."""
    status = Path(f"/proc/{program.process.pid}/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some images of 640x480."""
    folder = tmp_path_factory.mktemp("film")
    for number in range(4):
        image = cv2.putText(bombs.textured(*SIZE), str(number), (100, 300), cv2.FONT_HERSHEY_PLAIN, 20, (0, 0, 0), 9)
        assert cv2.imwrite(str(folder / f"{number}.jpg"), image)
    return folder


def run(
    film: Path, folder: Path, lies: Sequence[Lie], options: Sequence[str], size_px: tuple[int, int] | None = None
) -> tuple[float, dict[str, object], str]:
    """Let a board show its film and its lies for a while; return the host's peak in MB, its report and its log."""
    link, out = f"ipc://{folder}/link", folder / "out"
    camera = f"replay:{film}?fps={FPS}&loop=1"
    receiving = ["run", "--link", link, "--camera", camera, "--out", str(out), "--save-every", "0", "--json", *options]
    with board_of(LyingCamera(film, FPS, lies, size_px), link), host(receiving, folder) as receiver:
        if size_px is None:
            until(lambda: lines(out / "delays.jsonl") >= 3 * FPS, "pairs")
        else:
            until(lambda: "no_sound_image" in receiver.stderr, "the host says that it sees nothing")
        peak = peak_mb(receiver)
        assert receiver.stop() == 0, receiver.stderr
    report: dict[str, object] = json.loads((out / "report.json").read_text())
    return peak, report, receiver.stderr


@pytest.mark.parametrize("options", [["--rectified", "--disparities", "16", "--matcher", "block"], []])
def test_bombs_from_a_board(film: Path, tmp_path: Path, options: list[str]) -> None:
    """A host that gets a bomb with every other frame pairs the others, counts each bomb by its reason, and uses no more memory than without; its log stays short."""
    normal, quiet = (tmp_path / name for name in ("normal", "quiet"))
    for folder in (normal, quiet):
        folder.mkdir()
    usual_mb, report, _ = run(film, normal, [], options)
    assert report["pairs_account"]["spoiled_images"] == {}  # type: ignore[index]  # JSON
    peak_mb, report, log = run(film, quiet, bomb_frames(), options)
    print(f"peak {peak_mb:.0f} MB, without bombs {usual_mb:.0f} MB")
    assert peak_mb < _MOST_OF_NORMAL * usual_mb
    account = report["pairs_account"]
    assert isinstance(account, dict)
    counted = account["spoiled_images"]
    assert set(counted) == {"too_large", "other_size", "too_many_scans"}
    assert account["undecodable"] == sum(counted.values())
    assert (
        account["paired"]
        == account["processed"] + account["undecodable"] + account["dropped_fifo"] + account["stopped"]
    )
    assert len(log.splitlines()) < 25, log
    assert "spoiled image: too large" in (quiet / "out" / "index.html").read_text()


def test_a_board_that_claims_a_camera_of_a_bombs_size(film: Path, tmp_path: Path) -> None:
    """A hello beyond the limit: no frame is enlarged to it; the log says that no image is believed, and the run goes on until it is stopped."""
    _, report, log = run(film, tmp_path, [], [], (16_384, 16_384))
    assert report["pairs"] == 0
    assert list(report["pairs_account"]["spoiled_images"]) == ["too_large"]  # type: ignore[index]  # JSON
    assert "no_sound_image" in log
    assert "16384x16384" in log
    assert "--max-megapixels" in log


def test_corrupt_frames_are_counted_and_nothing_is_printed(film: Path, tmp_path: Path) -> None:
    """JPEGs that are cut and closed in the middle are spoiled by name; libjpeg's messages reach stderr only through the log."""
    content = (film / "0.jpg").read_bytes()
    cut = content[: len(content) // 2] + b"\xff\xd9"
    _, report, log = run(film, tmp_path, [Lie(cut)], [])
    assert report["pairs_account"]["spoiled_images"]["corrupt"] > FPS  # type: ignore[index]  # JSON
    assert not [line for line in log.splitlines() if line.startswith("Corrupt")]
    assert len(log.splitlines()) < 15, log


def phone_host(*arguments: object) -> "subprocess.CompletedProcess[str]":
    """Run a verb to its end."""
    command = [sys.executable, "-P", "-m", "phone_host.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)


@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_files_beyond_the_limit(tmp_path: Path, suffix: str) -> None:
    """stereo, calibrate and replay refuse a file that claims too much in one line: its name, its size, the limit, the remedy; exit 4."""
    content = bombs.SMALL_BOMB if suffix == ".jpg" else bombs.black_png(12_000, 12_000)
    left, right = (tmp_path / side / f"1{suffix}" for side in ("left", "right"))
    for path in (left, right):
        path.parent.mkdir()
        path.write_bytes(content)
    out = tmp_path / "out"
    size = "30000x30000" if suffix == ".jpg" else "12000x12000"
    for arguments in (
        ["stereo", left, right, "--rectified", "--disparities", 16, "--out", out],
        ["calibrate", left.parent, right.parent, "--board", "9x6", "--square", "25mm", "--out", out / "rig.yaml"],
        ["run", "--camera", f"replay:{left.parent}?fps=5", "--link", f"ipc://{tmp_path}/link"],
    ):
        done = phone_host(*arguments)
        assert done.returncode == 4, done.stderr
        [line] = [line for line in done.stderr.splitlines() if "error" in line]
        assert size in line
        if arguments[0] != "run" or suffix != ".jpg":  # no link takes 30000 px: that is reported first
            assert "the limit is 64 MPx" in line
        assert "left" in line


def test_a_higher_limit_is_taken(tmp_path: Path) -> None:
    """--max-megapixels sets the limit, from the option or the environment."""
    left, right = tmp_path / "left.png", tmp_path / "right.png"
    for path in (left, right):
        path.write_bytes(bombs.black_png(1200, 1000))
    given = ["stereo", left, right, "--rectified", "--disparities", 16, "--out", tmp_path / "out"]
    assert phone_host(*given, "--max-megapixels", 1).returncode == 4
    accepted = phone_host(*given, "--max-megapixels", 2)
    assert accepted.stdout.startswith("Depth is wrong: both cameras see no scene at all")  # they are black
    assert phone_host(*given, "--max-megapixels", 0).returncode == 2


def test_honest_images_that_fit_no_rig_end_the_run(film: Path, tmp_path: Path) -> None:
    """Two cameras of different size are no lie, but no rectified pair either: after ten pairs the run ends with both sizes and the remedy."""
    other = tmp_path / "other"
    other.mkdir()
    for number in range(4):
        (other / f"{number}.jpg").write_bytes(jpeg(320, 240, number))
    link = f"ipc://{tmp_path}/link"
    receiving = [
        "run",
        "--link",
        link,
        "--camera",
        f"replay:{film}?fps={FPS}&loop=1",
        "--rectified",
        "--disparities",
        "16",
    ]
    with (
        board(["run", "--camera", f"replay:{other}?fps={FPS}&loop=1", "--link", link], tmp_path),
        host(receiving, tmp_path) as receiver,
    ):
        assert receiver.wait() == 4
    [line] = [line for line in receiver.stderr.splitlines() if "error: " in line]
    assert "320x240 px" in line
    assert "640x480 px" in line
    assert "--calibration" in line
