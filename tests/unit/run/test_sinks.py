"""Sinks: a slow one never delays a pair, each drop is counted, a waiting one loses nothing; and what is on disk at the end."""

import json
import os
import resource
import signal
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phone_host.model import RectifiedPair, Result
from phone_host.output.axes import Axes
from phone_host.output.listed import LIST
from phone_host.output.move_up import STAGED
from phone_host.run.file_sink import FileSink
from phone_host.run.sinks import FunctionSink, SinkQueue
from tests.support.point_files import read_ply
from tests.support.results import result

PATIENCE_S = 60.0


class Gate:
    """Blocks a sink until it is opened."""

    def __init__(self) -> None:
        self.entered, self.opened, self.seen = threading.Event(), threading.Event(), list[int]()

    def take(self, number: int) -> None:
        """Wait, then record the number."""
        self.entered.set()
        assert self.opened.wait(PATIENCE_S)
        self.seen.append(number)


@pytest.fixture
def gate() -> Iterator[Gate]:
    """A gate that is opened at the end, even after a failure."""
    found = Gate()
    yield found
    found.opened.set()


def test_a_stuck_sink_drops_and_counts_and_holds_nobody_up(gate: Gate) -> None:
    """While a sink does nothing, a thousand results are offered without waiting: as many as its queue holds are kept, and the others are counted under its name."""
    queue = SinkQueue("stuck", gate.take, depth=3)
    taken = [queue.offer(number) for number in range(1000)]
    account = queue.account
    assert (account.name, account.written, account.dropped, account.waiting) == ("stuck", 0, 997, 3)
    assert taken == [True] * 3 + [False] * 997
    gate.opened.set()
    queue.finish()
    assert gate.seen == [0, 1, 2]
    assert (queue.account.written, queue.account.dropped, queue.account.waiting) == (3, 997, 0)


def test_a_waiting_sink_misses_nothing() -> None:
    """A sink that waits gets all of a thousand results in order, however fast they come and however short its queue is."""
    seen: list[int] = []
    queue = SinkQueue("waiting", seen.append, depth=1, waits=True)
    for number in range(1000):
        queue.await_place()
        assert queue.offer(number)
    queue.finish()
    assert seen == list(range(1000))
    assert queue.account.delay.count == 1000


def test_only_a_waiting_sink_makes_its_worker_wait(gate: Gate) -> None:
    """With a full queue `await_place` returns at once, unless the sink waits: then it returns when there is a place."""
    hasty, patient = SinkQueue("hasty", gate.take, depth=1), SinkQueue("patient", gate.take, depth=1, waits=True)
    hasty.offer(0)
    hasty.await_place()
    patient.offer(1)
    thread = threading.Thread(target=patient.await_place, daemon=True)
    thread.start()
    assert gate.entered.wait(PATIENCE_S)
    assert thread.is_alive()
    gate.opened.set()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()
    hasty.finish()
    patient.finish()


@given(st.integers(1, 4), st.lists(st.booleans(), max_size=60))
@settings(deadline=None, max_examples=40)
def test_what_is_offered_is_written_or_dropped(depth: int, pauses: list[bool]) -> None:
    """For any order of offers and pauses, offered = written + dropped at the end, and written results keep their order."""
    seen: list[int] = []
    queue = SinkQueue("any", seen.append, depth=depth)
    for number, pause in enumerate(pauses):
        queue.offer(number)
        if pause:
            os.sched_yield()
    queue.finish()
    assert queue.account.written + queue.account.dropped == len(pauses)
    assert len(seen) == queue.account.written
    assert seen == sorted(seen)


def test_a_sink_that_fails_is_told_and_takes_nothing_more() -> None:
    """An exception of a sink is its failure: from then on it drops, wakes whatever waits for a place, and ends."""

    def fail(_: Result) -> None:
        raise ZeroDivisionError

    sink = FunctionSink("failing", fail, depth=1, waits=True)
    for number in range(5):
        sink.await_place(number)
        sink.offer(result(number))
    sink.finish()
    assert isinstance(sink.failure, ZeroDivisionError)
    assert (sink.accounts[0].written, sink.accounts[0].dropped) == (0, 5)


def test_all_lines_and_every_third_pair_are_on_disk(tmp_path: Path) -> None:
    """Each of ten results has its line, every third has its folder with whole files, and the settings are beside them; all of it is listed as ours."""
    sink = FileSink(tmp_path, 3, waits=True, settings={"fifo": {"value": "1:block", "origin": "--fifo"}})
    for number in range(10):
        sink.await_place(number)
        sink.offer(result(number))
    sink.close({"pairs": 10})
    lines = [json.loads(line) for line in (tmp_path / "delays.jsonl").read_text().splitlines()]
    assert [line["sequence"] for line in lines] == list(range(10))
    assert {path.name for path in tmp_path.glob("pair-*")} == {f"pair-{number:06d}" for number in (0, 3, 6, 9)}
    assert {path.name for path in (tmp_path / "pair-000003").iterdir()} == {"left.png", "right.png", "disparity.pfm"}
    assert json.loads((tmp_path / "settings.json").read_text()) == {"fifo": {"value": "1:block", "origin": "--fifo"}}
    listed = (tmp_path / LIST).read_text().splitlines()
    assert {"report.json", "delays.jsonl", "settings.json", "pair-000009"} <= set(listed)
    assert sink.complete


def test_a_pair_whose_name_somebody_has_taken_is_counted_and_the_run_goes_on(tmp_path: Path) -> None:
    """Somebody's folder in the place of one pair's costs only this pair: the half-made folder is removed, and that person's file stays."""
    sink = FileSink(tmp_path, 1, waits=True)
    (tmp_path / "pair-000001").mkdir()
    (tmp_path / "pair-000001" / "mine").write_text("mine")
    for number in range(3):
        sink.await_place(number)
        sink.offer(result(number))
    sink.close({})
    assert (sink.unwritten.pairs, sink.complete) == (1, False)
    by_name = {account.name: (account.written, account.failed) for account in sink.accounts}
    assert by_name == {"lines": (3, 0), "pairs": (2, 1)}
    assert (tmp_path / "pair-000001" / "mine").read_text() == "mine"
    assert not list(tmp_path.glob("*.part"))
    assert (tmp_path / "pair-000002" / "left.png").exists()


def test_a_saved_pair_with_points_has_its_cloud_in_the_axes_asked_for_and_its_depth(tmp_path: Path) -> None:
    """The point 0.2 m below the optical axis and 1.5 m ahead is written as y = -0.2, z = -1.5 with y up; depth.png holds 1500 mm."""
    sink = FileSink(tmp_path, 1, waits=True, axes=Axes.Y_UP)
    small = result(0)
    height, width = small.processed.pair.left.shape[:2]
    cloud = np.full((height, width, 3), (0.1, 0.2, 1.5), np.float32)
    sink.await_place(0)
    sink.offer(replace(small, processed=replace(small.processed, cloud=cloud)))
    sink.close({})
    folder = tmp_path / "pair-000000"
    expected = np.array([0.1, -0.2, -1.5], np.float32)
    np.testing.assert_array_equal(np.unique(read_ply(folder / "cloud.ply").points_m, axis=0), [expected])
    depth = np.asarray(cv2.imread(str(folder / "depth.png"), cv2.IMREAD_UNCHANGED))
    assert depth.dtype == np.uint16
    assert np.unique(depth).tolist() == [1500]


def test_a_disk_slower_than_the_pairs_costs_pairs_and_no_line(tmp_path: Path) -> None:
    """Of 30 large pairs that come at once some are dropped, counted under the sink that saves them; each still has its line."""
    noise = np.random.default_rng(1).integers(0, 256, (1200, 1600), np.uint8)
    sink = FileSink(tmp_path, 1)
    for number in range(30):
        small = result(number)
        sink.offer(replace(small, processed=replace(small.processed, pair=RectifiedPair(noise, noise))))
    sink.close({})
    assert len((tmp_path / "delays.jsonl").read_text().splitlines()) == 30
    by_name = {account.name: account for account in sink.accounts}
    assert by_name["pairs"].dropped > 0
    assert by_name["pairs"].written == len(list(tmp_path.glob("pair-*"))) == 30 - by_name["pairs"].dropped
    assert (by_name["lines"].dropped, sink.complete) == (0, True)


def test_a_full_disk_is_told_once_and_counted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """If no file may grow, nothing is written: lines wait, pairs are counted as failed, each problem is one line in the log, and the folder is unlocked."""
    sink = FileSink(tmp_path, 1, waits=True)
    noise = np.random.default_rng(1).integers(0, 256, (100, 100), np.uint8)
    large = replace(result(0).processed, pair=RectifiedPair(noise, noise))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, hard))  # the list of names still fits
    try:
        for number in range(3):
            sink.await_place(number)
            sink.offer(replace(result(number), processed=large))
        sink.finish()
        assert sink.unwritten.lines == 3
        assert sink.unwritten.pairs == 3
        assert {account.name: account.failed for account in sink.accounts} == {"lines": 0, "pairs": 3}
        sink.close({"pairs": "x" * 300})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    assert not sink.complete
    told = [record.getMessage() for record in caplog.records if "results_not_written" in record.getMessage()]
    assert sorted(text.partition("what=")[2].split()[0] for text in told) == ["lines", "pairs", "report.json"]
    FileSink(tmp_path, 0).close({})  # nobody has it locked any more


def test_a_run_that_is_not_whole_replaces_no_earlier_one(tmp_path: Path) -> None:
    """Of two pairs the second has no room: the earlier results stay, the last line names them and where the first pair lies; the next whole run replaces all."""
    first = FileSink(tmp_path, 1, waits=True)
    first.offer(result(0))
    first.close({"number": 1})
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    sink = FileSink(tmp_path, 1, waits=True)
    sink.offer(result(0))
    sink.finish()
    noise = np.random.default_rng(1).integers(0, 256, (100, 100), np.uint8)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, hard))
    try:
        sink.offer(replace(result(1), processed=replace(result(1).processed, pair=RectifiedPair(noise, noise))))
        sink.close({"number": 2})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, ignored)
    assert not sink.complete
    partial = tmp_path / "partial-run"
    assert sink.missing.endswith(f"the earlier results stay in {tmp_path}, and what could be written is in {partial}")
    assert {path: path.read_bytes() for path in before if path.name != LIST} == {
        path: content for path, content in before.items() if path.name != LIST
    }
    assert (partial / "pair-000000").is_dir()
    FileSink(tmp_path, 0).close({"number": 3})
    assert sorted(path.name for path in tmp_path.iterdir()) == [LIST, "delays.jsonl", "report.json"]


@pytest.mark.parametrize("is_earlier", [True, False])
def test_a_run_without_a_pair_replaces_no_earlier_one(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, *, is_earlier: bool
) -> None:
    """If no board came, an earlier report stays, and a line in the log says so; in a new folder the report says what happened."""
    if is_earlier:
        FileSink(tmp_path, 0).close({"number": 1})
    sink = FileSink(tmp_path, 0)
    sink.close({"number": 2}, replaces_earlier=False)
    assert ('"number": 1' in (tmp_path / "report.json").read_text()) == is_earlier
    assert ("earlier_results_stay" in caplog.text) == is_earlier
    assert sink.complete
    assert not (tmp_path / STAGED).exists()


def test_a_page_that_has_no_room_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """If only index.html does not fit, the one line names it, the run counts as incomplete, and the other files are there."""
    sink = FileSink(tmp_path, 0)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, hard))
    try:
        sink.close({"pairs": 0}, "<p>" * 100, "{}")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    assert not sink.complete
    assert sink.missing == "index.html (File too large)"
    assert (tmp_path / "report.json").is_file()
    assert (tmp_path / "cameras.json").read_text() == "{}"
    (told,) = [record.getMessage() for record in caplog.records if "results_not_written" in record.getMessage()]
    assert "what=index.html" in told


def test_a_folder_that_cannot_be_begun_is_let_go(tmp_path: Path) -> None:
    """Settings that cannot be written, or are not JSON, leave no lock behind."""
    with pytest.raises(TypeError):
        FileSink(tmp_path, 1, settings={"camera": object()})
    FileSink(tmp_path, 1).close({})


def test_only_a_pair_that_is_due_waits_for_its_place(tmp_path: Path) -> None:
    """While the queue of pairs is full, a result that is not to be saved is still passed on at once."""
    sink = FileSink(tmp_path, 10, waits=True)
    noise = np.random.default_rng(1).integers(0, 256, (2400, 3200), np.uint8)
    for number in (0, 10):
        small = result(number)
        sink.offer(replace(small, processed=replace(small.processed, pair=RectifiedPair(noise, noise))))
    for number in range(11, 20):
        sink.await_place(number)
        sink.offer(result(number))
    by_name = {account.name: account for account in sink.accounts}
    assert by_name["pairs"].waiting > 0  # nine lines are faster than two large pairs
    sink.close({})
