"""Prints how much memory reading a mesh takes: `python -m tests.cases.peak_memory FILE...`, a line `bytes more than before` for each.

Each file is read by a process of its own, forked from one that has loaded all modules: its peak begins at what that one has.
"""

import os
import resource
import sys
from pathlib import Path

from common.errors import DataError
from phone_host.output.model_file import read_model


def main(paths: list[str]) -> None:
    """Read the files."""
    for path in [paths[0], *paths]:  # the first one twice: it loads what is loaded late
        child = os.fork()
        if child == 0:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            try:
                read_model(Path(path), "mm")
            except DataError as error:
                print(error, file=sys.stderr)
            print(1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before), flush=True)
            os._exit(0)
        os.waitpid(child, 0)


if __name__ == "__main__":
    main(sys.argv[1:])
