"""The command delay-bench: measures the delays of every link and stage on this machine, or takes a recorded run as its measurement.

What a recording does not tell is not guessed, but for one thing: a board frame whose number is missing counts as replaced by a newer one.
"""

import argparse
import json
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.table import Table

from common.errors import DataError, SettingsError, UnavailableError
from common.ledger import PairLedger
from common.program import logs
from common.program.commandline import INTERRUPTED
from common.program.signals import StopSignals
from common.program.terminal import fitted
from common.protocol.message import BoardCounts, Pacing
from common.recording.recorded import Recorded
from common.recording.stamps import pairs_of_two
from common.strict_json import strict_json
from common.words import counted
from phone_host.accounts.link_account import LinkAccount, SessionAccount
from phone_host.bench.analysis import Analysis, analyse
from phone_host.bench.cases import (
    BOARD_SETS,
    Case,
    Interface,
    Size,
    cases,
    interfaces,
    parse_links,
    parse_qualities,
    parse_rates,
    parse_sizes,
)
from phone_host.bench.changes import Change, parse_changes
from phone_host.bench.emulate import parse_profiles
from phone_host.bench.links import why_not_measurable
from phone_host.bench.matrix import measure, remote_cases
from phone_host.bench.page import figure, page
from phone_host.bench.report import PERCENTILES, Conditions, as_json, conditions, grouped, most_compared
from phone_host.bench.runs import WARM_UP_S, CaseResult, RunSettings, after_warm_up
from phone_host.bench.tables import (
    fit_lines,
    narrow_rows,
    prediction_lines,
    regime_lines,
    result_sentence,
    rows,
    summary_line,
)
from phone_host.bench.trace import TracedRun, trace_json
from phone_host.model import PairCounts
from phone_host.output.atomic import write_text
from phone_host.output.folder_lock import lock_for_command
from phone_host.output.result_files import claim, replacing_results
from phone_host.recording.clock_messages import told_clocks
from phone_host.recording.playback import Playback
from phone_host.run.progress_bar import busy_bar
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.matcher_names import matcher_named
from phone_host.subprocesses.board_process import BoardAccount
from phone_host.sync.fifo import FifoSettings

_LEAST: Final = 10
"""Pairs behind the warm-up: fewer tell no 95th percentile."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedRun:
    """A run that was recorded.

    Attributes:
        result: what it measured.
        fifo: its queue.
        matcher: name of its matcher; "-": not told.
        begun: when, UTC.
    """

    result: CaseResult
    fifo: FifoSettings
    matcher: str
    begun: str


def recorded_run(file: Path) -> RecordedRun:
    """Read the run that a recording was made beside.

    Raises:
        DataError: it cannot be read, or is no recording of two cameras, or holds no delays of pairs.
    """
    playback = Playback(file, Pacing.CLOCK)
    ledgers = sorted(playback.ledgers(), key=lambda ledger: ledger.done_ns)
    kept, measured_s = after_warm_up(ledgers)
    if len(kept) < _LEAST:
        raise DataError(
            f"{file} holds the delays of {counted(len(kept), 'pair')} after its first {WARM_UP_S:g} s, at least {_LEAST} are needed",
            "record longer, beside a run: phone-host run --record FILE.mcap",
        )
    camera, recorded = playback.board, playback.recorded
    interface = Interface(ledgers[-1].link)
    size, rate_hz = Size(camera.width_px, camera.height_px), max(1, round(1e9 / camera.period_ns))
    board, counts = _accounts(playback, ledgers)
    session = SessionAccount("", BoardCounts(), BoardCounts(), received=counts.received)
    known = told_clocks(recorded)
    last = known[-1].estimate if known else None
    result = CaseResult(
        case=Case(interface=interface, size=size, quality_percent=BOARD_SETS, rate_hz=rate_hz),
        ledgers=kept,
        measured_s=measured_s,
        uncertainty_ns=float("nan") if last is None else last.uncertainty_ns,
        bound_ns=float("nan") if last is None else max(last.uncertainty_ns, (last.high_ns - last.low_ns) / 2),
        board=board,
        link=LinkAccount([session]),
        counts=counts,
        processed=len(ledgers),
        undecodable=0,
    )
    settings = _recorded_settings(recorded)
    begun = datetime.fromtimestamp(playback.frames[0][0].log_ns / 1e9, UTC).isoformat(timespec="seconds")
    return RecordedRun(
        result=result, fifo=_fifo(settings.get("fifo", "")), matcher=settings.get("matcher") or "-", begun=begun
    )


def _accounts(playback: Playback, ledgers: Sequence[PairLedger]) -> tuple[BoardAccount, PairCounts]:
    """Count frames and pairs between the exposures of the first and the last pair."""
    unix_ns = playback.recorded.about.unix_ns
    marks = [ledger.board.exposed_ns + unix_ns for ledger in ledgers]
    reach_ns = playback.board.period_ns // 2
    low_ns, high_ns = min(marks) - reach_ns, max(marks) + reach_ns
    within = [(shown, is_board) for shown, is_board in playback.frames if low_ns <= shown.image.stamp_ns <= high_ns]
    board = [shown for shown, is_board in within if is_board]
    board_ns, own_ns = (sorted(shown.image.stamp_ns for shown, of in within if of is side) for side in (True, False))
    paired = len(pairs_of_two(board_ns, own_ns, max(playback.board.period_ns, playback.description.period_ns) // 2))
    missing = sum(max(0, after.sequence - before.sequence - 1) for before, after in pairwise(board))
    paired = max(paired, len(ledgers))
    alone = max(0, len(board) - paired)
    counts = PairCounts(
        received=len(board),
        host_frames=len(within) - len(board),
        paired=paired,
        dropped=paired - len(ledgers),
        taken=len(ledgers),
        board_orphans=(("no_partner", alone),) if alone else (),
    )
    return BoardAccount(len(board) + missing, len(board), (("replaced", missing),) if missing else ()), counts


def _recorded_settings(recorded: Recorded) -> dict[str, str]:
    """Return the settings of the run, as far as they are texts."""
    try:
        values = strict_json(bytes(recorded.attachments.get("settings.json", b"{}")))
        return {name: each["value"] for name, each in values.items() if isinstance(each["value"], str)}
    except (ValueError, TypeError, KeyError, AttributeError):
        return {}


def _fifo(text: str) -> FifoSettings:
    try:
        return FifoSettings.parse(text) if text else FifoSettings()
    except SettingsError:
        return FifoSettings()


_NOTHING_MEASURED = 4
_FILES = ("delay-bench.json", "delay-bench.html", "trace.json", "delay-bench.svg")


def run(options: argparse.Namespace) -> int:
    """Run the cases that the options ask for, print their delays, write the files."""
    changes = parse_changes(options.predict)
    if options.replay is not None:
        return _run_recorded(options, changes)
    settings = _settings(options)
    asked = _interfaces(options)
    matrix = parse_sizes(options.size), parse_qualities(options.quality), parse_rates(options.fps)
    here, not_run = _available(asked)
    if options.out is not None:
        _make_folder(options.out)
    logs.set_up(30)
    signals = StopSignals()
    boards = remote_cases([interface for interface in here if interface.is_remote], signals)
    for case in boards:
        print(
            f"delay-bench: {case.interface} shows {case.images}; its camera is not set from here: "
            "--size, --quality and --fps do not count there",
            file=sys.stderr,
        )
    planned = (*cases([interface for interface in here if not interface.is_remote], *matrix), *boards)
    outcome = measure(planned, settings, signals)
    _tell(options, outcome.results, conditions(settings, not_run), analyse(outcome.results, settings.fifo, changes))
    if outcome.failure is not None:
        raise outcome.failure
    if signals.stop:
        how = "interrupted" if signals.interrupted else "stopped"
        print(f"delay-bench: {how} after {len(outcome.results)} of {counted(len(planned), 'run')}", file=sys.stderr)
        return INTERRUPTED if signals.interrupted else 0
    return 0 if all(result.ledgers for result in outcome.results) else _NOTHING_MEASURED


def _run_recorded(options: argparse.Namespace, changes: Sequence[Change]) -> int:
    """Tell the delays of a recorded run, and predict from them."""
    for name in ("links", "emulate"):
        if getattr(options, name) is not None:
            raise SettingsError(
                f"--{name} beside --replay", "leave one of them out; --predict link=wifi predicts another link"
            )
    if options.out is not None:
        _make_folder(options.out)
    with busy_bar("reading the recording"):
        run = recorded_run(options.replay)
    under = Conditions(
        machine=f"recording {options.replay}",
        date=run.begun,
        matcher=run.matcher,
        fifo=run.fifo,
        seconds=round(run.result.measured_s, 1),
        recording=str(options.replay),
    )
    _tell(options, [run.result], under, analyse([run.result], run.fifo, changes))
    return 0


def _interfaces(options: argparse.Namespace) -> tuple[Interface, ...]:
    """Return the interfaces that the options ask for."""
    links = parse_links(options.links) if options.links else ()
    return interfaces(links, parse_profiles(options.emulate) if options.emulate else ())


def _available(asked: Sequence[Interface]) -> tuple[list[Interface], list[tuple[Interface, str]]]:
    """Return the interfaces that are available here, and the others with the reason, which is printed at once."""
    here, not_run = [], []
    for interface in asked:
        reason = why_not_measurable(interface)
        if reason:
            print(f"delay-bench: {interface} is not run: {reason}", file=sys.stderr)
            not_run.append((interface, reason))
        else:
            here.append(interface)
    if not here:
        raise UnavailableError("none of the links works on this machine", "give others with --links")
    return here, not_run


def _tell(options: argparse.Namespace, results: Sequence[CaseResult], under: Conditions, analysis: Analysis) -> None:
    """Print the table or the JSON object, and write the files."""
    report = as_json(results, under, analysis)
    if options.json:
        print(json.dumps(report))
    else:
        print_results(results, under, analysis)
    if options.out is None:
        return
    files = {
        "delay-bench.json": json.dumps(report, indent=1) + "\n",
        "delay-bench.html": page(results, under, analysis),
        "trace.json": trace_json([TracedRun(str(result.case), result.ledgers) for result in results]),
    }
    if any(result.ledgers for result in results):
        files["delay-bench.svg"] = figure(results, under)
    _write(options.out, files)


def _settings(options: argparse.Namespace) -> RunSettings:
    if not 0.5 <= options.seconds <= 3600:
        raise SettingsError(f"--seconds is {options.seconds:g}", "give 0.5 to 3600 seconds")
    return RunSettings(
        matcher_named(options.matcher) if options.matcher else default_matcher(),
        FifoSettings.parse(options.fifo),
        options.seconds,
    )


def _make_folder(folder: Path) -> None:
    try:
        lock_for_command(folder)
        claim(folder, *_FILES)
    except OSError as error:
        raise UnavailableError(
            f"results folder {folder} cannot be used ({error.strerror})", "give another with --out"
        ) from None


def _write(out: Path, files: dict[str, str]) -> None:
    try:
        with replacing_results(out, "|".join(map(re.escape, _FILES)), files) as place:
            for name, text in files.items():
                write_text(place / name, text)
    except OSError as error:
        raise UnavailableError(
            f"results in {out} cannot be written ({error.strerror})",
            "make room on the disk, or give another folder with --out",
        ) from None


def print_results(results: Sequence[CaseResult], under: Conditions, analysis: Analysis) -> None:
    """Print a table for each kind of images, stage by stage, with the interfaces below each other."""
    print(fitted(f"{under.machine}, {under.date}, matcher {under.matcher}"))
    if sentence := result_sentence(most_compared(results)):
        print(fitted(sentence))
    for group in grouped(results):
        table = Table(title=f"{group[0].case.images}, delays in ms", title_justify="left")
        table.add_column("stage")
        table.add_column("link", overflow="fold")  # boards' URIs are long and differ at their ends
        for name in PERCENTILES:
            table.add_column(name, justify="right")
        for row in rows(group):
            table.add_row(*row)
        if _fits(table):
            _print_whole(table)
        else:
            _print_narrow(group)
        for result in group:
            print(fitted(f"{result.case.interface}: {summary_line(result)}"))
            for line in regime_lines(result, under.fifo):
                print(fitted(f"  {line}"))
        print()
    for line in (*fit_lines(analysis), *prediction_lines(analysis, every=bool(under.recording))):
        print(fitted(line))


def _print_narrow(group: Sequence[CaseResult]) -> None:
    """Print a table for each interface, without lines, so that a terminal of 50 columns cuts no number."""
    print(fitted(f"{group[0].case.images}, delays in ms"))
    for result in group:
        table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
        for name in ("stage", "p50", "p95", "max"):
            table.add_column(name, justify="left" if name == "stage" else "right", no_wrap=True)
        for row in narrow_rows(result):
            table.add_row(*row)
        print(fitted(str(result.case.interface)))
        _print_whole(table)


def _fits(table: Table) -> bool:
    """Whether a table fits where stdout goes. A pipe or a file has no width, unless COLUMNS gives it one."""
    console = Console()
    has_width = console.is_terminal or bool(os.environ.get("COLUMNS"))
    return not has_width or _width(table) <= console.width


def _width(table: Table) -> int:
    console = Console(width=1000)
    return console.measure(table).maximum


def _print_whole(table: Table) -> None:
    """Print a table in its own width: rich would cut its cells to what it takes for the width of the terminal."""
    Console(highlight=False, width=_width(table)).print(table)
