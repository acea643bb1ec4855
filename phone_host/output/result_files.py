"""What verbs do with a folder of results (`listed.py`): replace files together, claim names for files that are replaced one by one, remove files."""

import os
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from phone_host.output.listed import ListedFolder


@contextmanager
def replacing_results(
    path: Path,
    names: str,
    files: Iterable[str],
    *,
    first: str = "",
    command: str = "",
    partial: Callable[[Path], None] | None = None,
) -> Iterator[Path]:
    """Write results that take the place of an earlier run's if the block ends without an error; else those stay as they are.

    Args:
        path: the folder, created if missing.
        names: pattern of the names that are removed if they are ours.
        files: names of what is written.
        first: name of a file that is worth keeping alone if the others cannot be written, unless it would replace an earlier one.
        command: the verb whose report is among them: that of another verb stays under another name. Empty: it has none.
        partial: what is called with the folder where the results are, if they are not whole and so must not replace any; None: they are whole.

    Yields:
        Where to write the files.

    Raises:
        UnavailableError: such a name belongs to a foreign file, or to a link; or another program writes there.
        OSError: as the operating system reports it; it names the file as it would be called in the end.
    """
    with ListedFolder(path, names, command=command) as folder:
        try:
            folder.add(*files)
            folder.stage()
            yield folder.place
            if partial is not None and folder.earlier:
                partial(folder.keep_staged())
            else:
                folder.publish()
        except OSError as error:
            if first and folder.publish_alone(first):
                error.strerror = f"{error.strerror}; {path / first} is written"
            if error.filename and (name := Path(os.fsdecode(error.filename)).name):
                error.filename = str(path / name)
            raise


def remove_results(path: Path, names: str) -> None:
    """Remove files that an earlier run has left.

    Raises:
        UnavailableError: such a name belongs to a foreign file, or to a link; or another program writes there.
        OSError: as the operating system reports it.
    """
    with ListedFolder(path, names) as folder:
        folder.remove_earlier()


def claim(path: Path, *names: str) -> None:
    """List names in a folder as ours before they are written; they must be free or left by an earlier run.

    Raises:
        UnavailableError: such a name belongs to a foreign file, or to a link.
        OSError: as the operating system reports it.
    """
    with ListedFolder(path, "(?!)", kept="|".join(re.escape(name) for name in names)) as folder:
        folder.add(*names)
