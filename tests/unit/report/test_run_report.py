"""A run's summary and page: what was not measured is called so, and never shown as a number."""

from dataclasses import replace
from typing import Any

import pytest

from common.camera.base import CameraHealth, CameraState
from common.camera.image_numbers import ImageNumbers
from common.diagnostic import Diagnostic, Severity
from common.frame import FrameFault
from common.protocol.message import BoardCounts, DropReason
from phone_host.accounts.delays import DelayStatistics, Series, SinkAccount
from phone_host.accounts.link_account import Absence, LinkAccount, LinkTally, SessionAccount, away_of, away_words
from phone_host.diagnostics.headline import headline
from phone_host.diagnostics.image_judge import ImageTrust
from phone_host.diagnostics.image_numbers import ImageEvidence
from phone_host.diagnostics.image_rules import ImageFigures
from phone_host.diagnostics.run_rules import nothing_whole
from phone_host.diagnostics.run_snapshot import Unused, unused
from phone_host.model import PairCounts, Side, TimeOffset, Unwritten
from phone_host.report.report_page import delay_series
from phone_host.report.run_json import age_bound, build
from phone_host.report.run_page import run_page
from phone_host.report.summary import phase_lines, summary
from phone_host.sync.clock import ClockEstimate
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.phase import Aligning, Alignment, Phase
from phone_host.sync.quarantine import Disbelief, Suspects
from phone_host.sync.stills import PairedBy, WhyOrder
from tests.support.run_snapshots import MS, run
from tests.support.samples import LEDGER


@pytest.mark.parametrize("pairs", [0, 1, 30])
def test_what_was_not_measured_is_no_number(pairs: int) -> None:
    """Neither the summary nor the page of a run of no, one or many pairs shows `nan` or `inf`."""
    text = summary(run(pairs)) + run_page(run(pairs), None, Side.LEFT, ())
    assert not any(word in text for word in (" nan", "(nan", ">nan", " inf ", "nan<"))


def test_a_rate_needs_two_pairs() -> None:
    """One pair has no rate; 31 pairs 50 ms apart are 20 a second."""
    assert summary(run(1)).splitlines()[1] == "1 pair, ended: stopped"
    assert summary(run(31)).splitlines()[1] == "31 pairs in 1.5 s (20.0 /s), ended: stopped"


def test_a_drift_that_takes_hours_is_not_told() -> None:
    """A turn of 50 ms at 13.9 ppm takes 3597 s and is told; at 13.8 ppm it takes 3623 s and is not."""
    told, untold = (
        phase_lines(Phase(time_skew_ns=0.0, period_ns=50 * MS, drift=drift, first_ns=0), None)[0]
        for drift in (13.9e-6, -13.8e-6)
    )
    assert told.endswith("one full turn in 3597 s")
    assert untold == "phase: the board exposes 0.0 of 50.0 ms after the host"


def test_what_could_not_be_written_is_told_without_zeros() -> None:
    """Only what is missing is listed: lines, pairs or both."""
    ends = [
        summary(replace(run(31), unwritten=Unwritten(lines, pairs, "disk full"))).splitlines()[-1]
        for lines, pairs in ((0, 13), (1, 0), (4, 6))
    ]
    assert ends == [
        "not written: 13 pairs (disk full)",
        "not written: 1 line of delays.jsonl (disk full)",
        "not written: 4 lines of delays.jsonl, 6 pairs (disk full)",
    ]


def test_the_phase_is_told_with_its_side() -> None:
    """A board that exposes 5 ms earlier is shown as before the host, and a phase without drift has no beat."""
    assert phase_lines(Phase(time_skew_ns=-5.0 * MS, period_ns=50 * MS, drift=0.0, first_ns=0), None) == [
        "phase: the board exposes 5.0 of 50.0 ms before the host"
    ]
    assert (
        "5.0 of 50.0 ms after the host, drifts by +100.0 ppm, one full turn in 500 s"
        in phase_lines(Phase(time_skew_ns=5.0 * MS, period_ns=50 * MS, drift=1e-4, first_ns=0), None)[0]
    )


def test_a_late_frame_has_one_reason() -> None:
    """A lost frame that came after all stays lost and is not stale, so that sent equals received plus lost, to the frame."""
    sent = BoardCounts(grabbed=10, sent=10)
    account = SessionAccount("s", BoardCounts(), sent, received=7, lost=3, late=2, duplicate=1)
    seen = replace(run(7), link=LinkAccount([account]))
    told: Any = build(seen)["sessions"]
    assert told[0]["sent"] == told[0]["received"] + told[0]["lost"]
    assert (told[0]["lost_late"], told[0]["stale"]) == (2, {"duplicate": 1, "old_session": 0})
    found = {item.place: item.count for item in unused(seen)}
    assert found == {
        "frames lost on the link": 1,
        "frames that came too late over another link": 2,
        "frames delivered again": 1,
    }


def test_only_stamps_that_nobody_knows_are_called_unmeasured() -> None:
    """Cameras whose stamps are exposure times by definition need no measurement. For others the report says how to measure. A measured offset is shown."""
    told = "cameras' stamps"
    assert f"{told} agree to" in summary(run(31))
    assert told not in summary(replace(run(31), stamps_exact=True))
    measured = TimeOffset(offset_ns=3 * MS, uncertainty_ns=MS // 2)
    assert f"{told} differ by +3.00 +-0.50 ms" in summary(replace(run(31), time_offset=measured))


def test_what_was_not_believed_is_told_everywhere() -> None:
    """JSON, summary and page name a step with its suspect frames, frames that were not believed, and spoiled images. Each raises a doubt."""
    account = SessionAccount("s", BoardCounts(), BoardCounts(), received=40)
    account.disbelieved[Disbelief.FUTURE] = 3
    account.disbelieved[Disbelief.CREDIT] = 2
    link = LinkAccount([account], clock_doubts=2, clock_steps=1)
    link.suspects.append(Suspects(session="s", first=11, last=17, frames=7))
    seen = replace(run(30), link=link, own_future=4, spoiled_images=(("too_large", 5),))
    told: Any = build(seen)
    assert told["clock"]["steps"] == 1
    assert told["clock"]["doubts"] == 2
    assert told["clock"]["suspects"] == [{"session": "s", "first": 11, "last": 17, "frames": 7}]
    dropped = {"from_the_future": 3, "beyond_credit": 2, "own_from_the_future": 4}
    assert told["frames"]["disbelieved"] == dropped
    assert {item["doubt"] for item in told["warnings"]} == {"clock_stepped", "disbelieved", "spoiled_images"}
    for text in (summary(seen), run_page(seen, None, Side.LEFT, ())):
        for words in ("jumped once", "7 pairs", "from the future", "beyond credit", "too large"):
            assert words in text


def test_everything_that_a_run_knows_is_told() -> None:
    """JSON and summary show clock, phase, alignment, links, losses and camera events with the given numbers."""
    estimate = ClockEstimate(
        reference_ns=0,
        offset_ns=5_000,
        skew=2e-6,
        skew_uncertainty=1e-7,
        uncertainty_ns=30_000,
        round_trip_ns=400_000,
        low_ns=-200_000,
        high_ns=210_000,
        skew_low=-1e-4,
        skew_high=1e-4,
    )
    links = (LinkTally("ipc", frames=20, bytes=900, carried=1), LinkTally("tcp", frames=11, carried=2, lost=1))
    links[0].age.add(7 * MS)
    account = SessionAccount("s", BoardCounts(), BoardCounts(40, 35, ((DropReason.REPLACED, 5),)), received=31)
    health = CameraHealth(
        CameraState.RUNNING, missed=1, stalls=2, failures=3, unplugged=4, returned=5, distrusted_stamps=6,
        refused_controls=7, faults=((FrameFault.NO_END, 8),),
    )  # fmt: skip
    seen = replace(
        run(31),
        estimate=estimate,
        link=LinkAccount([account], links=links, switches=2),
        phase=Phase(time_skew_ns=5.0 * MS, period_ns=50 * MS, drift=1e-4, first_ns=0),
        alignment=Alignment(
            state=Aligning.ALIGNED, words="within 1 ms", corrections=3, before_ns=9.0 * MS, after_ns=0.5 * MS
        ),
        camera=health,
        unwritten=Unwritten(4, 6, "disk full"),
        undecodable=2,
        failed_pairs=((Diagnostic("this pair_1 lies on its side", "turn it", Severity.FAIL), 2),),
        counts=PairCounts(received=31, paired=40, taken=33, dropped=3, board_orphans=(("no_partner", 9),)),
    )
    told: Any = build(seen)
    assert told["clock"]["known"]
    assert (told["clock"]["offset_ns"], told["clock"]["skew_ppm"], told["clock"]["uncertainty_us"]) == (
        5_000,
        2.0,
        30.0,
    )
    assert told["clock"]["round_trip_us"] == 400.0
    assert told["clock"]["uncertainty_at_pairs_us"]["p50"] == pytest.approx(0.05)
    assert told["phase"]["beat_s"] == pytest.approx(500.0)  # 50 ms at 100 ppm
    assert told["phase"]["alignment"] == {
        "state": "aligned", "words": "within 1 ms", "corrections": 3, "before_ms": 9.0, "after_ms": 0.5,
    }  # fmt: skip
    assert [link["link"] for link in told["links"]] == ["ipc", "tcp"]
    assert told["links"][0]["age_ms"]["p50"] == 7.0
    text = summary(seen)
    for words in (
        "+-30 us", "skew +2.0 ppm", "alignment: aligned", "unplugged 4 times", "stalled twice", "failed 3 times",
        "back 5 times", "1 frame missed", "6 stamps not believed", "7 controls refused", "8 frames no end",
        "5 frames dropped on the board: replaced", "9 board frames without partner: no partner",
        "3 pairs dropped from a full FIFO", "2 pairs that could not be processed: this pair_1 lies on its side",
        "4 pairs still waiting at the end", "4 lines of delays.jsonl, 6 pairs (disk full)",
    ):  # fmt: skip
        assert words in text
    [head, ipc, tcp] = text[text.index("link  ") :].splitlines()[:3]
    assert head.split()[:4] == ["link", "frames", "took", "over"]
    assert ipc.split() == ["ipc", "20", "1", "0", "7.000", "7.000"]
    assert tcp.split() == ["tcp", "11", "2", "1", "-", "-"]


@pytest.mark.parametrize(
    ("latency_ms", "stated_ms", "offset", "words"),
    [
        (None, None, TimeOffset(), "latency is unknown"),
        (None, None, TimeOffset(3 * MS, MS), "offset includes its latency"),
        (90, None, TimeOffset(), "arrival times minus 90 ms; images"),
        (90, 20, TimeOffset(), "arrival times minus 90 ms, known to +-24.0 ms; images"),
    ],
)
def test_stamps_that_are_arrivals_say_so(
    latency_ms: int | None, stated_ms: int | None, offset: TimeOffset, words: str
) -> None:
    """If the own camera's stamps are arrivals, the summary says what is known of its latency; JSON holds jitter and what remains."""
    latency_ns, stated_ns = (None if value is None else value * MS for value in (latency_ms, stated_ms))
    health = CameraHealth(jitter_ns=4 * MS, latency_ns=latency_ns, latency_uncertainty_ns=stated_ns)
    seen = replace(run(31), camera=health, time_offset=offset)
    assert words in summary(seen)
    assert "up to 4.0 ms late" in summary(seen)
    told: Any = build(seen)
    camera = told["host_frames"]["camera"]
    assert (camera["latency_ms"], camera["jitter_ms"]) == (latency_ms, 4.0)
    assert camera["stamp_uncertainty_ms"] == (None if stated_ms is None else 24.0)


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("2:drop-oldest", "2 frame period(s)"),
        ("3:drop-newest", "3 processing time(s): pairs that are in stay in, here 30.0 ms"),
        ("4:block", "4 processing time(s): a pair is fetched when a place is free, here 40.0 ms"),
    ],
)
def test_the_age_bound_follows_from_the_policy(text: str, bound: str) -> None:
    """Processing takes 10 ms. In a FIFO that keeps its pairs they wait for multiples of that; in one that drops the oldest, for frame periods."""
    assert age_bound(replace(run(31), fifo=FifoSettings.parse(text))).startswith(bound)


def test_what_was_not_used_is_told_once_each() -> None:
    """In a run with losses everywhere JSON, summary and page each show every place and reason once, with its count."""
    account = SessionAccount(
        "s",
        BoardCounts(),
        BoardCounts(9, 7, ((DropReason.REPLACED, 2),)),
        received=3,
        lost=3,
        late=1,
        duplicate=4,
        old_session=5,
    )
    seen = replace(
        run(2),
        link=LinkAccount([account], garbage=6, no_clock=7),
        counts=PairCounts(paired=20, dropped=8, board_orphans=(("no_partner", 9),), host_orphans=(("too_late", 10),)),
        undecodable=3, spoiled_images=(("corrupt", 1),), failed_pairs=((Diagnostic("other sizes", "calibrate", Severity.FAIL), 2),),
        spoiled=12, skipped=13,
        sinks=(SinkAccount(name="pairs", written=1, dropped=14, failed=15, waiting=0, delay=Series().spread()),),
    )  # fmt: skip
    counts = {(item.place, item.reason): item.count for item in unused(seen)}
    assert sorted(counts.values()) == [1, 1, 2, 2, 2, 4, 5, 6, 7, 7, 8, 9, 10, 12, 13, 14, 15]
    told: Any = build(seen)["unused"]
    assert {(item["place"], item["reason"]): item["count"] for item in told} == counts
    assert len(told) == len(counts)
    for item in unused(seen):
        assert item.told in summary(seen)
        assert item.words in run_page(seen, None, Side.LEFT, ())
    assert not unused(replace(run(2), ended="running"))


@pytest.mark.parametrize(
    ("place", "reason", "count", "told"),
    [
        ("frames dropped on the board", "replaced", 1, "1 frame dropped on the board: replaced"),
        ("frames dropped on the board", "replaced", 2, "2 frames dropped on the board: replaced"),
        ("host frames that were not whole images", "", 1, "1 host frame that was no whole image"),
        ("board frames without partner", "too_late", 1, "1 board frame without partner: too late"),
        ("packets of something else", "", 1, "1 packet of something else"),
    ],
)
def test_one_that_was_not_used_is_singular(place: str, reason: str, count: int, told: str) -> None:
    """The number and the noun of what was not used agree."""
    assert Unused(place, reason, count).told == told


def test_a_frame_that_waited_when_the_host_came_belongs_to_the_account() -> None:
    """The board had grabbed 8 and sent 5, dropped 2, so one waited; it was sent since: nothing waits, and never -1."""
    before = BoardCounts(grabbed=8, sent=5, dropped=((DropReason.NO_HOST, 2),))
    for latest, waiting in ((BoardCounts(8, 6, before.dropped), 0), (BoardCounts(8, 5, before.dropped), 1)):
        account = SessionAccount("s", before, latest, received=latest.sent - 5)
        told: Any = build(replace(run(1), link=LinkAccount([account])))["sessions"]
        assert told[0]["waiting"] == waiting
        assert told[0]["grabbed"] == told[0]["sent"] + sum(told[0]["dropped"].values()) + waiting


def test_what_has_come_was_sent_even_if_the_last_account_has_not() -> None:
    """The board's newest account counts 48 frames, 49 have come and 1 is lost: 50 were sent, and never fewer than arrived."""
    account = SessionAccount("s", BoardCounts(), BoardCounts(51, 48, ((DropReason.REPLACED, 3),)), received=49, lost=1)
    told: Any = build(replace(run(1), link=LinkAccount([account])))["sessions"]
    assert (told[0]["sent"], told[0]["grabbed"], told[0]["waiting"]) == (50, 53, 0)


def test_stills_have_no_figures_from_an_exposure() -> None:
    """Capture, end-to-end, time skew and age are null in the report, which says why, and no row or plot shows them."""
    delays = DelayStatistics()
    for _ in range(12):
        delays.add(LEDGER, timeless=True)
    link = LinkAccount([], links=(LinkTally("tcp"), LinkTally("serial")))
    link.links[0].age.add(MS)
    seen = replace(run(12), delays=delays, timeless=True, link=link, period_ns=0)
    report: Any = build(seen)
    assert [name for name, value in report["delays_ms"].items() if value is None] == ["capture", "end_to_end"]
    assert report["delays_ms"]["processing"]["count"] == 12
    assert (report["time_skew_ms"], report["links"][0]["age_ms"], report["image_motion_px_per_s"]) == (None, None, None)
    assert set(report["not_measured"]) == {"capture", "end_to_end", "time_skew"}
    lines = summary(seen).splitlines()
    assert not any(line.startswith(("capture", "end-to-end")) for line in lines)
    starved = DelayStatistics()
    starved.add(replace(LEDGER, queued_ns=3 * MS), timeless=True)
    assert not any(line.startswith("starvation") for line in lines)
    assert any(
        line.startswith("starvation") for line in summary(replace(seen, delays=starved, processed=1)).splitlines()
    )
    assert any(line.startswith("processing") for line in lines)
    page = run_page(seen, None, Side.LEFT, [LEDGER] * 12)
    assert "Time skew of the pairs" not in page
    assert "<dt>capture" not in page
    assert "<dt>end-to-end" not in page
    assert next(quantity.label for quantity in delay_series([LEDGER], timeless=True).delays) == "outbox"


def test_an_absence_of_the_board_is_told_and_counts_for_nothing() -> None:
    """Away from second 5 to 11 of a run of 12 pairs at 20 a second: the rate is 20, and summary, page and report name the absence."""
    start_ns = 1000 * MS
    absences = (Absence(start_ns + 5000 * MS, start_ns + 11_000 * MS),)
    seen = replace(run(12), away=away_of(absences, start_ns, 0), gaps=1, gap_s=6.1, seconds=0.5)
    assert seen.pairs_per_second == pytest.approx(20.0)
    words = "the board went away once and came back (for 6.0 s from 5 s on); rates leave this time out"
    assert away_words(seen.away) == words
    assert words in summary(seen)
    assert words[1:] in run_page(seen, None, Side.LEFT, ())
    report: Any = build(seen)
    assert report["board_away"] == [{"at_s": 5.0, "seconds": 6.0, "came_back": True}]
    assert "6.1 s around the board's absence are not counted" in report["regime"]["sentence"]


def test_a_board_that_is_still_away_is_told() -> None:
    """Its absence lasts until now."""
    (away,) = away_of((Absence(4000 * MS),), 1000 * MS, 6500 * MS)
    assert (away.at_s, away.seconds, away.is_over) == (3.0, 2.5, False)
    assert "has not come back" in away_words((away,))


def test_a_run_without_one_whole_image_says_so() -> None:
    """Ten spoiled images and no pair are a doubt that names the side; with a pair, or with fewer, they are not."""
    spoiled = BoardCounts(grabbed=10, sent=0, dropped=((DropReason.SPOILED, 10),))
    link = LinkAccount([SessionAccount("s", BoardCounts(), spoiled)])
    assert "because images are not whole (10 from the board's camera)" in summary(replace(run(0), link=link))
    assert nothing_whole(replace(run(0), link=link))
    assert not nothing_whole(replace(run(1), link=link))
    assert not nothing_whole(replace(run(0), spoiled=9))


def test_images_without_a_partner_do_not_make_the_depth_of_the_pairs_doubtful() -> None:
    """Image 7 of the board has no partner, and every pair has one number: the headline answers that depth is right, then names it; the doubt is listed."""
    figures = ImageFigures(density=0.9, consistency=0.9, vertical_px=0.2)
    trust = ImageTrust(judged=5, wants_depth=True, has_depth=True, start=figures, now=figures)
    board, own = (ImageNumbers(count=count, first=0, last=23) for count in (24, 23))
    by_number = ImageEvidence(
        paired_by=PairedBy.NUMBER, board=board, own=own, pairs=23, board_alone=1, board_numbers=(7,)
    )
    seen = replace(run(30), images=trust, replayed=by_number, timeless=True, period_ns=0)
    said = headline(seen)
    assert said.sentence.startswith("Depth looks right: 90% of the pixels have depth")
    assert "Image 7 of the board has no partner of the same number: the board shows 24 images" in said.sentence
    report: Any = build(seen)
    assert [warning["doubt"] for warning in report["warnings"]] == ["image_numbers"]
    by_order = replace(by_number, paired_by=PairedBy.ORDER, why_order=WhyOrder.UNKNOWN)
    said = headline(replace(seen, replayed=by_order))
    assert said.sentence.startswith("Depth may be wrong: the board shows 24 images, 0 to 23, this machine 23 images")
