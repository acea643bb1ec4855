"""Memory of both programs while they record, and of the host while it replays that recording: is it flat?

What counts is their own memory. Pages of a replayed file that the system keeps for as long as it has room are not. Of a replay the second half
is judged: in the first, what a run keeps for its report fills up to its bounds, as in each run of some thousand pairs.
"""

import os
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from tests.bench.figures import Verdict
from tests.bench.payloads import write_jpegs
from tests.bench.soak_checks import Resident, memory
from tests.support.programs import Program, board, host

_FPS = 30
_EACH_S = 1.0


def measured(folder: Path, minutes: float, tell: Callable[[str], None]) -> Iterator[Verdict]:
    """Record so long, replay that, and judge each program's memory.

    Args:
        folder: an empty one, for 180 MB a minute.
        minutes: how long.
        tell: is told what goes on.
    """
    film, recording = folder / "film", folder / "long.mcap"
    for side in ("left", "right"):
        (film / side).mkdir(parents=True)
        write_jpegs(film / side)
    link = f"ipc://{folder}/link"
    own = ["--link", link, "--camera", f"replay:{film}/right?fps={_FPS}&loop=1"]
    words = ["record", *own, "--out", str(recording), "--seconds", str(60 * minutes)]
    tell(f"recording for {minutes:g} minutes")
    sends = ["run", "--camera", f"replay:{film}/left?fps={_FPS}&loop=1", "--link", link]
    with board(sends, folder) as agent, host(words, folder, "record") as recorder:
        samples = _sampled({"board-agent": agent, "phone-host record": recorder}, recorder)
    tell(f"replaying {recording.stat().st_size / 1e6:.0f} MB")
    depth = ["--rectified", "--disparities", "32", "--scale", "0.25", "--save-every", "0"]
    with host(["run", "--replay", str(recording), *depth, "--out", str(folder / "out")], folder, "replay") as replay:
        taken = _sampled({"": replay}, replay)[""]
        samples["phone-host run --replay, second half"] = taken[len(taken) // 2 :]
    ends = {"record": (recorder, {0}), "run --replay": (replay, {0, 4})}  # 4: both films show the same, which is said
    for name, (program, good) in ends.items():
        code = program.process.returncode
        yield Verdict(f"exit code of {name} after {minutes:g} minutes", code in good, str(code), "no failure")
    for name, sizes in samples.items():
        check = memory("recording", name, sizes)
        yield Verdict(f"{check.what}, {minutes:g} minutes recorded", check.holds, check.found, check.limit)


def _sampled(programs: Mapping[str, Program], last: Program) -> dict[str, list[Resident]]:
    """Look at programs once a second until one of them ends."""
    samples: dict[str, list[Resident]] = {name: [] for name in programs}
    while last.process.poll() is None:
        for name, program in programs.items():
            if size := _own_bytes(program.process.pid):
                samples[name].append(Resident(time.monotonic_ns(), size))
        time.sleep(_EACH_S)
    return samples


def _own_bytes(pid: int) -> int:
    """Return a process's memory without pages of files; 0: it has ended."""
    try:
        resident, shared = map(int, Path(f"/proc/{pid}/statm").read_text().split()[1:3])
    except (OSError, ValueError):
        return 0
    return (resident - shared) * os.sysconf("SC_PAGE_SIZE")
