"""The demo as a new user runs it: both programs, a full report, depth checked against the rendered scene."""

import signal
from pathlib import Path

import cv2
import numpy as np

from tests.support.point_files import read_ply
from tests.support.programs import host, ledgers, lines, until


def test_the_demo_leaves_a_full_and_true_report(tmp_path: Path) -> None:
    """After some seconds there are cloud, picture, page, delays and report; every checked pair shows one moment with correct depth."""
    out = tmp_path / "demo"
    with host(["demo", "--seconds", "4", "--out", str(out), "--json"], tmp_path) as demo:
        assert demo.wait() == 0, demo.stderr
    assert "Traceback" not in demo.stderr
    assert str(out / "index.html") in demo.stderr
    report = demo.json()
    truth = report["truth"]
    assert truth["pairs"] > 0
    assert truth["wrong_pairs"] == 0
    # The figures hold without noise; the demo's sensors have noise and JPEG, and its farthest wall is at 2.5 m.
    assert truth["depth_percent"] <= 0.6
    assert truth["disparity_px"] <= 0.15
    assert truth["density"] >= 0.95
    records = ledgers(out)
    assert len(records) == report["pairs"]
    for record in records:
        delays = ("capture_ns", "outbox_ns", "propagation_ns", "pairing_ns", "queuing_ns", "processing_ns")
        assert sum(record[name] for name in delays) == record["end_to_end_ns"]
        assert sum(record["stages_ns"].values()) <= record["processing_ns"]
    cloud = read_ply(out / "cloud.ply")
    assert len(cloud.points_m) > 100_000
    assert 0.6 < float(np.min(cloud.points_m[:, 2])) < float(np.max(cloud.points_m[:, 2])) < 3.0
    assert np.asarray(cv2.imread(str(out / "disparity.png"))).ndim == 3
    page = (out / "index.html").read_text(encoding="utf-8")
    assert page.count("data:image/") >= 3  # left, right, disparity, and depth
    assert page.count("<script>") == 2  # the cloud's viewer and the charts, both inlined
    assert "<script src" not in page
    assert "http://" not in page.replace("http://www.w3.org/", "")
    assert "https://" not in page


def test_an_interrupted_demo_ends_both_programs_and_keeps_its_report(tmp_path: Path) -> None:
    """Ctrl-C in the middle ends with exit 130; report and page are written, and no board process is left behind."""
    out = tmp_path / "demo"
    with host(["demo", "--seconds", "600", "--out", str(out)], tmp_path) as demo:
        until(lambda: lines(out / "delays.jsonl") >= 5, "five pairs")
        assert demo.stop(signal.SIGINT) == 130
    assert (out / "report.json").exists()
    assert (out / "index.html").exists()
    left = [path for path in Path("/proc").glob("[0-9]*/cmdline") if _runs(path, str(out / "film"))]
    assert not left


def test_a_demo_that_is_interrupted_while_it_renders_says_so(tmp_path: Path) -> None:
    """As every command does: one line, and 130."""
    out = tmp_path / "demo"
    with host(["demo", "--out", str(out)], tmp_path) as demo:
        until((out / "film").exists, "the first image is rendered")
        assert demo.stop(signal.SIGINT) == 130
    assert demo.stderr.splitlines()[-1] == "phone-host: interrupted"


def test_a_demo_that_cannot_write_says_so(tmp_path: Path) -> None:
    """A folder that cannot be created ends the demo with exit 3 and one line that names it; invalid seconds end it with exit 2."""
    for arguments, code, culprit in (
        (["--out", "/proc/nowhere"], 3, "/proc/nowhere"),
        (["--seconds", "0"], 2, "--seconds"),
    ):
        with host(["demo", *arguments], tmp_path) as demo:
            assert demo.wait() == code
            errors = [line for line in demo.stderr.splitlines() if ": error: " in line]
            assert len(errors) == 1
            assert culprit in errors[0]


def _runs(cmdline: Path, word: str) -> bool:
    try:
        return word.encode() in cmdline.read_bytes()
    except OSError:
        return False  # it has just ended
