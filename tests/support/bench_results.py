"""Results of the delay benchmark with known delays and counts, for tests of its report."""

from dataclasses import replace

from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes
from common.protocol.message import BoardCounts
from phone_host.accounts.link_account import LinkAccount, SessionAccount
from phone_host.bench.analysis import Analysis, analyse
from phone_host.bench.cases import Case, Interface, Size
from phone_host.bench.report import Conditions
from phone_host.bench.runs import CaseResult, after_warm_up
from phone_host.model import PairCounts
from phone_host.subprocesses.board_process import BoardAccount
from phone_host.sync.fifo import FifoSettings
from tests.support.samples import LEDGER

UNDER = Conditions(
    machine="a machine",
    date="a date",
    matcher="sgbm",
    fifo=FifoSettings(),
    seconds=4.0,
    not_run=((Interface("rfcomm"), "no radio"),),
)


def ledger(number: int, period_ns: int = 33_000_000) -> PairLedger:
    """A pair whose delays are 1, 2, 3, 4, 5 and 15 ms."""
    exposed_ns = number * period_ns
    marks = BoardMarks(exposed_ns=exposed_ns, grabbed_ns=exposed_ns + 1_000_000, sent_ns=exposed_ns + 3_000_000)
    return replace(
        LEDGER,
        sequence=number,
        host_sequence=number,
        bytes=50_000,
        board=marks,
        received_ns=exposed_ns + 6_000_000,
        paired_ns=exposed_ns + 10_000_000,
        queued_ns=exposed_ns + 10_000_000,
        dequeued_ns=exposed_ns + 15_000_000,
        done_ns=exposed_ns + 30_000_000,
        previous_done_ns=exposed_ns + 9_000_000,
        stages=StageTimes(decode=1_000_000, match=14_000_000),
        time_skew_ns=-5_000,
        uncertainty_ns=40_000,
        host=HostMarks(exposed_ns=exposed_ns + 5_000, grabbed_ns=exposed_ns + 1_000_000),
    )


def result(pairs: int = 100, link: str = "tcp") -> CaseResult:
    """A run of 108 frames: 3 dropped on the board, 1 under way, 2 lost, 1 orphaned; the FIFO dropped one pair."""
    counts = BoardCounts()
    account = SessionAccount("s", counts, counts, received=102, lost=2)
    host = PairCounts(received=102, paired=101, dropped=1, taken=100, board_orphans=(("no_partner", 1),))
    kept, measured_s = after_warm_up([ledger(number) for number in range(pairs)])
    board = BoardAccount(108, 105, (("no_host", 3),))
    case = Case(interface=Interface(link), size=Size(640, 480), quality_percent=80, rate_hz=30)
    return CaseResult(
        case=case,
        ledgers=kept,
        measured_s=measured_s,
        uncertainty_ns=45e3,
        bound_ns=70e3,
        board=board,
        link=LinkAccount([account]),
        counts=host,
        processed=100,
        undecodable=0,
    )


def analysed(*results: CaseResult) -> Analysis:
    return analyse(results, UNDER.fifo)


def slower(link: str, factor: float) -> CaseResult:
    """The usual run over another link; there, the board's frames are exposed earlier, so that everything takes longer by a factor."""
    usual = result(link=link)
    early_ns = round(30_000_000 * (factor - 1))
    ledgers = tuple(
        replace(one, board=replace(one.board, exposed_ns=one.board.exposed_ns - early_ns)) for one in usual.ledgers
    )
    return replace(usual, ledgers=ledgers)
