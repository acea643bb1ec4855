"""What a run reports of its queue and of time, with real processes: a slow line, a moving scene, a terminal."""

import os
import pty
import subprocess
import sys
from pathlib import Path

from tests.support.moving import write_moving_film
from tests.support.numbered import write_film
from tests.support.programs import board, host
from tests.support.pty_line import PtyLine


def test_a_slow_line_starves_the_processor(tmp_path: Path) -> None:
    """Over a line that carries a fraction of the cameras' rate the report blames the link, and what it asks for exceeds what the line carries."""
    film = f"replay:{write_film(tmp_path / 'film', 200)}?fps=20&loop=1"
    with PtyLine(tmp_path, bytes_per_s=25_000, delay_ns=300_000) as line:
        board_uri, host_uri = line.uris
        receiving = ["run", "--camera", film, "--link", host_uri, "--pairs", "20", "--json"]
        with (
            host(receiving, tmp_path) as receiver,
            board(["run", "--camera", film, "--link", board_uri], tmp_path),
        ):
            assert receiver.wait() == 0
    regime = receiver.json()["regime"]
    assert regime["regime"] == "starved by the link", regime
    assert "smaller frames" in regime["remedies"][0]
    carried = float(regime["remedies"][1].rpartition("carries ")[2])
    assert carried <= 0.03  # MB/s; the line is 25 KB/s


def test_skew_and_motion_make_a_warning_and_rest_makes_none(tmp_path: Path) -> None:
    """With cameras of unlike rates and a moving scene the run warns in its log and its report; with a still scene it does not."""
    moving = write_moving_film(tmp_path / "moving", 100, 6)
    still = write_moving_film(tmp_path / "still", 2, 0)
    doubted = {}
    for name, film in (("moving", moving), ("still", still)):
        link = f"ipc://{tmp_path}/{name}-link"
        receiving = ["run", "--camera", f"replay:{film}?fps=15&loop=1", "--link", link, "--pairs", "60", "--json"]
        receiving += ["--out", str(tmp_path / name / "out")]
        with (
            board(["run", "--camera", f"replay:{film}?fps=20&loop=1", "--link", link], tmp_path, f"{name}-board"),
            host(receiving, tmp_path, f"{name}-host") as receiver,
        ):
            assert receiver.wait() == 0
        report = receiver.json()
        page = (tmp_path / name / "out" / "index.html").read_text()
        assert "Queue: the processor" in page
        assert "This machine&#x27;s camera" not in page  # a replay has no rate, and nothing happened to it
        assert ("depth is wrong" in page) is (name == "moving")
        doubted[name] = [warning["doubt"] for warning in report["warnings"]]
        assert ("depth_doubtful" in receiver.stderr) is (name == "moving")
        if name == "moving":
            # 6 px in 1/20 s are 120 px/s, except when the motion turns or a pair is left out.
            assert 60 < report["image_motion_px_per_s"] < 240
        else:
            assert report["image_motion_px_per_s"] < 5
    assert "time_skew" in doubted["moving"]
    assert doubted["still"] == []


def test_the_terminal_shows_regime_and_warning(tmp_path: Path) -> None:
    """In a terminal the live view says who waits for whom, and warns in words; the stages of processing and the clock's hard bound are shown beside."""
    film, link = write_moving_film(tmp_path / "moving", 100, 6), f"ipc://{tmp_path}/link"
    out = tmp_path / "out"
    command = [sys.executable, "-P", "-m", "phone_host.cli", "run", "--camera", f"replay:{film}?fps=15&loop=1"]
    ours, theirs = pty.openpty()
    shown = b""
    with board(["run", "--camera", f"replay:{film}?fps=20&loop=1", "--link", link], tmp_path):
        environment = {**os.environ, "COLUMNS": "300", "LINES": "50", "TERM": "xterm"}
        arguments = [*command, "--link", link, "--out", str(out), "--save-every", "0", "--pairs", "90"]
        with subprocess.Popen(arguments, stderr=theirs, stdout=subprocess.DEVNULL, env=environment) as running:
            os.close(theirs)
            try:
                while more := os.read(ours, 65536):
                    shown += more
            except OSError:  # EIO: the other end of a pty is closed
                pass
            assert running.wait(60) == 0
    os.close(ours)
    text = shown.decode(errors="replace")
    assert "the processor is idle for" in text
    assert "px of error, depth is wrong" in text
    assert "processing, p50 in ms: decode" in text
    assert "us (hard +-" in text
