"""Clocks that step: no pair of frames from different moments, the stated uncertainty holds, pairs resume, every frame is accounted for."""

from pathlib import Path

import pytest

from tests.system.hostile.attack import Attack, Rounds
from tests.system.hostile.clocks import SHORT


@pytest.mark.parametrize("attack", SHORT, ids=lambda attack: attack.name)
def test_a_clock_steps(attack: Attack, tmp_path: Path) -> None:
    """Whatever step either clock makes, nothing is paired wrongly and the stream recovers."""
    assert attack.run(tmp_path, Rounds()).broken() == []
