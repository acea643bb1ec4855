"""The same signals end the verbs that need two cameras, or compute: what they have come to stays. Beside test_signals.py, which has the others."""

import functools
import json
import os
import re
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import pytest
from _pytest.mark import ParameterSet

from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.board_films import FPS, SECONDS, board_films
from tests.support.planes import noise
from tests.support.programs import Program, board, children_of, command_of, lines, program, until
from tests.support.rigs import small_rig
from tests.support.terminal import in_terminal

SIGNALS: Final = (signal.SIGHUP, signal.SIGQUIT, signal.SIGTERM)


@dataclass(frozen=True, slots=True)
class Verb:
    """A verb that runs until it is stopped.

    Attributes:
        module: of its program.
        arguments: of its command line; {} is the folder.
        begins: what shows, one after the other, that it has something to lose; takes the folder and the program.
        left: file that it leaves; {} is the folder.
        is_streaming: whether it takes the film of a board process.
    """

    module: str
    arguments: str
    begins: tuple[Callable[[Path, Program], bool], ...]
    left: str
    is_streaming: bool = True


_OURS: Final = "--link ipc://{}/link --camera replay:{}/right?fps=10&loop=1"


def _rendered(images: int) -> Callable[[Path, Program], bool]:
    """So many images of the demo's film are there, or all: a busy machine takes minutes for them."""
    return lambda folder, _: (folder / "demo" / "rig.yaml").exists() or len([*folder.glob("demo/film/*/*")]) >= images


VERBS: Final = {
    "scan": Verb(
        "phone_host.cli",
        f"scan {_OURS} --calibration {{}}/small.yaml --out {{}}/scan --json",
        (lambda _, running: "model" in running.stderr,),
        "{}/scan/model.ply",
    ),
    "calibrate --live": Verb(
        "phone_host.cli",
        f"calibrate --live {_OURS} --square 25mm --no-sound --views 90 --out {{}}/rig/rig.yaml --json",
        (lambda _, running: "taken: 2" in running.stderr, lambda _, running: "taken: 5" in running.stderr),
        "{}/rig/rig.yaml",
    ),
    "demo": Verb(
        "phone_host.cli",
        "demo --seconds 600 --out {}/demo --json",
        (
            *(_rendered(images) for images in range(20, 200, 20)),
            lambda folder, _: lines(folder / "demo" / "delays.jsonl") >= 3,
        ),
        "{}/demo/report.json",
        is_streaming=False,
    ),
    "delay-bench": Verb(
        "phone_host.bench.cli",
        "--links ipc --size 160x120 --fps 15 --seconds 600 --out {}/bench --json",
        (lambda _, running: any(b"board_agent" in command_of(child) for child in children_of(running.process.pid)),),
        "{}/bench/delay-bench.json",
        is_streaming=False,
    ),
}


def _cases() -> list[ParameterSet]:
    """All combinations; every day each verb by one signal, and each signal once at least."""
    return [
        pytest.param(name, number, id=f"{name} {number.name}", marks=[] if row % 3 == column else [pytest.mark.slow])
        for row, name in enumerate(VERBS)
        for column, number in enumerate(SIGNALS)
    ]


@contextmanager
def _films(folder: Path, *, still: bool) -> Iterator[None]:
    board_films(folder)
    for path in folder.glob("*/*.jpg"):
        if still and int(path.stem) >= round(SECONDS * FPS):
            path.unlink()
    write_rig(folder / "small.yaml", small_rig(), rectify_rig(small_rig()))
    camera = f"replay:{folder}/left?fps={FPS}&loop=1"
    with board(["run", "--camera", camera, "--link", f"ipc://{folder}/link"], folder):
        yield


def _is_there_or_over(begins: Callable[[Path, Program], bool], folder: Path, running: Program) -> bool:
    return running.process.poll() is not None or begins(folder, running)


@pytest.mark.parametrize(("name", "number"), _cases())
def test_a_stream_ends_in_order_with_what_it_has_come_to(name: str, number: signal.Signals, tmp_path: Path) -> None:
    """Its results are whole, its account is printed, and the exit code is 0."""
    verb = VERBS[name]
    arguments = verb.arguments.replace("{}", str(tmp_path)).split()
    with (
        _films(tmp_path, still=name == "scan") if verb.is_streaming else nullcontext(),
        program(verb.module, arguments, tmp_path, "verb") as running,
    ):
        for begins in verb.begins:
            until(functools.partial(_is_there_or_over, begins, tmp_path, running), f"{name} has begun")
        assert running.stop(number) == 0, running.stderr
        assert isinstance(running.json(), dict)
        assert "Traceback" not in running.stderr
    assert Path(verb.left.replace("{}", str(tmp_path))).stat().st_size > 0


@pytest.mark.parametrize(
    "number", [signal.SIGHUP, *(pytest.param(each, marks=pytest.mark.slow) for each in SIGNALS[1:])]
)
def test_a_computation_keeps_what_it_has_come_to(number: signal.Signals, tmp_path: Path) -> None:
    """`quality` over many pairs: the report holds those that are done, and the exit code is 128 and the signal's number."""
    wide = noise(328, 96)
    for side, shift_px in (("left", 0), ("right", 8)):
        folder = tmp_path / side
        folder.mkdir()
        cv2.imwrite(str(folder / "0.png"), wide[:, shift_px : shift_px + 320])
        for copy in range(1, 400):
            os.link(folder / "0.png", folder / f"{copy}.png")
    geometry = ["--rectified", "--disparities", "16", "--focal", "200", "--baseline", "100mm"]
    words = ["quality", str(tmp_path / "left"), str(tmp_path / "right"), *geometry, "--out", str(tmp_path / "out")]
    with in_terminal([sys.executable, "-P", "-m", "phone_host.start", *words], 100, tmp_path) as running:
        until(lambda: not running.read() or re.search(rb" [1-9]\d*/400", running.seen) is not None, "a pair is done")
        running.process.send_signal(number)
        assert running.read_all() == 128 + number, running.seen
    assert b"Traceback" not in running.seen
    assert json.loads((tmp_path / "out" / "report.json").read_text())["pairs"]
