"""Random pairs for the library's matcher under AddressSanitizer and UndefinedBehaviorSanitizer: `python -m tests.native.fuzz_match [--minutes N] [--seed N]`.

Builds the library with sanitizers and starts itself with it. A pair that gives other bits than plain C, or touches what
is not its own, ends it with its seed.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from phone_host.stereo.native.library import Library, load
from tests.native.conftest import FOLDER
from tests.native.match_cases import random_case
from tests.native.test_match import require_sound
from tests.native.test_sanitized import sanitized

_PROGRESS_S = 30.0


def fuzz(library: Library, seconds: float, seed: int) -> int:
    """Try random pairs on every instruction set of this processor; return how many."""
    ends, tells, count = time.monotonic() + seconds, time.monotonic() + _PROGRESS_S, 0
    libraries = [library.using(simd) for simd in library.usable_sets()]
    while time.monotonic() < ends:
        case = random_case(np.random.default_rng(seed + count))
        for each in libraries:
            try:
                require_sound(each, case)
            except AssertionError:
                print(f"seed {seed + count}, {each.simd.text}", file=sys.stderr)
                raise
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
    options = parser.parse_args()
    if folder := os.environ.get(FOLDER):
        library = load(Path(folder))
        assert isinstance(library, Library), library
        sets = ", ".join(simd.text for simd in library.usable_sets())
        print(f"{fuzz(library, 60 * options.minutes, options.seed)} pairs on {sets}: no fault")
        return 0
    with tempfile.TemporaryDirectory() as name:
        environment = sanitized(Path(name))
        return subprocess.run(
            [sys.executable, "-m", __spec__.name, *sys.argv[1:]], env=environment, check=False
        ).returncode


if __name__ == "__main__":
    sys.exit(main())
