"""Everything that happens to a board in months, on a booted one: after each fault the stream is back, no pair is wrong, every frame is counted."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.programs import ledgers, until
from tests.vm.guest import NETWORK_CARD, UNIT, Guest
from tests.vm.stream import Film, Skew, board_accounts, check_journal, kill, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board


@pytest.fixture(autouse=True)
def _sound_afterwards(guest: Guest, webcam: Webcam) -> Iterator[None]:
    """After each test the service is up, its accounts balance and it has never shown a traceback."""
    assert webcam.plugged
    yield
    check_journal(guest)


def test_pairs_are_right_and_delays_add_up(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """50 pairs: correct images, one session, nothing lost, positive delays with an exact sum, and a status that states the rate."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(50, "at the start")
        guest.until("StatusText", "sent to the host", "the status tells the rate")
        report = stream.finish(skew)
    assert len(report["sessions"]) == 1
    assert report["sessions"][0]["lost"] == 0
    assert report["sessions"][0]["tail"] == "known"
    guest.until("StatusText", "waiting for a host on tcp://*:5555", "the status tells that the host has left")


def test_the_clock_estimate_is_true(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """The offset in every ledger is within its stated uncertainty of the offset measured from outside."""
    clock = guest.clock()
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(30, "at the start")
        offset_ns, error_ns = clock.offset_ns()
        stream.finish(skew)
    clock.close()
    for ledger in ledgers(tmp_path / "out"):
        # Added to the board's clock, the product's offset gives the host's.
        assert abs(ledger["offset_ns"] + offset_ns) <= ledger["uncertainty_ns"] + error_ns, ledger


def test_a_killed_agent_is_restarted(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """After SIGKILL systemd restarts the agent, and the same host pairs frames of the new session."""
    restarts = int(guest.show("NRestarts"))
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the kill")
        guest.sh(f"systemctl kill -s KILL {UNIT}")
        stream.more(10, "after the kill")
        report = stream.finish(skew)
    assert int(guest.show("NRestarts")) == restarts + 1
    assert [session["tail"] for session in report["sessions"]] == ["unknown", "known"]


def test_a_hung_agent_is_restarted_by_the_watchdog(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """If the agent's loop stops (SIGSTOP), the watchdog kills it and it is started again."""
    restarts = int(guest.show("NRestarts"))
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the stop")
        guest.sh(f"systemctl kill -s STOP {UNIT}")
        until(lambda: int(guest.show("NRestarts")) == restarts + 1, "the watchdog restarts the service")
        stream.more(10, "after the restart")
        report = stream.finish(skew)
    assert "Watchdog timeout" in guest.journal()
    assert len(report["sessions"]) == 2


def test_a_restarted_service_says_goodbye(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """`systemctl restart` ends the session with its account known to the host, and the next one streams."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the restart")
        guest.sh(f"systemctl restart {UNIT}")
        stream.more(10, "after the restart")
        report = stream.finish(skew)
    assert [session["tail"] for session in report["sessions"]] == ["known", "known"], stream.receiver.stderr
    accounts = board_accounts(guest.journal())
    first = report["sessions"][0]
    assert accounts[first["session"]]["sent"] >= first["sent"]  # an earlier host had the first ones


def test_wall_clock_jumps_change_nothing(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """The date set to 1970 and back, as on a board without a clock that meets a time server, ends no session; nor does a service that starts in 1970 fail."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the jump")
        # Linux refuses a date before its own boot: here 1970 began about an hour before this boot.
        guest.sh("date -s @$(($(cut -d. -f1 /proc/uptime) + 3600))")
        stream.more(10, "in 1970")
        guest.sh(f"systemctl restart {UNIT}")
        stream.more(10, "of a service that started in 1970")
        guest.sh(f"date -s @{int(time.time())}")
        stream.more(10, "back in the present")
        report = stream.finish(skew)
    assert [(session["lost"], session["tail"]) for session in report["sessions"]] == [(0, "known")] * 2


def test_a_host_that_died_is_forgotten_and_a_new_one_served(
    guest: Guest, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """While the host is dead the board drops frames at the source and says so; a new host gets fresh frames of the same session."""
    with streaming(guest, film.right, tmp_path / "first") as stream:
        stream.more(10, "of the first host")
        kill(stream)
    guest.until("StatusText", "waiting for a host", "the board has forgotten the dead host")
    with streaming(guest, film.right, tmp_path / "second") as stream:
        stream.more(10, "of the second host")
        stream.finish(skew)
    last, first = ledgers(tmp_path / "first")[-1], ledgers(tmp_path / "second")[0]
    assert last["session"] == first["session"]
    assert first["sequence"] > last["sequence"]


def test_a_full_disk_stops_nothing(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """With not one free block on the board's disk the stream goes on, and the service can even be restarted."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before")
        guest.code("dd if=/dev/zero of=/filler bs=1M 2>/dev/null")
        try:
            assert guest.code("dd if=/dev/zero of=/var/tmp/more bs=64k count=64 2>/dev/null") != 0, "the disk is full"
            stream.more(10, "on a full disk")
            guest.sh(f"systemctl restart {UNIT}")
            stream.more(10, "started on a full disk")
        finally:
            guest.sh("rm -f /filler /var/tmp/more")
        report = stream.finish(skew)
    assert len(report["sessions"]) == 2


@pytest.mark.parametrize("shape", ["delay 10ms 5ms loss 1% rate 20mbit", "rate 100kbit"], ids=["wireless", "crawling"])
def test_a_bad_link_costs_frames_but_never_rightness(
    guest: Guest, film: Film, skew: Skew, shape: str, tmp_path: Path
) -> None:
    """With delay, jitter and loss, and with a seventeenth of the rate that the frames need, the pairs that arrive are correct; then the full rate returns."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "on a good link")
        guest.sh(f"tc qdisc add dev {NETWORK_CARD} root netem {shape}")
        try:
            stream.more(8, f"with {shape}")
        finally:
            guest.sh(f"tc qdisc del dev {NETWORK_CARD} root")
        stream.more(20, "on a good link again")
        report = stream.finish(skew)
    assert report["sessions"][-1]["tail"] == "known"


def test_a_cut_link_heals(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """A cable pulled until both sides have given up: when it is plugged in again, the stream returns."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the cut")
        guest.sh(f"ip link set {NETWORK_CARD} down")
        try:
            guest.until("StatusText", "waiting for a host", "the board gives the host up")
            stream.until_said("board_gone", "the host gives the board up")
        finally:
            guest.sh(f"ip link set {NETWORK_CARD} up")
        stream.more(10, "after the cut")
        stream.finish(skew)


def test_a_rebooted_board_comes_back_by_itself(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """After a reboot, which sets the board's clock to zero, the same host pairs the correct images by the new clock."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the reboot")
        webcam.unplug()  # its USB bus goes down with the board
        guest.reboot()
        webcam.plug(guest)
        stream.more(20, "after the reboot")
        stream.finish(skew)
    sessions = [ledger["session"] for ledger in ledgers(tmp_path / "out")]
    assert len(set(sessions)) == 2
    assert sessions == sorted(sessions, key=sessions.index)
