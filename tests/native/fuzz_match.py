"""Random pairs for the library's matcher under AddressSanitizer and UndefinedBehaviorSanitizer: `python -m tests.native.fuzz_match [--minutes N] [--seed N]`.

Builds the library with sanitizers (a minute on two cores) and starts itself with it. A pair that gives other bits than plain C, touches
what is not its own, or is not matched within a minute ends it with its seed; `--seed N --pairs 1` tries that one again.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from phone_host.native.library import Library, load
from tests.native.conftest import FOLDER
from tests.native.match_cases import random_case
from tests.native.test_match import reference, require_sound
from tests.native.test_sanitized import built_into

_PROGRESS_S = 30.0
_MOST_S = 60.0
"""For one pair on one instruction set; the largest take a second or two with sanitizers."""
_HANGS = 98


def _give_up(what: str) -> None:
    print(f"{what}: no result after {_MOST_S:.0f} s", file=sys.stderr, flush=True)
    os._exit(_HANGS)  # the thread that hangs cannot be stopped


def try_one(libraries: Sequence[Library], seed: int) -> None:
    """Try the pair of one seed on every instruction set.

    Raises:
        AssertionError: a result is wrong; seed and instruction set have been printed.
    """
    case = random_case(np.random.default_rng(seed))
    expected = None
    for library in libraries:
        what = f"seed {seed}, {library.simd.text}"
        guard = threading.Timer(_MOST_S, _give_up, [what])  # the library lets go of the GIL
        guard.start()
        try:
            expected = expected or reference(library, case)
            require_sound(library, case, expected)
        except AssertionError:
            print(what, file=sys.stderr)
            raise
        finally:
            guard.cancel()


def fuzz(library: Library, seconds: float, seed: int, pairs: int) -> int:
    """Try random pairs on every instruction set of this processor, until the time or the pairs are over; return how many."""
    ends, tells, count = time.monotonic() + seconds, time.monotonic() + _PROGRESS_S, 0
    libraries = [library.using(simd) for simd in library.usable_sets()]
    while time.monotonic() < ends and count < pairs:
        try_one(libraries, seed + count)
        count += 1
        if time.monotonic() > tells:
            print(f"{count} pairs", flush=True)
            tells += _PROGRESS_S
    return count


def main() -> int:
    """Fuzz; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.native.fuzz_match")
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--pairs", type=int, default=sys.maxsize, help="at most (default: as many as the minutes allow)"
    )
    options = parser.parse_args()
    if folder := os.environ.get(FOLDER):
        library = load(Path(folder))
        assert isinstance(library, Library), library
        sets = ", ".join(simd.text for simd in library.usable_sets())
        print(f"{fuzz(library, 60 * options.minutes, options.seed, options.pairs)} pairs on {sets}: no fault")
        return 0
    with tempfile.TemporaryDirectory() as name:
        print("building the library with sanitizers", flush=True)
        environment = built_into(Path(name))
        return subprocess.run(
            [sys.executable, "-m", __spec__.name, *sys.argv[1:]], env=environment, check=False
        ).returncode


if __name__ == "__main__":
    sys.exit(main())
