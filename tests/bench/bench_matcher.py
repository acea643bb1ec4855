"""How fast a matcher is beside OpenCV's, in one run: `python -m tests.bench.bench_matcher [--help]`.

Each row times ours and its anchors in turns, on two threads, over a rendered pair of known content: the whole `match`, or
the chain from two JPEGs to coloured points. Medians of the wall clock and of the CPU time of all threads. A factor is
judged by the wall clock on a quiet machine; where other processes took more than 5 % of it, by CPU time, which they
cannot take. The CPU time of an anchor that uses one thread only (MODE_SGBM) is half as large in comparison.

`sgbm of 0.1` is not run: it is the `sgbm` that was the default before `tandem`, whose 66 ms by the wall clock and 102 ms
of CPU time stood at 4.6 and 3.8 times those of one bare 3WAY pass of the same run, and so they are taken from 3WAY's of this run.
`sgbm` as it is now tests what it finds (decision 0031), which takes longer; it stands beside for information.

limit: the arithmetic limit of this machine, which is measured (match_limit); above: our CPU time over the limit's. Memory: growth of the peak
during the first match, each in a process of its own. The row `AVX2` runs in a process whose environment limits both
sides to AVX2. Instructions: those of the matcher's sweep on NEON and SSE4.1, executed under qemu-user
(match_instructions); skipped where the cross compiler or qemu is missing. Only of `tandem`.

Figures to reach: those of `FACTORS`; less memory than 3WAY; on NEON at most 1.5 times the instructions. Exit 4 when one is missed.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from phone_host.stereo.matcher_names import MatcherName
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.match_child import limited_environment
from tests.bench.match_contestants import (
    THREADS,
    Setting,
    Times,
    interleaved,
    matches,
    our_chain,
    sample_chain,
    setting,
)
from tests.bench.match_instructions import Pair, counted
from tests.bench.match_limit import Peak, measured_peak

DEFAULT: Final = "tandem" if "tandem" in {name.value for name in MatcherName} else MatcherName.SGBM.value
BEFORE: Final = MatcherName.SGBM.value
OLD: Final = "sgbm of 0.1 (4.6 x 3WAY)"
SAMPLE: Final = "sample chain"

OLD_WALL: Final = 4.6
OLD_CPU: Final = 3.8
"""How much longer `sgbm` of 0.1 took than 3WAY at 640x480 with 64 disparities and two threads. Wall clock: 66 / 14.4 ms. CPU time:
102 / 26.9 ms, where 26.9 is what 3WAY takes on one thread (25.4 ms when it took 13.6 ms on two) in the run that gave 14.4."""

FACTORS: Final[Mapping[tuple[str, int, str], float]] = {
    ("match", 640, OLD): 5.0,
    ("match", 640, "3WAY"): 2.2,
    ("match", 1280, "3WAY"): 3.0,
    ("match", 1280, "HH4"): 10.0,
    ("match", 1280, "MODE_SGBM"): 6.0,
    ("chain", 640, SAMPLE): 3.0,
    ("chain", 1280, SAMPLE): 3.0,
    ("match, AVX2", 1280, "3WAY"): 2.0,
}
"""How many times faster than an anchor, by part, width and anchor. Other rows are for information."""

MOST_FOREIGN: Final = 0.05
_LEAST_RUNS: Final = 15


@dataclass(frozen=True, slots=True)
class Row:
    """Ours beside one anchor.

    Attributes:
        part: what was timed.
        setting: image size and search range.
        width_px: of the images.
        anchor: its name.
        ours: our medians.
        theirs: the anchor's.
        limit_ms: the least possible time of a match; 0: unknown, or not a match.
        foreign: share of the machine that other processes took meanwhile.
    """

    part: str
    setting: str
    width_px: int
    anchor: str
    ours: Times
    theirs: Times
    limit_ms: float
    foreign: float

    @property
    def factors(self) -> tuple[float, float]:
        """How many times faster ours is, by wall clock and by CPU time."""
        return self.theirs.wall_ms / self.ours.wall_ms, self.theirs.cpu_ms / self.ours.cpu_ms

    @property
    def above_limit(self) -> float:
        """Our CPU time above the arithmetic limit's, which no other process can disturb; inf: the limit is unknown."""
        return self.ours.cpu_ms / (self.limit_ms * THREADS) if self.limit_ms else float("inf")

    @property
    def is_quiet(self) -> bool:
        """Whether the wall clock counts."""
        return self.foreign <= MOST_FOREIGN

    @property
    def verdict(self) -> Verdict | None:
        """Compare with the figure; None: there is none."""
        least = FACTORS.get((self.part, self.width_px, self.anchor))
        if least is None:
            return None
        factor = self.factors[0 if self.is_quiet else 1]
        clock = "wall clock" if self.is_quiet else f"CPU time, others took {100 * self.foreign:.0f} % of the machine"
        what = f"{self.part}, {self.setting}, against {self.anchor}"
        return Verdict(what, factor >= least, f"{factor:.2f}x by {clock}", f"{least:g}x")


class Foreign:
    """How much of the machine other processes take from now on."""

    def __init__(self) -> None:
        self._before = _jiffies(), sum(os.times()[:4]), time.monotonic()

    def share(self) -> float:
        """Share of all cores that others used, 0..1; children of this process that have ended are its own."""
        busy, own, began = self._before
        seconds = max(1e-3, time.monotonic() - began)
        others = (_jiffies() - busy) / os.sysconf("SC_CLK_TCK") - (sum(os.times()[:4]) - own)
        return min(1.0, max(0.0, others / seconds / (os.cpu_count() or 1)))


def _jiffies() -> int:
    """Clock ticks in which any core was not idle (proc_stat(5))."""
    fields = [int(field) for field in Path("/proc/stat").read_text(encoding="ascii").splitlines()[0].split()[1:9]]
    return sum(fields) - fields[3] - fields[4]


def rows_of(part: str, where: Setting, times: Mapping[str, Times], peak: Peak, foreign: float) -> Iterator[Row]:
    """One row for each anchor; the first name is ours."""
    ours, *anchors = times
    limit_ms = 0.0 if part == "chain" else peak.limit_ms(where.left[..., 0].size, where.disparities, THREADS)
    for name in anchors:
        yield Row(part, where.name, where.width_px, name, times[ours], times[name], limit_ms, foreign)


def with_old_sgbm(times: Mapping[str, Times]) -> dict[str, Times]:
    """Add what `sgbm` of 0.1 would take, from 3WAY's times."""
    pass_of_3way = times["3WAY"]
    return {**times, OLD: Times(OLD_WALL * pass_of_3way.wall_ms, OLD_CPU * pass_of_3way.cpu_ms)}


def in_process(matcher: str, runs: int, peak: Peak) -> list[Row]:
    """The rows that need no process of their own."""
    rows: list[Row] = []
    anchors = {640: (("3WAY",), (BEFORE,)), 1280: (("3WAY", "HH4", "MODE_SGBM"), ())}
    for width_px, (modes, before) in anchors.items():
        where = setting(width_px)
        others = tuple(name for name in before if name != matcher)
        foreign = Foreign()
        times = interleaved(matches(where, (matcher, *others), modes), runs)
        if before:
            times = with_old_sgbm(times)
        rows += rows_of("match", where, times, peak, foreign.share())
        foreign = Foreign()
        times = interleaved({matcher: our_chain(where, matcher), SAMPLE: sample_chain(where)}, runs)
        rows += rows_of("chain", where, times, peak, foreign.share())
    return rows


def _child(*arguments: str, environment: Mapping[str, str] | None = None) -> dict[str, object]:
    command = [sys.executable, "-m", "tests.bench.match_child", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode:
        raise RuntimeError(f"{' '.join(arguments)}: {done.stderr.strip().splitlines()[-1]}")
    found: dict[str, object] = json.loads(done.stdout)
    return found


def limited(matcher: str, runs: int) -> tuple[list[Row], str]:
    """The row of AVX2, or why there is none."""
    flags = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    if " avx2 " not in flags:
        return [], "AVX2 was not timed: this processor does not have it"
    foreign = Foreign()
    found = _child("times", matcher, str(runs), environment=limited_environment())
    taken = found["times"]
    assert isinstance(taken, dict)
    times = {name: Times(**both) for name, both in taken.items()}
    peak = measured_peak(avx2=True)
    rows = list(rows_of("match, AVX2", setting(1280), times, peak, foreign.share()))
    skipped = [name for name, flag in (("AVX-512", " avx512bw "), ("NEON", " asimd ")) if flag not in flags]
    said = f"AVX2 row: OpenCV's features {found['opencv_features']} (? = off); {peak}"
    without = f"; not timed, because this processor lacks it: {', '.join(skipped)}" if skipped else ""
    return rows, said + without


def memory(matcher: str) -> tuple[Verdict, dict[str, float]]:
    """Growth of the peak memory, ours beside 3WAY."""
    where = setting(1280)
    with tempfile.TemporaryDirectory() as folder:
        pair = Path(folder, "pair.npz")
        np.savez(pair, left=where.left, right=where.right)
        growth = {name: float(str(_child("memory", name, str(pair))["growth_mb"])) for name in (matcher, "3WAY")}
    ours, theirs = growth[matcher], growth["3WAY"]
    return Verdict("memory during a match, 1280x720", ours < theirs, f"{ours:.0f} MB", f"below {theirs:.0f} MB"), growth


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser(
        "python -m tests.bench.bench_matcher",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--matcher", default=DEFAULT, help="a matcher's name (default: %(default)s)")
    parser.add_argument("--runs", type=int, default=_LEAST_RUNS, help="of each contestant (default: %(default)s)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    cv2.setNumThreads(THREADS)
    peak = measured_peak()
    rows = in_process(options.matcher, options.runs, peak)
    narrow, said = limited(options.matcher, options.runs)
    rows += narrow
    verdict, growth = memory(options.matcher)
    counts = counted(Pair()) if options.matcher == DEFAULT else None
    verdicts = [each for row in rows if (each := row.verdict) is not None]
    verdicts += [verdict, *(counts.verdicts() if counts else ())]
    if options.json:
        head = {"machine": str(machine()), "opencv": cv2.__version__, "matcher": options.matcher, "peak": str(peak)}
        shown = {"rows": [asdict(row) for row in rows], "verdicts": [asdict(each) for each in verdicts]}
        counted_here = asdict(counts) if counts else None
        print(json.dumps({**head, **shown, "growth_mb": growth, "instructions": counted_here, "note": said}))
    else:
        print(f"{machine()}, OpenCV {cv2.__version__}, {options.matcher}, {THREADS} threads, {options.runs} runs each")
        print(f"{peak}\n{said}")
        _print(rows)
        if counts:
            print(counts)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _print(rows: Sequence[Row]) -> None:
    table = Table()
    for title in (
        "part",
        "images",
        "anchor",
        "ours ms",
        "CPU",
        "anchor ms",
        "CPU",
        "wall x",
        "CPU x",
        "limit ms",
        "above",
    ):
        table.add_column(title, justify="left" if title in {"part", "images", "anchor"} else "right")
    for row in rows:
        wall, cpu = row.factors
        above = f"{row.above_limit:.1f}x" if row.limit_ms else "-"
        times = (row.ours.wall_ms, row.ours.cpu_ms, row.theirs.wall_ms, row.theirs.cpu_ms)
        limit = f"{row.limit_ms:.1f}" if row.limit_ms else "-"
        cells = (*(f"{ms:.1f}" for ms in times), f"{wall:.2f}", f"{cpu:.2f}", limit, above)
        table.add_row(row.part, row.setting, row.anchor, *cells)
    Console(width=150).print(table)


if __name__ == "__main__":
    sys.exit(main())
