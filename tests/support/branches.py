"""The share of the pure modules' branches that the unit tests take: `python -m tests.support.branches FILE`, of what `coverage json` wrote.

coverage's own limit (fail_under in pyproject.toml) is on statements and branches together, where one branch in twenty may be left out unseen.
"""

import json
import sys
from pathlib import Path
from typing import Final

LEAST_PERCENT: Final = 98.0


def judge(totals: dict[str, int]) -> tuple[str, bool]:
    """One line for people, and whether the share is enough.

    Args:
        totals: of the report: `num_branches` and `covered_branches`. No branches at all are no measurement, and not enough.
    """
    taken, every = totals["covered_branches"], totals["num_branches"]
    percent = 100.0 * taken / every if every else 0.0
    # Cut off, not rounded: 97.96 shall not read like the limit that it misses.
    told = f"{int(10 * percent) / 10:.1f} % ({taken} of {every}); at least {LEAST_PERCENT:.0f}"
    return f"branches of the pure modules: {told}", percent >= LEAST_PERCENT


if __name__ == "__main__":
    line, enough = judge(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["totals"])
    print(line)
    sys.exit(not enough)
