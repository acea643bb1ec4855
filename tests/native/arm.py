"""The native library on ARM and on older x86 processors, under qemu-user: `make test-arm`.

Cross-compiles library and `arm_program` for aarch64 and armv7 and has them compute cases whose results this machine's own
library gave; every bit must agree, for NEON and for plain C. Emulated processors without AVX show that the library finds what each of them has. Needs aarch64-linux-gnu-gcc, arm-linux-gnueabihf-gcc,
qemu-aarch64-static, qemu-arm-static and qemu-x86_64-static; exit 3 names what is missing.
"""

import os
import platform
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import DepthLimits, StereoGeometry
from phone_host.native.build_library import LIBRARY_FILE, SOURCES, WARNINGS, build
from phone_host.native.library import Library, native
from phone_host.output.ply import packed_points
from phone_host.stereo.reproject import points_of, rays, reproject_job
from tests.native.match_cases import fixed_cases, result_of

PROGRAM = Path(__file__).resolve().parent / "arm_program"
KINDS = ("points", "records", "remap", "match")
"""As `checks` in check.c orders them."""


@dataclass(frozen=True, slots=True)
class Machine:
    """An architecture to try.

    Attributes:
        name: of the architecture.
        compiler: builds for it.
        emulator: runs its programs here.
        options: of the emulator: where the C library lies, which processor it is.
        sets: instruction sets that the library must find there, and that must agree.
    """

    name: str
    compiler: str
    emulator: str
    options: tuple[str, ...]
    sets: tuple[str, ...]


MACHINES = (
    Machine(
        "aarch64", "aarch64-linux-gnu-gcc", "qemu-aarch64-static", ("-L", "/usr/aarch64-linux-gnu"), ("scalar", "neon")
    ),
    Machine(
        "armv7", "arm-linux-gnueabihf-gcc", "qemu-arm-static", ("-L", "/usr/arm-linux-gnueabihf"), ("scalar", "neon")
    ),
)
OLDER_X86 = (
    # Processors of 2006, 2008 and 2013: the library must find what each has, and run nothing else.
    Machine("core2duo", "cc", "qemu-x86_64-static", ("-cpu", "core2duo"), ("scalar",)),
    Machine("nehalem", "cc", "qemu-x86_64-static", ("-cpu", "Nehalem"), ("scalar", "sse41")),
    Machine("haswell", "cc", "qemu-x86_64-static", ("-cpu", "Haswell"), ("scalar", "sse41", "avx2")),
)


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One computation: what goes in, then what must come out.

    Attributes:
        kind: which of `KINDS`.
        fields: arrays in the order that arm_program states.
    """

    kind: str
    fields: tuple[NDArray[Any], ...]


def point_cases(library: Library) -> Iterator[Case]:
    """Disparities of all sorts, with odd widths, wide and narrow views, and every limit at work."""
    random = np.random.default_rng(17)
    special = np.array([np.nan, np.inf, -np.inf, 0, -0.0, 1e-45, -1e-45, 1e-30, 3.4e38, 0.25], np.float32)
    limits = DepthLimits(near_m=0.3, far_m=4.0, disparity_error_px=0.25, from_rig=True)
    for width, height in ((1, 1), (63, 2), (64, 3), (65, 2), (128, 4), (333, 9)):
        for focal_px, doffs_px in ((40.0, 0.0), (40.0, 31.5), (900.0, -7.25)):
            disparity = random.uniform(-2, 90, (height, width)).astype(np.float32)
            odd = random.random((height, width)) < 0.2
            disparity[odd] = random.choice(special, np.count_nonzero(odd))
            geometry = StereoGeometry(
                focal_px=focal_px, baseline_m=0.1, cx_px=width / 3, cy_px=height / 2, doffs_px=doffs_px
            )
            columns, rows = rays(geometry, width, height)
            cloud = np.empty((height, width, 3), np.float32)
            job = reproject_job(disparity, (columns, rows), geometry, limits, cloud)
            library.run(job)
            assert cloud.tobytes() == points_of(disparity, geometry, limits, library).cloud.tobytes()
            whole = np.array([width, height, job.wide], "<i4")
            values = np.array([job.doffs_px, job.product, job.least_px, job.at_zero_px, job.far_m, job.near_m], "<f4")
            counts = np.array([job.found, job.at_zero, job.in_front, job.too_far, job.too_near], "<i8")
            yield Case("points", (whole, values, disparity, columns, rows, cloud, counts))


def record_cases(library: Library) -> Iterator[Case]:
    """Clouds with gaps, grey and coloured."""
    random = np.random.default_rng(18)
    for width, height, channels in ((1, 1, 1), (1, 1, 3), (70, 5, 1), (333, 7, 3)):
        cloud = random.normal(size=(height, width, 3)).astype(np.float32)
        cloud[random.random((height, width)) < 0.3] = np.nan
        cloud[random.random((height, width, 3)) < 0.05] = np.inf
        shape = (height, width) if channels == 1 else (height, width, 3)
        colours = random.integers(0, 256, shape, np.uint8)
        records = packed_points(cloud, colours, library=library)
        whole = np.array([width, height, channels], "<i4")
        yield Case("records", (whole, np.zeros(3, np.uint8), cloud, colours, records))


def remap_cases() -> Iterator[Case]:
    """Maps that stay inside an image, and maps that leave it on all sides; the results are OpenCV's."""
    random = np.random.default_rng(19)
    for width, height, reach in ((1, 1, 3), (2, 9, 3), (90, 41, 0), (90, 41, 30)):
        image = random.integers(0, 256, (height, width, 3), np.uint8)
        x, y = (random.uniform(-reach, side - 1 + reach, (23, 37)).astype(np.float32) for side in (width, height))
        places, fractions = cv2.convertMaps(x, y, cv2.CV_16SC2)
        out = cv2.remap(image, places, fractions, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        yield Case("remap", (np.array([width, height], "<i4"), image, places, fractions, out))


def match_cases(library: Library) -> Iterator[Case]:
    """Pairs of all kinds, sizes and strides, with and without the guide."""
    for case in fixed_cases():
        left, right = case.left, case.right
        whole = [case.width, case.height, case.disparities, case.threads]
        whole += [left.offset, left.stride, right.offset, right.stride, case.guide]
        found = result_of(library, case)
        yield Case("match", (np.array(whole, "<i4"), left.memory, right.memory, *found))


def every_case(library: Library) -> list[Case]:
    """All cases of all kinds."""
    return [*point_cases(library), *record_cases(library), *match_cases(library), *remap_cases()]


def write_cases(path: Path, cases: list[Case]) -> None:
    """Write cases as check.c reads them."""
    with path.open("wb") as file:
        file.write(b"TANDEM1\n" + struct.pack("<Q", len(cases)))
        for case in cases:
            file.write(struct.pack("<II", KINDS.index(case.kind), len(case.fields)))
            for field in case.fields:
                content = field.tobytes()
                file.write(struct.pack("<Q", len(content)) + content)


def built_program(compiler: str, library: Path, folder: Path) -> Path:
    """Build arm_program against a library; return its path."""
    program = folder / "check"
    sources = sorted(PROGRAM.glob("*.c"))
    flags = ["-std=c11", "-O2", *WARNINGS, "-Werror", f"-I{SOURCES}"]
    subprocess.run([compiler, *flags, "-o", program, *sources, library], check=True)
    return program


def checked(machine: Machine, cases: Path, folder: Path) -> bool:
    """Build for a machine, unless another one of its kind was before, and compute the cases there; return whether all sets agree."""
    program = folder / "check"
    if not folder.exists():
        folder.mkdir()
        os.environ["CC"] = machine.compiler
        built_program(machine.compiler, build(folder, ["-Werror"]).path, folder)
    done = subprocess.run(
        [machine.emulator, *machine.options, "-E", f"LD_LIBRARY_PATH={folder}", program, cases],
        capture_output=True,
        text=True,
        check=False,
    )
    for line in (done.stdout + done.stderr).splitlines():
        if "TCG doesn't support" in line:  # some feature of that processor that we do not use
            continue
        print(f"{machine.name} {line}")
    told = {line.partition(":")[0] for line in done.stdout.splitlines() if "have the same bits" in line}
    return done.returncode == 0 and told == set(machine.sets)


def main() -> int:
    """Try every machine; return the exit code."""
    machines = MACHINES + (OLDER_X86 if platform.machine() == "x86_64" else ())
    needed = [tool for machine in machines for tool in (machine.compiler, machine.emulator)]
    missing = [tool for tool in needed if shutil.which(tool) is None]
    if missing:
        packages = "gcc-aarch64-linux-gnu gcc-arm-linux-gnueabihf qemu-user-static"
        print(f"error: {', '.join(missing)} cannot be found: apt install {packages}", file=sys.stderr)
        return 3
    library = native()
    if not isinstance(library, Library):
        print(f"error: no native library here ({library.message}): {library.remedy}", file=sys.stderr)
        return 3
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = every_case(library)
        write_cases(folder / "cases", cases)
        print(f"{len(cases)} cases, computed here with {library.simd.text} ({LIBRARY_FILE})")
        results = [checked(machine, folder / "cases", folder / machine.compiler) for machine in machines]
    return 0 if all(results) else 4


if __name__ == "__main__":
    sys.exit(main())
