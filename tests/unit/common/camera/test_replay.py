"""Replay's own rules: order of names, globs, the image of a moment, options of the URI."""

import re
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.camera.base import Skipped
from common.camera.factory import open_camera, parse_camera
from common.camera.replay import ReplayCamera, ReplaySettings, find_images
from common.errors import DataError, SettingsError, UnavailableError
from common.frame import Frame
from common.name_order import name_order
from common.protocol.message import Pacing
from phone_host.camera.factory import check_camera
from tests.support.pictures import jpeg

NAMES = st.text(st.sampled_from("ab019_.²٣é"), min_size=1, max_size=8)


def names(pattern: str) -> list[str]:
    """The names that a replay of this folder or glob shows, in order."""
    return [path.name for path in find_images(pattern)]


def fill(folder: Path, *wanted: str) -> Path:
    """Write small, different JPEGs with these names there."""
    folder.mkdir(exist_ok=True)
    for seed, name in enumerate(wanted):
        (folder / name).write_bytes(jpeg(seed=seed))
    return folder


@given(st.lists(st.integers(0, 10**6), unique=True, max_size=20))
@settings(deadline=None)
def test_numbers_in_names_count_as_numbers(numbers: list[int]) -> None:
    """Names that differ only in a number are in the order of that number."""
    paths = [Path(f"frame{number}.jpg") for number in numbers]
    assert sorted(paths, key=name_order) == [Path(f"frame{number}.jpg") for number in sorted(numbers)]


@given(st.lists(NAMES, unique=True, max_size=20))
@settings(deadline=None)
def test_any_names_have_one_order(texts: list[str]) -> None:
    """Every set of names can be sorted, and the order does not depend on how the folder lists them."""
    paths = [Path(text) for text in texts]
    backwards = list(reversed(paths))
    assert sorted(paths, key=name_order) == sorted(backwards, key=name_order)


def test_a_folder_shows_its_images_in_name_order(tmp_path: Path) -> None:
    """frame2 comes before frame10, and files without an image's name are left out."""
    fill(tmp_path, "frame10.jpg", "frame2.JPG", "frame1.png")
    (tmp_path / "notes.txt").write_text("no image")
    assert names(str(tmp_path)) == ["frame1.png", "frame2.JPG", "frame10.jpg"]


def test_globs_and_single_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A glob shows its matches, absolute or relative, across folders with **; a single file shows itself."""
    fill(tmp_path, "l1.jpg", "l2.jpg", "r1.jpg")
    fill(tmp_path / "sub", "l3.jpg")
    assert names(f"{tmp_path}/l*.jpg") == ["l1.jpg", "l2.jpg"]
    assert names(f"{tmp_path}/?1.jpg") == ["l1.jpg", "r1.jpg"]
    assert names(f"{tmp_path}/**/l[23].jpg") == ["l2.jpg", "l3.jpg"]
    assert names(f"{tmp_path}/r1.jpg") == ["r1.jpg"]
    monkeypatch.chdir(tmp_path)
    assert names("sub/*") == ["l3.jpg"]


def test_a_folder_with_glob_letters_in_its_name_is_a_folder(tmp_path: Path) -> None:
    """An existing folder is taken literally, even if its name looks like a glob."""
    assert names(str(fill(tmp_path / "run[1]", "a.jpg"))) == ["a.jpg"]


@pytest.mark.parametrize(
    ("path", "error"),
    [
        ("{}/none", UnavailableError),
        ("{}/none.jpg", UnavailableError),
        ("{}/*.jpg", DataError),
        ("{}", DataError),
        ("", SettingsError),
        ("{}/a**b", SettingsError),
    ],
)
def test_nothing_to_show_is_named(tmp_path: Path, path: str, error: type[Exception]) -> None:
    """A missing folder is unavailable, a folder without images is bad data, and a missing path or invalid glob is a wrong setting."""
    pattern = path.format(tmp_path)
    with pytest.raises(error, match="replay") as caught:
        find_images(pattern)
    assert repr(pattern) in str(caught.value) or not pattern


@given(
    st.fractions(Fraction(1, 100), 1000, max_denominator=1001),
    st.integers(0, 10**18),
    st.lists(st.integers(0, 3 * 10**8), min_size=1, max_size=8),
)
@settings(deadline=None, max_examples=40)
def test_the_image_of_a_moment(
    tmp_path_factory: pytest.TempPathFactory, fps: Fraction, start_ns: int, steps_ns: list[int]
) -> None:
    """Image number k is exposed at k / fps and available from then on: a read returns floor(t * fps) as the newest, never a future image."""
    folder = tmp_path_factory.getbasetemp() / "moments"
    if not folder.exists():
        fill(folder, "0.jpg", "1.jpg", "2.jpg")
    images = [path.read_bytes() for path in find_images(str(folder))]
    camera = ReplayCamera(ReplaySettings(path=str(folder), fps=fps, loop=True), start_ns)
    now_ns = start_ns
    for step_ns in steps_ns:
        now_ns += step_ns
        grabs = camera.read(now_ns)
        for grab in grabs:
            if isinstance(grab, Skipped):  # after a long pause; skipped images are reported by number
                continue
            assert isinstance(grab, Frame)
            number = round(grab.exposed.ns * fps / 10**9)
            assert abs(grab.exposed.ns - Fraction(number * 10**9) / fps) <= Fraction(1, 2)
            assert start_ns < grab.exposed.ns <= now_ns
            assert grab.grabbed.ns == now_ns
            assert grab.payload == images[number % 3]
        assert camera.due_ns(now_ns) > now_ns
    camera.close()


@pytest.mark.parametrize(
    "uri",
    [
        "",
        "replay",
        "replay:",
        "replay:?fps=30",
        "v4l3:/dev/video0",
        "REPLAY:x",
        "replay:{}?fps=0",
        "replay:{}?fps=-1",
        "replay:{}?fps=1001",
        "replay:{}?fps=fast",
        "replay:{}?fps=nan",
        "replay:{}?fps=1/0",
        "replay:{}?fps=",
        "replay:{}?loop=yes",
        "replay:{}?pace=slow",
        "replay:{}?speed=2",
        "replay:{}?fps=30&&loop=1&x",
    ],
)
def test_bad_camera_uris_are_refused(tmp_path: Path, uri: str) -> None:
    """A meaningless camera URI is a SettingsError in one line, whatever the folder holds."""
    fill(tmp_path, "a.jpg")
    with pytest.raises(SettingsError) as caught:
        open_camera(uri.format(tmp_path), "host", 0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ("fps=5fps", "has fps=5fps: give images per second from 0.01 to 1000"),
        ("fps=1001", "has fps=1001: give images per second from 0.01 to 1000"),
        ("loop=yes", "has loop=yes: give loop=1"),
        ("pace=slow", "has pace=slow: give pace=clock for a film, or pace=demand"),
        ("phase_ms=1e999999999", "has phase_ms=1e999999999: give a delay in ms"),
        ("fsp=30", "an unknown option 'fsp': the options are fps, loop, pace, phase_ms, rotate, flip"),
    ],
)
def test_a_bad_option_is_named_with_what_it_may_be(options: str, named: str) -> None:
    """The error names the option, its value and the values that it can have."""
    with pytest.raises(SettingsError, match=re.escape(named)):
        parse_camera(f"replay:film?{options}", "host")


def test_a_path_without_a_kind_is_given_back_with_one(tmp_path: Path) -> None:
    """For a folder or a device that exists, the URI that was meant is the remedy; what does not exist gets the examples of the program."""
    for path, kind in ((tmp_path, "replay"), (Path("/dev/null"), "v4l2")):
        with pytest.raises(SettingsError, match=f"give '{kind}:{path}\\?fps=3'"):
            parse_camera(f"{path}?fps=3", "host")
        with pytest.raises(SettingsError, match=f"give '{kind}:{path}'"):
            check_camera(str(path))
    with pytest.raises(SettingsError, match=r"unknown kind.*http://[^[]*$"):  # their options would hide the kinds
        check_camera(f"{tmp_path}/missing")
    with pytest.raises(SettingsError, match=r"'replay:' names no folder: name one"):
        check_camera("replay:")


def test_a_board_says_that_only_the_host_takes_servers() -> None:
    """A server's address given to the board is told as the host's kind of camera, without the password in it."""
    with pytest.raises(SettingsError, match=r"camera http://\.\.\. is of a kind that only phone-host takes") as caught:
        parse_camera("http://user:secret@phone:8080/video", "board")
    assert "secret" not in str(caught.value)
    assert "v4l2:" in caught.value.remedy


def test_options_reach_the_camera(tmp_path: Path) -> None:
    """Rate, pacing, size and encoding of a replay are in its description, and the `?` of a glob starts no option."""
    fill(tmp_path, "a1.jpg", "a2.jpg")
    camera = open_camera(f"replay:{tmp_path}/a?.jpg?fps=30000/1001&pace=demand", "host", 0)
    description = camera.description
    assert (description.width_px, description.height_px) == (32, 24)
    assert description.period_ns == 1001 * 10**9 // 30000
    assert description.pacing is Pacing.DEMAND
    assert open_camera(f"replay:{tmp_path}/a?.jpg", "host", 0).description.period_ns == 10**9 // 30


def test_a_long_stall_costs_bounded_work(tmp_path: Path) -> None:
    """After an hour without a read only a few images come, the newest ones, and sequence numbers show how many were skipped."""
    camera = ReplayCamera(ReplaySettings(path=str(fill(tmp_path, "a.jpg")), fps=Fraction(30), loop=True), 0)
    grabs = camera.read(3600 * 10**9)
    assert len(grabs) <= 65
    assert grabs[0] == Skipped(0, 3600 * 30 - 64)
    last = grabs[-1]
    assert isinstance(last, Frame)
    assert (last.sequence, last.exposed.ns) == (3600 * 30 - 1, 3600 * 10**9)


def test_a_phase_puts_every_exposure_later(tmp_path: Path) -> None:
    """Of two replays of one folder the one with phase_ms shows the same images, each exactly that much later."""
    fill(tmp_path / "film", "0.jpg", "1.jpg", "2.jpg")
    shown = []
    for options in ("", "&phase_ms=12.5"):
        camera = open_camera(f"replay:{tmp_path}/film?fps=20&loop=1{options}", "host", 10**9)
        shown.append([grab for grab in camera.read(2 * 10**9) if isinstance(grab, Frame)])
    common = {bytes(frame.payload): frame.exposed.ns % 150_000_000 for frame in shown[0]}
    assert len(common) == 3
    for frame in shown[1]:
        assert (frame.exposed.ns - common[bytes(frame.payload)]) % 150_000_000 == 12_500_000


def test_a_phase_on_demand_is_refused(tmp_path: Path) -> None:
    """A camera without a clock of its own has no phase."""
    fill(tmp_path / "film", "0.jpg")
    with pytest.raises(SettingsError, match="phase_ms"):
        open_camera(f"replay:{tmp_path}/film?pace=demand&phase_ms=3", "host", 10**9)
