"""Messages to the service manager (sd_notify(3)), with a real datagram socket."""

import os
import socket
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from board_agent.sd_notify import Notifier, ServiceState, socket_address, watchdog_ns

SECOND_NS = 1_000_000_000


def test_each_datagram_says_ready_alive_and_status() -> None:
    """A lost datagram does no harm: each one says READY, feeds the watchdog and gives the status."""
    state = ServiceState(10 * SECOND_NS)
    for moment in range(3):
        assert state.alive(moment, "30.0 fps").split(b"\n") == [b"READY=1", b"WATCHDOG=1", b"STATUS=30.0 fps"]


def test_without_watchdog_it_is_not_fed() -> None:
    """Without a watchdog WATCHDOG is not sent."""
    assert ServiceState(None).alive(0, "x") == b"READY=1\nSTATUS=x"


@given(st.integers(10**6, 10**12), st.lists(st.integers(1, 10**9), min_size=1, max_size=200), st.integers(0, 2**62))
def test_the_watchdog_is_fed_in_time_by_any_loop_that_is_fast_enough(
    limit_ns: int, steps_ns: list[int], start_ns: int
) -> None:
    """However long a loop's rounds take, if each takes less than half the limit, the silence stays below the limit."""
    state, now_ns, fed_ns = ServiceState(limit_ns), start_ns, start_ns
    state.alive(now_ns, "")
    for step_ns in steps_ns:
        now_ns += min(step_ns, limit_ns // 2)
        if state.due(now_ns):
            assert now_ns - fed_ns < limit_ns
            state.alive(now_ns, "")
            fed_ns = now_ns
    assert now_ns - fed_ns < limit_ns


def test_a_status_is_one_line() -> None:
    """A line break in the status cannot inject another message."""
    assert ServiceState(None).stopping("a\nMAINPID=1\n b") == b"STOPPING=1\nSTATUS=a MAINPID=1 b"


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({}, None),
        ({"WATCHDOG_USEC": "10000000"}, 10 * SECOND_NS),
        ({"WATCHDOG_USEC": "10000000", "WATCHDOG_PID": "42"}, 10 * SECOND_NS),
        ({"WATCHDOG_USEC": "10000000", "WATCHDOG_PID": "43"}, None),
        ({"WATCHDOG_USEC": "0"}, None),
        ({"WATCHDOG_USEC": "soon"}, None),
    ],
)
def test_the_watchdog_counts_only_for_the_process_it_is_meant_for(
    environment: dict[str, str], expected: int | None
) -> None:
    """WATCHDOG_USEC is read as microseconds, unless WATCHDOG_PID names another process or the value is no number."""
    assert watchdog_ns(environment, 42) == expected


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({}, None),
        ({"NOTIFY_SOCKET": "/run/systemd/notify"}, "/run/systemd/notify"),
        ({"NOTIFY_SOCKET": "@/org/x"}, "\0/org/x"),
        ({"NOTIFY_SOCKET": "vsock:2:1"}, None),
    ],
)
def test_paths_and_abstract_names_are_sockets(environment: dict[str, str], expected: str | None) -> None:
    """A path stays a path, a leading @ becomes the zero byte of the abstract namespace, and anything else is ignored."""
    assert socket_address(environment) == expected


@pytest.mark.parametrize("kind", ["path", "abstract"])
def test_datagrams_arrive(kind: str, tmp_path: Path) -> None:
    """READY, watchdog, status and STOPPING reach a socket at the address in the environment."""
    path, shown = (str(tmp_path / "notify"),) * 2 if kind == "path" else (f"\0t{os.getpid()}", f"@t{os.getpid()}")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(path)
        notifier = Notifier({"NOTIFY_SOCKET": shown, "WATCHDOG_USEC": "8000000"})
        assert notifier.due(0)
        notifier.alive(0, "waiting")
        assert not notifier.due(SECOND_NS)
        assert manager.recv(4096) == b"READY=1\nWATCHDOG=1\nSTATUS=waiting"
        notifier.stopping("bye")
        assert manager.recv(4096) == b"STOPPING=1\nSTATUS=bye"
        notifier.close()


def test_an_absent_or_busy_service_manager_stops_nothing(tmp_path: Path) -> None:
    """Without a manager nothing is due; there is no wait for one that is gone or does not read."""
    assert not Notifier({}).due(10**18)
    gone = Notifier({"NOTIFY_SOCKET": str(tmp_path / "nowhere")})
    gone.alive(0, "x")
    gone.close()
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        notifier = Notifier({"NOTIFY_SOCKET": str(tmp_path / "notify")})
        for _ in range(5000):  # far more than a socket's queue holds
            notifier.alive(0, "x" * 500)
        notifier.close()
