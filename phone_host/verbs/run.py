"""phone-host run: pair a board's frames with the host camera's, compute depth and measure every delay."""

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import TYPE_CHECKING, Final

from common import now
from common.diagnostic import Diagnostic, diagnostic_of
from common.errors import SettingsError
from common.program import logs
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.interrupts import leave
from common.program.settings import Resolved, log_level
from common.program.signals import StopSignals
from common.program.terminal import columns, headed, rows, say
from phone_host.declared_settings import PhoneHostSettings
from phone_host.diagnostics.run_rules import depth_is_wrong, nothing_whole
from phone_host.jobs.run import Ended, PreparedRun, open_run
from phone_host.jobs.run_request import RunRequest, checked
from phone_host.output.json_text import json_text
from phone_host.report.summary import summary
from phone_host.run.host_settings import EndReason
from phone_host.run.progress_bar import tell
from phone_host.run.terminal_view import LiveTable

if TYPE_CHECKING:
    from phone_host.serve.beside import BesideRun

EXAMPLES = """  phone-host run --link tcp://192.168.7.2:5555 --camera 'replay:right?loop=1' --calibration rig.yaml --out scan
  phone-host run --link ipc://$XDG_RUNTIME_DIR/board --camera replay:right --rectified --disparities 64 --out scan    # photographs, by number
  phone-host run --link tcp://192.168.7.2:5555 --camera 'http://127.0.0.1:8080/video?latency_ms=120' --calibration rig.yaml --out scan
  phone-host run --link serial:/dev/ttyACM0 --link tcp://192.168.7.2:5555 --camera 'replay:right?loop=1' --out scan
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --align-phase    # both cameras expose together
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --budget 30ms    # coarser depth rather than slower
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --serve    # shows the page of this run
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --record session.mcap    # to compute it again later
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --record session.mcap --record-topics depth,cloud    # for other programs
  phone-host run --replay session.mcap --calibration rig.yaml --out again
  phone-host run --replay 'session.mcap?pace=clock' --calibration rig.yaml --fifo 2:drop-newest --out again
  phone-host run --camera 'replay:right?loop=1' --pairs 300 --json    # no depth: pairs and delays only
"""

_SOON_NS: Final = 1_000_000_000
"""A board that is there is met within a fifth of this; then there is nothing to say."""


def run(request: RunRequest) -> int:
    """Run until stopped, until the number of pairs is reached, or until a stream ends."""
    found = checked(request)
    logs.set_up(log_level(found.values.log_level))
    with _page(request, found) as page:  # first of all, because a browser gives its camera by it
        opened = open_run(request, found, tell, None if page is None else page.feed)
        signals = StopSignals()
        prepared = opened.prepared(sys.argv, () if page is None else (page.sink(opened.core, opened.named),))
        if page is not None:
            page.watch(prepared.host)

        def stopped() -> bool:
            return signals.stop or (page is not None and page.stopped())

        try:
            ended = _watched(request, prepared, stopped)
        except BaseException as error:
            with suppress(Exception):  # tell what ended the run, not what followed
                failed = prepared.failed(diagnostic_of(error))
                if request.as_json:
                    print(json_text(failed.report))
            raise
        written = prepared.ended(ended)
        if page is not None:
            page.ended(written.snapshot)
    return _finish(request, prepared, written, ended, signals, is_stopped=stopped())


def _page(request: RunRequest, found: Resolved[PhoneHostSettings]) -> "AbstractContextManager[BesideRun | None]":
    """Serve the page of a run, if it is wanted."""
    if request.serve is None:
        if request.lan:
            raise SettingsError("--lan without --serve", "add --serve, or leave it out")
        return nullcontext()
    from phone_host.serve.page import page_beside  # noqa: PLC0415 - a server that most runs do without

    return page_beside(request, found)


def _watched(request: RunRequest, prepared: PreparedRun, stop: Callable[[], bool]) -> EndReason:
    """Run before the user's eyes: a live table on a terminal, else a line where one is due."""
    host = prepared.host
    live = (
        LiveTable(host.snapshot, pairs=request.pairs or 0, seconds=request.duration_s) if sys.stderr.isatty() else None
    )
    note = WaitingNote(
        prepared.named, lambda: host.has_met_board, lambda: host.refused, lambda line: say(line, sys.stderr, flush=True)
    )
    with live or nullcontext():
        return host.run(stop, live.refresh if live else note.refresh)


def _finish(
    request: RunRequest,
    prepared: PreparedRun,
    written: Ended,
    ended: EndReason,
    signals: StopSignals,
    *,
    is_stopped: bool,
) -> int:
    """Print the report of a run; return its exit code."""
    host, snapshot = prepared.host, written.snapshot
    missing = f"\nnot written: {written.missing}: make room and run again" if written.missing else ""
    told = summary(snapshot, columns()) + missing
    text = json_text(written.report) if request.as_json else headed(told, columns(), rows())
    print(text, flush=host.has_given_up)
    if request.as_json and snapshot.shortfall:
        tell(snapshot.shortfall)
    if signals.interrupted and host.has_given_up:
        leave()  # the interpreter's end would wait for native code
    if signals.interrupted:
        return INTERRUPTED
    too_few = request.pairs and ended is EndReason.STREAM_ENDED
    too_few = too_few or (ended is EndReason.SECONDS_OVER and not snapshot.processed)
    is_wrong = not is_stopped and (depth_is_wrong(snapshot) or nothing_whole(snapshot))
    return CHECK_FAILED if too_few or is_wrong or not written.is_complete else 0


class WaitingNote:
    """One line, written if no board has been met after a second, and one as soon as a board refuses this host.

    Args:
        links: addresses at which the board is looked for.
        has_met_board: whether a board has said hello.
        refused: why the board refuses this host; None if it does not.
        say: takes a line.
    """

    def __init__(
        self,
        links: Sequence[str],
        has_met_board: Callable[[], bool],
        refused: Callable[[], Diagnostic | None],
        say: Callable[[str], None],
    ) -> None:
        self._line = f"phone-host: waiting for a board at {' and '.join(links)}"
        self._has_met_board, self._refused, self._say = has_met_board, refused, say
        self._told: Diagnostic | None = None
        self._due_ns: int | None = now.monotonic_ns() + _SOON_NS

    def refresh(self) -> None:
        """Write what is due. Called several times a second."""
        refused = self._refused()
        if refused is not None and refused != self._told:
            self._told, self._due_ns = refused, None
            self._say(f"phone-host: waiting: {refused.message}: {refused.remedy}")
        if self._due_ns is None or now.monotonic_ns() < self._due_ns:
            return
        self._due_ns = None
        if not self._has_met_board():
            self._say(self._line)
