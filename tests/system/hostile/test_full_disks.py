"""Verbs on a full disk: what was good stays, nothing half written stays, and the same command works when there is room again."""

import pytest

from tests.system.hostile.full_disks import VERBS, can_mount, on_full_disks


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """What was wrong, by verb and room."""
    return on_full_disks(tmp_path_factory.mktemp("full"))


@pytest.mark.skipif(not can_mount(), reason="no mount namespace can be made here")
@pytest.mark.parametrize("verb", [verb.name for verb in VERBS])
def test_a_full_disk_costs_nothing_that_was_there(verb: str, found: dict[str, list[str]]) -> None:
    """The earlier results are there byte by byte, one line names the file and the remedy, nothing else stays, and the command works again."""
    of_verb = {name: faults for name, faults in found.items() if name.startswith(f"{verb},")}
    assert of_verb
    assert not any(of_verb.values()), of_verb
