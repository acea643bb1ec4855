"""Runs a matrix of cases one after another, with a progress bar, until a signal comes or one fails. Shell."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Self

from rich.console import Console

from common import now
from common.errors import TandemError, UnavailableError
from common.program.signals import StopSignals
from phone_host.bench.cases import Case, Interface, Size
from phone_host.bench.links import ask_board
from phone_host.bench.runs import PATIENCE_NS, WARM_UP_S, CaseResult, RunSettings, film_images, render, run_case
from phone_host.run.progress_bar import busy_bar, progress_bar
from phone_host.scene.film import Film
from phone_host.subprocesses.board_process import socket_folder

_RENDER_S: Final = 0.06
"""About how long an image takes to render; the progress bar estimates the remaining time with it."""

_SET_UP_S: Final = 2.0
"""A run takes this much longer than its seconds, because processes start and stop."""


class _StoppedError(Exception):
    """Raised during rendering when the user wants to stop."""


@dataclass(slots=True)
class Outcome:
    """The results of a matrix of cases.

    Attributes:
        results: of the cases that were run, in order.
        failure: the error that ended it early; None if there was none.
    """

    results: list[CaseResult] = field(default_factory=list)
    failure: TandemError | None = None


def remote_cases(remote: Sequence[Interface], signals: StopSignals) -> list[Case]:
    """Ask the remote boards what they show; returns fewer cases if a signal comes meanwhile.

    Returns:
        A case for each board.

    Raises:
        UnavailableError: a board did not answer.
    """
    found = []
    for interface in remote:
        with busy_bar(f"asking the board at {interface.link}"):
            case = ask_board(interface.link, PATIENCE_NS, lambda: signals.stop)
        if case is None:
            break
        found.append(case)
    return found


def measure(planned: Sequence[Case], settings: RunSettings, signals: StopSignals) -> Outcome:
    """Run all cases until a signal comes or one fails; earlier results are kept."""
    outcome = Outcome()
    run_s = _SET_UP_S + WARM_UP_S + settings.seconds
    render_s = film_images() * _RENDER_S
    sizes = dict.fromkeys(case.size for case in planned)
    with (
        tempfile.TemporaryDirectory(prefix="delay-bench-") as name,
        socket_folder() as sockets,
        _Bar(len(sizes) * render_s + len(planned) * run_s, signals) as bar,
    ):
        folder = Path(name)
        films: dict[tuple[Size, int], Film] = {}
        for number, case in enumerate(planned):
            try:
                if (case.size, case.quality_percent) not in films:
                    bar.begin(f"rendering {case.size}", render_s)
                    films |= _films(planned, case.size, folder, bar.rendered)
                bar.begin(f"{number + 1}/{len(planned)} {case}", run_s)
                result = run_case(
                    case,
                    films[case.size, case.quality_percent],
                    _fresh(sockets / f"run{number}"),
                    settings,
                    stop=bar.stopped,
                )
            except _StoppedError:
                break
            except TandemError as error:
                outcome.failure = error
                break
            if result is not None:
                outcome.results.append(result)
            if signals.stop:
                break
    return outcome


class _Bar:
    """The progress bar over the whole matrix, in seconds of expected time; hidden if stderr is not a terminal."""

    def __init__(self, total_s: float, signals: StopSignals) -> None:
        self._progress = progress_bar(Console(stderr=True))
        self._task = self._progress.add_task("", total=total_s)
        self._signals = signals
        self._done_s = self._length_s = 0.0
        self._begun_ns = now.monotonic_ns()

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def begin(self, what: str, length_s: float) -> None:
        """Begin a piece of work; the one before it is done."""
        self._done_s += self._length_s
        self._length_s, self._begun_ns = length_s, now.monotonic_ns()
        self._progress.update(self._task, description=what, completed=self._done_s)

    def stopped(self) -> bool:
        """Show the progress; return whether the user wants to stop."""
        elapsed_s = (now.monotonic_ns() - self._begun_ns) / 1e9
        self._progress.update(self._task, completed=self._done_s + min(elapsed_s, self._length_s))
        return self._signals.stop

    def rendered(self) -> None:
        """Show the progress after a rendered image; raise if the user wants to stop."""
        if self.stopped():
            raise _StoppedError


def _films(
    planned: Sequence[Case], size: Size, folder: Path, advance: Callable[[], None]
) -> dict[tuple[Size, int], Film]:
    """Render the films of one size, in all its qualities."""
    qualities = tuple(dict.fromkeys(case.quality_percent for case in planned if case.size == size))
    try:
        films = render(size, qualities, folder / str(size), advance)
    except OSError as error:
        raise _no_room(folder, error) from None
    return {(size, quality): film for quality, film in films.items()}


def _fresh(folder: Path) -> Path:
    """Make a new folder for one run's sockets."""
    try:
        folder.mkdir()
    except OSError as error:
        raise _no_room(folder, error) from None
    return folder


def _no_room(folder: Path, error: OSError) -> UnavailableError:
    return UnavailableError(
        f"temporary folder {folder} cannot be used ({error.strerror})",
        "make room on the disk, or set TMPDIR to another folder",
    )
