"""The Python API and its examples, with real boards, and with programs that are slow, that leave, or that fail."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from common.errors import SettingsError, UnavailableError
from phone_host.api import open_scanner
from phone_host.model import CameraModel, Disparity, RectifiedPair, Rig
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.numbered import HEIGHT_PX, WIDTH_PX, number_of, saved_numbers, write_film
from tests.support.own_threads import own_threads
from tests.support.point_files import read_ply
from tests.support.programs import board, until

ROOT = Path(__file__).resolve().parents[2]
FRAMES = 60


@pytest.fixture
def film(tmp_path: Path) -> Path:
    """Numbered images."""
    return write_film(tmp_path / "film", FRAMES)


@pytest.fixture
def live(film: Path, tmp_path: Path) -> Iterator[tuple[str, str]]:
    """A board that shows 30 frames a second for ever; return its link and a camera for the host that shows the same."""
    link, camera = f"ipc://{tmp_path}/link", f"replay:{film}?fps=30&loop=1"
    with board(["run", "--camera", camera, "--link", link], tmp_path):
        yield link, camera


class Counting:
    """A matcher that belongs to a user's program."""

    def __init__(self) -> None:
        self.calls = 0

    def match(self, pair: RectifiedPair) -> Disparity:
        """Count calls; every pixel has disparity 8."""
        self.calls += 1
        return np.full(pair.left.shape[:2], 8, np.float32)


def test_stills_are_given_one_by_one(film: Path, tmp_path: Path) -> None:
    """With still images on both sides a slow program gets every pair, in order, with the right images, its own matcher's disparity and delays that add up."""
    link, matcher = f"ipc://{tmp_path}/link", Counting()
    camera = f"replay:{film}?pace=demand"
    results = []
    with (
        board(["run", "--camera", camera, "--link", link], tmp_path),
        open_scanner(link=link, camera=camera, matcher=matcher, out=tmp_path / "out", save_every=20) as scanner,
    ):
        for result in scanner:
            results.append(result)
            time.sleep(0.005)
    assert [result.number for result in results] == list(range(FRAMES)) == list(range(matcher.calls))
    for result in results:
        left, right = result.processed.pair.left, result.processed.pair.right
        assert number_of(left) == number_of(right) == result.ledger.sequence
        assert result.processed.disparity is not None
        assert (result.processed.disparity == 8).all()
        ledger = result.ledger
        delays = (ledger.capture_ns, ledger.outbox_ns, ledger.propagation_ns, ledger.pairing_ns, ledger.queuing_ns)
        assert sum(delays) + ledger.processing_ns == ledger.end_to_end_ns
    (account,) = [sink for sink in scanner.snapshot().sinks if sink.name == "program"]
    assert (account.written, account.dropped) == (FRAMES, 0)
    assert len(saved_numbers(tmp_path / "out")) == FRAMES // 20
    assert len((tmp_path / "out" / "delays.jsonl").read_text().splitlines()) == FRAMES
    assert json.loads((tmp_path / "out" / "report.json").read_text())["pairs"] == FRAMES


def test_a_slow_program_gets_the_newest_and_holds_nobody_up(live: tuple[str, str]) -> None:
    """While a program sleeps over one result, pairs are processed as before; the next result is one of the newest, and missed results are counted."""
    link, camera = live
    with open_scanner(link=link, camera=camera) as scanner:
        results = iter(scanner)
        first = next(results)
        until(
            lambda: scanner.snapshot().processed >= first.number + 30, "30 more pairs, though the program does nothing"
        )
        second, _, third = next(results), next(results), next(results)
        snapshot = scanner.snapshot()
    assert second.number >= first.number + 28
    assert third.number > second.number
    (account,) = [sink for sink in snapshot.sinks if sink.name == "program"]
    assert account.written + account.dropped + account.waiting == snapshot.processed
    assert account.dropped >= 27


def test_a_program_may_leave_at_any_time(live: tuple[str, str]) -> None:
    """After `break` in the middle of a lossless scan all its threads have ended."""
    link, camera = live
    before = own_threads()
    with open_scanner(link=link, camera=camera, lossless=True) as scanner:
        for result in scanner:
            if result.number == 3:
                break
    until(lambda: own_threads() <= before, "the scanner's threads are gone")


def test_what_ends_a_run_is_raised(live: tuple[str, str], film: Path, tmp_path: Path) -> None:
    """If no board answers in time, or a matcher fails, the iterator raises that very error."""
    with (
        open_scanner(link=f"ipc://{tmp_path}/nobody", camera=f"replay:{film}?loop=1", wait_s=0.2) as scanner,
        pytest.raises(UnavailableError),
    ):
        next(iter(scanner))

    class Failing:
        def match(self, pair: RectifiedPair) -> Disparity:
            raise ZeroDivisionError(pair)

    link, camera = live
    with open_scanner(link=link, camera=camera, matcher=Failing()) as scanner, pytest.raises(ZeroDivisionError):
        next(iter(scanner))


@pytest.mark.parametrize(
    "wrong",
    [
        {"board_side": "up"},
        {"matcher": "no-such"},
        {"fifo": "0:block"},
        {"link": "carrier-pigeon://x"},
        {"link": []},
        {"pairs": -1},
        {"wait_s": float("nan")},
        {"tolerance_ms": -5.0},
        {"save_every": -1},
        {"near_m": 0.0},
    ],
)
def test_arguments_of_no_sense_are_told_at_once(wrong: dict[str, object], film: Path, tmp_path: Path) -> None:
    """A wrong argument is a SettingsError, and nothing stays open."""
    usual = {"link": f"ipc://{tmp_path}/link", "camera": f"replay:{film}?loop=1"}
    with pytest.raises(SettingsError):
        open_scanner(**(usual | wrong), disparities=16)  # type: ignore[arg-type]


@pytest.mark.parametrize("example", ["save_every_tenth_cloud", "plot_delays", "own_matcher"])
def test_the_examples_do_what_they_say(example: str, live: tuple[str, str], tmp_path: Path) -> None:
    """Each example ends with success and leaves the files it announces."""
    matrix = np.array([[150.0, 0, WIDTH_PX / 2], [0, 150.0, HEIGHT_PX / 2], [0, 0, 1]])
    model = CameraModel(width_px=WIDTH_PX, height_px=HEIGHT_PX, matrix=matrix, distortion=np.zeros(5))
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    write_rig(tmp_path / "rig.yaml", rig, rectify_rig(rig))
    arguments = [*live, *([] if example == "plot_delays" else [str(tmp_path / "rig.yaml")]), "12"]
    done = subprocess.run(
        [sys.executable, ROOT / "examples" / f"{example}.py", *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    match example:
        case "save_every_tenth_cloud":
            assert [path.name for path in sorted(tmp_path.glob("*.ply"))] == ["cloud-000000.ply", "cloud-000010.ply"]
            assert read_ply(tmp_path / "cloud-000010.ply").points_m.shape[1] == 3
        case "plot_delays":
            assert (tmp_path / "delays.svg").read_text().count("<rect") == 16
        case _:
            assert len(done.stdout.splitlines()) == 12


def test_what_was_opened_is_let_go_where_the_rest_cannot_be(film: Path, tmp_path: Path) -> None:
    """A folder in use ends `open_scanner` without an open descriptor, a scanner that was never entered is closed, and one runs only once."""
    link, camera, out = f"ipc://{tmp_path}/link", f"replay:{film}?loop=1", tmp_path / "out"
    scanner = open_scanner(link=link, camera=camera, out=out)
    before = len(list(Path("/proc/self/fd").iterdir()))
    with pytest.raises(UnavailableError, match="is being written by process"):
        open_scanner(link=link, camera=camera, out=out)
    until(lambda: len(list(Path("/proc/self/fd").iterdir())) <= before, "what was opened is closed")
    with pytest.raises(RuntimeError):
        next(iter(scanner))
    scanner.close()
    again = open_scanner(link=link, camera=camera, out=out, wait_s=0.1)
    with pytest.raises(UnavailableError), again:
        until(lambda: again.snapshot().ended == "failed", "there is no board")
    with pytest.raises(RuntimeError):
        again.__enter__()
    settings = json.loads((out / "settings.json").read_text())
    assert settings["wait_s"] == {"value": 0.1, "origin": "open_scanner"}
