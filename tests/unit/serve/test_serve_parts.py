"""The parts of the page's root: shelf, activities, steps and memory."""

import io
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.camera_identity import CameraIdentity
from common.diagnostic import Diagnostic, Severity
from common.doctor.finding import fail, ok, warn
from common.doctor.machine_checks import LOG_UNREADABLE
from common.errors import DataError, SettingsError, UnavailableError
from common.ledger import StageTimes
from common.peers import Peer
from phone_host.discovery.found import Found
from phone_host.doctor.camera_check.words import stored_finding
from phone_host.model import FramePair, PairCounts, Processed, RectifiedPair, Result, Side
from phone_host.model.capture import CaptureSource
from phone_host.output.axes import Axes
from phone_host.run.live_scan import LiveScan
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.tracking_words import Weakness
from phone_host.serve import check
from phone_host.serve.activities import Activities, Task
from phone_host.serve.find import board_choice, stranger
from phone_host.serve.memory import Memory
from phone_host.serve.point_answer import answered
from phone_host.serve.saved import keep_newest
from phone_host.serve.scanning import Scanned, Scanning, page_words
from phone_host.serve.shelf import PageSink, Shelf
from phone_host.serve.steps import steps
from phone_host.verbs.serve import Status, activity_text
from phone_host.web.source import Activity, PageState, ScanState, StepName, Surface
from tests.support.run_snapshots import run
from tests.support.samples import LEDGER


def _result(number: int, size: int = 8) -> Result:
    image = np.full((size, size), number % 256, np.uint8)
    pair = RectifiedPair(image, image)
    cloud = np.zeros((size, size, 3), np.float32)
    frames = FramePair.__new__(FramePair)  # no frame is looked at
    return Result(number, frames, Processed(pair, None, cloud, StageTimes()), LEDGER)


def test_the_shelf_numbers_all_results_and_keeps_the_newest() -> None:
    """Numbers grow by one over all runs; only the newest has its cloud; of many, the last 32 are kept, and of large ones fewer. What begins anew has none."""
    shelf = Shelf()
    assert shelf.newest() is None
    first, second = PageSink(shelf, None), PageSink(shelf, None)
    for number in range(30):
        first.offer(_result(number))
    for number in range(10):
        second.offer(_result(number))
    newest = shelf.newest()
    assert newest is not None
    assert (newest.newest.number, newest.newest.result.number) == (40, 9)
    assert newest.newest.result.processed.cloud is not None
    before = shelf.numbered(39)
    assert before is not None
    assert before.newest.result.processed.cloud is None
    assert shelf.numbered(9) is not None
    assert shelf.numbered(8) is None
    for number in range(3):
        second.offer(_result(number, 4000))
    assert shelf.numbered(39) is None
    shelf.clear()
    assert shelf.newest() is None
    second.offer(_result(0))
    assert shelf.numbered(44) is not None


def test_a_viewer_that_fails_is_told_no_more_and_ends_nothing() -> None:
    """Subscribers are told of each result until they leave or fail; the run's thread never sees the failure."""
    shelf, calls = Shelf(), []

    def broken() -> None:
        calls.append("broken")
        raise RuntimeError

    shelf.subscribe(broken)
    leave = shelf.subscribe(lambda: calls.append("sound"))
    sink = PageSink(shelf, None)
    sink.await_place(0)
    sink.offer(_result(0))
    sink.offer(_result(1))
    leave()
    sink.offer(_result(2))
    sink.finish()
    assert sorted(calls) == ["broken", "sound", "sound"]
    assert (sink.failure, sink.accounts) == (None, ())


def test_a_tap_without_depth_says_why() -> None:
    """No pair, a pair that is gone, and one without a core are told in words; nothing is measured."""
    shelf = Shelf()
    assert "no pair" in answered(shelf, [(1, 1)], None).words
    shelf.put(_result(0), None)
    assert "no longer in memory" in answered(shelf, [(1, 1), (2, 2)], 7).words
    without = answered(shelf, [(1, 1), (2, 2)], None)
    assert "no depth" in without.words
    assert (without.places_m, without.length_m) == ((None, None), None)


def test_snapshots_take_the_next_free_number(tmp_path: Path) -> None:
    """Each snapshot gets a folder of its own; without a pair, or where nothing can be written, the reason is told."""
    shelf, folder = Shelf(), tmp_path / "shots"
    with pytest.raises(DataError, match="no pair"):
        keep_newest(shelf, folder, Axes.CAMERA)
    shelf.put(_result(0), None)
    for name in ("pair-000000", "pair-000001"):
        assert keep_newest(shelf, folder, Axes.CAMERA).words.endswith(name)
        assert (folder / name / "left.png").exists()
    (tmp_path / "file").touch()
    with pytest.raises(UnavailableError):
        keep_newest(shelf, tmp_path / "file", Axes.CAMERA)


class _Watched:
    """Activities with what they tell."""

    def __init__(self) -> None:
        self.begun = self.changes = 0
        self.failures: list[Diagnostic] = []
        self.all = Activities(self._begin, self._change, self.failures.append)

    @property
    def now(self) -> str:
        """What goes on."""
        return self.all.now.value

    def _begin(self) -> None:
        self.begun += 1

    def _change(self) -> None:
        self.changes += 1


def test_one_activity_at_a_time_stopped_at_any_moment() -> None:
    """A second one is refused in words; stop ends the first, and then another may begin; after the close none may."""
    seen = _Watched()
    inside = threading.Event()

    def work(task: Task) -> None:
        inside.set()
        with task.held():
            while not task.stopped():
                threading.Event().wait(0.001)
        task.go_on()
        raise AssertionError

    assert seen.now == "idle"
    assert not seen.all.stop()
    assert seen.all.begin(Activity.RUNNING, work) is None
    assert inside.wait(60)
    assert seen.now == "running"
    refused = seen.all.begin(Activity.CHECKING, work)
    assert refused is not None
    assert refused.message == "a run is active"
    assert seen.all.stop(60)
    assert seen.now == "idle"
    assert (seen.begun, seen.failures) == (1, [])
    seen.all.close(60)
    late = seen.all.begin(Activity.RUNNING, work)
    assert late is not None
    assert "ending" in late.message


def test_what_waits_for_a_device_is_left_and_its_failure_concerns_nobody() -> None:
    """An activity that holds nothing is left to itself when it does not end; one that holds cameras is waited for."""
    seen, ends, holds = _Watched(), threading.Event(), threading.Event()

    def deaf(task: Task) -> None:
        del task
        ends.wait(60)
        raise ValueError("too late")

    assert seen.all.begin(Activity.ENROLLING, deaf) is None
    seen.all.stop(0.0)
    assert seen.now == "idle"

    def holding(task: Task) -> None:
        with task.held():
            holds.set()
            ends.wait(60)

    assert seen.all.begin(Activity.RUNNING, holding) is None
    assert holds.wait(60)
    seen.all.stop(0.0)
    assert seen.now == "ending"
    ends.set()
    seen.all.wait(60)
    assert seen.now == "idle"
    assert seen.failures == []


def test_a_failure_is_told_with_its_remedy() -> None:
    """An error of ours in its own words; a mistake of the program as such."""
    seen = _Watched()
    for error in (SettingsError("bad", "mend it"), KeyError("x")):

        def work(task: Task, error: Exception = error) -> None:
            del task
            raise error

        assert seen.all.begin(Activity.CHECKING, work) is None
        seen.all.wait(60)
    assert seen.failures[0] == Diagnostic("bad", "mend it", Severity.FAIL)
    assert "the program itself failed" in seen.failures[1].message


def test_the_steps_lead_from_nothing_to_a_run_and_a_scan() -> None:
    """Each step says what to do until it is done, then what it has come to; a board that wants its code is not done."""
    nothing = steps({})
    assert [step.name for step in nothing] == list(StepName)
    assert not any(step.done for step in nothing)
    both = {"link": "tcp://b:1", "camera": "v4l2:auto"}
    assert "board-agent pair" in steps(both, stranger="tcp://b:1")[0].words
    chosen = steps(both)
    assert [step.done for step in chosen] == [True, True, False, False, False, False]
    assert "calibrate first" in chosen[5].words
    ready = steps({**both, "calibration": "rig.yaml"}, checked="seen", pairs=2)
    assert [step.done for step in ready] == [True] * 5 + [False]
    assert ready[4].words == "the last run gave 2 pairs"
    assert "slowly move the cameras" in ready[5].words
    scanned = steps(both, scan="3 of 3 pairs are in the model", has_scan=True)[5]
    assert (scanned.done, scanned.words) == (True, "3 of 3 pairs are in the model")
    assert steps({**both, "rectified": "yes"}, is_running=True)[3].done
    assert steps(both, is_running=True)[4].words == "it runs"


def test_a_board_across_the_network_needs_its_code_once() -> None:
    """One on this machine never does; a stranger does; a board that was enrolled has its name."""
    peer = Peer(name="bone", key="k" * 40, added="2026", address="tcp://10.0.0.2:5555")
    assert "code" in board_choice(Found("shed", "tcp://10.0.0.3:5555"), ()).note
    assert board_choice(Found("", "tcp://127.0.0.1:5555"), ()).note == ""
    known = board_choice(Found("", peer.address), (peer,))
    assert (known.name, known.note) == ("bone", "")
    assert stranger(f"ipc:///tmp/x {peer.address}", (peer,)) == ""
    assert stranger("ipc:///tmp/x tcp://10.0.0.3:5555", ()) == "tcp://10.0.0.3:5555"


def test_a_check_lists_only_what_matters_to_the_chosen_cameras() -> None:
    """What is right with the rest of the machine is left out, what is wrong with it stays; serial ports and Bluetooth count only for such links, and a log that only root may read never."""
    camera, python = ok("camera", "there"), ok("python", "3.11")
    power, log = warn("power", "under-voltage", "a stronger supply"), warn("usb-log", LOG_UNREADABLE, "ask as root")
    serial, bluetooth = warn("serial", "no pyserial", "install it"), ok("bluetooth", "no adapter was found")
    found = [python, camera, serial, bluetooth, power, log]
    assert check.relevant(found, "tcp://10.0.0.2:5555") == [camera, power]
    assert check.relevant(found, "tcp://10.0.0.2:5555 serial:/dev/ttyACM0") == [camera, serial, power]
    assert check.relevant(found, "rfcomm:00:11:22:33:44:55") == [camera, bluetooth, power]


def test_a_check_says_what_it_saw_or_what_is_missing() -> None:
    """Pairs, rate and skew; or which camera sent nothing; or the finding that stops everything."""
    assert check.obstacle([ok("python", "there")]) is None
    assert check.obstacle([ok("a", "b"), fail("camera", "gone", "plug it in")]) == Diagnostic(
        "camera: gone", "plug it in", Severity.FAIL
    )
    phone = CaptureSource(camera=CameraIdentity("browser", "back"), width_px=640, height_px=480)
    never = stored_finding(None, phone, has_lens=True)
    assert [each.remedy for each in check.checked([never, ok("a", "b")])] == [
        "press \u201cCheck for image stabilisation\u201d",
        "",
    ]
    assert check.seen(run(21)) == "both cameras work: 21 pairs, 20 pairs/s, time skew 0.0 ms"
    assert check.seen(run(0)) == ""
    nothing = run(0)
    assert "board" in check.unseen(nothing).message
    assert "this machine" in check.unseen(replace(nothing, counts=PairCounts(received=3))).message
    assert "match in time" in check.unseen(replace(nothing, counts=PairCounts(received=3, host_frames=3))).message


def test_a_calibration_that_was_stopped_is_told_from_one_that_was_computed() -> None:
    """What the guide last showed stays, with how it ended."""
    memory = Memory({})
    memory.guide({"state": "running", "verdict": "usable"})
    memory.calibration_stopped("stopped: 5 views taken")
    told = memory.state(PageState(activity=Activity.IDLE)).guide
    assert told == {"state": "stopped", "verdict": "usable", "result": "stopped: 5 views taken"}


def test_the_memory_tells_a_change_once() -> None:
    """`changed` grows with each change and only then; a run is asked at most a few times a second; a new activity forgets the last run."""
    memory, asked = Memory({"camera": "v4l2:auto"}), []

    def state() -> PageState:
        return memory.state(PageState(activity=Activity.IDLE))

    assert state().changed == state().changed == 1
    memory.fail(Diagnostic("a", "b", Severity.FAIL))
    assert state().changed == 2

    def ask() -> object:
        asked.append(1)
        return run(3)

    with memory.live(ask):  # type: ignore[arg-type]  # it returns one
        assert state().run is state().run is not None
    assert len(asked) == 1
    memory.begin()
    assert (state().run, state().trouble) == (None, None)
    memory.last(run(2))
    assert state().run is not None


def test_the_terminal_tells_what_goes_on() -> None:
    """Where there is no terminal, a line for each change; a trouble is told with its remedy."""
    written = io.StringIO()
    status = Status(written)
    ready = PageState(activity=Activity.IDLE)
    for state in (ready, ready, replace(ready, activity=Activity.RUNNING, run=run(3)), ready):
        status.show(state)
    status.clear()
    assert written.getvalue().splitlines() == [
        "phone-host: ready",
        "phone-host: running: 3 pairs",
        "phone-host: ready",
    ]
    assert (
        activity_text(replace(ready, trouble=Diagnostic("no rig", "calibrate", Severity.FAIL)))
        == "ready; no rig: calibrate"
    )


@pytest.mark.parametrize("weakness", Weakness)
def test_advice_on_the_page_names_no_option_of_the_command_line(weakness: Weakness) -> None:
    """The page has fields in their place."""
    assert "--" not in page_words(weakness.advice)


@pytest.mark.parametrize(
    ("option", "way", "words"),
    [
        ("--mat", "", "press Stop and choose \u201cAn object on a mat\u201d, or take the mat away"),
        ("--mat 8x6:28mm:20mm:6x6", " in place of --turntable",
         "press Stop and choose \u201cAn object on a mat\u201d (8x6:28mm:20mm:6x6), or take the mat away"),
    ],
)  # fmt: skip
def test_a_mat_that_is_not_used_is_named_with_its_field(option: str, way: str, words: str) -> None:
    """With the sheet where it is not the usual one."""
    remedy = f"use {option}{way} to scan the object on it, or take the mat away"
    assert page_words(f"3 pairs in the model: {remedy}") == f"3 pairs in the model: {words}"


def test_a_scan_is_told_while_it_goes_on_and_afterwards(tmp_path: Path) -> None:
    """Nothing before the first; then what helps; then what came of it. Its surface stays, what it was made of does not. Its options, with the newest box, are told all the time."""
    scanning = Scanning()

    def state() -> ScanState | None:
        return scanning.state

    assert state() is None
    assert scanning.surface(0, 10) is None
    live = LiveScan(ScanWanted(), Side.LEFT, tmp_path, waits=False, is_timeless=False)
    with scanning.shown(live, 7, {"voxel": "2mm", "box": ""}):
        assert state() == ScanState(words="waiting for the first pair", options={"voxel": "2mm", "box": ""})
        scanning.crop("1000x1000x1000@500,500,500")
        assert scanning.surface(0, 10) == Surface(7, ())
        assert (
            activity_text(PageState(activity=Activity.SCANNING, scan=state())) == "scanning: waiting for the first pair"
        )
    ended = state()
    assert ended is not None
    assert "ended without a result" in ended.words
    over = Scanned(words="3 pairs", level="good", folder=tmp_path, files=("model.ply",))
    scanning.over(over)
    options = {"voxel": "2mm", "box": "1000x1000x1000@500,500,500"}
    assert state() == ScanState(
        words="3 pairs", level="good", folder=str(tmp_path), files=("model.ply",), options=options
    )
    assert scanning.folder == str(tmp_path)
    assert scanning.surface(0, 10) == Surface(7, ())
