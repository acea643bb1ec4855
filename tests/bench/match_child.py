"""Runs one part of bench_matcher in a process of its own: `python -m tests.bench.match_child PART MATCHER RUNS|PAIR`.

PART is `times` (our matcher and 3WAY in turns at 1280x720, 128; the caller limits the instruction sets by the environment)
or `memory` (growth of the peak resident memory during the first match of the images in the file PAIR; MATCHER may be
3WAY). Prints one JSON object.
"""

import ctypes
import gc
import json
import os
import re
import sys
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

import cv2
import numpy as np

from tests.bench.match_contestants import MODES, THREADS, Setting, interleaved, matches, setting

WIDTH_PX = 1280


def limited_environment() -> dict[str, str]:
    """The environment in which ours and OpenCV use AVX2 at most.

    OpenCV's wheels read OPENCV_CPU_DISABLE at start; a feature that it switches off bears a question mark in
    `cv2.getCPUFeaturesLine()`.
    """
    return {**os.environ, "TANDEMSCAN_SIMD": "avx2", "OPENCV_CPU_DISABLE": "AVX512-SKX"}


def _status_kb(name: str) -> int:
    found = re.search(rf"^{name}:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"), re.MULTILINE)
    assert found is not None
    return int(found[1])


def growth_mb(matcher: str, pair: Path) -> float:
    """How far the peak of the resident memory rises above what is resident before the first match, MB.

    The images are loaded and the matcher is made before; its threads and buffers are not.

    Args:
        matcher: its name, or a key of MODES.
        pair: .npz with `left` and `right`, BGR. Rendering them here would leave freed memory, in which a match would not grow.
    """
    with np.load(pair) as images:
        where = Setting(WIDTH_PX, WIDTH_PX // 10, images["left"], images["right"])
    ours, modes = ((), (matcher,)) if matcher in MODES else ((matcher,), ())
    run = matches(where, ours, modes)[matcher]
    gc.collect()
    with suppress(OSError, AttributeError):  # glibc alone has it
        ctypes.CDLL(None).malloc_trim(0)
    # proc(5): writing 5 resets the peak to what is resident now.
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    before_kb = _status_kb("VmRSS")
    run()
    return (_status_kb("VmHWM") - before_kb) * 1024 / 1e6


def main() -> None:
    """Run the part that the arguments name."""
    part, matcher, last = sys.argv[1:]
    cv2.setNumThreads(THREADS)
    if part == "memory":
        print(json.dumps({"growth_mb": growth_mb(matcher, Path(last))}))
        return
    times = interleaved(matches(setting(WIDTH_PX), (matcher,), ("3WAY",)), int(last))
    taken = {name: asdict(time) for name, time in times.items()}
    print(json.dumps({"times": taken, "opencv_features": cv2.getCPUFeaturesLine()}))


if __name__ == "__main__":
    main()
