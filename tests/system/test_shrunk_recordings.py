"""Recordings that another program makes shorter while the real programs replay them."""

import os
from pathlib import Path

import pytest

from tests.support.pictures import jpeg
from tests.support.programs import board, host, ledgers, until
from tests.support.recorded import recording

PAIRS = 1500
"""A minute of pairs."""


@pytest.fixture
def long(tmp_path: Path) -> Path:
    """A recording that lasts longer than the test."""
    pictures = [jpeg(96, 72, seed=seed) for seed in range(4)]
    path = tmp_path / "long.mcap"
    path.write_bytes(recording(PAIRS, image=lambda _, number: pictures[number % 4]))
    return path


def _one_line(text: str) -> None:
    said = [line for line in text.splitlines() if "became shorter while it was read" in line]
    assert len(said) == 1, text
    assert "long.mcap" in said[0]
    assert "copy it first" in said[0]
    assert "Traceback" not in text


def test_a_replay_whose_file_shrinks_ends_in_one_line(long: Path, tmp_path: Path) -> None:
    """Exit code 4, no signal, and the pairs so far are on the disk with their report."""
    out = tmp_path / "out"
    words = ["run", "--replay", f"{long}?pace=clock", "--rectified", "--disparities", "16", "--out", str(out)]
    with host([*words, "--save-every", "0"], tmp_path) as running:
        until(lambda: (out / "delays.jsonl").exists() and len(ledgers(out)) > 2, "pairs")
        os.truncate(long, 4096)
        assert running.wait() == 4, running.stderr
        _one_line(running.stderr)
    assert len(ledgers(out)) > 2
    assert (out / "report.json").exists()


def test_a_board_whose_recording_shrinks_ends_in_one_line(long: Path, tmp_path: Path) -> None:
    """Exit code 4 and no signal: the camera's images have become unreadable."""
    link, out = f"ipc://{tmp_path}/link", tmp_path / "out"
    own = f"replay:{long.with_name('own.mcap')}?topic=/right/image/compressed&pace=clock"
    long.with_name("own.mcap").write_bytes(long.read_bytes())
    words = ["--camera", own, "--link", link, "--out", str(out), "--rectified", "--disparities", "16"]
    camera = f"replay:{long}?topic=/left/image/compressed&pace=clock"
    with (
        board(["run", "--camera", camera, "--link", link], tmp_path) as agent,
        host(["run", *words, "--save-every", "0"], tmp_path),
    ):
        until(lambda: (out / "delays.jsonl").exists() and len(ledgers(out)) > 2, "pairs")
        os.truncate(long, 4096)
        assert agent.wait() == 4, agent.stderr
        _one_line(agent.stderr)
