"""What a path names, and what the commands say of one that leads nowhere good."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from common.camera.replay import find_images
from common.diagnostic import Severity
from common.errors import DataError, TandemError, UnavailableError
from common.places import Kind, kind_of, make_folder, nearest, resolved
from phone_host.cli import main
from phone_host.doctor.host_doctor import examine_out
from phone_host.jobs.output_folders import announce_other_report, require_file, require_folder, spare_inputs
from phone_host.jobs.run import spare
from phone_host.stereo.view_files import pair_files

LONG = "a" * 300
DEEP = 2000


@pytest.fixture
def room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with one of each kind."""
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    os.mkfifo("pipe")
    Path("circle").symlink_to("circle")
    Path("dangling").symlink_to("nothing")
    return tmp_path


def test_each_kind_is_told(room: Path) -> None:
    """Files, folders, devices and pipes are told apart; what is not there, or behind a file, is missing."""
    kinds = {"file": Kind.FILE, ".": Kind.FOLDER, "pipe": Kind.PIPE, "/dev/zero": Kind.DEVICE}
    for path, kind in (kinds | dict.fromkeys(("nothing", "dangling", "file/x", "x/y/z"), Kind.MISSING)).items():
        assert kind_of(room / path) is kind
    assert nearest(Path("file/x/y")) == (Path("file"), Kind.FILE)
    assert nearest(Path("x/y")) == (Path(), Kind.FOLDER)


@pytest.mark.parametrize(
    ("path", "code"),
    [(LONG, errno.ENAMETOOLONG), ("circle", errno.ELOOP), ("circle/x", errno.ELOOP), ("a\0b", errno.EINVAL)],
)
@pytest.mark.usefixtures("room")
def test_what_cannot_be_told_is_an_error_of_the_system(path: str, code: int) -> None:
    """Whatever Python's version makes of such a path, here it is an OSError."""
    with pytest.raises(OSError, match=r".") as caught:
        kind_of(path)
    assert caught.value.errno == code


@pytest.mark.usefixtures("room")
def test_links_in_a_circle_have_an_absolute_path_too() -> None:
    """Where a path leads can be compared even if it leads in a circle."""
    assert resolved(Path("circle")) == resolved(Path("./circle"))
    assert resolved(Path("dangling")) == Path.cwd() / "nothing"


@pytest.mark.usefixtures("room")
def test_a_folder_of_two_thousand_levels_is_made() -> None:
    """Missing parents are made, however many; a file or link in the way is an error."""
    deep = Path(*["b"] * DEEP)
    make_folder(deep)
    make_folder(deep)
    try:
        assert kind_of(deep) is Kind.FOLDER
        for path in ("file", "file/x", "circle", "dangling"):
            with pytest.raises(OSError, match=r"."):
                make_folder(Path(path))
    finally:
        while deep != Path():  # pytest's own removal would recurse
            deep.rmdir()
            deep = deep.parent


@pytest.mark.parametrize("path", [LONG, f"{LONG}*", "circle", "pipe", "/dev/zero", "/dev/null"])
@pytest.mark.usefixtures("room")
def test_images_that_are_none_are_told_in_one_line(path: str) -> None:
    """`stereo` and `calibrate` (4) and a replay (3) name the path, and say what it is if it is there."""
    for find, kind in ((lambda: pair_files(path, "file"), DataError), (lambda: find_images(path), UnavailableError)):
        with pytest.raises(kind) as caught:
            find()
        assert repr(path) in str(caught.value)
        assert "does not exist" not in str(caught.value)


def test_a_glob_into_a_folder_that_may_not_be_searched_says_so(room: Path) -> None:
    """Images of which only the names can be read are an error, not left out."""
    (room / "sec").mkdir()
    (room / "sec" / "1.png").touch()
    if os.geteuid() == 0:
        (room / "sec" / "2.png").symlink_to("2.png")  # root may search everywhere, but go round in no circle
    else:
        (room / "sec").chmod(0o600)
    try:
        with pytest.raises(DataError, match=r"LEFT 'sec/[12].png' cannot be read"):
            pair_files("sec/*.png", "file")
    finally:
        (room / "sec").chmod(0o700)


@pytest.mark.parametrize("path", [LONG, f"x/{LONG}", "circle", "circle/x", "pipe", "/dev/zero", "file/x"])
@pytest.mark.parametrize("require", [require_folder, lambda path: require_file(path / "rig.yaml")])
@pytest.mark.usefixtures("room")
def test_impossible_results_are_refused_before_the_work(path: str, require: Callable[[Path], None]) -> None:
    """A folder of results that cannot be is exit 3, whatever is in its way; the doctor fails it as well."""
    spare_inputs(Path(path), "x", {"LEFT": Path("file")})
    with pytest.raises(TandemError) as caught:
        require(Path(path))
    assert caught.value.exit_code == UnavailableError.exit_code
    assert [finding.severity for finding in examine_out(Path(path))] == [Severity.FAIL]


def test_the_doctor_finds_room_where_a_folder_can_be_made(room: Path) -> None:
    """A folder that is there, or can be made, is fine; a file is not, though its disk has room."""
    assert Severity.FAIL not in [finding.severity for path in (room, room / "x") for finding in examine_out(path)]
    assert [finding.severity for finding in examine_out(room / "file")] == [Severity.FAIL]


@pytest.mark.usefixtures("room")
def test_a_strange_replay_is_left_to_the_camera() -> None:
    """Comparing it with --out raises nothing: opening it says what is wrong."""
    for path in (LONG, "circle", "pipe", "nothing"):
        spare(Path("zz"), path, "")


def test_a_report_of_brackets_belongs_to_nobody(room: Path) -> None:
    """It is no report of another verb that would be kept."""
    (room / "report.json").write_text("[" * 200_000)
    announce_other_report(room, "stereo", print)
    assert (room / "report.json").stat().st_size == 200_000


@pytest.mark.parametrize("words", [("doctor", "--out"), ("demo", "--out"), ("run", "--config")])
@pytest.mark.parametrize("path", ["", "=--"])
def test_an_option_without_a_value_is_wrong_usage(
    words: tuple[str, str], path: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither an empty text nor two dashes are a path."""
    assert main([words[0], words[1] + path, *([] if path else [""])]) == 2
    assert capsys.readouterr().err.count("\n") == 1
