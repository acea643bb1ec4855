"""Both programs running under attack, and the judge of the outcome: pairs from delays.jsonl, accounts from report.json, memory and log of a process."""

import atexit
import json
import re
import shutil
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
"""Tolerated error of the stated uncertainty on a busy machine: the ledger has no hard bound, and the steps to be detected are ten times that."""

_HOLE_NS: Final = 400_000_000
_STREAM_NS: Final = 700_000_000
"""Pairs for this long without such a hole are a stream; a few pairs are not: an estimate may still be about to break."""

_SETTLED: Final = 30
_MOST_LINES: Final = 24
_MOST_LINES_EACH: Final = 8
"""Limits for a log: lines for start and end, and what each outage may add."""

_LOG_LINE: Final = re.compile(r"\d{4}-\d\d-\d\d [\d:,]+ (DEBUG|INFO|WARNING|ERROR) ")
_OWN_WORDS: Final = ("phone-host", "board-agent", "warning: ")


@cache
def film() -> Path:
    """A film of numbered images, written once; deleted when this process ends."""
    folder = Path(mkdtemp(prefix="hostile-film-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return write_film(folder / "numbered", FRAMES)


def camera() -> str:
    """The film as a camera on the clock."""
    return f"replay:{film()}?fps={FPS}&loop=1"


@dataclass(frozen=True, slots=True)
class Pair:
    """One line of delays.jsonl; each stamp is on the clock that took it, ns.

    Attributes:
        sequence: of the board's frame.
        board_ns: its exposure, board's clock.
        sent_ns: when it was sent, board's clock.
        host_ns: exposure of the host's frame.
        received_ns: when the board's frame arrived.
        done_ns: when the pair was done.
        offset_ns: host's clock - board's clock, as estimated.
        uncertainty_ns: as stated.
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
        """Parse one line."""
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
    """Watches a process from outside.

    Args:
        program: the watched process.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._normal_bytes = 0

    def now_is_normal(self) -> None:
        """Take the peak so far as the normal one."""
        self._normal_bytes = self._peak_bytes()

    @property
    def memory(self) -> float:
        """The peak in multiples of the normal one; 0 if unknown."""
        return self._peak_bytes() / self._normal_bytes if self._normal_bytes else 0.0

    def judge_log(self, outcome: Outcome) -> None:
        """Check its log, and whatever else was written to its stderr."""
        said = self._program.stderr
        most = _MOST_LINES + _MOST_LINES_EACH * len(outcome.gaps_s)
        outcome.expect("Traceback" not in said, "a traceback in the log")
        log = [line for line in said.splitlines() if _LOG_LINE.match(line)]
        past = [line for line in said.splitlines() if not _LOG_LINE.match(line) and not line.startswith(_OWN_WORDS)]
        outcome.expect(len(log) <= most, f"{len(log)} lines in the log, {most} are enough")
        outcome.expect(not past, f"{len(past)} lines past the log, such as {''.join(past[:1])[:80]!r}")

    def _peak_bytes(self) -> int:
        status = Path(f"/proc/{self._program.process.pid}/status").read_text(encoding="ascii")
        return 1024 * int(status.partition("VmHWM:")[2].split()[0])


class Scene:
    """A host under attack, or whose board is.

    Args:
        receiver: the host.
        out: its folder.
        clocks: of board and host, if they are shifted.
        true_board_ns: true exposure of a pair's board frame; None: its stamp, on the board's clock, is true.
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
        self._small_steps: list[tuple[int, int]] = []

    def look(self) -> list[Pair]:
        """Read what has been written since; return all pairs."""
        if self._path.exists():
            with self._path.open("rb") as file:
                file.seek(self._offset)
                whole = file.read().rpartition(b"\n")[0]
            if whole:
                self._offset += len(whole) + 1
                self.pairs += [Pair.read(line) for line in whole.decode().splitlines()]
        return self.pairs

    def settle(self) -> None:
        """Wait until pairs flow, and take memory then as normal."""
        assert self._wait(lambda: len(self.look()) >= _SETTLED), f"no stream came up: {self.receiver.stderr[-2000:]}"
        self.watched.now_is_normal()

    def more(self, pairs: int) -> None:
        """Wait for this many further pairs, or for the host's end."""
        enough = len(self.look()) + pairs
        self._wait(lambda: len(self.look()) >= enough)

    def cause_gone(self, outcome: Outcome, name: str = "", at_ns: int | None = None) -> bool:
        """The cause has gone: wait until pairs flow again, and note how long that took; return whether they came.

        Args:
            outcome: receives the gap, or a fault.
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

    def small_step(self, since_ns: int) -> None:
        """A clock was just stepped by less than two periods: until the next wave of echoes nobody can know.

        Args:
            since_ns: just before the step, true time. Pairs may come before this program runs again after the step.
        """
        self._small_steps.append((since_ns, time.monotonic_ns()))

    def judge_pairs(self, outcome: Outcome) -> None:
        """Count the pairs that are wrong by true exposure, and those whose offset error exceeds the stated uncertainty."""
        misstated = 0
        for pair in self.look():
            received_ns = self._on_host(pair.received_ns)
            excused = any(since_ns <= received_ns <= step_ns + _WAVE_NS for since_ns, step_ns in self._small_steps)
            outcome.wrong += self._apart_ns(pair) > TOLERANCE_NS + pair.uncertainty_ns + _SLACK_NS and not excused
            misstated += self._offset_error_ns(pair) > pair.uncertainty_ns + _SLACK_NS and not excused
        outcome.pairs += len(self.pairs)
        outcome.expect(not misstated, f"{misstated} pairs whose offset is further from the truth than stated")

    def stop(self, outcome: Outcome) -> Any:
        """End the host and judge its pairs, its report and its log; return the report."""
        if self.receiver.process.poll() is None:
            outcome.memory = max(outcome.memory, self.watched.memory)
            self.receiver.send(signal.SIGTERM)
        code = self.receiver.wait()
        outcome.expect(code == 0, f"the host ended with {code}")
        self.watched.judge_log(outcome)
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
        """True time at which the first of many pairs exposed after a given moment was done, ns."""
        done = [
            self._on_host(pair.done_ns)
            for pair in self.look()[-20 * FPS :]
            if self._on_host(pair.host_ns) >= at_ns and self._apart_ns(pair) <= PERIOD_NS
        ]
        first_ns = last_ns = done[0] if done else 0
        for ns in done:
            if ns - last_ns > _HOLE_NS:
                first_ns = ns
            last_ns = ns
            if last_ns - first_ns >= _STREAM_NS:
                return first_ns
        return None

    def _apart_ns(self, pair: Pair) -> int:
        """Return the true difference of exposure between the two frames of a pair."""
        told = self._told_board_ns
        board_ns = self._on_board(pair.board_ns) if told is None else told(pair)
        return abs(board_ns - self._on_host(pair.host_ns))

    def _offset_error_ns(self, pair: Pair) -> int:
        if self._told_board_ns is not None:
            return 0  # a liar's clock has no true time
        board = self._board_clock.step_at(pair.sent_ns) if self._board_clock else 0
        own = self._host_clock.step_at(pair.received_ns) if self._host_clock else 0
        return abs(pair.offset_ns - (own - board))

    def _on_board(self, stamp_ns: int) -> int:
        return self._board_clock.true_ns(stamp_ns) if self._board_clock else stamp_ns

    def _on_host(self, stamp_ns: int) -> int:
        return self._host_clock.true_ns(stamp_ns) if self._host_clock else stamp_ns


_WAVE_NS: Final = 750_000_000
"""Two waves of echoes are half a second apart; the answer is here a few ms later, somewhat more on a busy machine."""


def judge_account(report: Any, outcome: Outcome) -> None:
    """Every frame and every pair is accounted for, and every dropped frame has a named reason."""
    frames, pairs = report["frames"], report["pairs_account"]
    orphaned = sum(frames["orphaned"].values())
    outcome.expect(
        frames["received"] == frames["paired"] + orphaned + frames["held"], "received is not paired + orphaned + held"
    )
    used = sum(count for name, count in pairs.items() if name not in {"paired", "spoiled_images"})
    received = sum(session["received"] for session in report["sessions"])
    beyond = frames["disbelieved"].get("beyond_credit", 0) + frames["disbelieved"].get("own_from_the_future", 0)
    dropped = sum(frames["disbelieved"].values()) - beyond + frames["before_clock"]
    outcome.expect(received == frames["received"] + dropped, "what came is not what was taken in + dropped by name")
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
    own: str = "",
    true_board_ns: Callable[[Pair], int] | None = None,
) -> Iterator[Scene]:
    """A host that dials an address where somebody else is supposed to be; it ends with the block."""
    with _host(folder, address, ("--camera", own or camera(), *options), clocks[1]) as receiver:
        yield Scene(receiver, folder / "out", clocks, true_board_ns)


@contextmanager
def board_and_host(
    folder: Path,
    *,
    clocks: tuple[ShiftedClock | None, ShiftedClock | None] = (None, None),
    addresses: tuple[str, str] | None = None,
    options: Sequence[str] = (),
    own: str = "",
) -> Iterator[tuple[Program, Scene]]:
    """Both real programs over loopback tcp, or at these addresses of board and host, once pairs flow."""
    tcp = f"tcp://127.0.0.1:{free_port()}"
    listens, dials = addresses or (tcp, tcp)
    with ExitStack() as held:
        more = clocks[0].environment if clocks[0] else None
        agent = held.enter_context(board(board_arguments(listens), folder, more=more))
        watched = held.enter_context(scene(folder, clocks=clocks, address=dials, options=options, own=own))
        watched.settle()
        yield agent, watched


def board_arguments(address: str) -> list[str]:
    """Arguments of a board that shows the film."""
    return ["run", "--camera", camera(), "--link", address, "--json", "--log-level", "info"]


def _host(folder: Path, address: str, options: Sequence[str], clock: ShiftedClock | None) -> Any:
    out = ["--out", str(folder / "out"), "--save-every", "0", "--json", "--log-level", "info"]
    return host(["run", "--link", address, *out, *options], folder, more=clock.environment if clock else None)
