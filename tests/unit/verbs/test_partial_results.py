"""Long work that is ended early: what it has come to lies beside the results of an earlier one, and never takes their place."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from phone_host.cli import main
from phone_host.output.listed import ListedFolder
from tests.system.hostile.full_disks import write_inputs
from tests.unit.output.test_listed import tree

GEOMETRY = ["--rectified", "--disparities", "32", "--focal", "200", "--baseline", "100mm"]


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two pairs of pictures, and what else the verbs read."""
    folder = tmp_path_factory.mktemp("given")
    write_inputs(folder)
    return folder


def visible(folder: Path) -> dict[str, bytes]:
    """All files, but for our hidden ones and those of partial sets."""
    return {name: content for name, content in tree(folder).items() if not name.startswith((".", "partial-"))}


class _SecondPair:
    """What happens to a process when it has read the second pair: it is interrupted, or there is no memory.

    A signal comes to the process itself when it opens the second pair's left picture, as Python tells its audit hooks.
    """

    def __init__(self) -> None:
        self.path, self.is_out_of_memory = "", False
        sys.addaudithook(self._hear)  # stays for good; it does nothing without a path

    def _hear(self, event: str, arguments: tuple[object, ...]) -> None:
        if self.path and event == "open" and str(arguments[0]).endswith(self.path):
            self.path = ""
            if self.is_out_of_memory:
                raise MemoryError
            os.kill(os.getpid(), signal.SIGINT)


@pytest.fixture(scope="module")
def second_pair() -> Iterator[_SecondPair]:
    """One for all tests: an audit hook cannot be removed."""
    hook = _SecondPair()
    yield hook
    hook.path = ""


@pytest.mark.parametrize("is_out_of_memory", [False, True])
@pytest.mark.parametrize("verb", ["stereo", "quality", "scan"])
def test_an_earlier_result_stays_where_a_later_one_is_ended_early(
    verb: str,
    given: Path,
    tmp_path: Path,
    second_pair: _SecondPair,
    capsys: pytest.CaptureFixture[str],
    *,
    is_out_of_memory: bool,
) -> None:
    """After Ctrl-C or without memory, the earlier set is there byte by byte, the pairs so far lie in a folder that the program names, and the next whole set replaces both."""
    out, sides = tmp_path / "out", [str(given / "left"), str(given / "right")]
    more = ["--voxel", "20mm"] if verb == "scan" else []
    words = [verb, *sides, *GEOMETRY, *more, "--out", str(out)]
    code = main(words)
    assert code in {0, 4}
    before = visible(out)
    capsys.readouterr()
    partial, restart = out / f"partial-{verb}", ["--restart"] if verb == "scan" else []
    for _ in range(2 if verb == "stereo" else 1):  # the second partial set takes the place of the first
        second_pair.path, second_pair.is_out_of_memory = "left/1.png", is_out_of_memory
        assert main([*words, *restart]) == (4 if is_out_of_memory else 130)
        told = capsys.readouterr().err
        assert visible(out) == before | {name: data for name, data in visible(out).items() if "submap" in name}
        report = json.loads((partial / "report.json").read_text())
        assert report["interrupted_of"] == 2
        assert (
            f"ended after 1 of 2 pairs: the results so far are in {partial}, the earlier results stay in {out}" in told
        )
    assert main([*words, *restart]) == code
    assert not partial.exists()
    assert visible(out).keys() == before.keys()
    assert json.loads((out / "report.json").read_text())["interrupted_of"] is None


@pytest.mark.parametrize("verb", ["stereo", "quality", "scan"])
def test_where_nothing_is_replaced_a_part_is_under_the_final_names(
    verb: str, given: Path, tmp_path: Path, second_pair: _SecondPair
) -> None:
    """The pairs so far are of use, and nobody loses anything by them."""
    second_pair.path, second_pair.is_out_of_memory = "left/1.png", False
    more = ["--voxel", "20mm"] if verb == "scan" else []
    words = [verb, str(given / "left"), str(given / "right"), *GEOMETRY, *more, "--out", str(tmp_path / "out")]
    assert main(words) == 130
    assert json.loads((tmp_path / "out" / "report.json").read_text())["interrupted_of"] == 2
    assert not (tmp_path / "out" / f"partial-{verb}").exists()


def test_a_run_that_ends_before_its_pairs_replaces_no_whole_one(given: Path, tmp_path: Path) -> None:
    """The recording has eight pairs: a run that was to take nine leaves the earlier one as it was, and its own beside it."""
    out = tmp_path / "out"
    words = ["run", "--replay", str(given / "session.mcap"), "--save-every", "4", "--out", str(out), "--pairs"]

    def run(pairs: str) -> tuple[int, str]:
        command = [sys.executable, "-P", "-m", "phone_host.cli", *words, pairs]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return done.returncode, done.stderr

    assert run("6")[0] == 0
    before = visible(out)
    code, told = run("9")
    assert code == 4
    assert visible(out) == before
    partial = out / "partial-run"
    assert len((partial / "delays.jsonl").read_text().splitlines()) == 8
    assert {path.name for path in partial.glob("pair-*")} == {"pair-000000", "pair-000004"}
    assert re.search(rf"earlier_results_stay folder={out} of_this_run={partial}", told)
    assert run("6")[0] == 0
    assert not partial.exists()


def test_notes_in_a_partial_set_stay(tmp_path: Path) -> None:
    """What somebody put beside the results of a part is kept under a name of its own when a whole set comes; a file of the partial set's name keeps the results hidden."""
    folder, partial = ListedFolder(tmp_path, r"a\.txt", command="stereo"), tmp_path / "partial-stereo"
    for number in range(2):
        with folder:
            folder.stage()
            folder.add("a.txt")
            folder.write_text("a.txt", str(number))
            assert folder.keep_staged() == partial
        assert (partial / "a.txt").read_text() == str(number)
    (partial / "notes.txt").write_text("mine")
    with folder:
        folder.stage()
        folder.add("a.txt")
        folder.write_text("a.txt", "whole")
        folder.publish()
    assert tree(tmp_path).keys() == {".tandemscan", "a.txt", "partial-stereo.foreign/notes.txt"}
    partial.write_text("a file")
    with folder:
        folder.stage()
        folder.write_text("a.txt", "2")
        assert (folder.keep_staged() / "a.txt").read_text() == "2"
    assert partial.read_text() == "a file"
