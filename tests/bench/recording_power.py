"""What a power cut takes of a recording: all that was written after the last fsync that had returned. Measured on the real programs, under strace.

Files only grow, so what is on the disk for certain at a moment is their first part, as long as it was when that fsync began. The worst moment
is the one just before the next fsync returns: then the first image behind that part is lost, and all since.
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from common.recording.inflate import inflate
from common.recording.mcap_records import Message
from common.recording.salvage import Salvage
from tests.bench.figures import Verdict
from tests.bench.payloads import write_jpegs
from tests.support.programs import board

_FPS = 30
_MOST_S = 1.0
_CALLS = "write,writev,pwrite64,pwritev,ftruncate,fsync,fdatasync"
_CALL = re.compile(r"^(?P<at>[\d.]+) (?P<name>\w+)\(\d+<(?P<path>.*?)>.*\) = (?P<result>-?\d+).* <(?P<took>[\d.]+)>$")


@dataclass(frozen=True, slots=True)
class Sync:
    """A time at which a file was brought onto the disk.

    Attributes:
        size_bytes: how long the file was when it began.
        done_s: when it returned, s since 1970.
    """

    size_bytes: int
    done_s: float


def syncs(calls: Sequence[str], path: Path) -> list[Sync]:
    """Return the syncs of a file.

    Args:
        calls: lines of strace, in their order.
        path: the file.

    Raises:
        ValueError: something else than appending was done to it.
    """
    size, found = 0, []
    for match in filter(None, map(_CALL.match, calls)):
        if match["path"] != str(path):
            continue
        match match["name"]:
            case "write" | "writev":
                size += int(match["result"])
            case "fsync" | "fdatasync":
                found.append(Sync(size, float(match["at"]) + float(match["took"])))
            case name:
                raise ValueError(f"{path}: {name} is not appending")
    return found


def longest_loss_s(data: bytes, done: Sequence[Sync]) -> float:
    """Return how long the images reach back that a power cut takes at the worst moment, s.

    Args:
        data: the whole file.
        done: its syncs, the last of them after all of it.
    """
    came_s = _images(data)
    worst, on_disk = 0.0, 0
    for sync in done:
        if on_disk < len(came_s):
            worst = max(worst, sync.done_s - came_s[on_disk])
        on_disk = len(_images(data[: sync.size_bytes]))
    return worst


def _images(data: bytes) -> list[float]:
    """Return when the images came that can be read, s since 1970, in the file's order."""
    records = Salvage(memoryview(data), inflate).records() if data else ()
    return [one.log_ns / 1e9 for one in records if isinstance(one, Message) and len(one.data) > 10_000]


def measured(folder: Path, seconds: int) -> Iterator[Verdict]:
    """Record with both programs for so long, and judge.

    Args:
        folder: an empty one.
        seconds: of each recording.
    """
    if shutil.which("strace") is None:
        sys.exit("strace is not installed: install it, or leave out the part power")
    film = folder / "film"
    film.mkdir()
    write_jpegs(film)
    camera, link = f"replay:{film}?fps={_FPS}&loop=1", f"ipc://{folder}/link"
    with board(["run", "--camera", camera, "--link", link], folder):
        words = ["phone_host.cli", "record", "--link", link, "--camera", camera]
        host = _traced(folder, "host", words, seconds)
    alone = _traced(folder, "board", ["board_agent.cli", "record", "--camera", camera], seconds)
    for name, (data, done) in {"phone-host record": host, "board-agent record": alone}.items():
        worst = longest_loss_s(data, done)
        yield Verdict(f"{name}: a power cut takes at most", worst <= _MOST_S, f"{worst:.2f} s", f"{_MOST_S:.0f} s")
    without = longest_loss_s(host[0], host[1][1::2])
    found = f"{without:.2f} s"
    yield Verdict("the same if every second sync were missing", without > _MOST_S, found, f"more than {_MOST_S:.0f} s")


def _traced(folder: Path, name: str, words: Sequence[str], seconds: int) -> tuple[bytes, list[Sync]]:
    """Record, and return the file and its syncs."""
    path, trace = folder / f"{name}.mcap", folder / name
    command = ["strace", "-ff", "-ttt", "-T", "-y", "-s", "0", "-e", f"trace={_CALLS}", "-o", str(trace)]
    command += [sys.executable, "-P", "-m", *words, "--out", str(path), "--seconds", str(seconds)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=seconds + 60, check=False)
    if ended.returncode:
        sys.exit(f"{' '.join(words)} ended with {ended.returncode}: {ended.stderr[-400:]}")
    calls = [line for each in folder.glob(f"{name}.[0-9]*") for line in each.read_text().splitlines()]
    done = syncs(sorted(calls, key=lambda line: float(line.partition(" ")[0])), path)
    return path.read_bytes(), done
