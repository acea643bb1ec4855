"""Counts the instructions that a program executes, for any architecture: qemu-user runs it and logs each one.

`-singlestep` makes every instruction a block of its own and `-d nochain,exec` logs every block that is run, so the lines of
the log are the instructions (qemu 5 to 8; newer ones call the first option `-one-insn-per-tb`). What a program does at
its start and end cancels: it is run with one repetition of the work and with two, and the difference is one.
"""

import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_LOGGING: Final = ("-singlestep", "-d", "nochain,exec")
_BLOCK: Final = b"Trace "
"""How each line of the log begins."""
_PART: Final = 1 << 20


@dataclass(frozen=True, slots=True)
class Emulated:
    """A program for some processor.

    Attributes:
        program: a static executable; its last argument is the number of repetitions.
        machine: qemu's name of the architecture: aarch64, arm, x86_64.
        cpu: qemu's name of the processor; empty: its default. Nehalem ends with SSE4.2 and so has no AVX.
        arguments: before the number of repetitions.
    """

    program: Path
    machine: str
    cpu: str = ""
    arguments: tuple[str, ...] = ()

    @property
    def emulator(self) -> str | None:
        """Path of the emulator; None: it is not installed."""
        return shutil.which(f"qemu-{self.machine}-static") or shutil.which(f"qemu-{self.machine}")


def executed(what: Emulated, repetitions: int) -> int:
    """How many instructions the program executes.

    Args:
        what: the program.
        repetitions: of its work.

    Raises:
        FileNotFoundError: the emulator is not installed.
        RuntimeError: the program failed, or this qemu logs nothing.
    """
    if what.emulator is None:
        raise FileNotFoundError(f"qemu-{what.machine} is not installed: apt install qemu-user-static")
    cpu = ("-cpu", what.cpu) if what.cpu else ()
    command = [what.emulator, *cpu, *_LOGGING, str(what.program), *what.arguments, str(repetitions)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        count, rest, said = 0, b"", b""
        # In large parts: line by line takes several times as long as the emulation.
        while part := process.stderr.read(_PART):
            whole, _, rest = (rest + part).rpartition(b"\n")
            lines = whole.count(b"\n") + bool(whole)
            blocks = whole.count(b"\n" + _BLOCK) + whole.startswith(_BLOCK)
            count += blocks
            if blocks != lines:
                said = next(line for line in reversed(whole.split(b"\n")) if not line.startswith(_BLOCK))
    if process.returncode or not count:
        said = rest or said
        raise RuntimeError(f"{command[0]} ended with {process.returncode}: {said.decode(errors='replace').strip()}")
    return count


def of_one_repetition(what: Emulated) -> int:
    """Instructions of one repetition of the work, without the program's start and end."""
    return executed(what, 2) - executed(what, 1)


def per_pixel_and_disparity(what: Emulated, pixels: int, disparities: int) -> float:
    """Instructions of one repetition for each pixel and disparity.

    Args:
        what: a program whose one repetition matches one pair.
        pixels: of that pair.
        disparities: N.
    """
    return of_one_repetition(what) / (pixels * disparities)


def missing(programs: Sequence[Emulated]) -> list[str]:
    """The emulators that are not installed."""
    return sorted({f"qemu-{each.machine}" for each in programs if each.emulator is None})
