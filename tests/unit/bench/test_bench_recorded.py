"""What delay-bench makes of a recorded run: its delays, its losses, and predictions from them."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from common.errors import DataError
from common.frame import PixelFormat
from common.recording.layout import ABOUT, CLOCK, DELAYS, About, camera_name, camera_values, image_topic
from common.recording.recording_file import written
from common.recording.ros_messages import COMPRESSED_IMAGE, RecordedImage, image_message
from phone_host.bench.cli import main
from phone_host.bench.command import recorded_run
from phone_host.sync.fifo import FifoSettings, Overflow
from tests.support.bench_results import ledger, result
from tests.support.recorded import payload
from tests.support.samples import CAMERA

_PERIOD_NS = 33_000_000
_UNIX_NS = 1_700_000_000_000_000_000
_ESTIMATE = {
    "reference_ns": 0,
    "offset_ns": 5,
    "skew": 0.0,
    "skew_uncertainty": 0.0,
    "uncertainty_ns": 45_000,
    "round_trip_ns": 400_000,
    "low_ns": -70_000,
    "high_ns": 70_000,
    "skew_low": 0.0,
    "skew_high": 0.0,
}


def _recording(
    path: Path,
    pairs: int,
    *,
    unsent: frozenset[int] = frozenset(),
    dropped: frozenset[int] = frozenset(),
    settings: str,
) -> Path:
    """A recorded run of the usual ledgers; some board frames were never sent, some pairs given up by the FIFO."""
    camera = replace(CAMERA, period_ns=_PERIOD_NS)
    with written(path) as file:
        file.tell(ABOUT, About(unix_ns=_UNIX_NS).values())
        file.attach("settings.json", "", settings.encode(), 0)
        for side in ("left", "right"):
            file.tell(camera_name(side), camera_values(camera))
        for number in range(pairs):
            line = ledger(number, _PERIOD_NS)
            for side, exposed_ns in (("left", line.board.exposed_ns), ("right", line.host.exposed_ns)):
                if side == "left" and number in unsent:
                    continue
                stamp_ns = _UNIX_NS + exposed_ns
                image = RecordedImage(stamp_ns, side, PixelFormat.MJPEG, (0, 0), payload(0))
                topic = image_topic(side, COMPRESSED_IMAGE)
                log_ns = stamp_ns + 6_000_000
                file.add(topic, image_message(image), sequence=number, log_ns=log_ns, publish_ns=stamp_ns)
            if number not in unsent | dropped:
                at_ns = _UNIX_NS + line.done_ns
                file.add(DELAYS, line.to_json().encode(), sequence=number, log_ns=at_ns, publish_ns=at_ns)
        file.add(CLOCK, json.dumps(_ESTIMATE).encode(), sequence=0, log_ns=_UNIX_NS, publish_ns=_UNIX_NS)
    return path


def test_a_recorded_run_is_the_run_that_was(tmp_path: Path) -> None:
    """The same pairs at the same rate as a run of the benchmark with these ledgers; its queue and matcher; frames that were not sent and pairs that gave way are counted."""
    settings = json.dumps({"fifo": {"value": "4:drop-newest"}, "matcher": {"value": "sgbm"}, "pairs": {"value": 0}})
    run = recorded_run(_recording(tmp_path / "s.mcap", 100, settings=settings))
    assert run.result.ledgers == result().ledgers
    assert run.result.pairs_per_second == pytest.approx(result().pairs_per_second)
    assert (run.fifo, run.matcher) == (FifoSettings(4, Overflow.DROP_NEWEST), "sgbm")
    assert (run.result.uncertainty_ns, run.result.bound_ns) == (45_000, 70_000)
    assert str(run.result.case) == "tcp 640x480 at 30 frames/s"
    lossy = _recording(
        tmp_path / "lossy.mcap", 100, unsent=frozenset({50, 51, 70}), dropped=frozenset({60, 61}), settings="no json"
    )
    found = recorded_run(lossy)
    assert (found.fifo, found.matcher) == (FifoSettings(), "-")
    board, counts = found.result.board, found.result.counts
    assert (board.grabbed, board.sent, dict(board.dropped)) == (100, 97, {"replaced": 3})
    assert (counts.paired, counts.dropped, counts.host_frames, counts.board_orphans) == (97, 2, 100, ())


def test_a_recording_without_delays_predicts_nothing(tmp_path: Path) -> None:
    """One line says what to record."""
    path = _recording(tmp_path / "s.mcap", 35, settings='{"fifo": {"value": "odd"}}')
    with pytest.raises(DataError, match="delays of 4 pairs"):
        recorded_run(path)


def test_the_command_predicts_from_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Measured delays are those of then; settings that were not run are foretold from them; other links beside it are refused."""
    path = _recording(tmp_path / "s.mcap", 100, settings="{}")
    out = tmp_path / "out"
    assert main(["--replay", str(path), "--predict", "processing=2", "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["recording"] == str(path)
    assert told["runs"][0]["delays"]["end_to_end"]["p50_ms"] == pytest.approx(30.0)
    asked = next(each for each in told["not_run_settings"] if each["setting"] == "processing=2")
    usual = next(each for each in told["not_run_settings"] if "as it was run" in each["setting"])
    # Without the 2 ms in the outbox: the queues know no reason for them, for the link was free.
    assert usual["predicted"]["end_to_end_p50_ms"] == pytest.approx(28.0, rel=0.02)
    assert asked["predicted"]["end_to_end_p50_ms"] > usual["predicted"]["end_to_end_p50_ms"] + 10
    assert "The run of the recording" in (out / "delay-bench.html").read_text()
    assert main(["--replay", str(path), "--links", "tcp"]) == 2
    assert main(["--replay", str(path)]) == 0
    assert "the queues alone" in capsys.readouterr().out
