"""What a process has begun to write is gone if it leaves at once, and stays if it was finished."""

import os
import threading
import traceback
from collections.abc import Callable
from pathlib import Path

from common.unfinished import remove_unfinished, unfinished
from phone_host.output.atomic import replacing
from phone_host.output.listed import ListedFolder


def test_leaving_in_the_middle_removes_half_written_files_and_folders_only(tmp_path: Path) -> None:
    """A finished file stays; the one being written, and a folder of several, leave nothing behind."""
    (tmp_path / "whole").write_bytes(b"whole")

    def leave_in_the_middle() -> None:
        folder = ListedFolder(tmp_path, r"pair-\d")
        folder.open()
        with replacing(tmp_path / "half") as file, folder.new_folder("pair-0") as inside:
            file.write(b"begun")
            file.flush()
            (inside / "left.png").write_bytes(b"begun")
            assert any(path.name.startswith(".half.") for path in tmp_path.iterdir())
            assert "pair-0.part" in _names(tmp_path)
            remove_unfinished()
            os._exit(0)

    assert _in_child(leave_in_the_middle)
    assert _names(tmp_path) == [".tandemscan", "whole"]


def test_what_was_finished_is_not_removed() -> None:
    """After its block nothing is left to remove, whether the block succeeded or failed."""

    def leave_afterwards() -> None:
        removed: list[str] = []
        with unfinished(lambda: removed.append("first")):
            pass
        try:
            with unfinished(lambda: removed.append("second")):
                raise OSError
        except OSError:
            pass
        remove_unfinished()
        assert removed == []

    assert _in_child(leave_afterwards)


def test_nothing_half_removed_gets_its_final_name() -> None:
    """While the process leaves, another thread that comes to the end of its block goes no further."""

    def leave_beside_a_writer() -> None:
        begun, go_on, ended = threading.Event(), threading.Event(), threading.Event()

        def write() -> None:
            with unfinished(lambda: None):
                begun.set()
                go_on.wait()
            ended.set()

        threading.Thread(target=write, daemon=True).start()
        begun.wait()
        remove_unfinished()
        go_on.set()
        assert not ended.wait(0.05)

    assert _in_child(leave_beside_a_writer)


def _in_child(work: Callable[[], None]) -> bool:
    """Do something in a process of its own, which leaves afterwards. Return whether it succeeded."""
    child = os.fork()
    if child == 0:
        try:
            work()
            os._exit(0)
        except BaseException:  # noqa: BLE001 - a process must not go on as a second test run
            traceback.print_exc()
            os._exit(1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def _names(folder: Path) -> list[str]:
    """Names of what lies in a folder."""
    return sorted(path.name for path in folder.iterdir())
