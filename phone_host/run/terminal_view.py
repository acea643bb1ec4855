"""The live table that a terminal shows during a run."""

from collections.abc import Callable
from types import TracebackType
from typing import Final, Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table
from rich.text import Text

from common import now
from common.words import counted
from phone_host.measure.accounts import rung_lines
from phone_host.measure.delays import DELAYS, IDLE_STAGE_NS, STAGES, Spread
from phone_host.measure.regime import judge
from phone_host.measure.run_snapshot import RunSnapshot, concerns, figures
from phone_host.measure.unused import unused
from phone_host.report.summary import camera_troubles, phase_lines

_REFRESH_S: Final = 0.25
_WIDE: Final = 64
"""Characters that the whole table needs."""

_RECENT: Final = 300
"""Percentiles cover this many newest pairs: ten seconds at 30 pairs per second."""


class LiveTable:
    """Shows a run's delays while it is running; a context manager.

    Args:
        snapshot: returns the run's present state.
        console: where to draw; stderr by default, so that stdout is free for results.
        seconds: planned length of the run for the progress bar, s; 0 if it is given in pairs or open.
        pairs: the same, in pairs.
    """

    def __init__(
        self,
        snapshot: Callable[[], RunSnapshot],
        console: Console | None = None,
        *,
        seconds: float = 0.0,
        pairs: int = 0,
    ) -> None:
        self._snapshot = snapshot
        self._live = Live(console=console or Console(stderr=True), auto_refresh=False, transient=True)
        self._seconds = seconds
        self._started_s = now.monotonic_ns() / 1e9
        self._shown_s = 0.0
        self._last = (0, self._started_s)
        self._rate = 0.0
        self._progress = Progress(
            TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.0f}/{task.total:.0f}")
        )
        total = seconds or pairs
        self._task = self._progress.add_task("seconds" if seconds else "pairs", total=total) if total else None

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def refresh(self) -> None:
        """Show the present state, at most a few times a second."""
        now_s = now.monotonic_ns() / 1e9
        if now_s - self._shown_s < _REFRESH_S:
            return
        self._shown_s = now_s
        run = self._snapshot()
        pairs, since_s = self._last
        if now_s - since_s >= 1.0:
            self._rate = (run.processed - pairs) / (now_s - since_s)
            self._last = (run.processed, now_s)
        if self._task is not None:
            self._progress.update(self._task, completed=now_s - self._started_s if self._seconds else run.processed)
        bar = [self._progress] if self._task is not None else []
        # Problems come first, because a small terminal cuts off the bottom.
        shown = Group(
            *_judgement(run), _table(run, self._rate, self._live.console.width), _stages(run), _state(run), *bar
        )
        self._live.update(shown, refresh=True)


def _table(run: RunSnapshot, rate: float, width: int) -> Table:
    """Make the table; on a phone's terminal without lines and without the 99th percentile, so that no number is cut."""
    names = ("p50", "p95", "p99", "max") if width >= _WIDE else ("p50", "p95", "max")
    table = Table(title=f"{counted(run.processed, 'pair')}, {rate:.1f} /s", title_justify="left")
    if width < _WIDE:
        table.box, table.padding = None, (0, 2, 0, 0)
    table.add_column("delay, ms", no_wrap=True)
    for name in names:
        table.add_column(name, justify="right", no_wrap=True)
    for name in (*DELAYS, "time_skew"):
        spread = run.delays.spread(name, _RECENT)
        table.add_row(name.replace("_", "-"), *(_cell_ms(spread, column) for column in names))
    return table


def _stages(run: RunSnapshot) -> Text:
    """Return the stages' shares in one line. With a row each, warnings would not fit a terminal of 24 lines."""
    medians = [(name, run.delays.spread(name, _RECENT).p50_ns) for name in STAGES]
    shares = [
        f"{name} {value_ns / 1e6:.1f}" for name, value_ns in medians if value_ns > IDLE_STAGE_NS
    ]  # never true of NaN
    return Text(f"processing, p50 in ms: {', '.join(shares) or 'not yet'}", style="dim")


def _judgement(run: RunSnapshot) -> list[Text]:
    """Return the regime, the two cameras' troubles and the concerns about the depth."""
    warnings = [Text(f"warning: {item.sentence}: {item.remedy}", style="bold red") for item in concerns(run)]
    lines = (*camera_troubles(run.camera), *rung_lines(run.link))
    camera = [Text(line, style="yellow") for line in lines]
    return [Text(judge(figures(run)).sentence, style="dim"), *camera, *warnings]


def _state(run: RunSnapshot) -> Text:
    estimate = run.estimate
    clock = (
        f"clock +-{estimate.uncertainty_ns / 1000:.0f} us (hard +-{estimate.bound_ns / 1000:.0f} us)"
        if estimate
        else "clock unknown"
    )
    board = f"board connected over {run.carrier}" if run.carrier else "waiting for the board"
    lost = ", ".join(item.told for item in unused(run)) or "nothing"
    phase = "\n".join(phase_lines(run.phase, run.alignment))
    return Text(f"{board} · {clock} · not used: {lost}" + (f"\n{phase}" if phase else ""))


def _cell_ms(spread: Spread, name: str) -> str:
    if not spread.count:
        return "-"
    value = float(getattr(spread, f"{name}_ns")) / 1e6
    return f"{value:.3f}" if abs(value) < 1000 else f"{value:.0f}"
