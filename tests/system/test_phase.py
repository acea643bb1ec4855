"""Two real processes whose cameras are out of phase: the phase is reported, and steered to 0 on request."""

from pathlib import Path

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
    skews_ms = [abs(line["time_skew_ns"]) / 1e6 for line in ledgers(out)]
    assert 20 < skews_ms[0] < 22
    assert max(skews_ms[-40:]) <= most_ms
    phase = report["phase"]
    assert abs(phase["time_skew_ms"]) <= most_ms
    assert phase["period_ms"] == 1000 / FPS
    if arguments:
        assert phase["alignment"]["state"] == "aligned"
        assert 20 < phase["alignment"]["before_ms"] < 22
        assert phase["alignment"]["corrections"] == 1
    else:
        assert phase["time_skew_ms"] == pytest.approx(PHASE_MS, abs=1)
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
    # Reading the clock twice takes a microsecond; decoding and warping an image takes at least a hundred.
    assert sum(record["stages_ns"]["interpolate"] > 50_000 for record in records) >= len(records) - 1
    assert all(sum(record["stages_ns"].values()) <= record["processing_ns"] for record in records)
    assert report["stages_ms"]["interpolate"]["p50"] > 0
    assert report["time_skew_ms"]["p50"] == pytest.approx(PHASE_MS, abs=1)
