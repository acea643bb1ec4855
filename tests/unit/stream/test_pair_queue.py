"""The meeting point of the host's threads: it accounts for everything, whichever thread is faster."""

import threading
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common import now
from common.frame import Frame
from common.ledger import BoardMarks
from common.protocol.message import CameraDescription, Pacing
from phone_host.model import BoardFrame, FramePair, PairCounts
from phone_host.stream.demand_clock import DemandClock
from phone_host.stream.pair_queue import PairQueue
from phone_host.sync.fifo import FifoSettings, Overflow
from tests.support.samples import CAMERA, FRAME, shot

MS = 1_000_000
PERIOD_NS = 33 * MS


def board_frame(sequence: int, exposed_ns: int, received_ns: int | None = None) -> BoardFrame:
    """A frame that the board exposed at this time on the host's clock."""
    marks = BoardMarks(exposed_ns=exposed_ns, grabbed_ns=exposed_ns, sent_ns=exposed_ns)
    message = replace(
        FRAME,
        sent_index=sequence,
        sequence=sequence,
        marks=marks,
    )
    return BoardFrame(
        message=message,
        link="tcp",
        marks=marks,
        received_ns=exposed_ns if received_ns is None else received_ns,
        offset_ns=0,
        uncertainty_ns=0,
    )


def host_frame(sequence: int, exposed_ns: int, payload: bytes = b"") -> Frame:
    """A frame of the host's camera."""
    return shot(sequence, exposed_ns, payload=payload)


def camera_of(period_ns: int, pacing: Pacing = Pacing.CLOCK) -> CameraDescription:
    """A board's camera with that period."""
    return replace(CAMERA, period_ns=period_ns, pacing=pacing)


def queue_of(depth: int = 1, overflow: Overflow = Overflow.DROP_OLDEST) -> PairQueue:
    """A queue after the start of a board session."""
    queue = PairQueue(FifoSettings(depth, overflow), None, PERIOD_NS)
    queue.begin(camera_of(PERIOD_NS))
    return queue


def check(counts: PairCounts) -> None:
    """Both laws of conservation, and the one for the host's own frames."""
    assert counts.received == counts.paired + sum(n for _, n in counts.board_orphans) + counts.held_board
    assert counts.host_frames == counts.paired + sum(n for _, n in counts.host_orphans) + counts.held_host
    assert counts.paired == counts.taken + counts.dropped + counts.waiting


@given(
    st.integers(1, 4),
    st.sampled_from(Overflow),
    st.lists(st.tuples(st.sampled_from("bhhbbttrBv"), st.integers(-1, 3)), max_size=60),
)
@settings(deadline=None, max_examples=100)
def test_account_holds_after_every_call(depth: int, overflow: Overflow, acts: list[tuple[str, int]]) -> None:
    """After any call, also with repeated, late and missing frames and with new sessions, every frame and pair is accounted for."""
    queue = queue_of(depth, overflow)
    start_ns = now.monotonic_ns()
    board = host = 0
    for act, step in acts:
        match act:
            case "b":
                board += step
                queue.add_board(board_frame(board, start_ns + board * PERIOD_NS))
            case "h":
                host += step
                queue.add_host(host_frame(host, start_ns + host * PERIOD_NS, b"x" * 100))
            case "t":
                queue.tick()
            case "v":
                queue.void()
            case "r":
                queue.change_period(PERIOD_NS * (2 + step))
            case _:
                queue.begin(camera_of(PERIOD_NS + step))
        counts = queue.counts
        check(counts)
        assert counts.waiting <= depth
        assert 0 <= queue.free_slots() <= depth
    queue.finish()
    check(queue.counts)
    assert queue.counts.held_board == queue.counts.held_host == 0
    while queue.take() is not None:
        check(queue.counts)
    assert queue.counts.waiting == 0


@pytest.mark.parametrize("side", ["board", "host"])
def test_tiny_frames_are_bounded_in_number(side: str) -> None:
    """Ten thousand frames without bytes find no partner: 4096 of each side are held, and the older ones are dropped with their reason."""
    queue = queue_of()
    start_ns = now.monotonic_ns()
    for number in range(10_000):
        if side == "board":
            queue.add_board(board_frame(number, start_ns + number))
        else:
            queue.add_host(host_frame(number, start_ns + number))
    counts = queue.counts
    check(counts)
    assert (counts.held_board if side == "board" else counts.held_host) == 4096
    assert dict(counts.board_orphans if side == "board" else counts.host_orphans) == {"evicted": 10_000 - 4096}


def test_no_frame_from_before_a_doubt_meets_one_from_after() -> None:
    """Frames of both sides that wait when the clock comes into doubt are dropped with their reason, and the next two are paired."""
    queue = queue_of()
    start_ns = now.monotonic_ns()
    queue.add_host(host_frame(0, start_ns))
    queue.void()
    queue.add_board(board_frame(0, start_ns))
    queue.void()
    queue.add_host(host_frame(1, start_ns))
    assert queue.counts.paired == 0
    assert dict(queue.counts.host_orphans) == {"clock_in_doubt": 1, "out_of_order": 1}
    assert dict(queue.counts.board_orphans) == {"clock_in_doubt": 1}
    queue.add_board(board_frame(1, start_ns + PERIOD_NS))
    queue.add_host(host_frame(2, start_ns + PERIOD_NS))
    assert queue.counts.paired == 1
    check(queue.counts)


def in_threads(*works: Callable[[], None]) -> Callable[[], None]:
    """Start each task in a thread of its own; the returned function waits for all of them and raises the first failure."""
    failures: list[BaseException] = []

    def guarded(work: Callable[[], None]) -> None:
        try:
            work()
        except BaseException as error:  # noqa: BLE001 - handed to the test's own thread
            failures.append(error)

    threads = [threading.Thread(target=guarded, args=(work,)) for work in works]
    for thread in threads:
        thread.start()

    def join() -> None:
        for thread in threads:
            thread.join()
        assert failures == []

    return join


@pytest.mark.parametrize("overflow", Overflow)
def test_account_holds_between_real_threads(overflow: Overflow) -> None:
    """Two threads feed, one takes, one reads the counts: these add up at every reading, and pairs come out in order, correct and once."""
    queue = queue_of(3, overflow)
    start_ns = now.monotonic_ns() + 3600 * 1000 * MS  # nothing is dropped for its age, however slow the threads are
    taken: list[FramePair] = []
    fed = threading.Event()
    of_board, of_host = ([i for i in range(400) if i % lost] for lost in (7, 11))  # each side loses some

    def feed_board() -> None:
        for i in of_board:
            queue.add_board(board_frame(i, start_ns + i * PERIOD_NS + 2 * MS))

    def feed_host() -> None:
        for i in of_host:
            queue.add_host(host_frame(i, start_ns + i * PERIOD_NS))

    def look() -> None:
        while not fed.is_set():
            check(queue.counts)
            queue.tick()

    feeders = in_threads(feed_board, feed_host)
    others = in_threads(lambda: taken.extend(iter(queue.take, None)), look)
    feeders()
    fed.set()
    queue.finish()
    others()
    check(queue.counts)
    assert queue.counts.paired == len(set(of_board) & set(of_host))
    assert queue.counts.taken == len(taken)
    numbers = [pair.board.message.sequence for pair in taken]
    assert numbers == sorted(set(numbers)) == [pair.host.sequence for pair in taken]
    for pair in taken:
        assert pair.time_skew_ns == 2 * MS
        assert pair.paired_ns <= pair.queued_ns


def test_host_frames_are_bounded_in_bytes() -> None:
    """The host's frames that wait for a slow link take at most 64 MB; the oldest ones are dropped, with that reason."""
    queue = queue_of()
    start_ns = now.monotonic_ns()
    payload = bytes(5 * 2**20)
    for i in range(20):
        queue.add_host(host_frame(i, start_ns + i * PERIOD_NS, payload))
        assert queue.counts.held_host * len(payload) <= 64 * 2**20
    assert queue.counts.held_host == 12  # floor(64 / 5)
    assert dict(queue.counts.host_orphans) == {"evicted": 8}
    queue.add_board(board_frame(19, start_ns + 19 * PERIOD_NS))
    assert queue.counts.paired == 1


def test_host_frames_wait_as_long_as_the_link_delays() -> None:
    """A host frame is held for two seconds at first, and for 10 s once a delay of 10 s has been measured."""
    queue = queue_of()
    now_ns = now.monotonic_ns()
    queue.add_host(host_frame(0, now_ns - 3000 * MS))
    assert dict(queue.counts.host_orphans) == {"no_partner": 1}
    queue.add_board(board_frame(0, now_ns - 10_000 * MS, now_ns))
    queue.add_host(host_frame(1, now_ns - 2900 * MS))
    assert queue.counts.held_host == 1


def test_a_link_that_becomes_slow_finds_the_partners_still_there() -> None:
    """After 300 frames without delay, one that takes 1.5 s is paired with the host frame of its own moment, not with a worse one that came later."""
    queue = queue_of()
    start_ns = now.monotonic_ns() - 300 * PERIOD_NS - 1500 * MS
    for i in range(300):
        exposed_ns = start_ns + i * PERIOD_NS
        queue.add_board(board_frame(i, exposed_ns, exposed_ns + MS))
        queue.add_host(host_frame(i, exposed_ns))
    slow_ns = now.monotonic_ns() - 1500 * MS
    queue.add_host(host_frame(300, slow_ns))
    queue.tick()
    queue.add_host(host_frame(301, slow_ns + PERIOD_NS // 2))
    queue.add_board(board_frame(300, slow_ns, now.monotonic_ns()))
    queue.finish()
    last = queue.take()
    assert last is not None
    assert (last.host.sequence, last.time_skew_ns) == (300, 0)


def test_a_new_session_orphans_what_the_old_one_left() -> None:
    """Board frames held from an earlier session end as orphans with that reason; the host's frames stay for the new one."""
    queue = queue_of()
    start_ns = now.monotonic_ns()
    queue.add_board(board_frame(5, start_ns + 5 * PERIOD_NS))
    queue.begin(camera_of(PERIOD_NS))
    assert queue.counts.held_board == 0
    assert dict(queue.counts.board_orphans) == {"stream_ended": 1}
    queue.add_host(host_frame(5, start_ns + 5 * PERIOD_NS))
    assert queue.counts.held_host == 1
    queue.begin(camera_of(PERIOD_NS))
    queue.add_board(board_frame(0, start_ns + 5 * PERIOD_NS))  # older than the last frame of the earlier session
    assert queue.counts.paired == 1


def test_own_frames_before_any_board_are_counted_not_kept() -> None:
    """Without a board nothing is held: the host's frames are orphans with that reason."""
    queue = PairQueue(FifoSettings(), None, PERIOD_NS)
    queue.add_host(host_frame(0, 0, bytes(100)))
    assert dict(queue.counts.host_orphans) == {"no_board": 1}
    assert queue.tolerance_ns == PERIOD_NS // 2


def test_places_held_by_frames_without_partner_are_not_free() -> None:
    """With blocking overflow a place that a held board frame will need is not granted again as credit."""
    queue = queue_of(2, Overflow.BLOCK)
    start_ns = now.monotonic_ns()
    assert queue.free_slots() == 2
    queue.add_board(board_frame(0, start_ns))
    assert queue.free_slots() == 1
    queue.add_host(host_frame(0, start_ns))
    assert queue.free_slots() == 1
    assert queue.take() is not None
    assert queue.free_slots() == 2


def test_the_end_releases_a_waiting_worker() -> None:
    """A worker that waits for a pair is released when there will be no more pairs."""
    queue = queue_of()
    ended: list[FramePair | None] = []
    worker = threading.Thread(target=lambda: ended.append(queue.take()))
    worker.start()
    queue.finish()
    worker.join(60)
    assert ended == [None]
    assert queue.take() is None


@pytest.mark.parametrize("offset_ns", [-11 * MS, 0, 14 * MS])
def test_a_time_offset_is_taken_out_before_pairing(offset_ns: int) -> None:
    """Two cameras whose stamps of one moment differ by a known time pair as if they agreed, and the board's own marks are unchanged."""
    queue = PairQueue(FifoSettings(1, Overflow.DROP_OLDEST), 5 * MS, PERIOD_NS, time_offset_ns=offset_ns)
    queue.begin(camera_of(PERIOD_NS))
    start_ns = now.monotonic_ns()
    queue.add_host(host_frame(0, start_ns + offset_ns))
    queue.add_board(board_frame(0, start_ns))
    pair = queue.take()
    assert pair is not None
    assert pair.time_skew_ns == 0
    assert pair.board.marks.exposed_ns == start_ns


def test_a_better_clock_estimate_moves_no_label() -> None:
    """Images shown on demand are paired by number, however far the clock's estimate moves between two of them."""
    demand = DemandClock(Pacing.DEMAND)
    queue = PairQueue(FifoSettings(9, Overflow.DROP_NEWEST), None, 2 * MS, demand=demand)
    queue.begin(camera_of(2 * MS, Pacing.DEMAND))
    start_ns = now.monotonic_ns()
    for number, offset_ns in enumerate((5 * MS, 0, -7 * MS, 3 * MS)):
        exposed_ns = start_ns + number * 2 * MS + offset_ns
        frame = replace(board_frame(number, exposed_ns), offset_ns=offset_ns)
        queue.add_board(frame)
        queue.add_host(host_frame(number, start_ns + 5 * MS + number * 2 * MS))
    assert queue.counts.paired == 4
    pairs = [queue.take() for _ in range(4)]
    assert [(pair.board.message.sequence, pair.host.sequence, pair.time_skew_ns) for pair in pairs if pair] == [
        (number, number, 0) for number in range(4)
    ]
    check(queue.counts)


def test_tolerance_and_patience_follow_the_boards_rate() -> None:
    """The tolerance is always half of the longer period; a frame that was too far from its neighbour is paired with it once the period is longer."""
    queue = queue_of()
    start_ns = now.monotonic_ns()
    assert queue.tolerance_ns == PERIOD_NS // 2
    queue.add_board(board_frame(0, start_ns + 30 * MS))
    queue.change_period(4 * PERIOD_NS)
    assert queue.tolerance_ns == 2 * PERIOD_NS
    assert queue.counts.held_board == 1  # it still waits
    queue.add_host(host_frame(0, start_ns + 40 * MS))
    assert queue.counts.paired == 1
    queue.change_period(PERIOD_NS)
    assert queue.tolerance_ns == PERIOD_NS // 2
    queue.add_board(board_frame(1, start_ns + 1000 * MS))
    queue.add_host(host_frame(1, start_ns + 1030 * MS))
    assert queue.counts.paired == 1
    check(queue.counts)


def test_a_tolerance_that_was_given_stays() -> None:
    """A tolerance that the user asked for does not follow the rate."""
    queue = PairQueue(FifoSettings(1, Overflow.DROP_OLDEST), 3 * MS, PERIOD_NS)
    queue.begin(camera_of(PERIOD_NS))
    queue.change_period(4 * PERIOD_NS)
    assert queue.tolerance_ns == 3 * MS
