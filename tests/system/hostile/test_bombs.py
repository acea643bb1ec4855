"""Images of a few bytes that demand gigabytes, from the board and from the host's own camera: memory stays normal, each drop is named."""

from pathlib import Path

import pytest

from tests.system.hostile.attack import Attack, Rounds
from tests.system.hostile.crowds import HTTP
from tests.system.hostile.lies import SHORT_BOMBS


@pytest.mark.parametrize("attack", [*SHORT_BOMBS, HTTP], ids=lambda attack: attack.name)
def test_an_image_explodes(attack: Attack, tmp_path: Path) -> None:
    """An image is only decoded if it has the size of its camera's images."""
    assert attack.run(tmp_path, Rounds()).broken() == []
