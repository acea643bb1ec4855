"""Share of the pure modules' branches that the unit tests take: `python -m tests.support.branches FILE`, for a FILE from `coverage json`.

coverage's own limit (fail_under in pyproject.toml) applies to statements and branches together, so one branch in twenty
could be missed unnoticed.
"""

import json
import sys
from pathlib import Path
from typing import Final

LEAST_PERCENT: Final = 98.0


def judge(totals: dict[str, int]) -> tuple[str, bool]:
    """One line for people, and whether the share is enough.

    Args:
        totals: of the report: `num_branches` and `covered_branches`. No branches at all count as no measurement, and
            not as enough.
    """
    taken, every = totals["covered_branches"], totals["num_branches"]
    percent = 100.0 * taken / every if every else 0.0
    # Truncated, not rounded: 97.96 must not look like the limit that it misses.
    told = f"{int(10 * percent) / 10:.1f} % ({taken} of {every}); at least {LEAST_PERCENT:.0f}"
    return f"branches of the pure modules: {told}", percent >= LEAST_PERCENT


if __name__ == "__main__":
    line, enough = judge(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["totals"])
    print(line)
    sys.exit(not enough)
