"""phone-host sessions: recordings of which nothing can be made are told in one line, and leave no file behind."""

from pathlib import Path

import pytest

from common.recording.layout import topics
from common.recording.mcap_writer import McapWriter, Topic
from phone_host.cli import main
from tests.support.recorded import recording, recording_file

_CHAT = Topic("/chat", "cdr", "std_msgs/msg/String", "ros2msg", b"string data")


def _error(words: list[str], capsys: pytest.CaptureFixture[str], code: int = 4) -> str:
    """Return the one line of an error, which is one of bad data if nothing else is said."""
    assert main(["sessions", *words]) == code
    printed = capsys.readouterr()
    assert not printed.out
    [line] = printed.err.splitlines()
    return line


def test_what_holds_nothing_is_not_repaired(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A recording that was only begun, and another program's messages."""
    data = bytearray()
    writer = McapWriter(data.extend, "a test", (*topics(), _CHAT))
    begun, other, out = tmp_path / "begun.mcap", tmp_path / "other.mcap", tmp_path / "out.mcap"
    begun.write_bytes(data)
    writer.add("/chat", b"\0\1\0\0", sequence=0, log_ns=1, publish_ns=1)
    writer.finish()
    other.write_bytes(data)
    assert "holds no images that can be written: give a recording" in _error(
        ["repair", str(begun), "--out", str(out)], capsys
    )
    assert "(left out: 1 of /chat, a message that is not known here)" in _error(
        ["repair", str(other), "--out", str(out)], capsys
    )
    assert "begun.mcap holds no images, and nothing else" in _error(["info", str(begun)], capsys)
    assert "other.mcap holds no images, only /chat" in _error(["info", str(other)], capsys)
    assert not out.exists()


def test_a_part_without_images_is_not_cut(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is told how long the recording is; a part that has images is written."""
    path, out = recording_file(tmp_path, 5), tmp_path / "out.mcap"
    line = _error(["cut", str(path), "--from", "10", "--to", "20", "--out", str(out)], capsys)
    assert "holds no image of that time: it lasts 0.2 s" in line
    assert not out.exists()
    assert main(["sessions", "cut", str(path), "--from", "0.1", "--out", str(out)]) == 0
    assert out.exists()


def test_what_is_missing_is_told_of_an_export(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As of a repair."""
    path = tmp_path / "cut.mcap"
    data = recording(8)
    path.write_bytes(data[: len(data) // 2])
    assert main(["sessions", "export", str(path), "--out", str(tmp_path / "out")]) == 0
    assert "missing: at byte" in capsys.readouterr().out


def test_a_new_recording_has_a_name_of_its_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is replaced, and nothing is written that would not be known as a recording later; told before anything long begins."""
    path, camera = str(recording_file(tmp_path, 3)), ["--camera", f"replay:{tmp_path}/none.avi"]
    for words, option in (
        (["sessions", "cut", path, "--out"], "--out"),
        (["sessions", "join", path, path, "--out"], "--out"),
        (["record", "--alone", *camera, "--out"], "--out"),
        (["run", *camera, "--record"], "--record"),
    ):
        assert main([*words, path]) == 3
        assert f"{path} exists already" in capsys.readouterr().err
        assert main([*words, str(tmp_path / "new.bag")]) == 2
        assert f"{option} {tmp_path}/new.bag does not end in .mcap: give FILE.mcap" in capsys.readouterr().err


def test_a_folder_that_is_not_there_is_told_as_such(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A mistyped name is no data set of another form; nothing is written."""
    out = tmp_path / "out.mcap"
    assert "kiti is no folder" in _error(["import", str(tmp_path / "kiti"), "--out", str(out)], capsys)
    assert not out.exists()
