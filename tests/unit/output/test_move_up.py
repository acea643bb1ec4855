"""Sets of results that take their places together, wherever the program is killed."""

import errno
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from phone_host.output.atomic import write_text
from phone_host.output.listed import LIST, ListedFolder
from phone_host.output.move_up import STAGED, WHOLE
from phone_host.output.result_files import claim, replacing_results
from tests.support.killed_at import killed_at
from tests.unit.output.test_listed import tree


def placed(folder: Path, **texts: str) -> None:
    """A set of results: files by name, and a pair that holds the same."""
    with replacing_results(folder, r"a\.txt|b\.txt|pair-\d{6}", [f"{name}.txt" for name in texts]) as place:
        for name, text in texts.items():
            write_text(place / f"{name}.txt", text)


def test_results_take_their_places_together(tmp_path: Path) -> None:
    """A set replaces the one before as a whole, and what nothing replaces goes; a set whose writing fails changes nothing and leaves nothing."""
    placed(tmp_path, a="1", b="1")
    placed(tmp_path, a="2")
    kept = tree(tmp_path)
    assert {name: kept[name] for name in kept if name != LIST} == {"a.txt": b"2"}
    with pytest.raises(OSError, match="No space") as caught:
        write_badly(tmp_path)
    assert caught.value.filename == str(tmp_path / "b.txt")
    assert {name: text for name, text in tree(tmp_path).items() if name != LIST} == {"a.txt": b"2"}


def write_badly(folder: Path) -> None:
    """The first file is written; for the second there is no room."""
    with replacing_results(folder, r"a\.txt|b\.txt", ("a.txt", "b.txt")) as place:
        write_text(place / "a.txt", "3")
        raise OSError(errno.ENOSPC, "No space left on device", str(place / "b.txt"))


@pytest.mark.parametrize("moved", [(), ("a.txt",)])
def test_a_run_that_was_killed_while_it_moved_its_results_is_finished(moved: tuple[str, ...], tmp_path: Path) -> None:
    """Results that were whole are moved up by whoever opens the folder next, those that are missing, too; what they replace goes."""
    placed(tmp_path, a="1", b="1")
    (tmp_path / ".tandemscan.whole").mkdir()
    for name in {"a.txt", "c.txt"}.difference(moved):
        (tmp_path / ".tandemscan.whole" / name).write_text("2")
    for name in moved:
        (tmp_path / name).write_text("2")
    claim(tmp_path, "d.txt")
    assert not (tmp_path / ".tandemscan.whole").exists()
    assert [(tmp_path / name).read_text() for name in ("a.txt", "c.txt")] == ["2", "2"]


NAMES = r"[a-z]\.txt|pair-\d{6}|report\.json|index\.html"


def write_set(folder: Path, text: str, names: tuple[str, ...], command: str = "stereo") -> None:
    """Write a set of results in which every file says which set it is of: files, pairs (`pair-NNNNNN`) and a report."""
    with replacing_results(folder, NAMES, (*names, "report.json"), command=command) as place:
        for name in names:
            if name.startswith("pair-"):
                (place / name).mkdir()
                for file in ("left.png", "cloud.ply"):
                    write_text(place / name / file, text)
            else:
                write_text(place / name, text)
        write_text(place / "report.json", json.dumps({"command": command, "set": text}))


def sets_in(folder: Path) -> dict[str, str]:
    """Which set each file in a folder is of, without our hidden files."""
    texts = {name: text.decode() for name, text in tree(folder).items() if not name.startswith(".tandemscan")}
    return {name: json.loads(text)["set"] if text.startswith("{") else text for name, text in texts.items()}


def expected(names: tuple[str, ...], text: str) -> dict[str, str]:
    """What `sets_in` finds of a set."""
    files = [
        file
        for name in names
        for file in ([f"{name}/left.png", f"{name}/cloud.ply"] if name.startswith("pair-") else [name])
    ]
    return dict.fromkeys([*files, "report.json"], text)


OLD, NEW = ("a.txt", "b.txt", "pair-000000", "pair-000001"), ("b.txt", "c.txt", "pair-000001", "pair-000002")


def claim_elsewhere(folder: Path) -> None:
    """What a verb that knows nothing of these names does first."""
    claim(folder, "plot.svg")


@pytest.mark.parametrize("next_one", [claim_elsewhere, lambda folder: write_set(folder, "3", ("a.txt",))])
def test_a_kill_at_every_step_of_a_replacing_leaves_one_set(next_one: Callable[[Path], None], in_memory: Path) -> None:
    """Wherever the process is killed, another verb finds all of the earlier set or all of the later one, the same verb replaces it, and nothing else is left."""
    ended, steps, found = None, 0, set()
    while ended is None:
        steps += 1
        folder = in_memory / str(steps)
        write_set(folder, "1", OLD)
        ended = killed_at(steps, partial(write_set, folder, "2", NEW)).code
        next_one(folder)
        if next_one is claim_elsewhere:
            sets = sets_in(folder)
            assert sets in (expected(OLD, "1"), expected(NEW, "2")), steps
            found.add(sets["report.json"])
        write_set(folder, "3", ("a.txt",))
        assert sets_in(folder) == expected(("a.txt",), "3"), steps
        hidden = {path.name for path in folder.iterdir() if path.name.startswith(".")}
        assert hidden == {LIST}, steps
    assert ended == 0
    assert steps > 20
    assert found in (set(), {"1", "2"})


def test_a_move_that_is_killed_again_and_again_comes_to_its_end(in_memory: Path) -> None:
    """Each program that finishes the move is killed one step later than the one before; the set is whole in the end."""
    write_set(in_memory, "1", OLD)
    first = 1
    while killed_at(first, lambda: write_set(in_memory, "2", NEW)).code is None and not (in_memory / WHOLE).exists():
        first += 1
    assert (in_memory / WHOLE).is_dir()
    step = 1
    while killed_at(step, lambda: claim_elsewhere(in_memory)).code is None:
        step += 1
    assert sets_in(in_memory) == expected(NEW, "2")


def test_another_verbs_report_stays_until_the_new_one_is_whole(in_memory: Path) -> None:
    """Wherever the process is killed that replaces the report and the page of another verb, both are there, under the first names or under those that say whose they are."""
    ended, steps = None, 0
    while ended is None:
        steps += 1
        folder = in_memory / str(steps)
        write_set(folder, "1", ("index.html",), "calibrate")
        ended = killed_at(steps, partial(write_set, folder, "2", ("a.txt",), "quality")).code
        claim_elsewhere(folder)
        first, moved = (
            {"index.html": "1", "report.json": "1"},
            {"index-calibrate.html": "1", "report-calibrate.json": "1"},
        )
        assert sets_in(folder) in (first, moved | expected(("a.txt",), "2")), steps
    assert ended == 0


def test_what_somebody_puts_into_a_result_meanwhile_stays(tmp_path: Path) -> None:
    """Notes in a pair that is replaced are under a name of their own afterwards, and do not block the folder."""
    write_set(tmp_path, "1", ("pair-000000",))
    with replacing_results(tmp_path, NAMES, ("report.json",)) as place:
        write_text(place / "report.json", "{}")
        (tmp_path / "pair-000000" / "notes.txt").write_text("mine")
    assert (tmp_path / "pair-000000.foreign" / "notes.txt").read_text() == "mine"
    assert not (tmp_path / "pair-000000").exists()
    write_set(tmp_path, "2", ("a.txt",))


def test_a_plan_leads_to_nothing_but_our_results(tmp_path: Path) -> None:
    """Whoever writes the plan of a move can have results removed, but nothing else, in this folder or above it."""
    out = tmp_path / "out"
    write_set(out, "1", ("a.txt",))
    for path in (tmp_path / "precious", out / "notes.txt"):
        path.write_text("mine")
    (out / WHOLE).mkdir()
    names = ["../precious", str(tmp_path / "precious"), "notes.txt", "..", ".", ""]
    plan = {"remove": names, "rename": {"a.txt": "../moved", "notes.txt": "a.txt"}}
    for text in (json.dumps(plan), "[]", "{", json.dumps({"remove": 3, "rename": [1]})):
        (out / WHOLE).mkdir(exist_ok=True)
        (out / WHOLE / ".plan.json").write_text(text)
        claim_elsewhere(out)
        assert not (out / WHOLE).exists()
    assert (tmp_path / "precious").read_text() == (out / "notes.txt").read_text() == "mine"
    assert (out / "a.txt").read_text() == "1"
    assert {path.name for path in tmp_path.iterdir()} == {"precious", "out"}


def test_what_was_staged_stays_until_the_next_one_stages(tmp_path: Path) -> None:
    """What a killed program has saved is there after another verb has claimed names, and goes with the next set."""
    write_set(tmp_path, "1", ("a.txt",))

    def staged() -> None:
        folder = ListedFolder(tmp_path, NAMES)
        folder.open()
        folder.stage()
        write_text(folder.place / "b.txt", "2")

    assert killed_at(0, staged).code == 0
    claim_elsewhere(tmp_path)
    assert (tmp_path / STAGED / "b.txt").read_text() == "2"
    write_set(tmp_path, "3", ("a.txt",))
    assert not (tmp_path / STAGED).exists()
