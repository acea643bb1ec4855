"""The parts of a live calibration beside the guide: finding a moving board, the folders of pictures, the voice, the lines that are written."""

import io
import shlex
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest
from rich.console import Console

from common import now
from common.errors import DataError, SettingsError, UnavailableError
from common.link.factory import open_link, parse_link
from common.stamp import HOST_CLOCK
from phone_host.calibration.guide.gates import Gate, Glance
from phone_host.calibration.guide.snapshot import before_board
from phone_host.calibration.target.board_names import named_board
from phone_host.calibration.target.board_size import whole_size_seen
from phone_host.calibration.target.corners import Board, find_corners
from phone_host.calibration.target.moving_board import BoardFinder, SizeCheck, SizeFinder
from phone_host.calibration.target.sharpness import BoardLook
from phone_host.camera.factory import open_camera
from phone_host.jobs.calibrate.live import ring_instead
from phone_host.jobs.calibrate.live_calibration import LiveCalibration, LiveSettings
from phone_host.jobs.calibrate.newest import Newest
from phone_host.jobs.calibrate.view import Lines, Picture, SnapshotFiles, Spoken
from phone_host.jobs.calibrate.voice import Voice, speech_program
from phone_host.model import Image, Verdict
from phone_host.recording.chosen_views import Pictures, ViewFolders
from phone_host.run.host_settings import HostSettings
from phone_host.verbs.calibrate import exit_code, run
from tests.support.boards import BOARD, poses, render_pair
from tests.support.pictures import encoded
from tests.support.programs import until
from tests.support.requests import request_of
from tests.support.rigs import small_rig

_PAIR = render_pair(small_rig(), poses(1, seed=8, depth_m=(0.4, 0.5))[0])
_SIZES = ((640, 480), (640, 480))
_PAIR_CORNERS = 30.0 * BOARD.points_m()[:, :2] / BOARD.square_m + 100


def test_a_moving_board_is_found_roughly_and_then_exactly() -> None:
    """Both ways agree to half a pixel; the second look, near the first place, finds the same; an empty image has none."""
    finder = BoardFinder(BOARD)
    rough, exact = finder.find(*_PAIR), finder.find_exactly(*_PAIR)
    again = finder.find(*_PAIR)
    for image, one, two, three in zip(_PAIR, rough, exact, again, strict=True):
        np.testing.assert_allclose(two, find_corners(image, BOARD), atol=1e-6)
        assert np.abs(one - two).max() < 0.5
        assert np.abs(three - two).max() < 0.5
    left, right = finder.find(_PAIR[0], np.full_like(_PAIR[1], 128))
    assert (len(left), len(right)) == (54, 0)


def test_the_boards_size_is_found_and_a_wrong_one_is_named() -> None:
    """After a few pairs the size is known; a board that was named otherwise is refused with the right size."""
    finder = SizeFinder(0.025)
    found = [finder.find(*_PAIR) for _ in range(3)]
    assert found[-1] == BOARD
    check = SizeCheck(Board(8, 6, 0.025))
    for _ in range(12):
        check.missed(*_PAIR)
    with pytest.raises(SettingsError, match="this board has 9x6 inner corners, --board says 8x6"):
        check.missed(*_PAIR)


def test_a_board_without_a_margin_is_counted_in_some_pictures() -> None:
    """A board that is black to its edge never looks whole: it is counted as in files, in pictures that are some looks apart."""
    left, right = (_cut_out(image) for image in _PAIR)
    assert (whole_size_seen(left), whole_size_seen(right)) == (None, None)
    finder = SizeFinder(0.025, apart_looks=2, pictures=3)
    assert [finder.find(left, right) for _ in range(6)] == [None] * 5 + [BOARD]


def _cut_out(image: Image) -> Image:
    """The board's squares before a black background."""
    grid = find_corners(image, BOARD).reshape(BOARD.rows, BOARD.columns, 2)
    down, across = grid[1, 0] - grid[0, 0], grid[0, 1] - grid[0, 0]
    edge = [
        grid[0, 0] - down - across,
        grid[0, -1] - down + across,
        grid[-1, -1] + down + across,
        grid[-1, 0] + down - across,
    ]
    board = cv2.fillConvexPoly(np.zeros(image.shape, np.uint8), np.rint(edge).astype(np.int32), 255)
    return np.where(board > 0, image, 10).astype(np.uint8)


def test_a_row_that_glare_hides_from_the_quick_look_is_found() -> None:
    """A window's light lies on the first column in both pictures, so that a smaller board seems whole: its own size is looked for before that is believed."""
    left, right = (_lit(image) for image in _PAIR)
    assert (whole_size_seen(left), whole_size_seen(right)) == ((8, 6), (8, 6))
    finder = SizeFinder(0.025)
    found = [finder.find(left, right) for _ in range(3)]
    assert found[-1] == BOARD


def _lit(image: Image) -> Image:
    """Half as bright again towards white: a soft stripe along the outermost squares of one side."""
    grid = find_corners(image, BOARD).reshape(BOARD.rows, BOARD.columns, 2)
    across, along = grid[:, 1] - grid[:, 0], grid[1] - grid[0]
    outer, inner = grid[:, 0] - 1.6 * across, grid[:, 0] + 0.5 * across
    ends = [side + along[0] * by for side, by in ((outer[0], -1), (outer[-1], 1), (inner[-1], 1), (inner[0], -1))]
    stripe = cv2.fillConvexPoly(np.zeros(image.shape, np.uint8), np.array(ends).astype(np.int32), 255)
    light = cv2.GaussianBlur(stripe, (0, 0), 6) / 255.0
    return np.asarray(image + (255 - image) * light * 0.5, np.uint8)


def test_a_board_of_marks_is_not_taken_for_a_chessboard() -> None:
    """A ChArUco board is refused by name."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000)
    board = cv2.aruco.CharucoBoard((8, 6), 0.03, 0.022, family)
    image = np.asarray(board.generateImage((640, 480), marginSize=20), np.uint8)
    finder = SizeFinder(0.03)
    assert finder.find(image, image) is None
    with pytest.raises(DataError, match="ArUco 5x5"):
        finder.find(image, image)


def test_marks_of_another_board_are_told_while_it_is_shown() -> None:
    """After twelve looks without a corner the person is not asked for more light: the marks are another family's."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000)
    board = cv2.aruco.CharucoBoard((8, 6), 0.03, 0.022, family)
    shown = np.asarray(board.generateImage((640, 480), marginSize=20), np.uint8)
    check = SizeCheck(named_board("charuco:8x6:30mm:22mm:4x4", None))
    for _ in range(11):
        check.missed(shown, shown)
    with pytest.raises(SettingsError, match="marks of the family ArUco 5x5 and 8x6 squares, --board says charuco:8x6"):
        check.missed(shown, shown)


@pytest.mark.parametrize("live", [True, False])
def test_pictures_replace_those_of_an_earlier_session_only(tmp_path: Path, *, live: bool) -> None:
    """Pictures are exact and numbered; a second session that has some replaces them, one that has none does not; pictures of other names are refused."""
    left, right = tmp_path / "left", tmp_path / "right"
    folders = ViewFolders(left, right, are_taken_live=live)
    folders.write(Pictures("01", *_PAIR))
    folders.close("{}")
    assert np.array_equal(np.asarray(cv2.imread(str(right / "01.png"), cv2.IMREAD_GRAYSCALE)), _PAIR[1])
    assert (left / "cameras.json").read_text() == "{}"
    ViewFolders(left, right, are_taken_live=live).close("")
    folders = ViewFolders(left, right, are_taken_live=live)
    folders.write(Pictures("02", *_PAIR))
    assert [path.name for path in sorted(left.glob("*.png"))] == ["01.png"]
    folders.close("")
    assert [path.name for path in sorted(left.glob("*.*")) if path.suffix] == ["02.png"]
    (right / "holiday.jpg").write_bytes(b"")
    with pytest.raises(UnavailableError, match="holds other pictures"):
        ViewFolders(left, right, are_taken_live=live)


def test_only_the_newest_thing_is_worked_on() -> None:
    """What comes while one is worked on replaces what waits; the end waits for the last; a failure is kept."""
    begun, go, seen = threading.Event(), threading.Event(), list[int]()

    def work(number: int) -> None:
        begun.set()
        go.wait(60)
        seen.append(number)
        if number == 4:
            raise ValueError

    newest = Newest("test", work)
    newest.offer(1)
    begun.wait(60)
    for number in (2, 3):
        newest.offer(number)
    go.set()
    until(lambda: seen == [1, 3], "the third")
    newest.offer(4)
    newest.finish()
    assert seen == [1, 3, 4]
    assert isinstance(newest.failure, ValueError)


def test_words_are_spoken_by_the_systems_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The program that is there gets the words as one argument; without one there is no command."""
    monkeypatch.setenv("PATH", str(tmp_path))
    assert speech_program() == ()
    script = tmp_path / "espeak-ng"
    script.write_text(f'#!/bin/sh\necho "$1" >> {tmp_path}/said\n')
    script.chmod(0o755)
    assert speech_program() == ("espeak-ng",)
    failed = list[OSError]()
    voice = Voice(speech_program(), failed.append)
    spoken = Spoken(voice.say)
    for _ in range(2):
        spoken.show(before_board("hold still", 25, 1.0), (), "")
    voice.finish()
    assert (tmp_path / "said").read_text() == "hold still\n"
    assert not failed


def test_the_bell_rings_where_the_speech_program_does_not_start(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A program for another machine: that is told once, whatever else is to be said, and the bell takes its place."""
    (tmp_path / "espeak-ng").write_bytes(b"\x7fELF")
    (tmp_path / "espeak-ng").chmod(0o755)
    picture = Picture(Console(file=io.StringIO()))
    voice = Voice((str(tmp_path / "espeak-ng"),), lambda reason: ring_instead(picture, "espeak-ng", reason))
    voice.say("hold still")
    until(lambda: picture.rings, "the bell")
    voice.say("closer")
    voice.finish()
    assert caplog.text.count("voice_off program=espeak-ng") == 1
    assert "the terminal's bell rings instead" in caplog.text


def test_lines_are_written_when_they_are_new(capsys: pytest.CaptureFixture[str]) -> None:
    """The same words and the same note are written once."""
    lines = Lines()
    for words, note in (("hold still", ""), ("hold still", "waiting"), ("closer", "waiting"), ("closer", "")):
        lines.show(before_board(words, 25, 1.0), (), note)
    assert capsys.readouterr().err == "say: hold still\nnote: waiting\nsay: closer\n"


def test_the_picture_and_the_files_show_the_words(tmp_path: Path) -> None:
    """On a terminal of 48 columns, and in guide.json and guide.svg."""
    console = Console(file=io.StringIO(), force_terminal=True, width=48, height=20)
    with Picture(console) as picture:
        picture.show(before_board("hold still", 25, 1.0), (), "waiting for a board")
    assert isinstance(console.file, io.StringIO)
    assert "hold still" in console.file.getvalue()
    assert "waiting for a board" in console.file.getvalue()
    SnapshotFiles(tmp_path / "shown").show(before_board("hold still", 25, 1.0), (), "")
    assert sorted(path.name for path in (tmp_path / "shown").iterdir()) == ["guide.json", "guide.svg"]
    assert '"words": "hold still"' in (tmp_path / "shown" / "guide.json").read_text()


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--live"], "no camera of this machine"),
        (["--live", "--camera", "replay:x", "--views", "2"], "--views is 2"),
        (["--live", "--camera", "replay:x", "left"], "--live with 1 folder"),
        (["--live", "--camera", "replay:x", "--rotate-left", "90"], "--live does not take"),
        (["left", "right", "--camera", "replay:x"], "--camera without --live"),
        (["left", "right", "--views", "9"], "--views without --live"),
        (["left", "right", "--wait", "5s"], "--wait without --live"),
        (["left", "right", "--tolerance", "5ms"], "--tolerance without --live"),
        (["left", "right", "--keys", "folder"], "--keys without --live"),
        (["left", "right", "--no-sound"], "--no-sound without --live"),
        ([], "neither pictures nor --live nor --import"),
    ],
)
def test_options_that_do_not_fit_are_refused(tmp_path: Path, options: list[str], problem: str) -> None:
    """Each in one line, before a camera is opened."""
    with pytest.raises(SettingsError, match=problem):
        run(request_of("calibrate", *options, "--square", "25mm", "--out", str(tmp_path / "rig.yaml")))


def test_a_rejected_rig_counts_more_than_a_signal() -> None:
    """SIGTERM is exit 0 and Ctrl-C 130, but a check that failed is exit 4 in any case."""
    assert [exit_code(Verdict.GOOD, is_interrupted=each) for each in (False, True)] == [0, 130]
    assert [exit_code(Verdict.REJECT, is_interrupted=each) for each in (False, True)] == [4, 4]


def test_a_live_session_is_repeated_with_all_its_options() -> None:
    """What a shell would take apart is quoted; what only cameras need is left out. Where the earlier calibration is replaced, it holds the pictures: no command."""
    words = ["--live", "--camera", "browser:", "--no-sound", "--views", "9", "--link", "ipc://x", "--link", "ipc://y"]
    kept = [
        "--board",
        "9x6",
        "--square",
        "120px*0.1794mm",
        "--baseline",
        "80mm",
        "--from",
        "old rig.yaml",
        "--pose-only",
    ]
    kept += ["--export", "ros", "--export", "kalibr", "--board-side", "right", "--max-megapixels", "20"]
    request = request_of("calibrate", *words, *kept, "--out", "new rig.yaml")
    told = shlex.split(request.again("my views/left", "right"))
    assert told[:4] == ["phone-host", "calibrate", "my views/left", "right"]
    assert request_of(*told[1:]) == request_of("calibrate", "my views/left", "right", *kept, "--out", "new rig.yaml")
    assert request_of("calibrate", "--live", "--from", "rig.yaml", "--out", "rig.yaml").again("l", "r") == ""


class _EagerLock:
    """A lock for which somebody waits: whenever it is free he is in, and takes a view."""

    def __init__(self, take: Callable[[], None]) -> None:
        self._take = take

    def __enter__(self) -> None:
        """Nobody else is in."""

    def __exit__(self, *_: object) -> None:
        self._take()


def test_a_view_that_is_taken_while_it_is_shown_is_shown_later(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The looker waits for the lock of what is shown: picture and views are of one moment all the same, and both views are told in the end."""
    (tmp_path / "film").mkdir()
    (tmp_path / "film" / "1.png").write_bytes(encoded(".png", _PAIR[0]))
    camera = open_camera(f"replay:{tmp_path}/film?fps=5&loop=1", HOST_CLOCK, now.monotonic_ns())
    settings = LiveSettings(
        host=HostSettings(), board=BOARD, square_m=0.025, most_views=5, left=tmp_path / "l", right=tmp_path / "r"
    )
    with closing(open_link(parse_link(f"ipc://{tmp_path}/b", listens_by_default=False))) as link, closing(camera):
        live = LiveCalibration(settings, camera, [link], lambda *_: pytest.fail("nothing is to be calibrated"))
        guide, at_s = live.guide, iter(range(1, 9))
        assert guide is not None

        def take() -> None:
            corners = _PAIR_CORNERS + 40.0 * len(guide.views)
            seen = Glance(at_ns=next(at_s) * 10**9, skew_ns=0, left_px=corners, right_px=corners - 20, sizes_px=_SIZES)
            looks = BoardLook(2.0, 0.0, 0.0), BoardLook(2.0, 0.0, 0.0)
            assert guide.examine(seen, looks, seen.at_ns) is Gate.TAKEN

        live.lock = _EagerLock(take)  # type: ignore[assignment]  # stands for the looker's thread
        shows = Lines()
        for count in (0, 1, 2):
            snapshot, views = live.shown()
            assert (snapshot.views, len(views)) == (count, count)
            shows.show(snapshot, views, "")
    assert capsys.readouterr().err.count("taken: ") == 2
