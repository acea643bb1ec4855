"""A running pair of programs under attack, and the judge of what comes out: pairs from delays.jsonl, accounts from report.json, memory and log of a process."""

import json
import math
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Final

from tests.support.numbered import write_film
from tests.support.programs import PATIENCE_S, Program, board, free_port, host
from tests.system.hostile.attack import Outcome
from tests.system.hostile.shim import ShiftedClock

FPS: Final = 30
FRAMES: Final = 60
PERIOD_NS: Final = 1_000_000_000 // FPS
TOLERANCE_NS: Final = PERIOD_NS // 2

_SLACK_NS: Final = 1_000_000
"""What the stated uncertainty may be wrong by on a machine where others work: the ledger has no hard bound, and the steps that are looked for are ten times that."""

_STREAM: Final = 10
_STREAM_S: Final = 1.0
"""So many pairs within so much time are a stream; a single one is not."""

_SETTLED: Final = 30
_MOST_LINES: Final = 16
"""Of a log: start and end are six, and an attack may add some, each kind a few times."""


@cache
def film() -> Path:
    """A film of numbered images, written once."""
    return write_film(Path(mkdtemp(prefix="hostile-film-")) / "numbered", FRAMES)


def camera() -> str:
    """The film as a camera on the clock."""
    return f"replay:{film()}?fps={FPS}&loop=1"


@dataclass(frozen=True, slots=True)
class Pair:
    """One line of delays.jsonl, each stamp on the clock on which it was taken, ns.

    Attributes:
        sequence: of the board's frame.
        board_ns: its exposure, board's clock.
        sent_ns: when it was sent, board's clock.
        host_ns: exposure of the host's frame.
        received_ns: when the board's frame came.
        done_ns: when the pair was done.
        offset_ns: host's clock - board's clock, as it was believed.
        uncertainty_ns: as it was stated.
    """

    sequence: int
    board_ns: int
    sent_ns: int
    host_ns: int
    received_ns: int
    done_ns: int
    offset_ns: int
    uncertainty_ns: int

    @classmethod
    def read(cls, line: str) -> "Pair":
        """Take one line."""
        said = json.loads(line)
        exposed_ns, offset_ns = said["exposed_ns"], said["offset_ns"]
        return cls(
            said["sequence"],
            exposed_ns - offset_ns,
            said["sent_ns"] - offset_ns,
            exposed_ns - said["time_skew_ns"],
            said["received_ns"],
            said["done_ns"],
            offset_ns,
            said["uncertainty_ns"],
        )


class Watched:
    """Looks at a process from outside.

    Args:
        program: which.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._normal_bytes = 0

    def now_is_normal(self) -> None:
        """Take the peak until now as the normal one."""
        self._normal_bytes = self._peak_bytes()

    @property
    def memory(self) -> float:
        """The peak in multiples of the normal one."""
        return self._peak_bytes() / self._normal_bytes

    def judge_log(self, outcome: Outcome, most: int = _MOST_LINES) -> None:
        """Look at what it has logged."""
        said = self._program.stderr
        outcome.expect("Traceback" not in said, "a traceback in the log")
        outcome.expect(said.count("\n") <= most, f"{said.count(chr(10))} lines in the log, {most} are enough")

    def _peak_bytes(self) -> int:
        status = Path(f"/proc/{self._program.process.pid}/status").read_text(encoding="ascii")
        return 1024 * int(status.partition("VmHWM:")[2].split()[0])


class Scene:
    """A host that is attacked, or whose board is.

    Args:
        receiver: the host.
        out: its folder.
        clocks: of board and host, where they are shifted.
        true_board_ns: true exposure of a pair's board frame; None: as its stamp says, on the board's clock.
    """

    def __init__(
        self,
        receiver: Program,
        out: Path,
        clocks: tuple[ShiftedClock | None, ShiftedClock | None] = (None, None),
        true_board_ns: Callable[[Pair], int] | None = None,
    ) -> None:
        self.receiver = receiver
        self.watched = Watched(receiver)
        self._path = out / "delays.jsonl"
        self._board_clock, self._host_clock = clocks
        self._told_board_ns = true_board_ns
        self._offset = 0
        self.pairs: list[Pair] = []
        self._gone: list[int] = []
        self._small_steps: list[int] = []

    def look(self) -> list[Pair]:
        """Read what has been written since; gives all pairs."""
        if self._path.exists():
            with self._path.open("rb") as file:
                file.seek(self._offset)
                whole = file.read().rpartition(b"\n")[0]
            if whole:
                self._offset += len(whole) + 1
                self.pairs += [Pair.read(line) for line in whole.decode().splitlines()]
        return self.pairs

    def settle(self) -> None:
        """Wait until pairs flow, and take memory for normal then."""
        assert self._wait(lambda: len(self.look()) >= _SETTLED), f"no stream came up: {self.receiver.stderr[-2000:]}"
        self.watched.now_is_normal()

    def cause_gone(self, outcome: Outcome, name: str = "", at_ns: int | None = None) -> bool:
        """The cause has gone: wait until pairs flow again, and note how long that took; whether they came.

        Args:
            outcome: gets the gap, or a fault.
            name: of the cause, for the fault.
            at_ns: when it went, true time; None: now.
        """
        at_ns = time.monotonic_ns() if at_ns is None else at_ns
        if not self._wait(lambda: self._stream_since(at_ns) is not None):
            ended = self.receiver.process.poll()
            why = f"no pairs any more after {name}" if ended is None else f"the host ended with {ended} after {name}"
            outcome.expect(False, why)  # noqa: FBT003 - noted as it is
            return False
        came_ns = self._stream_since(at_ns)
        assert came_ns is not None
        outcome.gaps_s.append((came_ns - at_ns) / 1e9)
        return True

    def small_step(self) -> None:
        """A clock was stepped by less than two periods just now: until the next wave of echoes nobody can know."""
        self._small_steps.append(time.monotonic_ns())

    def judge_pairs(self, outcome: Outcome) -> None:
        """Count the pairs that are wrong by true exposure, and those whose offset is further from the truth than stated."""
        misstated = 0
        for pair in self.look():
            board_ns, host_ns = self._true_ns(pair)
            excused = any(0 <= self._on_host(pair.received_ns) - step_ns <= _WAVE_NS for step_ns in self._small_steps)
            apart_ns = abs(board_ns - host_ns)
            outcome.wrong += apart_ns > TOLERANCE_NS + pair.uncertainty_ns + _SLACK_NS and not excused
            misstated += self._offset_error_ns(pair) > pair.uncertainty_ns + _SLACK_NS and not excused
        outcome.pairs += len(self.pairs)
        outcome.expect(not misstated, f"{misstated} pairs whose offset is further from the truth than stated")

    def stop(self, outcome: Outcome, *, most_lines: int = _MOST_LINES) -> Any:
        """End the host and judge its pairs, its report and its log; gives the report."""
        if self.receiver.process.poll() is None:
            outcome.memory = max(outcome.memory, self.watched.memory)
            self.receiver.send(signal.SIGTERM)
        code = self.receiver.wait()
        outcome.expect(code == 0, f"the host ended with {code}")
        self.watched.judge_log(outcome, most_lines)
        self.judge_pairs(outcome)
        report = json.loads(self.receiver.out.read_text() or "{}")
        outcome.expect(bool(report), "no report")
        if report:
            judge_account(report, outcome)
            outcome.frames += sum(session["received"] for session in report["sessions"])
        return report

    def _wait(self, condition: Callable[[], bool]) -> bool:
        deadline = time.monotonic() + PATIENCE_S / 2
        while not condition():
            if time.monotonic() > deadline or self.receiver.process.poll() is not None:
                return condition()
            time.sleep(0.02)
        return True

    def _stream_since(self, at_ns: int) -> int | None:
        """When the first of many pairs of frames exposed after a moment was done, true time, ns."""
        done = [
            self._on_host(pair.done_ns)
            for pair in self.look()[-20 * FPS :]
            if self._on_host(pair.host_ns) >= at_ns and abs(math.dist(*((ns,) for ns in self._true_ns(pair)))) <= PERIOD_NS
        ]
        for first, last in zip(done, done[_STREAM - 1 :], strict=False):
            if last - first <= _STREAM_S * 1e9:
                return first
        return None

    def _true_ns(self, pair: Pair) -> tuple[int, int]:
        if self._told_board_ns is not None:
            return self._told_board_ns(pair), self._on_host(pair.host_ns)
        return self._on_board(pair.board_ns), self._on_host(pair.host_ns)

    def _offset_error_ns(self, pair: Pair) -> int:
        if self._told_board_ns is not None:
            return 0  # a liar's clock has no truth
        board = self._board_clock.step_at(pair.sent_ns) if self._board_clock else 0
        own = self._host_clock.step_at(pair.received_ns) if self._host_clock else 0
        return abs(pair.offset_ns - (own - board))

    def _on_board(self, stamp_ns: int) -> int:
        return self._board_clock.true_ns(stamp_ns) if self._board_clock else stamp_ns

    def _on_host(self, stamp_ns: int) -> int:
        return self._host_clock.true_ns(stamp_ns) if self._host_clock else stamp_ns


_WAVE_NS: Final = 750_000_000
"""Two waves of echoes are half a second apart; the answer is here a few ms later, on a busy machine some more."""


def judge_account(report: Any, outcome: Outcome) -> None:
    """Every frame and every pair is accounted for, and every frame that was dropped has a reason with a name."""
    frames, pairs = report["frames"], report["pairs_account"]
    orphaned = sum(frames["orphaned"].values())
    outcome.expect(
        frames["received"] == frames["paired"] + orphaned + frames["held"], "received is not paired + orphaned + held"
    )
    used = sum(count for name, count in pairs.items() if name != "paired")
    outcome.expect(pairs["paired"] == used, "paired is not processed + dropped + stopped")
    for session in report["sessions"]:
        if session["tail"] == "known" and session["session"]:
            known = session["received"] + session["lost"]
            outcome.expect(session["sent"] == known, f"sent {session['sent']} is not received + lost {known}")


@contextmanager
def scene(
    folder: Path,
    *,
    clocks: tuple[ShiftedClock | None, ShiftedClock | None] = (None, None),
    address: str = "",
    options: Sequence[str] = (),
    true_board_ns: Callable[[Pair], int] | None = None,
) -> Iterator[Scene]:
    """A host that dials an address, where somebody else is to be; ended with the block."""
    with _host(folder, address, options, clocks[1]) as receiver:
        yield Scene(receiver, folder / "out", clocks, true_board_ns)


@contextmanager
def board_and_host(
    folder: Path,
    *,
    clocks: tuple[ShiftedClock | None, ShiftedClock | None] = (None, None),
    address: str = "",
    options: Sequence[str] = (),
) -> Iterator[tuple[Program, Scene]]:
    """Both real programs over loopback tcp, pairs flowing."""
    address = address or f"tcp://127.0.0.1:{free_port()}"
    arguments = ["run", "--camera", camera(), "--link", address, "--json", "--log-level", "info"]
    with ExitStack() as held:
        agent = held.enter_context(board(arguments, folder, more=clocks[0].environment if clocks[0] else None))
        watched = held.enter_context(scene(folder, clocks=clocks, address=address, options=options))
        watched.settle()
        yield agent, watched


def _host(folder: Path, address: str, options: Sequence[str], clock: ShiftedClock | None) -> Any:
    out = ["--out", str(folder / "out"), "--save-every", "0", "--json", "--log-level", "info"]
    arguments = ["run", "--camera", camera(), "--link", address, *out, *options]
    return host(arguments, folder, more=clock.environment if clock else None)
