"""For the unit tests: one thread for the linear algebra of each worker, and a log that no test leaves changed.

There are as many workers as cores. With matrices as small as these OpenBLAS's threads mostly wait for each other, which costs a tenth of the suite's time.
"""

import logging
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported, which no conftest does earlier


@pytest.fixture(autouse=True)
def log_as_before() -> Iterator[None]:
    """A command that sets up its log in this process leaves no level behind that hides what the next test looks for."""
    level = logging.getLogger().level
    yield
    logging.getLogger().setLevel(level)


@pytest.fixture
def in_memory(tmp_path: Path) -> Iterator[Path]:
    """A folder that needs no disk: hundreds of processes sync here."""
    shared = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=shared if os.access(shared, os.W_OK) else tmp_path) as folder:
        yield Path(folder)
