"""Compiles the native library with the system's C compiler. Standard library only: `setup.py` runs this file before anything is installed.

Each file in `PER_ISA` is compiled once per instruction set, with that set's flags; `dispatch.c` chooses among them at run
time. The installation never fails because of it: whatever goes wrong becomes a sentence in a file beside the library
(`REASON_FILE`), which `library` reads.

    python -m phone_host.native.build_library        rebuilds the library of a checkout, in place

Environment: CC, the compiler and its arguments (default: the first of cc, gcc, clang). CFLAGS is not heeded: flags of others, such as
-ffast-math or -march=native, would change results or crash on other processors.
"""

import argparse
import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

LIBRARY_FILE: Final = "_tandem.so"
REASON_FILE: Final = "_not_built.txt"
SOURCES: Final = Path(__file__).resolve().parent / "src"

PER_ISA: Final = (
    "isa_table.c",
    "reproject_kernel.c",
    "pack_kernel.c",
    "remap_kernel.c",
    "sweep_kernel.c",
    "finish_kernel.c",
    "guide_kernel.c",
    "vote_kernel.c",
    "support_kernel.c",
    "fuse_kernel.c",
    "carve_kernel.c",
    "cast_kernel.c",
)
"""Compiled once per instruction set."""

ONCE: Final = (
    "dispatch.c",
    "match.c",
    "speckles.c",
    "support.c",
    "bridges.c",
    "crew.c",
    "volume.c",
    "fuse.c",
    "carve.c",
    "cast.c",
    "register.c",
    "absorb.c",
)
"""Compiled once, for the plainest processor of the architecture."""

FLAGS: Final = (
    "-std=c11",
    "-O3",
    "-fPIC",
    "-fvisibility=hidden",
    "-pthread",
    "-ffp-contract=off",  # a fused multiply-add rounds once: other bits than on machines without one
    "-fno-math-errno",
    "-fno-trapping-math",  # nobody reads the flags of float operations; without it conditions are not vectorised
    "-g0",
)
WARNINGS: Final = ("-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wstrict-prototypes", "-Wmissing-prototypes")
_LINK: Final = ("-shared", "-pthread", "-lm")

_TIMEOUT_S: Final = 600.0
_MOST_OF_A_REASON: Final = 300


@dataclass(frozen=True, slots=True)
class Isa:
    """An instruction set that a file can be compiled for.

    Attributes:
        name: as tandem.h and people call it.
        flags: what the compiler needs; `dispatch.c` asks the processor for the same features.
    """

    name: str
    flags: tuple[str, ...] = ()


_SCALAR: Final = Isa("scalar")
_SCALAR_LEVEL: Final = ("-O2", "-fno-unroll-loops")
"""Registers of 16 bytes become loops there. -O3 unrolls them all, as clang does with -O2: up to four times as long to compile, and slower."""
_X86: Final = (
    _SCALAR,
    Isa("sse41", ("-mssse3", "-msse4.1")),
    Isa("avx2", ("-mavx2", "-mbmi", "-mbmi2", "-mpopcnt")),
    Isa(
        "avx512",
        ("-mavx512f", "-mavx512bw", "-mavx512vl", "-mavx512dq", "-mavx512vbmi", "-mavx512bitalg", "-mavx2", "-mbmi", "-mbmi2", "-mpopcnt"),
    ),
)  # fmt: skip
_BY_MACRO: Final = (
    ("__x86_64__", _X86),
    ("__i386__", tuple(Isa(isa.name, ("-msse2", "-mfpmath=sse", *isa.flags)) for isa in _X86)),
    ("__aarch64__", (_SCALAR, Isa("neon"))),
    ("__arm__", (_SCALAR, Isa("neon", ("-mfpu=neon",)))),
)
"""By the macro with which a compiler names its target (`cc -dM -E`): also right for cross compilers and -m32."""


class BuildError(Exception):
    """Raised when the library cannot be built; the text says why and what helps, in one line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Built:
    """A library that was built.

    Attributes:
        path: of the shared library.
        compiler: the command.
        sets: names of the instruction sets in it.
        left_out: sets that this compiler cannot compile, each with its reason.
    """

    path: Path
    compiler: tuple[str, ...]
    sets: tuple[str, ...]
    left_out: tuple[str, ...]


def sources_digest() -> str:
    """Return a digest of all C sources, which the library holds, too: so a stale library can be told."""
    whole = hashlib.sha256()
    for path in sorted(SOURCES.glob("*.[ch]")):
        whole.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return whole.hexdigest()[:16]


def find_compiler() -> tuple[str, ...]:
    """Find the C compiler.

    Raises:
        BuildError: there is none.
    """
    chosen = shlex.split(os.environ.get("CC", ""))
    if chosen:
        if shutil.which(chosen[0]) is None:
            raise BuildError(f"the compiler CC={chosen[0]} does not exist")
        return tuple(chosen)
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name) is not None:
            return (name,)
    raise BuildError("no C compiler")


def build(folder: Path, extra: Sequence[str] = ()) -> Built:
    """Build the library.

    Args:
        folder: where it goes; it exists.
        extra: more flags, for compiling and linking (sanitizers, warnings as errors).

    Raises:
        BuildError: it cannot be built.
    """
    compiler = find_compiler()
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        sets, left_out = usable_sets(compiler, scratch)
        objects: list[Path] = []
        made = []
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            jobs = [
                (isa, [pool.submit(compiled, compiler, scratch, source, isa, extra) for source in PER_ISA])
                for isa in sets
            ]
            for isa, parts in jobs:
                try:
                    objects += [part.result() for part in parts]
                except BuildError as error:
                    if isa.name == _SCALAR.name:
                        raise
                    left_out.append(f"{isa.name}: {error}")
                else:
                    made.append(isa.name)
        known = [f"-DTANDEM_HAS_{isa.upper()}=1" for isa in made] + [f'-DTANDEM_SOURCES="{sources_digest()}"']
        objects += [compiled(compiler, scratch, source, _plain(sets), [*known, *extra]) for source in ONCE]
        library = scratch / LIBRARY_FILE
        _run([*compiler, *extra, "-o", str(library), *map(str, objects), *_LINK])
        path = folder / LIBRARY_FILE
        # Not written over: a running program may have the old one mapped.
        shutil.copyfile(library, path.with_suffix(".new"))
        path.with_suffix(".new").replace(path)
    return Built(path=path, compiler=compiler, sets=tuple(made), left_out=tuple(left_out))


def build_or_explain(folder: Path) -> Built | str:
    """Build the library, or leave a file that says why there is none; what an earlier build left there is removed.

    Args:
        folder: where either goes; made if missing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name in (LIBRARY_FILE, REASON_FILE):
        (folder / name).unlink(missing_ok=True)
    try:
        return build(folder)
    except (BuildError, OSError) as error:
        reason = " ".join(str(error).split())[:_MOST_OF_A_REASON]
        (folder / REASON_FILE).write_text(reason + "\n", encoding="utf-8")
        return reason


def main() -> int:
    """Rebuild the library in this folder; return the exit code."""
    parser = argparse.ArgumentParser(description="Builds the native library of this checkout, in place.")
    parser.add_argument("--out", type=Path, default=SOURCES.parent, metavar="DIR", help="where it goes instead")
    parser.add_argument("--flags", default="", help="more flags for the compiler, such as -Werror")
    options = parser.parse_args()
    try:
        options.out.mkdir(parents=True, exist_ok=True)
        built = build(options.out, shlex.split(options.flags))
    except BuildError as error:
        sys.stderr.write(f"error: {error}\n")
        return 3
    (options.out / REASON_FILE).unlink(missing_ok=True)
    for text in built.left_out:
        sys.stderr.write(f"left out {text}\n")
    sys.stdout.write(f"{built.path}: {' '.join(built.sets)}\n")
    return 0


def usable_sets(compiler: Sequence[str], scratch: Path) -> tuple[tuple[Isa, ...], list[str]]:
    """Return the sets of the compiler's target whose flags it knows, and the others, each with its reason."""
    macros = _run([*compiler, "-dM", "-E", "-x", "c", os.devnull])
    names = {line.split()[1] for line in macros.splitlines() if line.startswith("#define ")}
    wanted = next((sets for macro, sets in _BY_MACRO if macro in names), (_SCALAR,))
    empty = scratch / "empty.c"
    empty.write_text("typedef int nothing;\n", encoding="utf-8")
    usable, left_out = [], []
    for isa in wanted:
        try:
            _run([*compiler, *isa.flags, "-c", str(empty), "-o", str(scratch / "empty.o")])
        except BuildError as error:
            left_out.append(f"{isa.name}: {error}")
        else:
            usable.append(isa)
    return tuple(usable), left_out


def _plain(sets: Sequence[Isa]) -> Isa:
    """Return the flags for what runs on every processor of the architecture; no kernels are named after it."""
    return Isa("", sets[0].flags if sets else ())


def compiled(compiler: Sequence[str], scratch: Path, source: str, isa: Isa, extra: Sequence[str]) -> Path:
    """Compile one source for one instruction set; return the object file."""
    path = scratch / f"{Path(source).stem}_{isa.name}.o"
    named = (f"-DTANDEM_ISA={isa.name}", f"-DTANDEM_IS_{isa.name.upper()}=1") if isa.name else ()
    level = _SCALAR_LEVEL if isa.name == _SCALAR.name else ()
    _run(
        [*compiler, *FLAGS, *level, *WARNINGS, *isa.flags, *named, *extra, "-c", str(SOURCES / source), "-o", str(path)]
    )
    return path


def _run(command: Sequence[str]) -> str:
    """Run a compiler; return what it printed."""
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", check=False, timeout=_TIMEOUT_S
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BuildError(f"{command[0]} cannot be run ({error})") from error
    if done.returncode != 0:
        lines = done.stderr.splitlines()
        told = next((line for line in lines if "error" in line), lines[0] if lines else f"exit {done.returncode}")
        raise BuildError(f"{Path(command[0]).name} failed: {told}")
    if done.stderr.strip():
        sys.stderr.write(done.stderr)  # warnings
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
