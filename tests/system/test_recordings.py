"""Recordings as a user makes and replays them, with the real programs."""

import json
import signal
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from common.recording.mcap_writer import CHUNK_BYTES
from common.recording.opened import open_recorded
from tests.support.programs import board, host, ledgers, on_a_full_disk, program, until

RATE = 25
PAIRS = 30


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders left and right, 10 images each of 320x240; the right ones show everything 12 px farther left."""
    root = tmp_path_factory.mktemp("film")
    noise = np.random.default_rng(3).integers(0, 255, (60, 100), np.uint8)
    wide = cv2.resize(noise, (400, 240), interpolation=cv2.INTER_CUBIC)
    for side, shift in (("left", 20), ("right", 32)):
        (root / side).mkdir()
        for number in range(10):
            cv2.imwrite(str(root / side / f"{number}.jpg"), wide[:, shift + number : shift + number + 320])
    return root


def _uri(film: Path, side: str) -> str:
    return f"replay:{film}/{side}?fps={RATE}&loop=1"


@pytest.fixture(scope="module")
def live(film: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of 30 pairs that was recorded."""
    folder = tmp_path_factory.mktemp("live")
    link = f"ipc://{folder}/link"
    words = [
        "--camera",
        _uri(film, "right"),
        "--link",
        link,
        "--record",
        str(folder / "s.mcap"),
        "--out",
        f"{folder}/out",
    ]
    with (
        board(["run", "--camera", _uri(film, "left"), "--link", link], folder),
        host(["run", *words, "--pairs", str(PAIRS), "--save-every", "0"], folder) as running,
    ):
        assert running.wait() == 0, running.stderr
        assert "recorded:" in running.out.read_text()
    return folder


def _replay(live: Path, folder: Path, pace: str) -> dict[str, Any]:
    out = folder / "out"
    words = ["run", "--replay", f"{live}/s.mcap?pace={pace}", "--rectified", "--disparities", "32", "--out", str(out)]
    with host([*words, "--save-every", "1", "--json"], folder) as running:
        assert running.wait() == 0, running.stderr
        report: dict[str, Any] = running.json()
    return report


def _pairs(out: Path) -> list[tuple[int, int]]:
    return [(line["sequence"], line["host_sequence"]) for line in ledgers(out)]


def test_a_board_that_never_comes_leaves_no_recording(film: Path, tmp_path: Path) -> None:
    """The same command can be given again: what this machine's camera gave while it waited is no recording of both."""
    words = ["record", "--camera", _uri(film, "right"), "--link", f"ipc://{tmp_path}/nobody", "--wait", "0.5"]
    with host([*words, "--out", str(tmp_path / "s.mcap")], tmp_path) as running:
        assert running.wait() == 3
        assert "no board within 0.5 s" in running.stderr
    assert not list(tmp_path.glob("s.mcap*"))


def test_a_run_s_recording_holds_all_that_came(live: Path) -> None:
    """Both cameras' images, as many as the report counts, the delays of each pair and the settings; no harm done to the run."""
    report = json.loads((live / "out" / "report.json").read_text())["recording"]
    recorded = open_recorded(live / "s.mcap")
    images = {topic: len(shown) for topic, shown in recorded.images.items()}
    assert recorded.is_complete
    assert (report["frames"], report["dropped"], report["lost"], report["failure"]) == (
        sum(images.values()),
        0,
        0,
        None,
    )
    assert report["size_bytes"] == (live / "s.mcap").stat().st_size
    assert min(images.values()) >= PAIRS
    assert recorded.kinds["/delays"] == PAIRS
    assert {"settings.json", "cameras.json"} <= set(recorded.attachments)


def test_a_replay_on_demand_gives_the_same_bits_each_time(live: Path, tmp_path: Path) -> None:
    """Every pair of then, and twice the same disparities to the bit."""
    outs = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        report = _replay(live, tmp_path / name, "demand")
        outs.append(tmp_path / name / "out")
        assert report["replay"]["recorded_pairs"] == PAIRS
        assert report["pairs_account"]["dropped_fifo"] == 0
    assert _pairs(outs[0]) == _pairs(outs[1])
    assert set(_pairs(live / "out")) <= set(_pairs(outs[0]))
    saved = sorted(path.relative_to(outs[0]) for path in outs[0].glob("pair-*/disparity.pfm"))
    assert len(saved) >= PAIRS
    assert all((outs[0] / path).read_bytes() == (outs[1] / path).read_bytes() for path in saved)


def test_a_replay_with_its_clock_keeps_its_delays(live: Path, tmp_path: Path) -> None:
    """What came over the link took as long then; the report sets both side by side. It takes as long as the film."""
    report = _replay(live, tmp_path, "clock")
    then, now = report["replay"]["recorded_delays_ms"], report["delays_ms"]
    assert abs(then["propagation"]["p50"] - now["propagation"]["p50"]) < 0.5
    mates = dict(_pairs(live / "out"))
    again = dict(_pairs(tmp_path / "out"))
    both = set(mates) & set(again)
    assert len(both) >= 3  # either time a busy machine leaves out others
    assert all(mates[number] == again[number] for number in both)


def test_record_without_depth_survives_being_killed(film: Path, tmp_path: Path) -> None:
    """Killed with SIGKILL in the middle, it leaves all chunks but the last, and repair makes it whole."""
    link, path = f"ipc://{tmp_path}/link", tmp_path / "s.mcap"
    words = ["record", "--camera", _uri(film, "right"), "--link", link, "--out", str(path)]
    with board(["run", "--camera", _uri(film, "left"), "--link", link], tmp_path), host(words, tmp_path) as running:
        until(lambda: path.exists() and path.stat().st_size > 600_000, "half a megabyte")
        running.stop(signal.SIGKILL)
    cut = open_recorded(path)
    assert not cut.is_complete
    images = [shown.image for shown_ones in cut.images.values() for shown in shown_ones]
    assert sum(len(image.payload) for image in images) > 600_000 - CHUNK_BYTES
    with program(
        "phone_host.cli", ["sessions", "repair", str(path), "--out", f"{tmp_path}/w.mcap"], tmp_path, "r"
    ) as mend:
        assert mend.wait() == 0
    whole = open_recorded(tmp_path / "w.mcap")
    assert whole.is_complete
    assert whole.kinds == cut.kinds


def test_a_full_disk_ends_the_recording_and_not_the_run(film: Path, tmp_path: Path) -> None:
    """A file may take 1 MB: the run has all its pairs, says in a line what is missing and ends with exit code 4."""
    link, path = f"ipc://{tmp_path}/link", tmp_path / "s.mcap"
    words = ["run", "--camera", _uri(film, "right"), "--link", link, "--record", str(path), "--pairs", "60", "--json"]
    with board(["run", "--camera", _uri(film, "left"), "--link", link], tmp_path):
        ended = on_a_full_disk("phone_host.cli", words, tmp_path, 1_000_000)
    report = json.loads(ended.stdout)
    assert ended.returncode == 4
    assert report["pairs"] == 60
    assert "ended early" in report["recording"]["failure"]["problem"]
    assert report["recording"]["lost"] > 0
    assert ended.stderr.count("recording_ended_early") == 1
    assert sum(map(len, open_recorded(path).images.values())) > 5
