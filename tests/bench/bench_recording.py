"""What recording costs and what a broken recording gives: `python -m tests.bench.bench_recording [--help]`.

Figures to reach: the writer's thread takes at most 80 us of CPU for a 50 KB frame of 2 x 30 a second, and the file at most 130 bytes more than
the image; no frame waits longer than a second for the disk to have it; of 1000 files cut at random and 1000 with a flipped bit every whole chunk
is read; pairs with and without --record have the same p99 of the end-to-end delay within 5 % (medians of runs in turn); a replay on demand
gives the same bits twice, one with the clock 99.5 % of the pairs of then, and their median delay within 10 %. Exit 4 when a figure is missed.
"""

import argparse
import hashlib
import json
import random
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from common.frame import PixelFormat
from common.protocol.message import CameraDescription, Pacing
from common.recording.opened import inflate
from common.recording.recording_file import RecordingFile
from common.recording.salvage import Message, Salvage
from phone_host.model import Side
from phone_host.recording.recorder import Recorder
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.payloads import write_jpegs
from tests.support.programs import board, host, ledgers
from tests.support.recorded import board_frame, own_frame

_FPS = 30
_FRAME_BYTES = 51_283
_CPU_US, _OVERHEAD_BYTES, _UNSYNCED_S = 80.0, 130.0, 1.0
_P99_SHARE, _P50_SHARE, _SAME_PAIRS = 0.05, 0.1, 0.995
_FIFO = ("--fifo", "100:drop-newest")
"""Long enough that a busy machine drops no pair: which pairs are formed is what is compared."""

_CHUNK = 8
"""Messages in a chunk of 256 KiB: six frames and what stands between."""


class _Timed(RecordingFile):
    """A recording file that notes when it was brought onto the disk."""

    synced: list[float]

    def sync(self) -> None:
        """See RecordingFile."""
        super().sync()
        self.__dict__.setdefault("synced", []).append(time.monotonic())


def _record(folder: Path, seconds: int) -> tuple[float, float, float]:
    """Record 2 x 30 frames a second; return CPU of the writer's thread, us a frame, bytes beside the image, and the longest time between two syncs, s."""
    path = folder / "cost.mcap"
    file = _Timed(path)
    recorder = Recorder(file, Side.LEFT, time.time_ns() - time.monotonic_ns())
    image = random.Random(1).randbytes(_FRAME_BYTES)
    form = PixelFormat.MJPEG
    camera = CameraDescription(
        name="bench", width_px=640, height_px=480, pixel_format=form, period_ns=33_333_333, pacing=Pacing.CLOCK
    )
    recorder.board_camera(camera)
    [thread] = [each for each in threading.enumerate() if each.name == "recorder"]
    assert thread.ident is not None
    clock = time.pthread_getcpuclockid(thread.ident)
    began, before = time.monotonic(), time.clock_gettime(clock)
    for number in range(_FPS * seconds):
        time.sleep(max(0.0, began + number / _FPS - time.monotonic()))
        at_ns = time.monotonic_ns()
        recorder.board_frame(board_frame(number, image, at_ns))
        recorder.own_frame(own_frame(number, image, at_ns))
    used = time.clock_gettime(clock) - before
    account = recorder.finish()
    between = [b - a for a, b in zip([began, *file.synced], file.synced, strict=False)]
    frames = account.frames
    return used / frames * 1e6, (path.stat().st_size - frames * _FRAME_BYTES) / frames, max(between)


def _spoiled(data: bytes, count: int) -> tuple[int, int, int]:
    """Cut and flip so often; return how many messages the worst flip costs, and how many readings of cuts and flips were wrong."""

    def read(spoiled: bytes) -> list[tuple[int, int]]:
        records = Salvage(memoryview(spoiled), inflate).records()
        return [(one.number, one.sequence) for one in records if isinstance(one, Message)]

    whole, random_ = read(data), random.Random(4)
    worst, wrong_cuts, wrong_flips = 0, 0, 0
    for _ in range(count):
        found = read(data[: random_.randrange(9, len(data))])
        wrong_cuts += found != whole[: len(found)]
        flipped = bytearray(data)
        flipped[random_.randrange(len(flipped))] ^= 1 << random_.randrange(8)
        found = read(bytes(flipped))
        wrong_flips += not set(found) <= set(whole)
        worst = max(worst, len(whole) - len(found))
    return worst, wrong_cuts, wrong_flips


def _run(folder: Path, name: str, words: Sequence[str], *, link: str = "") -> Path:
    own = folder / name
    own.mkdir()
    with host(["run", *words, "--out", str(own / "out"), "--json"], own) as running:
        code = running.wait()
        if code not in {0, 4}:  # 4: the two films show the same, which is said
            sys.exit(f"{link}: run {' '.join(words)} ended with {code}: {running.stderr[-400:]}")
    return own


def _live(folder: Path, rounds: int, seconds: int) -> tuple[list[float], list[float], Path]:
    """Runs in turn with and without --record; return the p99 of each, ms, and the folder of the last recorded one."""
    film = folder / "film"
    for side in ("left", "right"):
        (film / side).mkdir(parents=True)
        write_jpegs(film / side)
    address = f"ipc://{folder}/link"
    words = ["--link", address, "--camera", f"replay:{film}/right?fps={_FPS}&loop=1", "--seconds", str(seconds)]
    words += ["--rectified", "--disparities", "32", "--scale", "0.25", "--save-every", "0", *_FIFO]
    with_it, without = [], []
    last = folder
    with board(["run", "--camera", f"replay:{film}/left?fps={_FPS}&loop=1", "--link", address], folder):
        for number in range(rounds):
            plain = _run(folder, f"plain{number}", words)
            last = folder / f"recorded{number}"
            record = ["--record", str(folder / f"s{number}.mcap")]
            _run(folder, f"recorded{number}", [*words, *record])
            without.append(_p99(plain))
            with_it.append(_p99(last))
    return with_it, without, folder / f"s{rounds - 1}.mcap"


def _p99(folder: Path) -> float:
    return float(_report(folder)["delays_ms"]["end_to_end"]["p99"])


def _report(folder: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads((folder / "out" / "report.json").read_text())
    return report


def _pairs(folder: Path) -> set[tuple[int, int]]:
    return {(line["sequence"], line["host_sequence"]) for line in ledgers(folder / "out")}


def _bits(folder: Path) -> str:
    saved = sorted((folder / "out").glob("pair-*/disparity.pfm"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in saved)).hexdigest()


def _replays(folder: Path, recording: Path, live: Path) -> tuple[bool, float, float]:
    """Return whether two replays on demand have the same bits and pairs; of one with the clock, the share of the pairs of then, and how much longer its median pair takes."""
    depth = ["--rectified", "--disparities", "32", "--scale", "0.25", *_FIFO]
    demand = [_run(folder, name, ["--replay", str(recording), *depth, "--save-every", "10"]) for name in ("one", "two")]
    clock = _run(folder, "clock", ["--replay", f"{recording}?pace=clock", *depth, "--save-every", "0"])
    is_same = _pairs(demand[0]) == _pairs(demand[1]) and _bits(demand[0]) == _bits(demand[1])
    then, report = _pairs(live), _report(clock)
    recorded_ms = report["replay"]["recorded_delays_ms"]["end_to_end"]["p50"]
    longer = report["delays_ms"]["end_to_end"]["p50"] / recorded_ms - 1
    return is_same, len(then & _pairs(clock)) / len(then), longer


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=10, help="of each recording and run (default 10)")
    parser.add_argument("--rounds", type=int, default=5, help="runs with and without a recording, in turn (default 5)")
    parser.add_argument(
        "--spoiled", type=int, default=1000, help="files cut, and files with a flipped bit (default 1000)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cpu_us, overhead, between_s = _record(folder, 3 * options.seconds)
        data = (folder / "cost.mcap").read_bytes()[:3_000_000]
        worst, wrong_cuts, wrong_flips = _spoiled(data, options.spoiled)
        with_it, without, recording = _live(folder, options.rounds, options.seconds)
        is_same, share, longer = _replays(folder, recording, folder / f"recorded{options.rounds - 1}")
    more = statistics.median(with_it) / statistics.median(without) - 1
    spoiled, found = f"{options.spoiled} files", f"{wrong_flips} read wrongly, the worst lost {worst} messages"
    same = "the same" if is_same else "different"
    verdicts = [
        Verdict("CPU of the writer's thread a frame", cpu_us <= _CPU_US, f"{cpu_us:.0f} us", f"{_CPU_US:.0f} us"),
        Verdict(
            "bytes a frame beside the image", overhead <= _OVERHEAD_BYTES, f"{overhead:.0f}", f"{_OVERHEAD_BYTES:.0f}"
        ),
        Verdict("longest time between two syncs", between_s <= _UNSYNCED_S + 0.1, f"{between_s:.2f} s", "1.1 s"),
        Verdict(f"{spoiled} cut at random", not wrong_cuts, f"{wrong_cuts} read wrongly", "0"),
        Verdict(
            f"{spoiled} with a flipped bit", not wrong_flips and worst <= _CHUNK, found, f"0, and one chunk ({_CHUNK})"
        ),
        Verdict(
            "p99 end to end with a recording", more <= _P99_SHARE, f"{more:+.1%}", f"{_P99_SHARE:+.0%} of that without"
        ),
        Verdict("two replays on demand", is_same, same, "the same to the bit"),
        Verdict("pairs of then in a replay with the clock", share >= _SAME_PAIRS, f"{share:.1%}", f"{_SAME_PAIRS:.1%}"),
        Verdict(
            "p50 end to end in a replay with the clock",
            abs(longer) <= _P50_SHARE,
            f"{longer:+.1%}",
            f"+-{_P50_SHARE:.0%} of then",
        ),
    ]
    if options.json:
        print(json.dumps({"machine": asdict(machine()), "verdicts": [asdict(one) for one in verdicts]}))
    else:
        console = Console()
        console.print(str(machine()))
        for verdict in verdicts:
            console.print(str(verdict))
    return exit_code(verdicts)


if __name__ == "__main__":
    sys.exit(main())
