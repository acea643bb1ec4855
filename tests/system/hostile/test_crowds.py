"""Crowds, bombs over HTTP, stops, kills and noise: nothing is paired wrongly, the stream recovers, every frame is accounted for."""

from pathlib import Path

import pytest

from tests.system.hostile.attack import Attack, Rounds
from tests.system.hostile.crowds import SHORT


@pytest.mark.parametrize("attack", SHORT, ids=lambda attack: attack.name)
def test_the_stream_survives(attack: Attack, tmp_path: Path) -> None:
    """What is done to the programs from outside costs at most frames, each of them accounted for by name."""
    assert attack.run(tmp_path, Rounds()).broken() == []
