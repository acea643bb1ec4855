"""delay-bench as a user runs it: real processes, short."""

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.programs import Program, program, until

SHORT = ["--links", "ipc", "--size", "320x240", "--fps", "15", "--seconds", "2"]


def bench(arguments: list[str], folder: Path) -> Any:
    return program("phone_host.bench_cli", arguments, folder, "bench")


def boards_of(running: Program) -> list[int]:
    """Pids of the board-agent processes that it started."""
    listing = subprocess.run(
        ["ps", "-o", "pid=,args=", "--ppid", str(running.process.pid)], capture_output=True, text=True, check=False
    ).stdout
    return [int(line.split()[0]) for line in listing.splitlines() if "board_agent" in line]


def is_running(pid: int) -> bool:
    status = Path(f"/proc/{pid}/stat")
    try:
        return status.read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_every_delay_is_measured_and_every_frame_accounted_for(tmp_path: Path) -> None:
    """One run over ipc: the object on stdout is the file's, delays are plausible sums, counts are conserved."""
    with bench([*SHORT, "--json", "--out", str(tmp_path / "out")], tmp_path) as running:
        assert running.wait() == 0, running.stderr
    report = running.json()
    assert json.loads((tmp_path / "out" / "delay-bench.json").read_text()) == report
    assert "<svg" in (tmp_path / "out" / "delay-bench.html").read_text()
    (run,) = report["runs"]
    assert (run["link"], run["width_px"], run["height_px"], run["camera_rate_hz"]) == ("ipc", 320, 240, 15)
    assert run["measured_pairs"] > 0
    delays, whole = run["delays"], run["whole_run"]
    parts = ("capture", "outbox", "propagation", "pairing", "queuing", "processing")
    # Means add up as the delays of each pair do; the report is rounded to the ns.
    assert delays["end_to_end"]["mean_ms"] == pytest.approx(sum(delays[name]["mean_ms"] for name in parts), abs=1e-4)
    stages = sum(stage["mean_ms"] for stage in run["stages"].values())
    assert 0 < stages <= delays["processing"]["mean_ms"] + 1e-4
    assert 0 < delays["processing"]["p50_ms"] <= delays["end_to_end"]["max_ms"]
    assert run["time_skew"]["max_ms"] < 1000 / 15 / 2
    assert whole["grabbed_frames"] == whole["sent_frames"] + sum(whole["dropped_on_board_frames"].values())
    assert whole["sent_frames"] == (
        whole["received_frames"] + whole["lost_on_link_frames"] + whole["under_way_at_end_frames"]
    )
    assert whole["under_way_at_end_frames"] >= 0
    orphaned = sum(whole["orphaned_frames"].values())
    assert whole["received_frames"] - whole["before_clock_frames"] == (
        whole["paired_pairs"] + orphaned + whole["held_at_end_frames"]
    )
    assert whole["paired_pairs"] == (
        whole["processed_pairs"]
        + whole["undecodable_pairs"]
        + whole["dropped_in_fifo_pairs"]
        + whole["not_processed_at_end_pairs"]
    )
    assert whole["processed_pairs"] >= run["measured_pairs"]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--links", "serial"], "tcp, ipc"),
        (["--links", "tcp,carrier-pigeon"], "tcp, ipc"),
        (["--size", "large"], "--size"),
        (["--fps", "0"], "--fps"),
        (["--seconds", "0"], "--seconds"),
        (["--matcher", "magic"], "sgbm"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_2(arguments: list[str], word: str, tmp_path: Path) -> None:
    """What makes no sense is refused before anything is started, with what would."""
    with bench(arguments, tmp_path) as running:
        assert running.wait() == 2
    assert word in running.stderr
    assert len(running.stderr.splitlines()) == 1


def test_a_folder_that_cannot_be_made_is_exit_3(tmp_path: Path) -> None:
    """Results that could not be written are said at once, not after a minute of measuring."""
    (tmp_path / "taken").write_text("a file")
    with bench([*SHORT, "--out", str(tmp_path / "taken" / "out")], tmp_path) as running:
        assert running.wait() == 3
    assert "--out" in running.stderr


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 0)])
def test_a_signal_ends_the_benchmark_and_its_children(number: signal.Signals, code: int, tmp_path: Path) -> None:
    """In the middle of a run, Ctrl-C ends it with 130 and SIGTERM with 0, what was measured so far, and no process left behind."""
    with bench([*SHORT, "--seconds", "600", "--json"], tmp_path) as running:
        until(lambda: bool(boards_of(running)), "a board process of the benchmark")
        (board,) = boards_of(running)
        assert running.stop(number) == code
        assert not is_running(board)
    assert running.json()["runs"] == []


def test_a_board_that_dies_is_one_clear_line(tmp_path: Path) -> None:
    """When the board process is killed under it, the benchmark says so and exits 3."""
    with bench([*SHORT, "--seconds", "600"], tmp_path) as running:
        until(lambda: bool(boards_of(running)), "a board process of the benchmark")
        subprocess.run(["kill", "-9", *(str(pid) for pid in boards_of(running))], check=True)
        assert running.wait() == 3
    assert "board-agent ended" in running.stderr


def test_help_opens_with_examples() -> None:
    """The first thing that --help shows below the usage is how to call it."""
    done = subprocess.run(
        [sys.executable, "-m", "phone_host.bench_cli", "--help"], capture_output=True, text=True, check=True
    )
    assert "examples:\n  delay-bench\n" in done.stdout
