"""What a soak demands of its samples: flat memory, delays that do not drift. Values in, verdicts out.

Only a full-length run proves anything: in a short one a buffer that is still filling looks like a leak.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

_SETTLING: Final = 0.2
"""Share of the run left out of the memory's slope, while caches and arenas fill up."""

_GROWTH_BYTES: Final = 1_000_000
_GROWTH_SHARE: Final = 0.02
"""Flat: from the first sample to the last, the fitted line rises by less than 1 MB, or 2 % of the process's memory."""

_DRIFT_NS: Final = 1_000_000
_DRIFT_SHARE: Final = 0.1
"""No drift: the first and last medians differ by less than 1 ms or a tenth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One line of the table.

    Attributes:
        part: of the soak.
        what: the quantity checked.
        found: in words.
        limit: in words.
        holds: whether the limit is kept.
    """

    part: str
    what: str
    found: str
    limit: str
    holds: bool


@dataclass(frozen=True, slots=True)
class Resident:
    """A process's resident memory at one moment."""

    at_ns: int
    size_bytes: int


def memory(part: str, name: str, samples: Sequence[Resident]) -> Check:
    """Check that a process's memory is flat: fit a straight line to the samples after the settling time."""
    settled = samples[int(len(samples) * _SETTLING) :]
    hours = np.array([sample.at_ns - settled[0].at_ns for sample in settled]) / 3.6e12
    sizes = np.array([sample.size_bytes for sample in settled], float)
    slope = float(np.polyfit(hours, sizes, 1)[0]) if len(settled) > 2 else float("nan")
    growth_bytes = slope * float(hours[-1])
    limit_bytes = max(_GROWTH_BYTES, _GROWTH_SHARE * float(sizes.mean()))
    found = f"{sizes[-1] / 1e6:.1f} MB, slope {slope / 1e6:+.2f} MB/h, {growth_bytes / 1e6:+.2f} MB in this time"
    return Check(
        part=part,
        what=f"memory of {name}",
        found=found,
        limit=f"+{limit_bytes / 1e6:.1f} MB",
        holds=growth_bytes <= limit_bytes,
    )


def drift(part: str, name: str, delays_ns: Sequence[int], window: int) -> Check:
    """Check that a delay is the same at the end as at the beginning: medians of the first and the last `window` pairs."""
    first, last = np.array(delays_ns[:window]), np.array(delays_ns[-window:])
    medians = float(np.median(first)), float(np.median(last))
    p95 = float(np.percentile(first, 95)), float(np.percentile(last, 95))
    limit_ns = max(_DRIFT_NS, _DRIFT_SHARE * medians[0])
    found = f"p50 {medians[0] / 1e6:.2f} -> {medians[1] / 1e6:.2f} ms, p95 {p95[0] / 1e6:.2f} -> {p95[1] / 1e6:.2f} ms"
    holds = abs(medians[1] - medians[0]) <= limit_ns
    return Check(part=part, what=f"drift of {name}", found=found, limit=f"p50 +- {limit_ns / 1e6:.1f} ms", holds=holds)


def count(part: str, what: str, found: int, wanted: int) -> Check:
    """Check that a count is exactly what it must be."""
    return Check(part=part, what=what, found=str(found), limit=str(wanted), holds=found == wanted)
