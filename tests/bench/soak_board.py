"""The board's part of the soak: the installed service on a booted board, a webcam on its bus, our host outside."""

import json
import re
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Final

import numpy as np

from tests.bench.board_guest import OurHost, booted_board
from tests.bench.payloads import write_jpegs
from tests.bench.soak_checks import Check, Resident, count, memory
from tests.vm.guest import UNIT
from tests.vm.machine import Architecture
from tests.vm.uvc import Model
from tests.vm.webcam import Webcam

_FPS: Final = 30
_PERIOD_NS: Final = 1_000_000_000 // _FPS
_SIZE_PX: Final = (640, 480)
_READOUT_NS: Final = 20_000_000
_SAMPLES: Final = 60
"""Memory samples over the run; each one costs the board an ssh command."""

_AGE_PERIODS: Final = 3
_SETTLING_S: Final = 12
"""Excluded from the ages: the camera's exposure and the clock estimate are still settling."""

_PART: Final = "board"
_CAMERA_ACCOUNT: Final = re.compile(
    r' stopped session=\w+ grabbed=(\d+) sent=(\d+) dropped="?(\{.*?\})"? garbage=.* camera="(\{.*\})"'
)


def soak_board(folder: Path, minutes: float, tell: Callable[[float], None]) -> list[Check]:
    """Stream from a booted board for a while.

    Args:
        folder: for images.
        minutes: how long, from the first frames.
        tell: receives the share that is done.

    Raises:
        UnavailableError: there is no image of a board.
    """
    write_jpegs(folder)
    frames = [path.read_bytes() for path in sorted(folder.iterdir())]
    samples = []
    with (
        booted_board(Architecture.AMD64) as board,
        closing(Webcam(frames, _FPS, _READOUT_NS, Model(sizes_px=(_SIZE_PX,), rates_hz=(_FPS,)))) as webcam,
    ):
        board.be_quiet()
        webcam.plug(board.guest)
        board.guest.configure(f"v4l2:auto?size={_SIZE_PX[0]}x{_SIZE_PX[1]}&fps={_FPS}")
        pid = board.service_pid
        with closing(OurHost(board.guest.link)) as receiver:
            board.until_frames(receiver)
            time.sleep(min(_SETTLING_S, minutes * 30))
            settled, began, length_s = len(receiver.ages_ns), time.monotonic(), minutes * 60
            while (passed_s := time.monotonic() - began) < length_s:
                samples.append(Resident(time.monotonic_ns(), board.resident_bytes(pid)))
                tell(passed_s / length_s)
                time.sleep(length_s / _SAMPLES)
        still_the_same = board.service_pid == pid
        board.guest.sh(f"systemctl stop {UNIT}")
        journal = board.guest.journal()
    account, ages_ns = receiver.account, np.array(receiver.ages_ns)[settled:]
    grabbed, sent, dropped, camera = _CAMERA_ACCOUNT.findall(journal)[-1]
    dropped, camera = (json.loads(text.replace("'", '"')) for text in (dropped, camera))
    p50_ms, p99_ms = (float(np.percentile(ages_ns, q)) / 1e6 for q in (50, 99))
    limit_ms = _AGE_PERIODS * _PERIOD_NS / 1e6
    age = f"p50 {p50_ms:.1f}, p99 {p99_ms:.1f} ms over {len(ages_ns)} frames"
    lost = {reason: number for reason, number in dropped.items() if reason not in {"no_host", "stopped"}}
    return [
        Check(
            part=_PART,
            what="the service's process is the first one",
            found=str(still_the_same),
            limit="True",
            holds=still_the_same,
        ),
        count(_PART, "frames that the driver left out", camera["missed"], 0),
        count(_PART, f"frames dropped by the board {lost or ''}".rstrip(), sum(lost.values()), 0),
        count(_PART, "frames lost on the link", account.lost, 0),
        count(_PART, "grabbed = sent + dropped", int(grabbed), int(sent) + sum(dropped.values())),
        count(_PART, "sent = received", int(sent), account.received),
        Check(part=_PART, what="age at the host", found=age, limit=f"p99 < {limit_ms:.0f} ms", holds=p99_ms < limit_ms),
        memory(_PART, "board-agent", samples),
    ]
