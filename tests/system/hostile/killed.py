"""Verbs that get a signal at one of their steps while they replace earlier results: `python -m tests.system.hostile.killed FOLDER ROUNDS SEED`.

Each verb runs once with one input, and leaves results. Then it runs with another input, and gets SIGKILL, SIGINT or SIGTERM before one of its steps on
the disk, which may have little room. After another verb has opened the folder, either all of the earlier results must be there or all of the later ones,
never some of both; results of a part of the pairs may lie beside the earlier ones, in a folder that the program names. Then the same command must work.
"""

import contextlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

from phone_host.cli import command_of, main
from phone_host.output.result_files import claim
from tests.support.killed_at import Ending, killed_at
from tests.system.hostile.attack import Attack, Outcome, Rounds
from tests.system.hostile.full_disks import VERBS, Verb, can_mount, faults_of, filled, in_namespace, write_inputs

SIGNALS: Final = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)
_PARTIAL: Final = "partial-"
_ROUNDS: Final = 200
_ENDS: Final = 4
"""Rounds with one verb, whose results are there already."""

_ROOMS: Final = (0, 4096, 12288, 65536, 1 << 20)

Tree = dict[str, bytes]


@dataclass(slots=True)
class Replaced:
    """A verb, and what its results are before and after it has replaced them.

    Attributes:
        verb: the verb.
        words: its command line with the second input.
        before: the results of the first input.
        names: of the results of the second.
        differing: names that both have, with different content.
        code: exit code of the second.
        steps: on the disk that the second takes.
    """

    verb: Verb
    words: list[str]
    before: Tree
    names: set[str] = field(default_factory=set)
    differing: set[str] = field(default_factory=set)
    code: int | None = 0
    steps: int = 0


def replaced(verb: Verb, inputs: tuple[Path, Path], disk: Path) -> Replaced:
    """Run a verb with one input and then with the other, without harm. The disk holds the results of the first one afterwards."""
    _emptied(disk)
    first, second = ([str(word) for word in verb.words(given, disk)] for given in inputs)
    ended, told = run(first, disk.parent)
    assert ended.code in {0, 4}, told
    if verb.makes_new:
        _remove(disk / verb.makes_new)
    saved = _saved(disk)
    made = Replaced(verb, second, results(disk))
    ended, told = run(second, disk.parent)
    made.code, made.steps = ended.code, ended.steps
    assert made.code in {0, 4}, told
    later = results(disk)
    made.names = set(later)
    made.differing = {name for name in later if name in made.before and later[name] != made.before[name]}
    _restored(saved, disk)
    _restored(saved, disk)
    return made


def faults_of_end(made: Replaced, disk: Path, step: int, number: int, left_bytes: int | None = None) -> list[str]:
    """Let a verb replace its results, and end it by a signal; return what was wrong. The disk is as before afterwards.

    Args:
        made: the verb.
        disk: holds the results of the first input.
        step: before which the signal comes.
        number: of the signal.
        left_bytes: room on the disk; None: enough.
    """
    saved, faults = _saved(disk), []
    try:
        with filled(disk, left_bytes) if left_bytes is not None else contextlib.nullcontext():
            _, told = run(made.words, disk.parent, step, number)
        if "Traceback" in told:
            faults.append(f"a traceback: {told}")
        faults += _faults_of_results(made, disk, told)
        ended, told = run(made.words, disk.parent)
        again = ended.code
        after = results(disk)
        is_there = bool(made.verb.makes_new) and (disk / made.verb.makes_new).exists() and again not in {0, made.code}
        if not is_there and (again != made.code or set(after) != made.names):
            changed = set(after).symmetric_difference(made.names)
            faults.append(f"the next time it ended with {again}: {told} {sorted(changed)}")
        left = [name for name in hidden(disk) if not name.endswith((".tandemscan", "/.tandemscan"))]
        if left and not is_there:
            faults.append(f"left behind: {left}")
    finally:
        _restored(saved, disk)
    return faults


def _faults_of_results(made: Replaced, disk: Path, told: str) -> list[str]:
    if not made.verb.makes_new:
        with contextlib.suppress(FileNotFoundError):
            claim(disk / "out", "plot.svg")
    found = results(disk)
    partial = {Path(name).parts[1] for name in found if _is_partial(name)}
    found = {name: content for name, content in found.items() if not _is_partial(name)}
    faults = [f"{each} is not named: {told}" for each in partial if each not in told]
    if found == made.before:
        return faults
    if set(found) != made.names:
        if made.verb.makes_new and set(found) == set(made.before):
            return faults
        return [*faults, f"neither set: {sorted(set(found).symmetric_difference(made.names))}"]
    mixed = [name for name in made.differing if found[name] == made.before[name]]
    return [*faults, f"of the earlier set among the later one: {mixed}"] if mixed else faults


def results(disk: Path) -> Tree:
    """Return the visible files on a disk."""
    return {
        str(path.relative_to(disk)): path.read_bytes()
        for path in sorted(disk.rglob("*"))
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(disk).parts)
    }


def hidden(disk: Path) -> list[str]:
    """Return the names that begin with a dot."""
    return [str(path.relative_to(disk)) for path in disk.rglob("*") if path.name.startswith(".")]


def run(words: list[str], folder: Path, step: int = 0, number: int = signal.SIGKILL) -> tuple[Ending, str]:
    """Run a command in a child process that gets a signal before a step; return how it ended and its stderr."""
    with tempfile.TemporaryFile(dir=folder) as errors, open(os.devnull, "wb") as nothing:  # noqa: PTH123

        def work() -> None:
            os.dup2(nothing.fileno(), 1)
            os.dup2(errors.fileno(), 2)
            sys.stdout, sys.stderr = (open(number, "w", buffering=1, closefd=False) for number in (1, 2))  # noqa: SIM115
            signal.signal(signal.SIGINT, signal.default_int_handler)
            raise SystemExit(main(words))

        ended = killed_at(step, work, number)
        errors.seek(0)
        return ended, errors.read().decode(errors="replace")


def _is_partial(name: str) -> bool:
    parts = Path(name).parts
    return len(parts) > 1 and parts[1].startswith(_PARTIAL)


def _remove(path: Path) -> None:
    shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def _emptied(disk: Path) -> None:
    for path in disk.iterdir():
        _remove(path)


def _saved(disk: Path) -> Path:
    saved = Path(tempfile.mkdtemp(dir=disk.parent))
    shutil.copytree(disk, saved, dirs_exist_ok=True, symlinks=True)
    return saved


def _restored(saved: Path, disk: Path) -> None:
    _emptied(disk)
    shutil.copytree(saved, disk, dirs_exist_ok=True, symlinks=True)


@contextlib.contextmanager
def prepared(folder: Path) -> Iterator[tuple[tuple[Path, Path], Path]]:
    """Write two inputs, and load in this process what the verbs need, so that its children begin at once.

    Args:
        folder: for all of it.

    Yields:
        The two inputs, and an empty folder.
    """
    inputs, disk = (folder / "first", folder / "second"), folder / "disk"
    disk.mkdir(exist_ok=True)
    for verb in (
        "stereo",
        "quality",
        "scan",
        "relief",
        "export",
        "printcheck",
        "target",
        "calibrate",
        "run",
        "sessions",
    ):
        command_of(verb)
    for given, turn in zip(inputs, (False, True), strict=True):
        given.mkdir()
        in_child(partial(write_inputs, given, is_other=turn))
    yield inputs, disk


def in_child(work: Callable[[], object]) -> Any:
    """Do something in a child process, whose threads this one does not inherit; return what it returned."""
    with tempfile.TemporaryFile("w+") as answer:

        def write() -> None:
            json.dump(work(), answer)
            answer.flush()

        assert killed_at(0, write).code == 0
        answer.seek(0)
        return json.load(answer)


def rounds_of(folder: Path, count: int, seed: int) -> list[str]:
    """Run random verbs, each with a random end or a random room on the disk, or both; return what was wrong.

    Args:
        folder: for all of it; the disk in it may be small.
        count: of the rounds.
        seed: of what is drawn.
    """
    draw, faults, made = random.Random(seed), [], dict[str, Replaced]()
    with prepared(folder) as (inputs, disk):
        for number in range(count // _ENDS):
            verb, room = draw.choice(VERBS), draw.choice((None, None, *_ROOMS))
            if number % 8 == 0 and room is not None:
                found = in_child(partial(faults_of, verb, inputs[0], disk, room))
                faults += [f"round {number}: {verb.name}, {room} bytes: {fault}" for fault in found]
                made.clear()  # the disk holds other results now
                continue
            if verb.name not in made or results(disk) != made[verb.name].before:
                made = {verb.name: replaced(verb, inputs, disk)}
            one = made[verb.name]
            for _ in range(_ENDS):
                step, sent = draw.randint(1, one.steps), draw.choice(SIGNALS)
                found = faults_of_end(one, disk, step, sent, room)
                faults += [
                    f"round {number}: {verb.name}, step {step}, {sent.name}, room {room}: {fault}" for fault in found
                ]
    return faults


def _attack(folder: Path, rounds: Rounds) -> Outcome:
    outcome, ended = Outcome(), 0
    if not can_mount():
        return Outcome(figures=["not run: no mount namespace can be made here"])
    for number in rounds:
        place = folder / str(number)
        place.mkdir()
        for fault in in_namespace(place, __spec__.name, str(_ROUNDS), str(33 + number)):
            outcome.expect(holds=False, otherwise=str(fault))
        ended += _ROUNDS
    outcome.figures.append(f"{ended} rounds")
    return outcome


LONG: Final = (Attack("ended writers", "verbs that are killed or interrupted while they replace results", _attack),)


if __name__ == "__main__":
    print(json.dumps(rounds_of(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))))
