"""Verbs that are killed or interrupted while they replace results. `make attack` draws hundreds of such ends."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.system.hostile.full_disks import VERBS, Verb
from tests.system.hostile.killed import faults_of_end, prepared, replaced

_SLOW = {"relief", "printcheck", "scan", "stereo of one pair", "target"}
"""For `make attack` only; they write as the others do."""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[tuple[Path, Path], Path]]:
    """Two inputs for each verb, and a folder for the results."""
    with prepared(tmp_path_factory.mktemp("killed")) as given:
        yield given


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb.name not in _SLOW], ids=lambda verb: verb.name)
def test_a_killed_verb_leaves_one_set(verb: Verb, place: tuple[tuple[Path, Path], Path]) -> None:
    """All of the earlier results are there, or all of the later ones, and the same command works, wherever it is killed or interrupted."""
    inputs, disk = place
    made = replaced(verb, inputs, disk)
    assert faults_of_end(made, disk, made.steps - 4, signal.SIGKILL) == []
    assert faults_of_end(made, disk, made.steps // 2, signal.SIGINT) == []
