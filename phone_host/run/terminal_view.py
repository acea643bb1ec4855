"""What a terminal shows during long work: a view that is redrawn in its place, below the lines of the log, and the live table of a run."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from threading import RLock
from types import TracebackType
from typing import Final, Self

from rich.console import Console, RenderableType
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn
from rich.segment import Segment, Segments
from rich.table import Table
from rich.text import Text

from common import now
from common.program import logs
from common.words import counted
from phone_host.accounts.delays import DELAYS, FROM_EXPOSURE, IDLE_STAGE_NS, STAGES, Spread
from phone_host.accounts.link_account import away_words, rung_lines
from phone_host.diagnostics.headline import headline
from phone_host.diagnostics.run_rules import concerns
from phone_host.diagnostics.run_snapshot import RunSnapshot, unused
from phone_host.diagnostics.throughput import budget_lines, figures, judge
from phone_host.report.summary import camera_troubles, corrected_lines, depth_lines, phase_lines


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a view.

    Attributes:
        rank: parts of a lower rank get room first.
        shown: its content.
    """

    rank: int
    shown: RenderableType


class Redrawn:
    """Draws parts on a terminal again and again, and nothing stays of them; a context manager.

    Args:
        console: where to draw; stderr by default, so that stdout is free for results.
    """

    def __init__(self, console: Console | None = None) -> None:
        self._live = Live(console=console or Console(stderr=True), auto_refresh=False, transient=True)
        # Two threads that draw at once would each move the cursor from where the other one had left it.
        self._drawing = RLock()
        self._ending = ExitStack()

    def __enter__(self) -> Self:
        with ExitStack() as begun:
            begun.enter_context(logs.written_by(self._say))
            self._live.start()
            begun.callback(self._live.stop)
            self._ending = begun.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._drawing:
            self._ending.close()

    @property
    def console(self) -> Console:
        """Where it is drawn."""
        return self._live.console

    def draw(self, parts: Sequence[Part], *, rings: bool = False) -> None:
        """Draw the parts in place of the last ones.

        Args:
            parts: from top to bottom.
            rings: whether the terminal's bell rings first.
        """
        with self._drawing:
            if rings:
                self.console.bell()
            self._live.update(_fitted(parts, self.console), refresh=True)

    def _say(self, line: str) -> None:
        """Write a line of the log above the view."""
        with self._drawing:
            self.console.print(Text(line, overflow="fold"))


def _fitted(parts: Sequence[Part], console: Console) -> Segments:
    """Draw parts below each other in the rows of a terminal; the last parts to get room are cut or left out.

    One row stays free: a view as high as the terminal would scroll when it ends, and its top could not be removed.
    """
    room = console.height - 1
    drawn: dict[int, list[list[Segment]]] = {}
    for place in sorted(range(len(parts)), key=lambda each: (parts[each].rank, each)):
        drawn[place] = console.render_lines(parts[place].shown, pad=False)[: max(room, 0)]
        room -= len(drawn[place])
    lines = [line for place in range(len(parts)) for line in drawn[place]]
    ended = [[*line, Segment.line()] for line in lines[:-1]]
    return Segments([segment for line in (*ended, *lines[-1:]) for segment in line])


_REFRESH_S: Final = 0.25
_WIDE: Final = 64
"""Characters that the whole table needs."""

_RECENT: Final = 300
"""Percentiles cover this many newest pairs: ten seconds at 30 pairs per second."""


class LiveTable(Redrawn):
    """Shows a run's delays while it is running; a context manager.

    Attributes:
        progress: its bar.

    Args:
        snapshot: returns the run's present state.
        console: where to draw; stderr by default, so that stdout is free for results.
        seconds: planned length of the run from its first pair, for the progress bar, s; 0 if it is given in pairs or open.
        pairs: the same, in pairs.
        refresh_s: least time between two redraws, s.
    """

    def __init__(
        self,
        snapshot: Callable[[], RunSnapshot],
        console: Console | None = None,
        *,
        seconds: float = 0.0,
        pairs: int = 0,
        refresh_s: float = _REFRESH_S,
    ) -> None:
        super().__init__(console)
        self._snapshot, self._refresh_s = snapshot, refresh_s
        self._seconds = seconds
        self._begun_s = 0.0
        self._shown_s = 0.0
        self._last = (0, now.monotonic_ns() / 1e9)
        self._rate = 0.0
        self.progress = Progress(
            TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.0f}/{task.total:.0f}")
        )
        total = seconds or pairs
        self._task = self.progress.add_task("seconds" if seconds else "pairs", total=total) if total else None

    def refresh(self) -> None:
        """Show the present state, at most a few times a second."""
        now_s = now.monotonic_ns() / 1e9
        if now_s - self._shown_s < self._refresh_s:
            return
        self._shown_s = now_s
        run = self._snapshot()
        pairs, since_s = self._last
        if now_s - since_s >= 1.0:
            self._rate = (run.processed - pairs) / (now_s - since_s)
            self._last = (run.processed, now_s)
        if run.processed and not self._begun_s:
            self._begun_s = now_s
        if self._task is not None:
            lasted_s = min(self._seconds, now_s - self._begun_s) if self._begun_s else 0.0
            self.progress.update(self._task, completed=lasted_s if self._seconds else run.processed)
        self.draw(self._parts(run, self.console.width))

    def _parts(self, run: RunSnapshot, width: int) -> Sequence[Part]:
        """Return the view from top to bottom; on a low terminal warnings, bar and table are what stays."""
        bar = [Part(1, self.progress)] if self._task is not None else []
        return (
            *(Part(0, line) for line in _warnings(run)),
            *(Part(3, line) for line in _cameras(run)),
            *(
                Part(5, Text(line))
                for line in (*depth_lines(run.images), *corrected_lines(run.depth), *budget_lines(run.budget))
            ),
            *([] if run.recording is None else [Part(4, Text(run.recording.words))]),
            Part(2, _table(run, self._rate, width)),
            Part(6, _stages(run)),
            Part(7, Text(judge(figures(run)).sentence, style="dim")),
            Part(4, _state(run)),
            *bar,
        )


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
        if run.timeless and name in FROM_EXPOSURE:
            continue
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


def _warnings(run: RunSnapshot) -> list[Text]:
    """Return the concerns; without any, how the depth fares."""
    warnings = [Text(f"warning: {item.message}: {item.remedy}", style="bold red") for item in concerns(run)]
    if run.images.wants_depth and run.images.judged and not warnings:
        return [Text(headline(run).sentence, style="bold")]
    return warnings


def _cameras(run: RunSnapshot) -> list[Text]:
    """Return the two cameras' troubles."""
    away = away_words(run.away)
    lines = (*camera_troubles(run.camera), *rung_lines(run.link), *([away] if away else []))
    return [Text(line, style="yellow") for line in lines]


def _state(run: RunSnapshot) -> Text:
    estimate = run.estimate
    clock = (
        f"clock +-{estimate.uncertainty_ns / 1000:.0f} us (hard +-{estimate.bound_ns / 1000:.0f} us)"
        if estimate
        else "clock unknown"
    )
    absent = "waiting for the board" if run.refused is None else f"{run.refused.message}: {run.refused.remedy}"
    board = f"board connected over {run.carrier}" if run.carrier else absent
    lost = ", ".join(item.told for item in unused(run)) or "nothing"
    phase = "\n".join(phase_lines(run.phase, run.alignment))
    return Text(f"{board} · {clock} · not used: {lost}" + (f"\n{phase}" if phase else ""))


def _cell_ms(spread: Spread, name: str) -> str:
    if not spread.count:
        return "-"
    value = float(getattr(spread, f"{name}_ns")) / 1e6
    return f"{value:.3f}" if abs(value) < 1000 else f"{value:.0f}"
