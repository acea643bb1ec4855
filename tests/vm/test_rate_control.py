"""Rate control on a real driver: uvcvideo's camera gives less over a slow network and everything over a fast one; and links without their devices."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Final

import cv2
import numpy as np
import pytest

from tests.support.programs import ledgers, lines, until
from tests.vm import uvc
from tests.vm.conftest import CAMERA, READOUT_MS
from tests.vm.guest import NETWORK_CARD, OPEN_TO_ALL, UNIT, Guest
from tests.vm.stream import FPS, Film, Skew, check_journal, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board

SLOW_FPS: Final = FPS // 2
MODEL: Final = uvc.Model(sizes_px=((320, 240), (160, 120)), rates_hz=(FPS, SLOW_FPS))
SETTINGS: Final = "/etc/tandemscan/board-agent.toml"


@pytest.fixture(scope="module")
def halves(film: Film) -> list[bytes]:
    """The left images at half their size, as from a camera that bins four pixels into one."""
    small = []
    for jpeg in film.frames:
        image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert image is not None
        half = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        done, encoded = cv2.imencode(".jpg", half, [cv2.IMWRITE_JPEG_QUALITY, 60])
        assert done
        small.append(encoded.tobytes())
    return small


@pytest.fixture(scope="module")
def webcam(guest: Guest, film: Film, halves: list[bytes]) -> Iterator[Webcam]:
    """A webcam with two sizes, each at two rates, whose owner allows size and rate to be lowered."""
    camera = Webcam(film.frames, FPS, READOUT_MS * 1_000_000, MODEL, halves)
    camera.plug(guest)
    lowered = f"-e 's|^least_fps = .*|least_fps = {SLOW_FPS}|' -e 's|^adapt = .*|adapt = [\"rate\", \"size\"]|'"
    guest.sh(f"sed -i {lowered} {SETTINGS} && systemctl restart {UNIT}")
    yield camera
    camera.close()


@contextmanager
def network_for(guest: Guest, frames: list[bytes], fps: float) -> Iterator[None]:
    """A network that carries this many of these frames a second; Ethernet, IP and TCP headers are a twentieth."""
    bits_per_s = round(1.05 * 8 * fps * sum(map(len, frames)) / len(frames))
    guest.sh(f"tc qdisc add dev {NETWORK_CARD} root netem rate {bits_per_s}bit limit 1000")
    try:
        yield
    finally:
        guest.sh(f"tc qdisc del dev {NETWORK_CARD} root")


def steps(out: Path) -> list[int]:
    """How many of the film's periods lie between consecutive ones of the last eleven pairs; nothing while there are fewer."""
    if lines(out / "delays.jsonl") < 11:
        return []
    exposed = [ledger["exposed_ns"] for ledger in ledgers(out)[-11:]]
    return [round((after - before) * FPS / 1e9) for before, after in pairwise(exposed)]


def rungs(log: str) -> list[int]:
    """The rungs that a program has reported."""
    told = [line for line in log.splitlines() if "camera_stepped" in line]
    return [int(word.partition("=")[2]) for line in told for word in line.split() if word.startswith("rung=")]


def climb(guest: Guest) -> None:
    """Wait until the camera is back at rung 0; if a stalled machine fails a trial, wait for the next step, up or down."""
    while (known := rungs(guest.journal()))[-1]:
        until(lambda known=known: rungs(guest.journal()) != known, "the next step")  # type: ignore[misc]  # bound now


def test_rate_and_size_give_way_and_come_back(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """On a network for seven frames the rate is halved, on one for two and a half the size, too, on the full one neither; each pair is correct."""
    out = tmp_path / "out"
    with streaming(guest, film.right, out) as stream:
        stream.more(20, "at the whole rate")
        journal_before = len(rungs(guest.journal()))
        with network_for(guest, film.frames, 7):
            guest.until(
                "StatusText", f"lowered to {SLOW_FPS} fps of 320x240 for the link (rung 1 of 2)", "less is told"
            )
            until(lambda: steps(out) == 10 * [2], "every other image, without a gap")
        with network_for(guest, film.frames, SLOW_FPS / 2):
            guest.until("StatusText", f"lowered to {SLOW_FPS} fps of 160x120 for the link (rung 2 of 2)", "still less")
            until(lambda: steps(out) == 10 * [2], "every other image, small, without a gap")
            assert ledgers(out)[-1]["bytes"] < min(map(len, film.frames)) / 2
        climb(guest)
        until(lambda: steps(out) == 10 * [1] and "lowered" not in guest.show("StatusText"), "every image again")
        report = stream.finish(skew)
        told = stream.receiver.stderr
    [session] = report["sessions"]
    board_rungs = rungs(guest.journal())[journal_before:]
    assert {0, 1, 2} == set(rungs(told)) == set(board_rungs)
    assert (session["camera"]["rung"], session["camera"]["lowest_rung"]) == (0, 2)
    assert session["camera"]["changes"] == len(board_rungs) >= 4
    assert session["camera"]["size"] == "320x240"
    assert "Board camera: as it was asked for (10 frames/s, 320x240), changed" in (out / "index.html").read_text()
    images = [cv2.imread(str(path / "left.png")) for path in out.glob("pair-*[0-9]")]
    assert {np.asarray(image).shape[:2] for image in images} == {(240, 320)}
    assert report["pairs_account"]["undecodable"] == 0
    assert webcam.starts >= len(board_rungs)  # each change of rate or size is a new stream
    check_journal(guest)


def test_an_adapter_that_is_missing_is_waited_for_beside_another_link(guest: Guest) -> None:
    """Without a Bluetooth adapter a board with another link serves that one and says what it waits for; with no other link it ends with exit 3."""
    guest.sh("modprobe rfcomm; mkdir -p /srv/frames && printf 'P5 2 2 255\nabcd' >/srv/frames/1.pgm")
    frames, missing = "replay:/srv/frames?fps=10&loop=1", "rfcomm://*?unpaired=1"
    assert guest.code(f"board-agent run --camera '{frames}' --link '{missing}'") == 3
    guest.configure(frames, missing, OPEN_TO_ALL)
    try:
        guest.until("StatusText", "waiting for a host on rfcomm://*", "both links are served")
        told = [line for line in guest.journal().splitlines() if "link_missing" in line]
        assert len(told) == 1
        assert "needs a Bluetooth adapter" in told[0]
    finally:
        guest.configure(CAMERA)
