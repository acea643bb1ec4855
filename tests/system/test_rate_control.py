"""The board lowers its camera's rate on a cable that is too slow, says so, and raises it again; every frame is accounted for, no pair is wrong."""

import json
from contextlib import AbstractContextManager
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from board_agent.agent import Agent
from board_agent.rate_control import RateControl, Way, ladder
from common import now
from common.camera.base import Grab, Mode, Offers
from common.camera.replay import ReplayCamera, ReplaySettings
from tests.support.board_thread import board_of
from tests.support.numbered import HEIGHT_PX, WIDTH_PX, saved_numbers, write_film
from tests.support.programs import Program, board, host, ledgers, lines, until
from tests.support.pty_line import PtyLine

FPS = 20
LEAST_FPS = 5


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, int]:
    """A replay URI of numbered images on the clock, and the length of the longest."""
    folder = write_film(tmp_path_factory.mktemp("film") / "numbered", 1000)
    return f"replay:{folder}?fps={FPS}&loop=1", max(path.stat().st_size for path in folder.iterdir())


def rungs(program: Program) -> list[int]:
    """The rungs that a program says the camera switched to."""
    steps = [line for line in program.stderr.splitlines() if "camera_stepped" in line]
    return [int(word.partition("=")[2]) for line in steps for word in line.split() if word.startswith("rung=")]


def steps(out: Path) -> list[int]:
    """How many periods of the film lie between the board's frames of consecutive pairs."""
    exposed = [ledger["exposed_ns"] for ledger in ledgers(out)] if lines(out / "delays.jsonl") else []
    return [round((after - before) * FPS / 1e9) for before, after in pairwise(exposed)]


def small_steps(out: Path, most_bytes: int) -> list[int]:
    """The same of pairs whose image has at most this many bytes, as had that before."""
    pairs = ledgers(out) if lines(out / "delays.jsonl") else []
    small = [(before, after) for before, after in pairwise(pairs) if max(before["bytes"], after["bytes"]) <= most_bytes]
    return [round((after["exposed_ns"] - before["exposed_ns"]) * FPS / 1e9) for before, after in small]


def is_small(out: Path, most_bytes: int) -> bool:
    """Whether none of the last 20 images has more bytes than this."""
    lengths = [ledger["bytes"] for ledger in ledgers(out)] if lines(out / "delays.jsonl") >= 20 else []
    return bool(lengths) and max(lengths[-20:]) <= most_bytes


def check_account(out: Path, report: Any, account: Any) -> None:
    """Every pair shows one number twice, and every frame is accounted for on both sides."""
    numbers = saved_numbers(out)
    assert numbers
    assert all(left == right for left, right in numbers)
    frames = report["frames"]
    assert frames["received"] == frames["paired"] + frames["held"] + sum(frames["orphaned"].values())
    [session] = report["sessions"]
    assert session["sent"] >= session["received"] + session["lost"]
    assert account["grabbed"] == account["sent"] + sum(account["dropped"].values())


def test_the_rate_follows_the_line(film: tuple[str, int], tmp_path: Path) -> None:
    """On a line for half of the frames the camera drops to half its rate; on a fast line it returns to the full rate, in one session."""
    uri, largest_bytes = film
    out = tmp_path / "out"
    slow_bytes_per_s = 1.15 * largest_bytes * FPS / 2
    with PtyLine(tmp_path, bytes_per_s=slow_bytes_per_s, delay_ns=1_000_000) as line:
        board_uri, host_uri = line.uris
        receiving = ["run", "--camera", uri, "--link", host_uri, "--out", str(out), "--save-every", "1", "--json"]
        sending = ["run", "--camera", uri, "--link", board_uri, "--least-fps", str(LEAST_FPS), "--json"]
        with (
            host([*receiving, "--log-level", "info"], tmp_path) as receiver,
            board(sending, tmp_path) as sender,
        ):
            until(lambda: rungs(sender)[-1:] == [1], "half of the rate")
            until(lambda: rungs(receiver)[-1:] == [1], "the host knows")
            # At the whole rate a quarter of the steps would be 1: the line takes 1.74 periods for an image. Longer steps are a busy machine's.
            until(lambda: len(last := steps(out)[-25:]) == 25 and min(last) == 2, "every other image")
            for way in line.ways:
                way.bytes_per_s = 3e6
            until(lambda: rungs(sender)[-1:] == [0], "the whole rate")
            until(lambda: rungs(receiver)[-1:] == [0], "the host knows")
            before = lines(out / "delays.jsonl")
            until(lambda: lines(out / "delays.jsonl") >= before + 30, "pairs at the whole rate")
            assert receiver.stop() == 0
            assert sender.stop() == 0
            report, account = receiver.json(), sender.json()
    check_account(out, report, account)
    [session] = report["sessions"]
    assert session["camera"]["rung"] == 0
    assert session["camera"]["lowest_rung"] == 3  # 10, 6.7 and 5 frames/s
    assert session["camera"]["changes"] == len(rungs(sender)) == len(rungs(receiver)) >= 2
    assert session["camera"]["fps"] == pytest.approx(FPS, abs=0.01)
    assert "Board camera: as it was asked for" in (out / "index.html").read_text()
    assert json.loads((out / "report.json").read_text())["sessions"][0]["camera"] == session["camera"]


class TwoSizes(ReplayCamera):
    """A replay that can show each image at half its size: like a camera that bins four pixels into one.

    Args:
        folder: numbered images.
        small: the same at half their size.
    """

    def __init__(self, folder: Path, small: Path, now_ns: int) -> None:
        chosen = ReplaySettings(path=str(folder), fps=Fraction(FPS), loop=True, clock="board")
        super().__init__(chosen, now_ns)
        self._small = ReplayCamera(replace(chosen, path=str(small)), now_ns)
        whole, half = ((c.description.width_px, c.description.height_px) for c in (self, self._small))
        self.offers = Offers(self.offers.periods_ns[:1], (), (whole, half))
        self._shows_small = False

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Show them at one of the two sizes."""
        self._small.read(now_ns)
        self._shows_small = mode.size_px == self.offers.sizes_px[1]

    def read(self, now_ns: int) -> list[Grab]:
        """Both films go on; one of them is shown."""
        both = super().read(now_ns), self._small.read(now_ns)
        return both[self._shows_small]


def two_sizes(film: Path, small: Path, uri: str) -> AbstractContextManager[Agent]:
    """A board whose camera has two sizes, in a thread."""
    camera = TwoSizes(film, small, now.monotonic_ns())
    return board_of(camera, uri, RateControl(ladder(camera.offers, {Way.SIZE}, 0)))


def test_smaller_images_are_paired_and_enlarged(film: tuple[str, int], tmp_path: Path) -> None:
    """On a line for half of the bytes the camera halves its image size; the host pairs those images at the full rate and enlarges them; none is refused."""
    uri, largest_bytes = film
    folder = Path(uri.removeprefix("replay:").partition("?")[0])
    small = tmp_path / "small"
    small.mkdir()
    for path in folder.iterdir():
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        assert image is not None
        half = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        assert cv2.imwrite(str(small / path.name), half, [cv2.IMWRITE_JPEG_QUALITY, 92])
    small_bytes = max(path.stat().st_size for path in small.iterdir())
    assert small_bytes < min(path.stat().st_size for path in folder.iterdir())
    out = tmp_path / "out"
    with PtyLine(tmp_path, bytes_per_s=largest_bytes * FPS / 2, delay_ns=1_000_000) as line:
        board_uri, host_uri = line.uris
        receiving = ["run", "--camera", uri, "--link", host_uri, "--out", str(out), "--save-every", "1", "--json"]
        with host([*receiving, "--log-level", "info"], tmp_path) as receiver, two_sizes(folder, small, board_uri):
            # Whole images would leave every other one out: no step of 1. Longer steps are a busy machine's.
            until(
                lambda: is_small(out, small_bytes) and small_steps(out, small_bytes).count(1) >= 10,
                "every image, and small ones only",
            )
            assert rungs(receiver)[-1] == 1
            assert receiver.stop() == 0
            report = receiver.json()
    numbers = saved_numbers(out)
    assert len(numbers) >= 25
    assert all(left == right for left, right in numbers)
    shapes = {np.asarray(cv2.imread(str(path / "left.png"))).shape[:2] for path in out.glob("pair-*[0-9]")}
    assert shapes == {(HEIGHT_PX, WIDTH_PX)}
    assert report["pairs_account"]["undecodable"] == 0
    [session] = report["sessions"]
    assert (session["camera"]["size"], session["camera"]["lowest_rung"]) == ("80x60", 1)


def test_without_leave_the_rate_stays(film: tuple[str, int], tmp_path: Path) -> None:
    """A camera whose rate may not be lowered is left alone however slow the line; frames are replaced on the board."""
    uri, largest_bytes = film
    out = tmp_path / "out"
    with PtyLine(tmp_path, bytes_per_s=largest_bytes * FPS / 4, delay_ns=1_000_000) as line:
        board_uri, host_uri = line.uris
        receiving = ["run", "--camera", uri, "--link", host_uri, "--out", str(out), "--save-every", "1", "--json"]
        with (
            host([*receiving, "--pairs", "60"], tmp_path) as receiver,
            board(["run", "--camera", uri, "--link", board_uri, "--json"], tmp_path) as sender,
        ):
            assert receiver.wait() == 0
            assert sender.stop() == 0
            report, account = receiver.json(), sender.json()
    check_account(out, report, account)
    assert rungs(sender) == []
    assert report["sessions"][0]["camera"]["lowest_rung"] == 0
    assert account["dropped"]["replaced"] > 60
