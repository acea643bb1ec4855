"""How long a command lives after Ctrl-C: `python -m tests.bench.bench_interrupts`. Figure to reach: 1 s, exit code 130, no traceback.

Starts `phone-host stereo` on two photographs of 50 megapixels and interrupts it at many moments, from its imports to the
middle of the matching. Exit 4 when a figure is missed.
"""

import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from tests.bench.machine import machine

_MOMENTS_S = (0.05, 0.15, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0)
_MOST_S = 1.0


def main() -> int:
    """Interrupt at each moment and print the table."""
    table = Table(
        "signal after, s",
        "ended after, s",
        "exit code",
        "left in the folder",
        title=", ".join(map(str, (machine().cpu, machine().cores, machine().date))),
    )
    missed = False
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / "image.jpg"
        tile = np.random.default_rng(1).integers(0, 256, (722, 1083), dtype=np.uint8)
        cv2.imwrite(str(image), np.tile(tile, (8, 8)))
        for moment_s in _MOMENTS_S:
            out = Path(folder) / f"out-{moment_s}"
            arguments = ["stereo", str(image), str(image), "--rectified", "--disparities", "256", "--out", str(out)]
            command = [str(Path(sys.executable).with_name("phone-host")), *arguments]
            with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as running:
                threading.Event().wait(moment_s)
                running.send_signal(signal.SIGINT)
                begun_s = time.monotonic()
                _, error = running.communicate()
                took_s = time.monotonic() - begun_s
            left = [path.name for path in out.iterdir() if path.name != ".tandemscan"] if out.exists() else []
            partial = [name for name in left if name.endswith(".part")]
            missed |= took_s > _MOST_S or running.returncode != 130 or "Traceback" in error or bool(partial)
            table.add_row(f"{moment_s:g}", f"{took_s:.2f}", str(running.returncode), ", ".join(left) or "nothing")
    Console().print(table)
    return 4 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
