"""Locks on folders of results: between programs, and within one that signals interrupt."""

import fcntl
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import FrameType

import pytest

from common.errors import UnavailableError
from phone_host.output.atomic import write_bytes
from phone_host.output.folder_lock import LOCK, FolderLock, Length
from phone_host.output.listed import ListedFolder
from phone_host.output.result_files import replacing_results
from tests.unit.output.test_listed import plant_link

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


class _Interrupt:
    """Sends this process SIGINT before the Nth line of some functions, as a signal may come between any two."""

    def __init__(self, line: int, files: tuple[str, ...]) -> None:
        self._left, self._files = line, files

    def __call__(self, frame: FrameType, event: str, argument: object) -> "_Interrupt | None":
        del argument
        if not frame.f_code.co_filename.endswith(self._files):
            return self if event == "call" else None
        if event == "call" and frame.f_code.co_name == "__del__":  # Python drops what is raised there
            return None
        if event == "line":
            self._left -= 1
            if self._left == 0:
                sys.settrace(None)
                signal.raise_signal(signal.SIGINT)
        return self

    @property
    def is_over(self) -> bool:
        """Whether the signal never came: there are fewer lines."""
        return self._left > 0


FILES = ("output/folder_lock.py", "output/listed.py", "output/result_files.py")


def interrupted(line: int, work: Callable[[], object]) -> bool:
    """Do something that is interrupted before one of its lines; return whether there was such a line."""
    before, interrupt = sys.gettrace(), _Interrupt(line, FILES)
    sys.settrace(interrupt)
    try:
        work()
    except KeyboardInterrupt:
        pass
    finally:
        sys.settrace(before)
    return not interrupt.is_over


def locked(folder: Path) -> None:
    """Lock a folder for a command, and in it for a set of results."""
    with FolderLock(folder), FolderLock(folder, length=Length.RESULTS):
        pass


def results(folder: Path) -> None:
    """Replace two files."""
    with FolderLock(folder), replacing_results(folder, r"[ab]\.txt", ("a.txt", "b.txt")) as place:
        for name in "ab":
            write_bytes(place / f"{name}.txt", b"new")


@pytest.mark.parametrize("work", [locked, results])
def test_an_interrupt_before_any_line_leaves_the_folder_free(work: Callable[[Path], None], in_memory: Path) -> None:
    """Wherever Ctrl-C comes, this process and another one can lock the folder afterwards, nothing stays locked, and files are all of one set."""
    line, is_more = 0, True
    while is_more:
        line += 1
        folder = in_memory / str(line)
        folder.mkdir()
        is_more = interrupted(line, partial(work, folder))
        if (folder / LOCK).exists():  # a signal may keep it from being removed, but nobody holds it
            with (folder / LOCK).open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with FolderLock(folder), FolderLock(folder, length=Length.RESULTS):
            pass
        with ListedFolder(folder, "(?!)"):
            pass
        assert {path.read_bytes() for path in folder.glob("*.txt")} <= {b"new"}
        assert len(list(folder.glob("*.txt"))) in {0, 2}
        assert not (folder / LOCK).exists()
    assert line > 50


_RIVAL = """
import fcntl, os, signal, sys
from pathlib import Path
from common.errors import UnavailableError
from phone_host.output.folder_lock import FolderLock
def is_free(witness):
    try:
        fcntl.flock(witness, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
# The kernel drops the locks of a killed process one by one, by their descriptors. One witness is opened before the lock, the other after it:
# in whichever order that is, one of them is free before the lock is. Only who finds both taken has met somebody.
out, before = Path(sys.argv[1]), os.open(sys.argv[2], os.O_RDWR | os.O_CREAT)
signal.signal(signal.SIGTERM, signal.default_int_handler)
done, asked = 0, {signal.SIGINT, signal.SIGTERM}
print("ready", flush=True)
while done < int(sys.argv[3]):
    try:
        with FolderLock(out):
            try:
                # A signal must not part the witnesses from the lock: who left with them would bear false witness.
                signal.pthread_sigmask(signal.SIG_BLOCK, asked)
                after = os.open(sys.argv[2] + " after", os.O_RDWR | os.O_CREAT)
                if not [witness for witness in (before, after) if is_free(witness)]:
                    sys.exit("two have the lock")
                (out / "file").write_text(str(os.getpid()))
                assert (out / "file").read_text() == str(os.getpid())
                done += 1
                os.close(after)
                fcntl.flock(before, fcntl.LOCK_UN)
            finally:
                signal.pthread_sigmask(signal.SIG_UNBLOCK, asked)
    except UnavailableError as error:
        assert f"process {os.getpid()}:" not in str(error), "locked out by itself"
    except KeyboardInterrupt:
        pass
"""
_RIVALS, _TURNS, _SIGNALS = 4, 150, 120


@pytest.mark.timeout(120)
def test_one_at_a_time_whatever_signals_come(tmp_path: Path) -> None:
    """Four processes lock one folder again and again, while they get SIGINT, SIGTERM and SIGKILL: never two have it, none locks itself out, and each that lives takes all its turns."""
    out, draw = tmp_path / "out", random.Random(4)

    def rival() -> "subprocess.Popen[str]":
        words = [sys.executable, "-c", _RIVAL, str(out), str(tmp_path / "witness"), str(_TURNS)]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert process.stdout is not None
        process.stdout.readline()
        return process

    rivals = [rival() for _ in range(_RIVALS)]
    ended = []
    for number in range(_SIGNALS):
        index = draw.randrange(_RIVALS)
        if number % 30 == 29:
            rivals[index].kill()
            ended.append(rivals[index])
            rivals[index] = rival()
        elif rivals[index].poll() is None:
            rivals[index].send_signal(draw.choice((signal.SIGINT, signal.SIGTERM)))
        signal.sigtimedwait([], draw.random() * 0.01)
    told = [(process.communicate(timeout=60)[1], process.returncode) for process in (*rivals, *ended)]
    assert not [text for text, code in told if code == 1 or "locked out" in text or "two have" in text], told
    with FolderLock(out):
        pass
    assert not (out / LOCK).exists()
