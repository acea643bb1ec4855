"""A board that lies to its host: no pair contains a false frame, the stream goes on, memory stays normal, every dropped frame is named."""

from pathlib import Path

import pytest

from tests.system.hostile.attack import Attack, Rounds
from tests.system.hostile.lies import SHORT


@pytest.mark.parametrize("attack", SHORT, ids=lambda attack: attack.name)
def test_a_board_lies(attack: Attack, tmp_path: Path) -> None:
    """Whatever a board says, the host uses nothing that cannot be true, and goes on."""
    assert attack.run(tmp_path, Rounds()).broken() == []
