"""What a process has begun to write is gone if it leaves at once, and stays if it was finished."""

from pathlib import Path

from common.unfinished import remove_unfinished, unfinished
from phone_host.output.atomic import replacing
from phone_host.output.listed import ListedFolder


def test_leaving_in_the_middle_removes_half_written_files_and_folders_only(tmp_path: Path) -> None:
    """A finished file stays; the one being written, and a folder of several, leave nothing behind."""
    (tmp_path / "whole").write_bytes(b"whole")
    folder = ListedFolder(tmp_path, r"pair-\d", inner=r"left\.png")
    with replacing(tmp_path / "half") as file:
        file.write(b"begun")
        file.flush()
        assert any(path.name.startswith(".half.") for path in tmp_path.iterdir())
        remove_unfinished()
        assert _names(tmp_path) == [".tandemscan", "whole"]
        (tmp_path / next(iter(_temporary(file.fileno())))).touch()  # so that the block can end as usual
    with folder.new_folder("pair-0") as inside:
        (inside / "left.png").write_bytes(b"begun")
        remove_unfinished()
        assert _names(tmp_path) == [".tandemscan", "half", "whole"]
        (tmp_path / "pair-0.part").mkdir()
    folder.close()


def test_what_was_finished_is_not_removed() -> None:
    """After its block nothing is left to remove, whether the block succeeded or failed."""
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


def _temporary(descriptor: int) -> list[str]:
    """Name of a file that was removed while it was open."""
    return [Path(f"/proc/self/fd/{descriptor}").readlink().name.removesuffix(" (deleted)")]


def _names(folder: Path) -> list[str]:
    """Names of what lies in a folder."""
    return sorted(path.name for path in folder.iterdir())
