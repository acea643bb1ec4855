"""The host's part of the soak: both real programs over loopback TCP at 30 pairs a second, with a cheap matcher."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import cv2

from phone_host.subprocesses.board_process import free_port
from tests.bench.soak_checks import Check, Resident, count, drift, memory
from tests.support.planes import plane
from tests.support.programs import Program, board, host, ledgers, lines

_FPS: Final = 30
_VIEWS: Final = 30
_SAMPLES: Final = 300
"""Samples of each process's memory over the run."""

_WINDOW: Final = 0.15
"""Share of the pairs compared at each end of the run."""

_PART: Final = "host"
_DELAYS: Final = ("capture", "outbox", "propagation", "pairing", "queuing", "processing", "end_to_end")


def soak_host(folder: Path, minutes: float, tell: Callable[[float], None]) -> list[Check]:
    """Run both programs for a while.

    Args:
        folder: for images and results.
        minutes: how long, from the first pair.
        tell: receives the share that is done.
    """
    _write_views(folder)
    address, out = f"tcp://127.0.0.1:{free_port()}", folder / "out"
    left, right = (f"replay:{folder / side}?fps={_FPS}&loop=1" for side in ("left", "right"))
    core = ("--rectified", "--disparities", "32", "--matcher", "block", "--save-every", "0")
    samples: dict[str, list[Resident]] = {"board-agent": [], "phone-host": []}
    with (
        board(["run", "--camera", left, "--link", address, "--json"], folder) as agent,
        host(["run", "--camera", right, "--link", address, "--out", str(out), *core, "--json"], folder) as receiver,
    ):
        while lines(out / "delays.jsonl") < _FPS:
            _check_alive(agent, receiver)
            time.sleep(0.1)
        began, length_s = time.monotonic(), minutes * 60
        while (passed_s := time.monotonic() - began) < length_s:
            _check_alive(agent, receiver)
            for name, program in (("board-agent", agent), ("phone-host", receiver)):
                samples[name].append(Resident(time.monotonic_ns(), _resident_bytes(program)))
            tell(passed_s / length_s)
            time.sleep(length_s / _SAMPLES)
        codes = receiver.stop(), agent.stop()
    report, account = receiver.json(), agent.json()
    pairs = ledgers(out)
    checks = [
        count(_PART, f"exit code of {name}", code, 0)
        for name, code in zip(("phone-host", "board-agent"), codes, strict=True)
    ]
    checks += [memory(_PART, name, found) for name, found in samples.items()]
    window = max(_FPS, int(len(pairs) * _WINDOW))
    settled = pairs[min(10 * _FPS, len(pairs) // 4) :]  # the host learns the clock with more echoes for ten seconds
    checks += [drift(_PART, name, [pair[f"{name}_ns"] for pair in settled], window) for name in _DELAYS]
    return [*checks, *_conservation(report, account, len(pairs))]


def _conservation(report: dict[str, Any], account: dict[str, Any], ledger_lines: int) -> list[Check]:
    """Check that every single frame and pair is accounted for."""
    frames, pairs, (session,) = report["frames"], report["pairs_account"], report["sessions"]
    orphaned, dropped = sum(frames["orphaned"].values()), sum(account["dropped"].values())
    used = pairs["processed"] + pairs["undecodable"] + pairs["dropped_fifo"]
    return [
        Check(
            part=_PART,
            what="the end of the session",
            found=session["tail"],
            limit="known",
            holds=session["tail"] == "known",
        ),
        count(_PART, "grabbed = sent + dropped (board)", account["grabbed"], account["sent"] + dropped),
        count(_PART, "sent: the board's account = the host's", account["sent"], session["sent"]),
        count(_PART, "sent = received (lost: 0)", session["sent"], session["received"]),
        count(
            _PART,
            "received = paired + orphaned + held",
            frames["received"],
            frames["paired"] + orphaned + frames["held"],
        ),
        # When the run is stopped, one pair may be with the matcher and one in the FIFO.
        Check(
            part=_PART,
            what="paired = processed + dropped + stopped",
            found=str(frames["paired"]),
            limit=f"{used} + 0..2",
            holds=0 <= frames["paired"] - used <= 2,
        ),
        count(_PART, "a ledger for each processed pair", ledger_lines, pairs["processed"]),
    ]


def _write_views(folder: Path) -> None:
    for side in ("left", "right"):
        (folder / side).mkdir()
    for number in range(_VIEWS):
        pair = plane(width_px=320, height_px=240, seed=number).pair
        for side, image in (("left", pair.left), ("right", pair.right)):
            cv2.imwrite(str(folder / side / f"{number}.jpg"), image)


def _resident_bytes(program: Program) -> int:
    status = Path(f"/proc/{program.process.pid}/status").read_text(encoding="ascii")
    return 1024 * int(status.partition("VmRSS:")[2].split()[0])


def _check_alive(*programs: Program) -> None:
    for program in programs:
        assert program.process.poll() is None, program.stderr[-2000:]
