"""Results folders into which others have put things: links, pipes, folders of their own."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from common.errors import DataError, SettingsError, TandemError, UnavailableError
from common.files import read_whole
from phone_host.jobs.output_folders import spare_inputs
from phone_host.jobs.run import spare
from phone_host.output.atomic import replacing, write_bytes, write_text
from phone_host.output.folder_lock import LOCK
from phone_host.output.listed import LIST, ListedFolder
from phone_host.output.move_up import STAGED
from phone_host.output.result_files import claim, remove_results
from phone_host.run.file_sink import NAMES, FileSink
from tests.support.killed_at import killed_at
from tests.unit.common.camera.test_replay import fill

FILES = ("left.png", "right.png", "disparity.pfm", "cloud.ply")


def earlier_run(folder: Path) -> None:
    """What a run of three pairs leaves if it is killed in the middle of the last one."""
    results = FileSink(folder, 1)
    assert results.listed is not None
    for name in ("pair-000000", "pair-1000000"):
        results.listed.add(name)
        (folder / name).mkdir()
        for file in FILES:
            (folder / name / file).write_bytes(b"x")
    results.listed.add("pair-000002")
    (folder / "pair-000002.part").mkdir()
    (folder / "pair-000002.part" / f".left.png.{'0' * 16}.part").write_bytes(b"x")
    (folder / f".report.json.{'0' * 16}.part").write_bytes(b"x")
    results.close({"of": "an earlier run"}, "<html>")


def tree(folder: Path) -> dict[str, bytes]:
    """All files and links below a folder with their content."""
    return {
        str(path.relative_to(folder)): bytes(path.readlink()) if path.is_symlink() else path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_symlink() or path.is_file()
    }


def test_a_later_run_replaces_what_an_earlier_one_left_and_nothing_else(tmp_path: Path) -> None:
    """What is whole of the earlier run stays while the later one runs, and goes with its report; what was half made goes at once; a user's similar names stay."""
    earlier_run(tmp_path)
    mine = {"pair-000123-my-notes/a.txt": b"a", "pair-12/b": b"b", "report.json.bak": b"c", "notes.txt": b"d"}
    for name, content in mine.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    before = {name: content for name, content in tree(tmp_path).items() if not name.endswith(".part") and name != LIST}
    results = FileSink(tmp_path, 1)
    during = tree(tmp_path)
    hidden = {name: during.pop(name) for name in list(during) if name.startswith(".tandemscan")}
    assert hidden.keys() == {LIST, LOCK, f"{STAGED}/delays.jsonl"}
    assert hidden[LOCK] == f"{os.getpid()}\n".encode()
    assert during == before
    results.close({"of": "a later run"})
    left = tree(tmp_path)
    assert b"a later run" in left.pop("report.json")
    assert left.pop(LIST)
    assert left == {**mine, "delays.jsonl": b""}


def test_a_run_again_and_again_in_one_folder(tmp_path: Path) -> None:
    """Each run replaces the one before, even one that was killed before its report."""
    for number in range(3):
        FileSink(tmp_path, 1).close({"number": number})
    running = FileSink(tmp_path, 1)
    with pytest.raises(UnavailableError, match=f"is being written by process {os.getpid()}: wait for its end"):
        FileSink(tmp_path, 1)
    running.close({"number": 3})
    assert killed_at(0, lambda: FileSink(tmp_path, 1)).code == 0
    assert (tmp_path / STAGED).is_dir()
    FileSink(tmp_path, 1).close({})
    assert sorted(path.name for path in tmp_path.iterdir()) == [LIST, "delays.jsonl", "report.json"]


def plant_link(path: Path) -> None:
    """A link to a file beside the folder."""
    path.symlink_to(path.parent.parent / "precious")


def plant_file(path: Path) -> None:
    """A file of the user's."""
    path.write_text("mine")


def refused(out: Path, name: str) -> None:
    """A run into this folder ends with one line that names what is in the way and the remedy; nothing has been changed."""
    before = tree(out.parent)
    with pytest.raises(UnavailableError, match=name) as caught:
        FileSink(out, 1)
    assert "--out" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert tree(out.parent) == before


@pytest.mark.parametrize("name", ["delays.jsonl", "report.json", "index.html", "pair-000007", LIST])
@pytest.mark.parametrize("plant", [plant_link, plant_file, os.mkfifo, Path.mkdir])
def test_what_is_not_ours_ends_the_first_run(name: str, plant: Callable[[Path], None], tmp_path: Path) -> None:
    """A link, file, pipe or folder under a name that the run needs is refused before anything is changed."""
    (tmp_path / "precious").write_text("precious")
    (tmp_path / "out").mkdir()
    plant(tmp_path / "out" / name)
    refused(tmp_path / "out", name)


@pytest.mark.parametrize("name", ["delays.jsonl", "report.json", "index.html", "pair-000000", LIST])
@pytest.mark.parametrize("plant", [plant_link, os.mkfifo])
def test_a_link_or_pipe_in_place_of_ours_ends_a_later_run(
    name: str, plant: Callable[[Path], None], tmp_path: Path
) -> None:
    """A link is not ours even under a name that is listed as ours: it is refused before anything is changed."""
    (tmp_path / "precious").write_text("precious")
    earlier_run(tmp_path / "out")
    (tmp_path / "out" / name).rename(tmp_path / "moved")
    plant(tmp_path / "out" / name)
    refused(tmp_path / "out", name)


@pytest.mark.parametrize("file", ["notes.txt", "left.png.bak", ".hidden"])
def test_a_users_file_in_a_pair_of_ours_ends_the_run(file: str, tmp_path: Path) -> None:
    """Notes that somebody put into a saved pair stay, and so does the rest of it; so do the targets of links in it."""
    earlier_run(tmp_path)
    (tmp_path / "pair-000000" / file).write_text("mine")
    before = tree(tmp_path)
    with pytest.raises(UnavailableError, match=f"pair-000000/{file}"):
        FileSink(tmp_path, 1)
    assert tree(tmp_path) == before
    (tmp_path / "pair-000000" / file).unlink()
    (tmp_path / "pair-000000" / "left.png").unlink()
    (tmp_path / "pair-000000" / "left.png").symlink_to(tmp_path / "report.json")
    with pytest.raises(UnavailableError, match="pair-000000/left"):
        FileSink(tmp_path, 1)
    assert (tmp_path / "report.json").exists()


def test_a_link_planted_while_the_run_goes_on_is_replaced(tmp_path: Path) -> None:
    """A link at report.json or index.html that appears after the start is replaced by the report; its target is unchanged."""
    precious, out = tmp_path / "precious", tmp_path / "out"
    precious.write_text("precious")
    results = FileSink(out, 1)
    (out / "report.json").symlink_to(precious)
    (out / "index.html").symlink_to(precious)
    results.close({"a": 1}, "<html>")
    assert precious.read_text() == "precious"
    assert not (out / "report.json").is_symlink()
    assert (out / "index.html").read_text() == "<html>"


@pytest.mark.parametrize("write", [lambda path: write_text(path, "new"), lambda path: write_bytes(path, b"new")])
def test_every_writer_replaces_a_link(write: Callable[[Path], None], tmp_path: Path) -> None:
    """What each verb writes with never goes through a link, and leaves nothing else behind."""
    (tmp_path / "precious").write_text("precious")
    (tmp_path / "result").symlink_to("precious")
    write(tmp_path / "result")
    assert tree(tmp_path) == {"precious": b"precious", "result": b"new"}


def test_a_torn_last_line_of_the_list_counts_for_nothing(tmp_path: Path) -> None:
    """If a full disk cut the last line of a list, the list names what stands before it; the next run repairs it."""
    FileSink(tmp_path, 1).close({})
    with (tmp_path / LIST).open("a") as list_file:
        list_file.write("pair-0000")
    FileSink(tmp_path, 1).close({})
    assert "pair-0000" not in (tmp_path / LIST).read_text()


def test_what_another_verb_has_listed_stays(tmp_path: Path) -> None:
    """A run leaves files that it does not write itself, and they remain ours."""
    with ListedFolder(tmp_path, "disparity.pfm") as other:
        other.add("disparity.pfm", "report.json")
    for name in ("disparity.pfm", "report.json"):
        (tmp_path / name).write_text("of stereo")
    FileSink(tmp_path, 1).close({})
    assert (tmp_path / "disparity.pfm").read_text() == "of stereo"
    remove_results(tmp_path, r"disparity\.pfm")
    assert not (tmp_path / "disparity.pfm").exists()


def test_a_list_with_ways_out_of_the_folder_leads_nowhere(tmp_path: Path) -> None:
    """Whoever writes the list can have results removed, but nothing above the folder and nothing with another name."""
    out = tmp_path / "out"
    FileSink(out, 1).close({})
    (tmp_path / "report.json").write_text("precious")
    (out / "notes.txt").write_text("precious")
    with (out / LIST).open("a") as list_file:
        list_file.write("../report.json\nnotes.txt\n/etc/passwd\n..\n.\n")
    with ListedFolder(out, NAMES):
        pass
    assert (tmp_path / "report.json").read_text() == "precious"
    assert (out / "notes.txt").read_text() == "precious"


_WRITER = """
import sys
from pathlib import Path
from phone_host.output.atomic import write_text
print("ready", flush=True)
while True:
    for letter in "ab":
        write_text(Path(sys.argv[1]), letter * 3_000_000)
"""


def test_a_process_that_is_killed_leaves_one_whole_report(tmp_path: Path) -> None:
    """A process killed at any moment while it replaces one report by another leaves the old one or the new one."""
    report = tmp_path / "report.json"
    write_text(report, "b" * 3_000_000)
    for number in range(12):
        with subprocess.Popen([sys.executable, "-c", _WRITER, str(report)], stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            writer.stdout.readline()
            threading.Event().wait(0.003 * number)
            writer.send_signal(signal.SIGKILL)
        text = report.read_text()
        assert len(text) == 3_000_000
        assert len(set(text)) == 1


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    """A file in place of the folder, or a dangling link, is named with the remedy."""
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to("nowhere/at/all")
    for name in ("file", "link"):
        with pytest.raises(TandemError, match=rf"{name}.*--out"):
            FileSink(tmp_path / name, 1)


def test_names_are_claimed_before_they_are_written(tmp_path: Path) -> None:
    """A verb that writes single files refuses other people's files before its work and replaces those of earlier runs; later runs replace its own."""
    (tmp_path / "report.json").write_text("mine")
    with pytest.raises(UnavailableError, match=r"report\.json was not written by an earlier run"):
        claim(tmp_path, "report.json", "plot.svg")
    (tmp_path / "report.json").unlink()
    for _ in range(2):
        claim(tmp_path, "report.json", "plot.svg")
        (tmp_path / "report.json").write_text("ours")
    remove_results(tmp_path, r"report\.json|disparity\.pfm")
    assert not (tmp_path / "report.json").exists()


def test_what_is_read_is_not_replaced(tmp_path: Path) -> None:
    """Images or a rig under a name that the results need end the run before anything is changed; beside the results they do no harm."""
    names = NAMES
    with pytest.raises(SettingsError, match=r"--camera .*pair-000003 lies inside --out"):
        spare_inputs(tmp_path, names, {"--camera": tmp_path / "pair-000003"})
    with pytest.raises(SettingsError, match="--calibration"):
        spare_inputs(tmp_path, names, {"--calibration": tmp_path / "pair-000003" / "rig.yaml"})
    spare_inputs(tmp_path, names, {"--camera": tmp_path / "left", "--calibration": tmp_path / "rig.yaml"})
    spare_inputs(tmp_path, names, {"--camera": tmp_path.parent / "pair-000003"})


def test_a_file_without_end_is_not_read(tmp_path: Path) -> None:
    """A device, a pipe or a file that is far too long gives one line, at once and without using memory."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "sparse").touch()
    os.truncate(tmp_path / "sparse", 1 << 40)
    for path in (Path("/dev/zero"), tmp_path / "pipe", tmp_path / "sparse", tmp_path):
        with pytest.raises((DataError, IsADirectoryError)):
            read_whole(path, 1 << 20)
    (tmp_path / "link").symlink_to("plain")
    (tmp_path / "plain").write_bytes(b"content")
    assert read_whole(tmp_path / "link", 7) == b"content"
    with pytest.raises(DataError, match="has 7 bytes, 6 are the most"):
        read_whole(tmp_path / "link", 6)


def test_a_limit_of_any_size_takes_no_memory(tmp_path: Path) -> None:
    """Memory is taken for what is in the file, even if the limit is beyond any memory; files that state no size are read whole."""
    (tmp_path / "file").write_bytes(b"content")
    assert read_whole(tmp_path / "file", 10**30) == b"content"
    stated = Path("/proc/self/status")
    assert stated.stat().st_size == 0
    assert b"Name:" in read_whole(stated, 10**12)


@pytest.mark.parametrize("replay", ["photos", "photos/*.jpg", "photos/a1.jpg"])
def test_a_run_does_not_write_among_the_photographs_it_replays(tmp_path: Path, replay: str) -> None:
    """The folder of a replay, or of what its glob names, is refused as --out; a folder in it or beside it is not."""
    fill(tmp_path / "photos", "a1.jpg", "a2.jpg")
    for out in (tmp_path / "photos", tmp_path / "photos" / "x" / ".."):
        with pytest.raises(SettingsError, match="is the folder of the photographs of --camera"):
            spare(out, str(tmp_path / replay), "")
    spare(tmp_path / "photos" / "scan", str(tmp_path / replay), "")
    spare(tmp_path, str(tmp_path / replay), "")


def test_what_a_killed_writer_left_is_removed_by_the_next_one(tmp_path: Path) -> None:
    """A temporary that nobody writes any more goes; one that is being written stays, and so does a file with a similar name."""
    left, other = tmp_path / f".report.json.{'a' * 16}.part", tmp_path / ".report.json.old.part"
    left.write_text("half")
    other.write_text("mine")
    with replacing(tmp_path / "report.json") as file:
        file.write(b"1")
        write_text(tmp_path / "report.json", "2")
        assert not left.exists()
        assert other.read_text() == "mine"
    assert (tmp_path / "report.json").read_bytes() == b"1"
