"""Whether the causes of bad calibrations are told apart: `python -m tests.bench.bench_causes [--help]`.

Series of board views are made by exact geometry with one mistake each, of random kind and size (see
`tests/support/cause_series.py`); blur and glare are rendered. 50 good series have what good series have: noise, a
board that is not flat, one pair in which it moved. Half of the good series tell a measured baseline. Series with an
odd number were never looked at while limits were chosen (`held out`); both halves are shown. With $SCAN_DATA, real
series are judged as they are, and with a mistake of each class made on their corners or images;
rigs that turned while they were calibrated are among them: a mistake that is named as what the series has of its own counts as neither.

To reach: 95 % of 200 mistakes named rightly, and of those made on real series; none of 50 good series accused. Exit 4 when one is missed.
"""

import argparse
import json
import multiprocessing
import os
import sys
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from phone_host.calibration.failure_modes.mistakes import Mistake
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.support.cause_judge import finding_of
from tests.support.cause_real import RealNamed, named_real_series
from tests.support.cause_series import MAKERS, Made, good, good_pictures

_MISTAKES, _GOOD = 200, 50
_GOOD_PICTURES: Final = 0.2
_TO_REACH: Final = 0.95
_REAL_WRONG: Final = 0.05
_NONE: Final = "good"


@dataclass(frozen=True, slots=True)
class _Case:
    """One series: what is made (None: nothing wrong), and its seed."""

    made: Mistake | None
    seed: int


@dataclass(frozen=True, slots=True)
class _Judged:
    """What was made and what was named; `truth` and `sentence` in words."""

    case: _Case
    named: Mistake | None
    truth: str
    sentence: str

    @property
    def is_right(self) -> bool:
        return self.named is self.case.made


def main() -> int:
    """Run and print."""
    options = _options()
    kinds = list(Mistake)
    cases = [_Case(kinds[index % len(kinds)], options.seed + index // len(kinds)) for index in range(options.mistakes)]
    cases += [_Case(None, options.seed + index) for index in range(options.good)]
    console = Console(width=160)
    judged = []
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.jobs, context, _alone) as pool, Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task("judging", total=len(cases))
        for each in pool.map(_judge, cases):
            judged.append(each)
            bar.advance(task)
    real = list(named_real_series())
    verdicts = _verdicts(judged, real)
    if options.json:
        shown = {"verdicts": [asdict(verdict) for verdict in verdicts], "named": _counts(judged)}
        shown["real"] = [(f"{each.series}, {each.what}", _word(each.made), _word(each.named)) for each in real]
        print(json.dumps({"machine": str(machine()), **shown}))
        return exit_code(verdicts)
    console.print(f"{machine()}")
    console.print(_matrix(judged))
    for each in judged:
        if not each.is_right:
            console.print(
                f"  {_word(each.case.made)} {each.case.seed} ({each.truth}) was named {_word(each.named)}: {each.sentence}"
            )
    for seen in real:
        said = _NONE if seen.named is None else f"{seen.named.value}: {seen.sentence}"
        console.print(
            f"  {'real' if seen.named is seen.made else 'real, otherwise'} {seen.series}, {seen.what}: {said}"
        )
    for verdict in verdicts:
        console.print(str(verdict))
    return exit_code(verdicts)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="bench_causes", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--mistakes", type=int, default=_MISTAKES, help="how many series with a mistake (default 200)")
    parser.add_argument("--good", type=int, default=_GOOD, help="how many good series (default 50)")
    parser.add_argument("--seed", type=int, default=0, help="of the first series of each kind (default 0)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser.parse_args()


def _alone() -> None:
    """Let a process use one core: there is one process for each."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    cv2.setNumThreads(1)


def _judge(case: _Case) -> _Judged:
    if case.made is None:
        maker: Callable[[np.random.Generator], Made] = (
            good_pictures if case.seed % round(1 / _GOOD_PICTURES) == 0 else good
        )
    else:
        maker = MAKERS[case.made]
    made = maker(np.random.default_rng([case.seed, 0 if case.made is None else 1 + list(Mistake).index(case.made)]))
    found = finding_of(made)
    return _Judged(
        case, None if found is None else Mistake(found.code), made.truth, "" if found is None else found.message
    )


def _matrix(judged: list[_Judged]) -> Table:
    """The confusion matrix: made in rows, named in columns; rows of tuned and held-out series together."""
    kinds = [*Mistake, None]
    table = Table("made", *(_word(kind) for kind in kinds), "right", "held out")
    for made in kinds:
        own = [each for each in judged if each.case.made is made]
        counts = Counter(each.named for each in own)
        held = [each for each in own if each.case.seed % 2]
        table.add_row(
            _word(made),
            *(str(counts[kind]) if counts[kind] else "." for kind in kinds),
            f"{sum(each.is_right for each in own)}/{len(own)}",
            f"{sum(each.is_right for each in held)}/{len(held)}",
        )
    return table


def _counts(judged: list[_Judged]) -> dict[str, dict[str, int]]:
    """The confusion matrix: made, then named, then how often."""
    found: dict[str, Counter[str]] = {}
    for each in judged:
        found.setdefault(_word(each.case.made), Counter())[_word(each.named)] += 1
    return {made: dict(named) for made, named in found.items()}


def _word(mistake: Mistake | None) -> str:
    return _NONE if mistake is None else mistake.value


def _verdicts(judged: list[_Judged], real: list[RealNamed]) -> list[Verdict]:
    bad = [each for each in judged if each.case.made is not None]
    accused = [each for each in judged if each.case.made is None and not each.is_right]
    named = sum(each.is_right for each in bad)
    goods = len(judged) - len(bad)
    return [
        Verdict(
            "mistakes named rightly",
            named >= _TO_REACH * len(bad),
            f"{named} of {len(bad)}",
            f"{_TO_REACH:.0%} of them",
        ),
        Verdict("good series accused", not accused, f"{len(accused)} of {goods}", "none"),
        *_of_real(real),
    ]


def _of_real(real: list[RealNamed]) -> list[Verdict]:
    """Mistakes made on real series. A series that has one of its own has two then: both names are right, and it is told apart."""
    if not real:
        return []
    own = {each.series: each.named for each in real if each.made is None and each.named is not None}
    made = [each for each in real if each.made is not None]
    wrong = [each for each in made if each.named is not each.made]
    as_own = [each for each in wrong if own.get(each.series) is each.named]
    others = [each for each in wrong if each not in as_own]
    said = "; ".join(f"{each.series}, {each.what}: {_word(each.named)}" for each in others)
    also = f"; {len(as_own)} named as what the series has of its own" if as_own else ""
    return [
        Verdict(
            "mistakes made on the corners and images of four real series, named rightly",
            len(others) <= _REAL_WRONG * len(made),
            f"{len(made) - len(wrong)} of {len(made)}{also}" + (f"; otherwise: {said}" if said else ""),
            f"all but {_REAL_WRONG:.0%} or those of its own",
        ),
        Verdict(
            "real series with something of their own, as they are",
            reached=True,
            found="; ".join(f"{series}: {_word(named)}" for series, named in own.items()) or "none",
            limit="shown, not judged",
        ),
    ]


if __name__ == "__main__":
    sys.exit(main())
