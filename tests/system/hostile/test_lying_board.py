"""A board that lies to its host: no pair with a frame that lied, the stream goes on, memory stays, every frame that is dropped is named."""

from pathlib import Path

import pytest

from tests.system.hostile.attack import Attack, Rounds
from tests.system.hostile.lies import SHORT


@pytest.mark.parametrize("attack", SHORT, ids=lambda attack: attack.name)
def test_a_board_lies(attack: Attack, tmp_path: Path) -> None:
    """Whatever a board says, the host uses nothing of it that cannot be, and goes on."""
    assert attack.run(tmp_path, Rounds()).broken() == []
