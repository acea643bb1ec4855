"""Freed memory is kept for the next pair."""

import platform
import subprocess
import sys

import pytest

_CODE = """
import resource, sys
import numpy as np
from phone_host.run.kept import keep_freed_memory
if sys.argv[1] == "kept":
    keep_freed_memory()
def pair():
    arrays = [np.ones(1_000_000 * n, np.uint8) for n in (3, 4, 11, 14)]  # images, disparity, cloud, records at 1280x720
pair(), pair()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(5):
    pair()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def page_faults(mode: str) -> int:
    """Pages that had to be cleared for five pairs, in a process of its own."""
    done = subprocess.run([sys.executable, "-c", _CODE, mode], capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries than glibc are left as they are")
def test_further_pairs_clear_no_more_pages() -> None:
    """After the first pairs, the same blocks come from kept memory; without it every pair clears thousands of pages."""
    assert page_faults("kept") < 100
    assert page_faults("as usual") > 1000
