"""Runs one target under atheris in its own process: `python -m tests.fuzz.worker TARGET BYTES METER [libFuzzer's arguments]`.

Writes its counts of runs and bytes to METER, a file of two 64-bit numbers that the parent reads meanwhile; stops after
BYTES bytes.
"""

import mmap
import os
import struct
import sys
from pathlib import Path

import atheris

_COUNTS = struct.Struct("<QQ")


def main() -> None:
    """Fuzz."""
    name, most_bytes, meter = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    with atheris.instrument_imports(include=["common", "phone_host"]):
        from tests.fuzz.targets import TARGETS  # noqa: PLC0415 - what it imports is instrumented
    run = TARGETS[name].run
    runs = fed = 0
    with meter.open("r+b") as file:
        counts = mmap.mmap(file.fileno(), _COUNTS.size)

    def once(data: bytes) -> None:
        nonlocal runs, fed
        runs += 1
        fed += len(data)
        _COUNTS.pack_into(counts, 0, runs, fed)
        run(data)
        if fed >= most_bytes:
            sys.stderr.flush()
            os._exit(0)  # libFuzzer itself stops only after a number of runs

    atheris.Setup([sys.argv[0], *sys.argv[4:]], once)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
