"""Where the processor time of a frame goes on both ends of our link: `python -m tests.bench.link_profile [--help]`.

Both ends run as in bench_link (50 KB JPEGs, 30 frames/s, loopback, SCHED_FIFO where allowed). Chosen calls are timed in the steady state: how
often a frame makes each of them, and how long it takes with everything that it calls. Timing adds about 1 us to each call.
"""

import argparse
import functools
import importlib
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.table import Table

from phone_host.subprocesses.board_process import free_port
from tests.bench import link_job
from tests.bench.link_job import Job
from tests.bench.machine import be_quiet, machine
from tests.bench.payloads import write_jpegs

_FPS: Final = 30
_CALLS: Final = {
    "send": (
        ("board_agent.agent", "Agent._poll"),
        ("board_agent.agent", "Agent._receive"),
        ("board_agent.agent", "Agent._grab"),
        ("common.camera.replay", "ReplayCamera.read"),
        ("common.now", "SleepWatch.slept_ns"),
        ("board_agent.agent", "Agent._flush"),
        ("board_agent.agent", "encode_frame"),
        ("common.link.zeromq", "_send"),
        ("board_agent.agent", "Agent._attend"),
    ),
    "receive": (
        ("common.now", "StandstillWatch.look"),
        ("phone_host.stream.receiver", "Receiver._receive"),
        ("phone_host.stream.receiver", "decode"),
        ("common.protocol.host_session", "HostSession.take_frame"),
        ("phone_host.stream.reception", "Reception._accept_frame"),
        ("phone_host.stream.border", "Border.admit"),
        ("phone_host.stream.reception", "Reception._pass"),
        ("phone_host.stream.reception", "Reception._note_clock"),
        ("phone_host.stream.reception", "Reception.tick"),
        ("common.link.zeromq", "_send"),
    ),
}
"""Module and name of each timed call, by end. `Agent._poll` includes the wait, so only its number says anything."""

_WAITS: Final = ("Agent._poll",)


@dataclass(slots=True)
class Spent:
    """Number of calls of a function, and the time in them, ns."""

    calls: int = 0
    ns: int = 0


def main() -> int:
    """Run both ends and print a table for each."""
    parser = argparse.ArgumentParser("python -m tests.bench.link_profile", description=__doc__)
    parser.add_argument("--warm-up", type=float, default=62.0, metavar="S", help="left out (default 62)")
    parser.add_argument("--seconds", type=float, default=10.0, metavar="S", help="measured (default 10)")
    options = parser.parse_args()
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        write_jpegs(Path(folder))
        warm_up = round(options.warm_up * _FPS)
        numbers = [str(warm_up), str(warm_up + round(options.seconds * _FPS))]
        job = [f"tcp://127.0.0.1:{free_port()}", folder, *numbers]
        ends = {
            role: subprocess.Popen(
                [sys.executable, "-m", "tests.bench.link_profile", "--end", role, *job], stdout=subprocess.PIPE
            )
            for role in ("receive", "send")
        }
        told = {role: json.loads(end.communicate()[0]) for role, end in ends.items()}
    for role in ("send", "receive"):
        _print(role, told[role])
    return 0


def _end(role: str, address: str, folder: str, warm_up: str, frames: str) -> None:
    """Be one end; print what its calls took as JSON."""
    spent = {name: _timed(module, name) for module, name in _CALLS[role]}
    before: dict[str, Spent] = {}
    passed = link_job.Tally.passed

    def noted(tally: link_job.Tally, number: int) -> None:
        passed(tally, number)
        if number >= tally.warm_up - 1 and not before:
            before.update({name: Spent(one.calls, one.ns) for name, one in spent.items()})

    link_job.Tally.passed = noted  # type: ignore[method-assign, assignment]
    ours = importlib.import_module("tests.bench.link_ours")
    be_quiet(0 if role == "send" else 1)
    job = Job(address=address, folder=Path(folder), fps=_FPS, warm_up=int(warm_up), frames=int(frames))
    tally = (ours.send_tandemscan if role == "send" else ours.receive_tandemscan)(job)
    measured = int(frames) - int(warm_up)
    rows = {
        name: [(one.calls - before[name].calls) / measured, (one.ns - before[name].ns) / measured / 1000]
        for name, one in spent.items()
    }
    print(json.dumps({"cpu_us": json.loads(tally.report())["cpu_us_per_frame"], "calls": rows}))


def _timed(module: str, name: str) -> Spent:
    """Replace a function or method by one that notes the time in it."""
    owner: Any = importlib.import_module(module)
    *path, last = name.split(".")
    for part in path:
        owner = getattr(owner, part)
    spent, function = Spent(), getattr(owner, last)

    @functools.wraps(function)
    def timed(*given: Any, **named: Any) -> Any:
        begun_ns = time.perf_counter_ns()
        try:
            return function(*given, **named)
        finally:
            spent.calls, spent.ns = spent.calls + 1, spent.ns + time.perf_counter_ns() - begun_ns

    setattr(owner, last, timed)
    return spent


def _print(role: str, told: dict[str, Any]) -> None:
    end = "sender" if role == "send" else "receiver"
    table = Table(title=f"{end}: {told['cpu_us']:.0f} us CPU a frame, all threads", title_justify="left")
    table.add_column("call")
    table.add_column("a frame", justify="right")
    table.add_column("us a frame, with what it calls", justify="right")
    for name, (calls, us) in told["calls"].items():
        table.add_row(name, f"{calls:.2f}", "waits" if name in _WAITS else f"{us:.0f}")
    Console(width=110).print(table)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--end"]:
        _end(*sys.argv[2:])
    else:
        sys.exit(main())
