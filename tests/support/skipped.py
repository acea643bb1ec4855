"""Why tests were skipped: noted by pytest in each part of `make test`, and listed with counts at its end."""

import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Final

_PREFIX: Final = "Skipped: "


def append_skips(file: Path, skips: Iterable[object]) -> None:
    """Append one line for each skipped test: its reason.

    Args:
        file: to append to.
        skips: what pytest's reports hold of skipped tests: path, line, reason.
    """
    reasons = [str(skip[2]) if isinstance(skip, tuple) else str(skip) for skip in skips]
    with file.open("a", encoding="utf-8") as out:
        out.writelines(" ".join(reason.removeprefix(_PREFIX).split()) + "\n" for reason in reasons)


def listed(lines: Iterable[str]) -> list[str]:
    """Return the lines to print: how many tests were skipped, then each reason with its count, the most frequent first.

    Args:
        lines: of such a file.
    """
    counts = Counter(line.strip() for line in lines if line.strip())
    if not counts:
        return ["no test was skipped"]
    return [f"skipped: {counts.total()}", *(f"{count:6}  {reason}" for reason, count in counts.most_common())]


if __name__ == "__main__":
    print("\n".join(listed(Path(sys.argv[1]).read_text(encoding="utf-8").splitlines())))
