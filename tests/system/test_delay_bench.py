"""delay-bench as a user runs it: real processes, short."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from phone_host.subprocesses.board_process import board_process
from tests.support.numbered import write_film
from tests.support.programs import Program, board, children_of, command_of, free_port, program, until
from tests.support.trace_format import checked

SHORT = ["--links", "ipc", "--size", "160x120", "--fps", "15", "--seconds", "2"]


def bench(arguments: list[str], folder: Path) -> Any:
    return program("phone_host.bench.cli", arguments, folder, "bench")


@pytest.fixture(scope="module", autouse=True)
def absent(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Program]]:
    """An address at which no board is, and a benchmark that waits for one: a quarter of a minute, in which the other tests run."""
    address = f"tcp://127.0.0.1:{free_port()}"
    with bench(["--links", f"ipc,{address}", *SHORT[2:]], tmp_path_factory.mktemp("absent")) as running:
        yield address, running


def boards_of(running: Program) -> list[int]:
    """Pids of the board-agent processes that a program started."""
    return boards_below(running.process.pid)


def boards_below(pid: int) -> list[int]:
    """The same, of a process; from /proc, since a small machine has no `ps`."""
    return [child for child in children_of(pid) if b"board_agent" in command_of(child)]


def is_running(pid: int) -> bool:
    status = Path(f"/proc/{pid}/stat")
    try:
        return status.read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_every_delay_is_measured_and_every_frame_accounted_for(tmp_path: Path) -> None:
    """One run over ipc: stdout holds the same object as the file, delays are plausible sums, counts are conserved."""
    with bench([*SHORT, "--json", "--out", str(tmp_path / "out")], tmp_path) as running:
        assert running.wait() == 0, running.stderr
    report = running.json()
    assert json.loads((tmp_path / "out" / "delay-bench.json").read_text()) == report
    assert "<svg" in (tmp_path / "out" / "delay-bench.html").read_text()
    (run,) = report["runs"]
    traced = checked((tmp_path / "out" / "trace.json").read_text())
    assert sum(event["ph"] == "s" for event in traced) == run["measured_pairs"]
    assert (run["link"], run["width_px"], run["height_px"], run["camera_rate_hz"]) == ("ipc", 160, 120, 15)
    assert run["measured_pairs"] > 0
    delays, whole = run["delays"], run["whole_run"]
    parts = ("capture", "outbox", "propagation", "pairing", "queuing", "processing")
    # The mean delays add up as each pair's delays do; the report is rounded to the ns.
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
    assert whole["disbelieved_frames"] == {}
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
        (["--links", "tcp,carrier-pigeon"], "tcp, ipc, serial, rfcomm"),
        (["--links", "tcp://192.168.7.2"], "names no port"),
        (["--emulate", "carrier-pigeon"], "bluetooth"),
        (["--emulate", "wifi", "--links", "rfcomm"], "tcp or ipc or serial"),
        (["--quality", "101"], "--quality"),
        (["--fifo", "0"], "--fifo"),
        (["--predict", "speed=60"], "processing=0.5"),
        (["--size", "large"], "--size"),
        (["--fps", "0"], "--fps"),
        (["--seconds", "0"], "--seconds"),
        (["--matcher", "magic"], "sgbm"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_2(arguments: list[str], word: str, tmp_path: Path) -> None:
    """Invalid settings are refused before anything starts; the message says what would be valid."""
    with bench(arguments, tmp_path) as running:
        assert running.wait() == 2
    assert word in running.stderr
    assert len(running.stderr.splitlines()) == 1


def test_a_serial_line_is_made_where_there_is_none_and_a_missing_radio_is_said(tmp_path: Path) -> None:
    """`--links serial,rfcomm`: pairs come over a pseudo terminal; without two Bluetooth adapters the report and one line say why rfcomm was left out."""
    with bench(["--links", "serial,rfcomm", *SHORT[2:], "--json"], tmp_path) as running:
        assert running.wait() == 0, running.stderr
    report = running.json()
    assert {run["link"] for run in report["runs"]} | {one["link"] for one in report["not_run"]} == {"serial", "rfcomm"}
    serial = report["runs"][0]
    assert serial["measured_pairs"] > 0
    # All bytes of the frames passed over the line between the two processes.
    assert serial["line"]["to_host_bytes"] > serial["measured_pairs"] * serial["mean_frame_bytes"]
    for one in report["not_run"]:
        assert "Bluetooth" in one["reason"]
        assert one["reason"] in running.stderr


def test_an_emulated_interface_is_as_slow_as_its_profile(tmp_path: Path) -> None:
    """No frame over the emulated Bluetooth arrives sooner than its bytes take at 80 kB/s plus the least delay, within the clock's bound."""
    with bench(["--emulate", "bluetooth", *SHORT[2:], "--seconds", "4", "--json"], tmp_path) as running:
        assert running.wait() == 0, running.stderr
    (run,) = running.json()["runs"]
    assert (run["link"], run["emulated"]) == ("serial", "bluetooth")
    least_ms = 3.75 + run["least_frame_bytes"] / 80
    assert run["delays"]["propagation"]["p50_ms"] > least_ms - run["clock_bound_at_end_us"] / 1e3
    assert run["line"]["to_host_bytes"] > run["measured_pairs"] * run["least_frame_bytes"]


def test_a_board_elsewhere_is_measured_with_its_own_camera(tmp_path: Path) -> None:
    """A board named by its URI shows what its camera shows; the command says that it does not configure that board, and leaves it alone."""
    address = f"tcp://127.0.0.1:{free_port()}"
    images = write_film(tmp_path / "images", 8)
    with board(["run", "--camera", f"replay:{images}?fps=20&loop=1", "--link", address], tmp_path) as serving:
        with bench(["--links", address, "--seconds", "2", "--json"], tmp_path) as running:
            assert running.wait() == 0, running.stderr
        assert serving.process.poll() is None
        assert serving.stop() == 0
    (run,) = running.json()["runs"]
    assert (run["link"], run["camera_rate_hz"], run["jpeg_quality_percent"]) == (address, 20, None)
    assert run["measured_pairs"] > 0
    assert "not set from here" in running.stderr


def test_profiles_are_listed() -> None:
    """`--emulate list` names every interface with its rate and the source of that rate, also as one JSON object."""
    command = [sys.executable, "-m", "phone_host.bench.cli", "--emulate", "list"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    listed = json.loads(subprocess.run([*command, "--json"], capture_output=True, text=True, check=True).stdout)
    assert {"bluetooth", "wifi", "usb-serial", "ethernet"} <= {one["name"] for one in listed["profiles"]}
    assert all(one["name"] in said and one["source"] in said for one in listed["profiles"])


def test_a_matrix_foretells_each_run_from_the_others(tmp_path: Path) -> None:
    """Two qualities and two rates over one link: the sizes differ, so the report has a line with an interval, a prediction for each run, and settings not run."""
    with bench(
        [
            "--links",
            "ipc",
            "--size",
            "160x120",
            "--quality",
            "40,95",
            "--fps",
            "10,20",
            "--seconds",
            "1",
            "--predict",
            "fps=5,link=uart",
            "--json",
        ],
        tmp_path,
    ) as running:
        assert running.wait() == 0, running.stderr
    report = running.json()
    assert len(report["runs"]) == 4
    (line,) = report["interfaces"]
    assert line["fitted_frames"] == sum(run["measured_pairs"] for run in report["runs"])
    assert line["slope_low_ns_per_byte"] <= line["slope_ns_per_byte"] <= line["slope_high_ns_per_byte"]
    for one in report["predictions"]:
        rate_hz = int(one["images"].split()[-2])
        # The camera sets the rate; on a busy machine both the measured and the predicted rate are lower.
        assert 0 < one["predicted"]["pair_rate_hz"] <= 1.01 * rate_hz
        assert one["predicted"]["end_to_end_p50_ms"] > 0
    settings = {one["setting"]: one["predicted"] for one in report["not_run_settings"] if one["link"] == "ipc"}
    as_run = next(value for name, value in settings.items() if "as it was run" in name)
    slower = settings["matcher four times slower"]
    assert slower["pair_rate_hz"] <= 1.01 * as_run["pair_rate_hz"]
    assert slower["end_to_end_p50_ms"] > 2 * as_run["end_to_end_p50_ms"]
    errors = report["prediction_errors"]
    enough = sum(run["measured_pairs"] >= 10 for run in report["runs"])
    assert errors["held_out"]["predicted_runs"] == errors["queues_alone"]["predicted_runs"] == enough
    assert {one["link"] for one in report["not_run_settings"]} > {"bluetooth (serial)", "wifi (tcp)"}
    # Predict a run of the largest frames over 115200 baud: 11 520 bytes a second, and no result comes faster than a frame.
    asked = settings["fps=5,link=uart"]
    frame_bytes = max(run["mean_frame_bytes"] for run in report["runs"])
    assert asked["propagation_p50_ms"] == pytest.approx(1 + frame_bytes / 11.52, rel=0.1)
    assert asked["pair_rate_hz"] <= 5.01


def test_a_full_disk_is_said_and_the_table_is_not_lost(tmp_path: Path) -> None:
    """If the files cannot be written, the command still prints its report, and exits 3 with one line that names the folder."""
    out = tmp_path / "disk"
    out.mkdir()
    bench_run = [sys.executable, "-P", "-m", "phone_host.bench.cli", *SHORT, "--json", "--out", str(out)]
    small = 'mount -t tmpfs -o size=8k tmpfs "$1" && shift && exec "$@"'
    command = ["unshare", "-rm", "sh", "-c", small, "sh", str(out), *bench_run]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if "unshare" in done.stderr or "mount" in done.stderr:
        pytest.skip(f"no small disk can be had here: {done.stderr.strip()}")
    assert done.returncode == 3, done.stderr
    assert str(out) in done.stderr.splitlines()[-1]
    assert json.loads(done.stdout)["runs"][0]["measured_pairs"] > 0


def test_a_folder_that_cannot_be_made_is_exit_3(tmp_path: Path) -> None:
    """Results that could not be written are reported at once, not after a minute of measuring."""
    (tmp_path / "taken").write_text("a file")
    with bench([*SHORT, "--out", str(tmp_path / "taken" / "out")], tmp_path) as running:
        assert running.wait() == 3
    assert "--out" in running.stderr


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 0)])
def test_a_signal_ends_the_benchmark_and_its_children(number: signal.Signals, code: int, tmp_path: Path) -> None:
    """In the middle of a run, Ctrl-C ends it with 130 and SIGTERM with 0; results so far are kept, and no process is left behind."""
    with bench([*SHORT, "--seconds", "600", "--json"], tmp_path) as running:
        until(lambda: bool(boards_of(running)), "a board process of the benchmark")
        (board,) = boards_of(running)
        assert running.stop(number) == code
        assert not is_running(board)
    assert running.json()["runs"] == []


def test_a_board_that_ctrl_c_reached_first_gives_its_account(tmp_path: Path) -> None:
    """A terminal's Ctrl-C reaches the board's process, too: if it ends with 130 before it was asked to, that is no failure."""
    images = write_film(tmp_path / "images", 4)
    with board_process(f"replay:{images}?fps=20&loop=1", f"ipc://{tmp_path}/link") as serving:
        until((tmp_path / "link").exists, "the board's socket")
        (pid,) = boards_below(os.getpid())
        os.kill(pid, signal.SIGINT)
        until(lambda: not is_running(pid), "the end of the board's process")
        account = serving.stop()
    assert account.grabbed == account.sent + sum(count for _, count in account.dropped)


def test_what_was_measured_before_ctrl_c_is_written(tmp_path: Path) -> None:
    """Interrupted in the second of two runs: exit 130, and the first run is in the files and on stdout."""
    out = tmp_path / "out"
    with bench([*SHORT[:4], "--fps", "10,20", "--seconds", "1", "--json", "--out", str(out)], tmp_path) as running:
        until(lambda: bool(boards_of(running)), "a board process of the first run")
        (first,) = boards_of(running)
        until(lambda: bool(set(boards_of(running)) - {first}), "a board process of the second run")
        assert running.stop(signal.SIGINT) == 130
    report = running.json()
    assert report["runs"][0]["camera_rate_hz"] == 10
    assert report["runs"][0]["measured_pairs"] > 0
    assert json.loads((out / "delay-bench.json").read_text()) == report
    assert "interrupted after" in running.stderr
    assert not [pid for pid in boards_of(running) if is_running(pid)]


def test_a_board_that_dies_is_one_clear_line(tmp_path: Path) -> None:
    """If the board process is killed during a run, the benchmark says so and exits 3."""
    with bench([*SHORT, "--seconds", "600"], tmp_path) as running:
        until(lambda: bool(boards_of(running)), "a board process of the benchmark")
        for pid in boards_of(running):
            os.kill(pid, signal.SIGKILL)
        assert running.wait() == 3
    assert "board-agent ended" in running.stderr


def test_help_opens_with_examples() -> None:
    """Below the usage line, --help first shows how to call the command."""
    done = subprocess.run(
        [sys.executable, "-m", "phone_host.bench.cli", "--help"], capture_output=True, text=True, check=True
    )
    assert re.match(r"examples:\n  \S*delay-bench --out bench\n", done.stdout)


def test_an_absent_board_elsewhere_is_exit_3(absent: tuple[str, Program]) -> None:
    """A missing board is reported before anything is measured."""
    address, running = absent
    assert running.wait() == 3
    assert address in running.stderr.splitlines()[-1]
