"""A view that is redrawn in its place on a terminal. Log lines go above it, and it is never higher than the terminal."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from threading import RLock
from types import TracebackType
from typing import Self

from rich.console import Console, RenderableType
from rich.live import Live
from rich.segment import Segment, Segments
from rich.text import Text

from common.program import logs


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
