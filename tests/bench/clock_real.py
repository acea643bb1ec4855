"""The error of the clock estimate between two real processes on one machine, for bench_clock: a board-agent and our `Receiver`."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common import now
from common.link.factory import open_link, parse_link
from phone_host.stream.receiver import Receiver
from phone_host.subprocesses.board_process import board_process, free_port
from phone_host.sync.clock import ClockEstimate
from tests.bench.machine import Busyness, be_quiet, may_use_fifo
from tests.bench.payloads import write_raw
from tests.support.unkept import Unkept

_LENGTH_S = 13.0
_STEP_S = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class RealRow:
    """Figures for one load, us; how busy each core was with any work, %."""

    load: str
    scheduling: str
    early_p50_us: float
    early_p99_us: float
    late_p50_us: float
    late_p99_us: float
    uncertainty_us: float
    contained: float
    bound_us: float
    round_trip_us: float
    load_average: float
    busy_percents: tuple[int, ...]


def measure(runs: int) -> list[RealRow]:
    """Measure idle and under raw frames, with and without SCHED_FIFO and a core for each side where permitted.

    Args:
        runs: sessions per row.
    """
    rows = []
    with tempfile.TemporaryDirectory() as name:
        idle, raw = Path(name) / "idle", Path(name) / "raw"
        for folder in (idle, raw):
            folder.mkdir()
        write_raw(raw)
        (idle / "0.png").write_bytes(next(raw.iterdir()).read_bytes())
        for fifo in (True, False) if may_use_fifo() else (False,):
            rows.append(_measured("idle, one frame/s", idle, 1, runs, fifo=fifo))
            rows.append(_measured("raw frames, 30/s", raw, 30, runs, fifo=fifo))
    return rows


@contextmanager
def _scheduling(*, fifo: bool) -> Iterator[list[int]]:
    """While the block lasts, run on the first core with priority over ordinary work; restore everything afterwards."""
    cores, policy, parameter = sorted(os.sched_getaffinity(0)), os.sched_getscheduler(0), os.sched_getparam(0)
    if fifo:
        be_quiet(0)
    try:
        yield cores
    finally:
        os.sched_setscheduler(0, policy, parameter)
        os.sched_setaffinity(0, cores)


def _measured(load: str, folder: Path, fps: int, runs: int, *, fifo: bool) -> RealRow:
    address = f"tcp://127.0.0.1:{free_port()}"
    seen: list[tuple[float, int, ClockEstimate]] = []
    busyness = Busyness()
    with (
        _scheduling(fifo=fifo) as cores,
        board_process(f"replay:{folder}?fps={fps}&loop=1", address),  # inherits the first core
    ):
        if fifo:
            os.sched_setaffinity(0, {cores[-1]})
        for _ in range(runs):
            seen += _session(address)
    errors = [(age_s, abs(estimate.offset_at(at_ns)) / 1e3) for age_s, at_ns, estimate in seen]
    early, late = [e for age, e in errors if 1 <= age < 2], [e for age, e in errors if age >= 10]
    return RealRow(
        load=load,
        scheduling="SCHED_FIFO, a core each" if fifo else "ordinary",
        early_p50_us=float(np.percentile(early, 50)),
        early_p99_us=float(np.percentile(early, 99)),
        late_p50_us=float(np.percentile(late, 50)),
        late_p99_us=float(np.percentile(late, 99)),
        uncertainty_us=float(
            np.median([estimate.uncertainty_at(at_ns) / 1e3 for age, at_ns, estimate in seen if age >= 10])
        ),
        contained=float(
            np.mean([abs(estimate.offset_at(at_ns)) <= estimate.uncertainty_at(at_ns) for _, at_ns, estimate in seen])
        ),
        bound_us=float(np.median([estimate.bound_at(at_ns) / 1e3 for age, at_ns, estimate in seen if age >= 10])),
        round_trip_us=float(np.median([estimate.round_trip_ns / 1e3 for age, _, estimate in seen if age >= 10])),
        load_average=os.getloadavg()[0],
        busy_percents=busyness.percents,
    )


def _session(address: str) -> Iterator[tuple[float, int, ClockEstimate]]:
    """Run one host session; returns (seconds since the first echo, host's time, estimate)."""
    link = open_link(parse_link(address, listens_by_default=False))
    receiver = Receiver([link], now.random_id(), Unkept())
    receiver.start()
    start_ns = 0
    while (age_s := (now.monotonic_ns() - start_ns) / 1e9) < _LENGTH_S or not start_ns:
        time.sleep(_STEP_S)
        estimate = receiver.estimate
        if estimate is None:
            continue
        start_ns = start_ns or now.monotonic_ns()
        yield age_s, now.monotonic_ns(), estimate
    receiver.stop()
    if receiver.failure is not None:
        raise receiver.failure
