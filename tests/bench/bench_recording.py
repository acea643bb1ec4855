"""What recording costs and what a broken recording gives: `python -m tests.bench.bench_recording [--help]`.

Figures to reach: the writer's thread takes at most 80 us of CPU for a 50 KB frame of 2 x 30 a second, and the file at most 130 bytes more than
the image (medians of five recordings); a power cut takes a second at most, of recordings whose system calls strace tells; of 1000 files cut at
random and 1000 with a flipped bit every whole chunk is read; pairs with and without --record have the same p99 of the end-to-end delay within 5 % (medians of runs in turn); a replay on demand
gives the same bits twice, one with the clock 99.5 % of the pairs of then, and their median delay within 10 %. The part memory, which is left out
unless named, records for ten minutes and replays them: no program's memory grows. Exit 4 when a figure is missed.
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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from common.frame import PixelFormat
from common.protocol.message import CameraDescription, Pacing
from common.recording.inflate import inflate
from common.recording.mcap_records import Message
from common.recording.recording_file import RecordingFile
from common.recording.salvage import Salvage
from phone_host.model import Side
from phone_host.recording.recorder import Recorder
from tests.bench import recording_memory, recording_power
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.payloads import write_jpegs
from tests.support.programs import board, host, ledgers
from tests.support.recorded import board_frame, own_frame

_FPS = 30
_FRAME_BYTES = 51_283
_CPU_US, _OVERHEAD_BYTES = 80.0, 130.0
_RECORDINGS = 5
_P99_SHARE, _P50_SHARE, _SAME_PAIRS = 0.05, 0.1, 0.995
_FIFO = ("--fifo", "100:drop-newest")
"""Long enough that a busy machine drops no pair: which pairs are formed is what is compared."""

_CHUNK = 8
"""Messages in a chunk of 256 KiB: six frames and what stands between."""


def _record(folder: Path, seconds: int) -> tuple[float, float]:
    """Record 2 x 30 frames a second; return CPU of the writer's thread, us a frame, and bytes beside the image."""
    path = folder / "cost.mcap"
    path.unlink(missing_ok=True)
    recorder = Recorder(RecordingFile(path), Side.LEFT, time.time_ns() - time.monotonic_ns())
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
    frames = recorder.finish().frames
    return used / frames * 1e6, (path.stat().st_size - frames * _FRAME_BYTES) / frames


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


def _cost(folder: Path, options: argparse.Namespace) -> Iterator[Verdict]:
    recorded = [_record(folder, options.seconds) for _ in range(_RECORDINGS)]
    cpu_us, more = (statistics.median(values) for values in zip(*recorded, strict=True))
    limit = f"{_OVERHEAD_BYTES:.0f}"
    yield Verdict("CPU of the writer's thread a frame", cpu_us <= _CPU_US, f"{cpu_us:.0f} us", f"{_CPU_US:.0f} us")
    yield Verdict("bytes a frame beside the image", more <= _OVERHEAD_BYTES, f"{more:.0f}", limit)


def _damages(folder: Path, options: argparse.Namespace) -> Iterator[Verdict]:
    _record(folder, 2)
    worst, wrong_cuts, wrong_flips = _spoiled((folder / "cost.mcap").read_bytes()[:3_000_000], options.spoiled)
    files, found = f"{options.spoiled} files", f"{wrong_flips} read wrongly, the worst lost {worst} messages"
    is_good = not wrong_flips and worst <= _CHUNK
    yield Verdict(f"{files} cut at random", not wrong_cuts, f"{wrong_cuts} read wrongly", "0")
    yield Verdict(f"{files} with a flipped bit", is_good, found, f"0, and one chunk ({_CHUNK})")


def _runs(folder: Path, options: argparse.Namespace) -> Iterator[Verdict]:
    with_it, without, recording = _live(folder, options.rounds, options.seconds)
    is_same, share, longer = _replays(folder, recording, folder / f"recorded{options.rounds - 1}")
    more = statistics.median(with_it) / statistics.median(without) - 1
    limit, same = f"{_P99_SHARE:+.0%} of that without", "the same" if is_same else "different"
    p50 = "p50 end to end in a replay with the clock"
    yield Verdict("p99 end to end with a recording", more <= _P99_SHARE, f"{more:+.1%}", limit)
    yield Verdict("two replays on demand", is_same, same, "the same to the bit")
    yield Verdict(
        "pairs of then in a replay with the clock", share >= _SAME_PAIRS, f"{share:.1%}", f"{_SAME_PAIRS:.1%}"
    )
    yield Verdict(p50, abs(longer) <= _P50_SHARE, f"{longer:+.1%}", f"+-{_P50_SHARE:.0%} of then")


def _power(folder: Path, options: argparse.Namespace) -> Iterator[Verdict]:
    return recording_power.measured(folder, options.seconds)


def _memory(folder: Path, options: argparse.Namespace) -> Iterator[Verdict]:
    return recording_memory.measured(folder, options.minutes, lambda text: print(text, file=sys.stderr))


_PARTS: dict[str, Callable[[Path, argparse.Namespace], Iterator[Verdict]]] = {
    "cost": _cost,
    "damages": _damages,
    "power": _power,
    "runs": _runs,
    "memory": _memory,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--seconds",
        type=int,
        default=15,
        help="of each run and recording; p99 of six seconds is two pairs' (default 15)",
    )
    parser.add_argument("--rounds", type=int, default=5, help="runs with and without a recording, in turn (default 5)")
    parser.add_argument(
        "--spoiled", type=int, default=1000, help="files cut, and files with a flipped bit (default 1000)"
    )
    parser.add_argument("--minutes", type=float, default=10, help="of the part memory (default 10)")
    usual = [name for name in _PARTS if name != "memory"]
    help_text = f"what to measure (default {' '.join(usual)})"
    parser.add_argument("--parts", nargs="+", choices=_PARTS, default=usual, metavar="PART", help=help_text)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args(arguments)
    verdicts: list[Verdict] = []
    for part in options.parts:
        with tempfile.TemporaryDirectory() as name:
            verdicts += _PARTS[part](Path(name), options)
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
