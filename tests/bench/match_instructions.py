"""How many instructions the sweep of `tandem` executes for each pixel, disparity and view, on processors that may not be here.

The sweep is the kernel's inner loop with all that belongs to it: costs, three paths, the winner, sub-pixel steps. It is
compiled with the product's flags, linked with a small program (tests/native/sweep_program) that sweeps both views of a fixed
pair, and run under qemu-user, which logs every instruction that is executed (instructions). NEON must need at most
`GREATEST` times as many as SSE4.1: both have registers of 16 bytes. The programs must print the same sum of their
results, so that all have done the same work.

    python -m tests.bench.match_instructions [--width PX] [--height PX] [--disparities N]
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from phone_host.native.build_library import FLAGS, SOURCES, WARNINGS, compiled, usable_sets
from tests.bench.figures import Verdict, exit_code
from tests.bench.instructions import Emulated, missing, per_pixel_and_disparity

PROGRAM: Final = Path(__file__).resolve().parents[1] / "native" / "sweep_program" / "sweep.c"
GREATEST: Final = 1.5
OURS: Final = "NEON"
REFERENCE: Final = "SSE4.1"
_VIEWS: Final = 2


@dataclass(frozen=True, slots=True)
class Target:
    """A processor whose instructions are counted.

    Attributes:
        name: of its instruction set.
        isa: the library's name for it.
        compilers: commands that build for it; the first that exists is taken.
        machine: qemu's name of the architecture.
        cpu: qemu's name of the processor; empty: its default. Nehalem has SSE4.2 and no AVX.
    """

    name: str
    isa: str
    compilers: tuple[str, ...]
    machine: str
    cpu: str = ""

    @property
    def compiler(self) -> str | None:
        """The first of its compilers that is installed."""
        return next((name for name in self.compilers if shutil.which(name)), None)

    def lacks(self) -> str:
        """What is missing to count here; empty: nothing."""
        if self.compiler is None:
            return " or ".join(self.compilers)
        return ", ".join(missing([Emulated(PROGRAM, self.machine, self.cpu)]))


_ON_X86: Final = ("cc", "gcc", "x86_64-linux-gnu-gcc") if os.uname().machine == "x86_64" else ("x86_64-linux-gnu-gcc",)
_ON_AARCH64: Final = ("aarch64-linux-gnu-gcc", *(("cc", "gcc") if os.uname().machine == "aarch64" else ()))
TARGETS: Final = (
    Target(OURS, "neon", _ON_AARCH64, "aarch64"),
    Target(REFERENCE, "sse41", _ON_X86, "x86_64", "Nehalem"),
    Target("NEON of armv7", "neon", ("arm-linux-gnueabihf-gcc",), "arm"),
)
"""The last is told for information."""


@dataclass(frozen=True, slots=True)
class Pair:
    """What is swept."""

    width: int = 320
    height: int = 16
    disparities: int = 64

    def __str__(self) -> str:
        """As a table tells it."""
        return f"{self.width}x{self.height}, {self.disparities} disparities"


@dataclass(frozen=True, slots=True)
class Counts:
    """Executed instructions for each pixel, disparity and view.

    Attributes:
        pair: what was swept.
        found: by the name of the target.
        skipped: what is missing, by the name of the target.
    """

    pair: Pair
    found: Mapping[str, float]
    skipped: Mapping[str, str]

    @property
    def ratio(self) -> float | None:
        """NEON's to SSE4.1's; None: one of them was not counted."""
        both = [self.found.get(name) for name in (OURS, REFERENCE)]
        return None if both[0] is None or both[1] is None else both[0] / both[1]

    def verdicts(self) -> list[Verdict]:
        """The figure, if both were counted."""
        if self.ratio is None:
            return []
        what = f"instructions per pixel and disparity of a sweep, {OURS} beside {REFERENCE}, {self.pair}"
        return [Verdict(what, self.ratio <= GREATEST, f"{self.ratio:.2f}x", f"{GREATEST:g}x at most")]

    def __str__(self) -> str:
        """One line a target."""
        told = [f"executed instructions per pixel, disparity and view of a sweep ({self.pair}; qemu-user):"]
        told += [f"  {name}: {count:.3f}" for name, count in self.found.items()]
        told += [f"  {name}: not counted: {what} is not installed" for name, what in self.skipped.items()]
        return "\n".join(told)


def built(target: Target, folder: Path) -> Path:
    """Build the program for a target, with the product's flags, and static, so that qemu needs no libraries.

    Raises:
        BuildError: the sweep cannot be compiled.
        CalledProcessError: the program cannot be compiled.
    """
    assert target.compiler is not None
    compiler = (target.compiler,)
    isa = next(isa for isa in usable_sets(compiler, folder)[0] if isa.name == target.isa)
    kernel = compiled(compiler, folder, "sweep_kernel.c", isa, ())
    program = folder / "sweep"
    flags = [*FLAGS, *WARNINGS, "-Werror", *isa.flags, f"-DTANDEM_ISA={isa.name}", f"-I{SOURCES}"]
    subprocess.run([*compiler, *flags, "-static", "-o", program, PROGRAM, kernel], check=True)
    return program


def counted(pair: Pair, targets: Sequence[Target] = TARGETS) -> Counts:
    """Build for all targets and count.

    Raises:
        RuntimeError: two targets have other results.
    """
    lacking = {target.name: target.lacks() for target in targets}
    arguments = tuple(str(size) for size in (pair.width, pair.height, pair.disparities))
    found, sums = {}, {}
    for target in (target for target in targets if not lacking[target.name]):
        with tempfile.TemporaryDirectory() as folder:
            what = Emulated(built(target, Path(folder)), target.machine, target.cpu, arguments)
            sums[target.name] = result_of(what)
            pixels = _VIEWS * pair.width * pair.height
            found[target.name] = per_pixel_and_disparity(what, pixels, pair.disparities)
    if len(set(sums.values())) > 1:
        raise RuntimeError(f"the sweeps have different results: {sums}")
    return Counts(pair, found, {name: what for name, what in lacking.items() if what})


def result_of(what: Emulated) -> str:
    """The sum that the program prints after one repetition."""
    cpu = ("-cpu", what.cpu) if what.cpu else ()
    command = [str(what.emulator), *cpu, str(what.program), *what.arguments, "1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[0]} ended with {done.returncode}: {done.stderr.strip()}")
    return done.stdout.strip()


def main() -> int:
    """Count and print; exit code 4 when the figure is missed, 3 when it cannot be counted here."""
    parser = argparse.ArgumentParser(
        "python -m tests.bench.match_instructions",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    usual = Pair()
    parser.add_argument("--width", type=int, default=usual.width, metavar="PX", help="(default: %(default)s)")
    parser.add_argument("--height", type=int, default=usual.height, metavar="PX", help="(default: %(default)s)")
    parser.add_argument(
        "--disparities", type=int, default=usual.disparities, metavar="N", help="(default: %(default)s)"
    )
    options = parser.parse_args()
    found = counted(Pair(options.width, options.height, options.disparities))
    verdicts = found.verdicts()
    print(found, *verdicts, sep="\n")
    return exit_code(verdicts) if verdicts else 3


if __name__ == "__main__":
    sys.exit(main())
