"""The links' contract suite, run in the guest where the real devices are."""

import tempfile
from pathlib import Path
from typing import Final

from tests.vm.conftest import ROOT
from tests.vm.guest import Guest

_FILES: Final = ("tests/__init__.py", "tests/contract/__init__.py", "tests/contract/test_link.py")

_PATIENCE_S: Final = 180
"""For one condition: three times as long as elsewhere, because the processor is emulated."""

_LIMIT_S: Final = 1500
"""For the whole suite: it takes a minute and a half on an idle machine."""


def run_contract(guest: Guest, transport: str) -> str:
    """Run it on one transport, with the sources of this checkout; fails if the suite fails.

    Returns:
        The last line of pytest: how many passed, how many were skipped.
    """
    guest.code("rm -rf /srv/suite")
    with tempfile.TemporaryDirectory() as folder:
        suite = Path(folder) / "suite"
        for name in _FILES:
            (suite / name).parent.mkdir(parents=True, exist_ok=True)
            (suite / name).write_bytes((ROOT / name).read_bytes())
        guest.put(suite, "/srv")
    guest.put(ROOT / "common", "/srv/suite")
    guest.put(ROOT / "tests" / "support", "/srv/suite/tests")
    running = guest.popen(
        f"cd /srv/suite && TEST_PATIENCE_S={_PATIENCE_S} exec python3 -m pytest -q -p no:cacheprovider --import-mode=importlib "
        f"-W error tests/contract/test_link.py -k {transport} 2>&1"
    )
    with running:
        told = running.communicate(timeout=_LIMIT_S)[0].decode()
    assert running.returncode == 0, told[-5000:]
    return told.strip().splitlines()[-1]
