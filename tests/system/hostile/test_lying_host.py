"""Hosts that lie to a board, and strangers at a host: the stream goes on, the next host gets its frames, memory and log stay small."""

from pathlib import Path

import pytest

from tests.system.hostile.attack import Attack, Rounds
from tests.system.hostile.lying_host import SHORT


@pytest.mark.parametrize("attack", SHORT, ids=lambda attack: attack.name)
def test_a_host_lies(attack: Attack, tmp_path: Path) -> None:
    """Whatever a host or a stranger says, frames keep reaching the right host."""
    assert attack.run(tmp_path, Rounds()).broken() == []
