"""Two real processes whose cameras are out of phase: the phase is reported, and steered to 0 on request."""

from pathlib import Path
from statistics import median

import pytest

from tests.support.pictures import jpeg
from tests.support.programs import board, free_port, host, ledgers

FPS, PHASE_MS = 20, 21.0


def film(folder: Path, images: int = 20) -> Path:
    """A folder of small images."""
    folder.mkdir()
    for number in range(images):
        (folder / f"{number}.jpg").write_bytes(jpeg(seed=number))
    return folder


@pytest.mark.parametrize(("arguments", "most_ms"), [([], 22.0), (["--align-phase"], 4.0)])
def test_cameras_out_of_step_are_steered(arguments: list[str], most_ms: float, tmp_path: Path) -> None:
    """Pairs of two cameras 21 ms out of phase keep that skew, and the report says so; with --align-phase it falls below 4 ms."""
    images, address = film(tmp_path / "film"), f"tcp://127.0.0.1:{free_port()}"
    uri = f"replay:{images}?fps={FPS}&loop=1"
    out = tmp_path / "out"
    with board(["run", "--camera", f"{uri}&phase_ms={PHASE_MS}", "--link", address], tmp_path):
        run = ["run", "--link", address, "--camera", uri, "--pairs", "160", "--out", str(out), "--json", *arguments]
        with host(run, tmp_path) as running:
            assert running.wait() == 0, running.stderr
            report = running.json()
    records = ledgers(out)
    # A busy machine knows its clocks less well, and says by how much.
    skews_ms = [abs(line["time_skew_ns"]) / 1e6 for line in records]
    doubts_ms = [line["uncertainty_ns"] / 1e6 for line in records]
    assert abs(skews_ms[0] - PHASE_MS) < 1 + doubts_ms[0]
    assert all(skew <= most_ms + doubt for skew, doubt in zip(skews_ms[-40:], doubts_ms[-40:], strict=True))
    phase = report["phase"]
    assert abs(phase["time_skew_ms"]) <= most_ms + max(doubts_ms[-40:])
    assert phase["period_ms"] == 1000 / FPS
    if arguments:
        assert phase["alignment"]["state"] == "aligned"
        assert abs(phase["alignment"]["before_ms"] - PHASE_MS) < 1 + max(doubts_ms)
        # The grid moves exactly: a second correction only mends what the clocks were not known well enough for.
        assert phase["alignment"]["corrections"] == 1 or max(doubts_ms) > 1
    else:
        assert phase["time_skew_ms"] == pytest.approx(PHASE_MS, abs=1 + max(doubts_ms[-40:]))
        assert abs(phase["drift_ppm"]) < 100
        assert "alignment" not in phase


def test_the_boards_image_is_taken_to_the_hosts_moment(tmp_path: Path) -> None:
    """With --interpolate every pair except perhaps the first passes through that stage, its cost is listed beside the others, and the delays still add up."""
    images, address = film(tmp_path / "film"), f"tcp://127.0.0.1:{free_port()}"
    uri = f"replay:{images}?fps={FPS}&loop=1"
    out = tmp_path / "out"
    with board(["run", "--camera", f"{uri}&phase_ms={PHASE_MS}", "--link", address], tmp_path):
        run = ["run", "--link", address, "--camera", uri, "--pairs", "20", "--out", str(out), "--json", "--interpolate"]
        with host(run, tmp_path) as running:
            assert running.wait() == 0, running.stderr
            report = running.json()
    records = ledgers(out)
    # Reading the clock twice takes next to nothing; the stage decodes an image and warps it, so it takes as long as decoding usually does.
    stages = [record["stages_ns"] for record in records]
    decode_ns = median(one["decode"] for one in stages)
    assert sum(one["interpolate"] > decode_ns / 10 for one in stages) >= len(records) - 1
    assert all(sum(record["stages_ns"].values()) <= record["processing_ns"] for record in records)
    assert report["stages_ms"]["interpolate"]["p50"] > 0
    doubt_ms = max(record["uncertainty_ns"] for record in records) / 1e6
    assert report["time_skew_ms"]["p50"] == pytest.approx(PHASE_MS, abs=1 + doubt_ms)
