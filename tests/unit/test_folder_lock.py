"""Locks on folders of results: between programs, and within one that signals interrupt."""

import fcntl
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from common.errors import UnavailableError
from phone_host.output.folder_lock import LOCK, FolderLock
from tests.unit.test_listed import plant_link

_HOLDER = """
import sys
from pathlib import Path
from phone_host.output.folder_lock import FolderLock
with FolderLock(Path(sys.argv[1]), *sys.argv[2:]):
    print("locked", flush=True)
    sys.stdin.read()
"""


@pytest.mark.parametrize("file", [(), ("cup.mcap",)])
def test_another_program_is_kept_out_as_long_as_one_writes(tmp_path: Path, file: tuple[str, ...]) -> None:
    """It is told the number of the process that writes; when that one is killed, nothing is in the way any more and nothing stays."""
    out = tmp_path / "out"
    out.mkdir()
    words = [sys.executable, "-c", _HOLDER, str(out), *file]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        holder.stdout.readline()
        with pytest.raises(
            UnavailableError, match=f"is being written by process {holder.pid}: wait for its end"
        ) as caught:
            FolderLock(out, *file).acquire()
        assert caught.value.exit_code == 3
        holder.kill()
    assert len(list(out.iterdir())) == 1  # nobody was left to remove it
    with FolderLock(out, *file):
        pass
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("plant", [plant_link, os.mkfifo, Path.mkdir])
@pytest.mark.timeout(30)
def test_a_foreign_lock_is_named(plant: Callable[[Path], None], tmp_path: Path) -> None:
    """A link, pipe or folder under the lock's name is one line, and stays."""
    (tmp_path / "precious").write_text("")
    (tmp_path / "out").mkdir()
    plant(tmp_path / "out" / LOCK)
    with pytest.raises(UnavailableError, match=rf"out/{re.escape(LOCK)} is not a file of this program: move or delete"):
        FolderLock(tmp_path / "out").acquire()
    assert (tmp_path / "precious").read_text() == ""
    assert (tmp_path / "out" / LOCK).exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make another user's lock")
def test_what_a_killed_root_left_locks_nobody_out() -> None:
    """A lock file of root's that nobody holds is no obstacle for the user whose folder it is, and goes with his own lock; one that is held is told."""
    with tempfile.TemporaryDirectory() as name:
        out = Path(name)
        (out / LOCK).write_text("1\n")
        out.chmod(0o777)
        held = os.open(out / LOCK, os.O_RDONLY)
        fcntl.flock(held, fcntl.LOCK_EX)
        os.seteuid(65534)
        try:
            with pytest.raises(UnavailableError, match="is being written by process 1:"):
                FolderLock(out).acquire()
            os.close(held)
            with FolderLock(out):
                pass
            assert list(out.iterdir()) == []
        finally:
            os.seteuid(0)


def test_a_lock_leaves_no_folder_behind(tmp_path: Path) -> None:
    """Folders that it had to make go with it if nothing was written into them; others stay."""
    with FolderLock(tmp_path / "a" / "b"):
        pass
    assert list(tmp_path.iterdir()) == []
    with FolderLock(tmp_path / "a" / "b"):
        (tmp_path / "a" / "file").write_text("")
    assert [path.name for path in tmp_path.rglob("*")] == ["a", "file"]
