"""The demo of a scan as a new user runs it: both programs, a model compared with the thing it was made from, and what a printer takes."""

import signal
from pathlib import Path

import numpy as np
import pytest

from phone_host.output.model_file import read_model
from phone_host.scene.object_scene import Setting, object_scene
from tests.support.programs import PATIENCE_S, host, until

pytestmark = pytest.mark.timeout(5 * PATIENCE_S)
"""The first test waits for the whole demo."""


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, object], str]:
    """One demo with few views: its folder, what it said as JSON, and what it told the user."""
    folder = tmp_path_factory.mktemp("scan")
    with host(["demo", "--scan", "--views", "9", "--out", str(folder / "demo"), "--json"], folder) as demo:
        # Twenty seconds of computing, beside whatever else runs.
        assert demo.process.wait(4 * PATIENCE_S) == 0, demo.stderr
    assert "Traceback" not in demo.stderr
    return folder / "demo", demo.json(), demo.stderr


def test_the_model_is_the_thing_and_its_errors_are_told(scanned: tuple[Path, dict[str, object], str]) -> None:
    """All pairs are in the model; most of the thing is there, half a millimetre off on average, and the model's own points say the same."""
    out, report, told = scanned
    assert report["command"] == "demo"
    assert report["in_model"] == 9
    truth = report["truth"]
    assert isinstance(truth, dict)
    assert truth["mean_mm"] <= 0.5
    assert truth["p95_mm"] <= 1.5
    assert truth["coverage"] >= 0.9
    model = read_model(out / "model.ply").solid
    points = model.points_m[model.seen][::20].astype(np.float64)
    off_mm = np.abs(object_scene("speckled", Setting()).solid.signed_distance(points)) * 1000
    assert off_mm.mean() == pytest.approx(truth["mean_mm"], abs=0.1)
    assert str(out / "index.html") in told
    stages = [line for line in told.splitlines() if line.startswith("phone-host: ")]
    assert list(dict.fromkeys(stage.split()[1] for stage in stages)) == ["rendering", "scanning", "making", "slicing"]
    assert "\x1b" not in told
    assert "\r" not in told


def test_the_page_shows_the_model_and_the_comparison(scanned: tuple[Path, dict[str, object], str]) -> None:
    """The page tells how far the model is off and what to do next, and is self-contained."""
    page = (scanned[0] / "index.html").read_text(encoding="utf-8")
    assert "against the true surface" in page
    assert "export" in page
    assert "printcheck" in page
    assert "<script src" not in page
    assert "https://" not in page


def test_the_model_is_ready_to_print(scanned: tuple[Path, dict[str, object], str]) -> None:
    """There is an STL as high as the thing, z up; where a slicer is installed there is G-code, too, else it is said that there is none."""
    out, report, told = scanned
    printed = report["print"]
    assert isinstance(printed, dict)
    content = (out / "model.stl").read_bytes()
    count = int.from_bytes(content[80:84], "little")
    corners = np.frombuffer(content[84:], np.dtype([("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")]), count)["p"]
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    assert high[2] - low[2] == pytest.approx(97.0, abs=4.0)
    assert (high - low)[:2].max() < 92.0
    if printed["gcode"] is None:
        assert str(printed["problem"]) in told
    else:
        assert "G1" in (out / "model.gcode").read_text(encoding="utf-8", errors="replace")


def test_a_scan_demo_that_is_interrupted_while_it_renders_says_so(tmp_path: Path) -> None:
    """As every command does: one line, and 130."""
    out = tmp_path / "demo"
    with host(["demo", "--scan", "--out", str(out)], tmp_path) as demo:
        until((out / "film" / "left").exists, "the rendering has begun")
        assert demo.stop(signal.SIGINT) == 130
    rendering, interrupted = demo.stderr.splitlines()
    assert "rendering 36 views" in rendering
    assert interrupted == "phone-host: interrupted"


@pytest.mark.parametrize(
    ("arguments", "culprit"),
    [
        (["--scan", "--views", "5"], "--views"),
        (["--scan", "--seconds", "9"], "--seconds"),
        (["--object", "thin"], "--object"),
        (["--views", "12"], "--views"),
    ],
)
def test_options_that_do_not_fit_are_refused(tmp_path: Path, arguments: list[str], culprit: str) -> None:
    """With one line that names the option, and 2."""
    with host(["demo", *arguments, "--out", str(tmp_path / "demo")], tmp_path) as demo:
        assert demo.wait() == 2
    assert culprit in demo.stderr
    assert not (tmp_path / "demo").exists()
