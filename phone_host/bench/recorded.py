"""A recorded run as the benchmark's measurement: what its pairs took then, from which other settings are predicted.

What a recording does not tell is not guessed, but for one thing: a board frame whose number is missing counts as replaced by a newer one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from common.ledger import PairLedger
from common.protocol.message import BoardCounts, Pacing
from common.recording.recorded import Recorded
from common.recording.stamps import pairs_of_two
from common.strict_json import strict_json
from common.words import counted
from phone_host.accounts.link_account import LinkAccount, SessionAccount
from phone_host.bench.cases import BOARD_SETS, Case, Interface, Size
from phone_host.bench.runs import WARM_UP_S, CaseResult, after_warm_up
from phone_host.model import PairCounts
from phone_host.recording.clock_messages import told_clocks
from phone_host.recording.playback import Playback
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
    settings = _settings(recorded)
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


def _settings(recorded: Recorded) -> dict[str, str]:
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
