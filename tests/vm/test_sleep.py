"""A board that sleeps: its CLOCK_MONOTONIC, the clock of all stamps, stands still while the host's goes on."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.vm.guest import Guest
from tests.vm.stream import Film, Skew, check_journal, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board

SLEEP_S = 1.5
"""Shorter than the silence after which a host gives up its board: then only the board itself reports the sleep. Longer than a
second: the guest's kernel measures a sleep by a clock of whole seconds, and takes a shorter one for none."""


@pytest.fixture(autouse=True)
def _sound_afterwards(guest: Guest, webcam: Webcam) -> Iterator[None]:
    """After each test the service is up, its accounts balance and it has never shown a traceback."""
    assert webcam.plugged
    yield
    check_journal(guest)


def offset_ns(guest: Guest) -> int:
    """Guest's clock minus this machine's."""
    clock = guest.clock()
    found_ns, _ = clock.offset_ns()
    clock.close()
    return found_ns


def test_a_board_that_was_suspended_streams_on(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """Suspended to memory and woken, the board continues in the same session; its clock is measured anew, no pair is wrong."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the sleep")
        before_ns = offset_ns(guest)
        webcam.unplug()  # a USB port without power has no camera
        guest.suspend()
        time.sleep(SLEEP_S)  # the length of the sleep, not a wait for something
        guest.wake()
        webcam.plug(guest)
        stream.more(20, "after the sleep")
        assert before_ns - offset_ns(guest) > 0.9e9 * SLEEP_S, "the board's clock stood still"
        report = stream.finish(skew)
    journal = guest.journal()
    # While the kernel freezes and thaws processes CLOCK_MONOTONIC runs on: where that takes seconds, systemd's watchdog bites first.
    frozen = guest.sh("dmesg | grep -E 'PM:|Freezing|Restarting tasks' || true")
    assert len(report["sessions"]) == 1, f"{frozen}\n{journal}\n{stream.receiver.stderr}"
    assert "slept" in journal
