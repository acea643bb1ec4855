"""The arithmetic limit of semi-global matching on this machine: its measured peak of byte operations, and how many a pair needs.

The count is stated, not measured. With bytes in vector registers, for each pixel and disparity: 24 byte operations for
the cost (the Hamming distance of a census of 64 bits: 3 instructions of 8 pairs each), 11 for each of 5 path directions
(4 minima, 3 saturated sums, a difference, and 3 to add up in 16 bits) and 6 for the winner with its uniqueness (3
instructions on 16 bits): 85. One aggregation only, one view only; a matcher that does more does it above this limit.

The peak is measured by a C program of a few lines: independent chains of saturated byte sums and as many of byte minima,
the two operations of which the aggregation consists, in the widest registers of the processor, on one core; the best of
ten turns. The limit on T cores is the count / peak / T: no cache, no latency, no branch.
"""

import os
import platform
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

OPERATIONS: Final = 24 + 5 * 11 + 6
"""Byte operations a pixel and disparity."""

_SOURCE: Final = r"""
#include <stdint.h>
#include <stdio.h>
#include <time.h>
#if defined(__AVX512BW__)
#include <immintrin.h>
typedef __m512i V;
#define ADD _mm512_adds_epu8
#define MIN _mm512_min_epu8
#define FILL _mm512_set1_epi8
#define NAME "AVX-512"
#define HOLD(x) __asm__ volatile("" : "+v"(x))
#elif defined(__AVX2__)
#include <immintrin.h>
typedef __m256i V;
#define ADD _mm256_adds_epu8
#define MIN _mm256_min_epu8
#define FILL _mm256_set1_epi8
#define NAME "AVX2"
#define HOLD(x) __asm__ volatile("" : "+x"(x))
#elif defined(__SSE2__)
#include <emmintrin.h>
typedef __m128i V;
#define ADD _mm_adds_epu8
#define MIN _mm_min_epu8
#define FILL _mm_set1_epi8
#define NAME "SSE2"
#define HOLD(x) __asm__ volatile("" : "+x"(x))
#elif defined(__ARM_NEON)
#include <arm_neon.h>
typedef uint8x16_t V;
#define ADD vqaddq_u8
#define MIN vminq_u8
#define FILL vdupq_n_u8
#define NAME "NEON"
#define HOLD(x) __asm__ volatile("" : "+w"(x))
#else
#error no vector instructions
#endif
/* Named variables stay in registers; an array might not. */
#define STEP(x, y) x = ADD(x, one); HOLD(x); y = MIN(y, one); HOLD(y);
static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}
int main(void) {
    V one = FILL(1), a = FILL(0), b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a, l = a;
    double best = 0;
    for (int turn = 0; turn < 10; turn++) {
        double began = seconds();
        for (long n = 0; n < 3000000; n++) {
            STEP(a, b) STEP(c, d) STEP(e, f) STEP(g, h) STEP(i, j) STEP(k, l)
        }
        double rate = 12.0 * 3000000 * sizeof(V) / (seconds() - began);
        if (rate > best) best = rate;
    }
    printf("%s %.0f\n", NAME, best);
    return 0;
}
"""


@dataclass(frozen=True, slots=True)
class Peak:
    """Byte operations a second that one core can do.

    Attributes:
        name: of the instruction set.
        per_second: saturated byte sums and minima; 0: unknown.
        why: why it is unknown.
    """

    name: str
    per_second: float = 0.0
    why: str = ""

    def limit_ms(self, pixels: int, disparities: int, cores: int) -> float:
        """The least time in which so many cores can match a pair, ms; 0: unknown."""
        if not self.per_second:
            return 0.0
        return 1e3 * OPERATIONS * pixels * disparities / self.per_second / cores

    def __str__(self) -> str:
        """One line."""
        if not self.per_second:
            return f"{self.name}: not measured: {self.why}"
        return f"{self.name}: {self.per_second / 1e9:.0f} G byte operations a second and core"


def measured_peak(*, avx2: bool = False) -> Peak:
    """Compile and run the measuring program.

    Args:
        avx2: limit it to AVX2; otherwise it takes what this machine has.
    """
    name = "AVX2" if avx2 else "native"
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        return Peak(name, why="no C compiler")
    if avx2 and platform.machine() not in {"x86_64", "AMD64"}:
        return Peak(name, why=f"{platform.machine()} has none")
    target = ["-mavx2"] if avx2 else ["-march=native"]
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder, "peak.c"), Path(folder, "peak")
        source.write_text(_SOURCE, encoding="ascii")
        built = subprocess.run(
            [compiler, "-O2", *target, "-o", str(program), str(source)], capture_output=True, text=True, check=False
        )
        if built.returncode:
            return Peak(name, why=f"{compiler}: {built.stderr.strip().splitlines()[0]}")
        done = subprocess.run([str(program)], capture_output=True, text=True, check=False)
        if done.returncode:
            return Peak(name, why=f"the measuring program ended with {done.returncode}")
    found, rate = done.stdout.split()
    return Peak(found, float(rate))
