"""The doctor's verdicts: each reading gives the finding that a person would give, with a remedy wherever something is wrong."""

import os
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from board_agent.doctor.board_doctor import check_keys
from board_agent.doctor.link_checks import LinkReadings, check_link
from common.camera.v4l2_formats import FormatOffer, Rates, Wanted
from common.camera.v4l2_stamps import StampClock, rate_remedy
from common.diagnostic import Diagnostic, Severity
from common.doctor.access import Account, Holder, Node, check_access, may_open
from common.doctor.camera_checks import (
    Offered,
    Sample,
    UsbBus,
    UsbCamera,
    check_absence,
    check_bus,
    check_format,
    check_stream,
    check_taken,
)
from common.doctor.finding import CHECK_FAILED, exit_code, fail, ok, table, values, warn
from common.doctor.unit_check import Unit, check_unit
from common.frame import PixelFormat
from common.keys import KeyFolder
from common.peers import Peer

OK, WARN, FAIL = Severity.OK, Severity.WARN, Severity.FAIL
SERVICE = Account("tandemscan", 995, frozenset({995, 44, 20}), is_me=False)
ME = Account("me", 1000, frozenset({1000}), is_me=True)
VIDEO = Node(path="/dev/video0", uid=0, gid=44, group="video", mode=0o660, open_to_me=False)

MJPG = FormatOffer(letters="MJPG", text="Motion-JPEG", sizes_px=((640, 480), (320, 240)))
OFFERED = Offered((MJPG,), {("MJPG", (640, 480)): Rates((Fraction(30), Fraction(10)))})

SOUND = Sample(
    frames=30,
    spoiled=(),
    missed=0,
    distrusted=0,
    nominal_ns=33_333_333,
    period_ns=33_400_000,
    frame_bytes=50_000,
    first_ns=120_000_000,
    stamps=StampClock.MONOTONIC,
    driver="uvcvideo",
)


def test_every_finding_is_one_line_and_the_exit_code_follows_the_worst() -> None:
    """Each finding has one line, with the remedy behind an arrow; only a failed check makes exit 4; the object counts both kinds."""
    findings = [ok("disk", "50 MB"), warn("usb-log", "a reset", "another cable")]
    assert table(findings).splitlines() == ["ok    disk     50 MB", "warn  usb-log  a reset -> another cable"]
    assert exit_code(findings) == 0
    worse = [*findings, fail("camera", "none", "plug one in")]
    assert exit_code(worse) == 4
    assert (values(worse)["failed"], values(worse)["warnings"], len(values(worse)["checks"])) == (1, 1, 3)


@pytest.mark.parametrize(
    ("node", "account", "may"),
    [
        (VIDEO, SERVICE, True),
        (VIDEO, Account("nobody", 65534, frozenset({65534}), is_me=False), False),
        (VIDEO, Account("root", 0, frozenset({0}), is_me=False), True),
        (Node(path="/dev/video0", uid=0, gid=44, group="video", mode=0o600, open_to_me=False), SERVICE, False),
        (Node(path="/dev/video0", uid=0, gid=44, group="video", mode=0o640, open_to_me=False), SERVICE, False),
        (Node(path="/dev/video0", uid=995, gid=0, group="root", mode=0o600, open_to_me=False), SERVICE, True),
        (Node(path="/dev/video0", uid=0, gid=0, group="root", mode=0o666, open_to_me=False), SERVICE, True),
        (VIDEO, ME, False),
        (
            Node(path="/dev/video0", uid=0, gid=44, group="video", mode=0o660, open_to_me=True),
            ME,
            True,
        ),  # by an access list
    ],
)
def test_access_follows_owner_group_and_mode(node: Node, account: Account, *, may: bool) -> None:
    """Who may read and write a node is judged as the kernel would judge it; for the user who asks, the kernel itself was asked."""
    assert may_open(node, account) is may
    assert check_access("permission", node, account).severity is (OK if may else FAIL)


def test_a_user_outside_the_group_is_told_to_join_and_a_changed_mode_is_named() -> None:
    """If the group has access, the remedy is usermod; if not even the group has, the remedy is for the node itself."""
    outside = check_access("permission", VIDEO, Account("pi", 1000, frozenset({1000}), is_me=False))
    assert "usermod -aG video pi" in outside.remedy
    shut = check_access(
        "permission", Node(path="/dev/video0", uid=0, gid=44, group="video", mode=0o600, open_to_me=False), SERVICE
    )
    assert "chmod 660 /dev/video0" in shut.remedy


def test_an_absent_camera_is_told_from_one_without_driver() -> None:
    """A camera that the USB bus sees without a driver needs the driver; no camera at all means that one must be plugged in."""
    assert "plug one in" in check_absence(0, ()).remedy
    driverless = check_absence(0, (UsbCamera("HD Cam", has_driver=False),))
    assert (driverless.severity, "HD Cam" in driverless.message, "modprobe" in driverless.remedy) == (FAIL, True, True)
    assert check_absence(2, (UsbCamera("HD Cam", has_driver=True),)).severity is FAIL


@pytest.mark.parametrize(
    ("wanted", "verdict", "word"),
    [
        (Wanted(), OK, "MJPG 640x480 at 30"),
        (Wanted((640, 480), Fraction(10)), OK, "at 10"),
        (Wanted((800, 600)), FAIL, "640x480, 320x240"),
        (Wanted((640, 480), Fraction(60)), FAIL, "30, 10"),
        (Wanted(pixel_format=PixelFormat.YUYV), FAIL, "MJPG"),
    ],
)
def test_what_is_asked_is_held_against_the_offer(wanted: Wanted, verdict: Severity, word: str) -> None:
    """An offered format is named; for one that is not offered the finding lists those that are."""
    finding = check_format("/dev/video0", OFFERED, wanted)
    assert finding.severity is verdict
    assert word in finding.message + finding.remedy


@pytest.mark.parametrize(
    ("megabits", "cameras", "frame_bytes", "verdict"),
    [
        (480, 1, 50_000, OK),  # MJPEG: 1.5 of 24.6 MB/s
        (480, 1, 640 * 480 * 2, OK),  # YUYV 640x480: 18.4 MB/s fits
        (480, 2, 640 * 480 * 2, WARN),  # two of them do not
        (480, 1, 1280 * 720 * 2, FAIL),  # 55 MB/s
        (12, 1, 50_000, FAIL),  # 1.5 of 1.0 MB/s
        (12, 1, 10_000, WARN),  # a slow port, but it is enough
        (5000, 2, 1920 * 1080 * 2, OK),
    ],
)
def test_the_bus_is_judged_by_bytes_a_second(
    megabits: float, cameras: int, frame_bytes: int, verdict: Severity
) -> None:
    """30 frames a second against what USB 2.0 (5.6.3) gives one endpoint: 24.576 MB/s at high, 1.023 MB/s at full speed."""
    assert check_bus(UsbBus("1-1", megabits, cameras), frame_bytes, 30.0).severity is verdict


@pytest.mark.parametrize(
    ("sample", "verdict", "word"),
    [
        (SOUND, OK, "29.9 of 30"),
        (replace(SOUND, frames=0, period_ns=None, frame_bytes=0, first_ns=0, stamps=None), FAIL, "no frame"),
        (replace(SOUND, frames=0, spoiled=(("no_end", 9),), stamps=None), FAIL, "9 no_end"),
        (replace(SOUND, spoiled=(("no_end", 3),)), WARN, "3 no_end"),
        (replace(SOUND, period_ns=66_700_000), WARN, "15.0 of 30"),
        (replace(SOUND, missed=9), WARN, "9 missed"),
        (replace(SOUND, frames=3, period_ns=None, missed=1), OK, "too few to tell"),
    ],
)
def test_a_second_of_frames_is_judged(sample: Sample, verdict: Severity, word: str) -> None:
    """No sound frame fails; spoiled, missed or slow ones warn; the rate is the measured one."""
    finding = check_stream(sample)[0]
    assert finding.severity is verdict
    assert word in finding.message
    assert bool(finding.remedy) is (verdict is not OK)


@pytest.mark.parametrize(
    ("period_ns", "exposure_ns", "remedy"),
    [
        (100_000_000, 100_000_000, "each exposure takes 100 ms: more light, or exposure_ms=29; or ask for fps=10"),
        (100_000_000, None, "more light, or exposure_ms=29; if the bus is full, smaller frames or another port"),
        (100_000_000, 5_000_000, "if the bus is full, smaller frames or another port; or ask for fps=10"),
    ],
)
def test_a_camera_slower_than_offered_has_a_remedy_with_figures(
    period_ns: int, exposure_ns: int | None, remedy: str
) -> None:
    """10 of 30 frames a second: the offer is the driver's, what comes is said beside it, and the longest exposure for that rate is named."""
    slow = check_stream(replace(SOUND, period_ns=period_ns, exposure_ns=exposure_ns))[0]
    assert "10.0 of 30 a second" in slow.message
    assert "slower than the driver offers" in slow.message
    assert remedy in slow.remedy
    assert "is offered by the driver" in check_format("/dev/video0", OFFERED, Wanted()).message
    assert rate_remedy(20_000_000, 33_333_333, None) == "ask for the rate that it gives: fps=50"


def test_stamps_and_refused_controls_have_lines_of_their_own() -> None:
    """Impossible stamps and refused controls are warnings; a camera without frames has neither line."""
    assert [item.code for item in check_stream(SOUND)] == ["stream", "stamps"]
    doubtful = check_stream(replace(SOUND, distrusted=30, stamps=StampClock.UNKNOWN, driver="vivid", refused=2))
    assert [(item.code, item.severity) for item in doubtful] == [("stream", OK), ("stamps", WARN), ("controls", WARN)]
    assert "unnamed clock" in doubtful[1].message
    assert "a copied clock" in check_stream(replace(SOUND, stamps=StampClock.COPY))[1].message
    assert len(check_stream(replace(SOUND, frames=0))) == 1


AGENT, OTHER = Holder(412, "board-agent"), Holder(77, "motion")


@pytest.mark.parametrize(
    ("holders", "status", "all_seen", "verdict", "word"),
    [
        ((AGENT,), "30.0 fps, 512 sent to the host, 0 dropped", True, OK, "30.0 fps"),
        ((AGENT,), "no frame from v4l2:auto for 4 s: is it plugged in?", True, FAIL, "no frame"),
        ((OTHER,), "", True, FAIL, "motion (pid 77)"),
        ((), "", False, WARN, "only root"),
        ((), "", True, FAIL, "cannot be seen"),
    ],
)
def test_a_taken_camera_is_judged_by_who_has_it(
    holders: tuple[Holder, ...], status: str, verdict: Severity, word: str, *, all_seen: bool
) -> None:
    """Our own service may hold the camera if it streams; another program is named; what only root may see is reported as such."""
    finding = check_taken(holders, AGENT.pid, status, all_seen=all_seen)
    assert finding.severity is verdict
    assert word in finding.message


@pytest.mark.parametrize(
    ("link", "verdict", "word"),
    [
        (LinkReadings(uri="tcp://*:5555"), OK, "free"),
        (LinkReadings(uri="tcp://127.0.0.1:5555"), OK, "this machine only"),
        (LinkReadings(uri="tcp://*:5555", holders=(AGENT,)), OK, "our own service"),
        (LinkReadings(uri="tcp://*:5555", holders=(OTHER,)), FAIL, "motion (pid 77)"),
        (
            LinkReadings(uri="tcp://*:5555", all_seen=False, failure=fail("link", "in use", ""), taken=True),
            WARN,
            "only root",
        ),
        (
            LinkReadings(uri="tcp://*:5555", failure=fail("link", "no such address", "ip address")),
            FAIL,
            "no such address",
        ),
        (LinkReadings(uri="serial:/dev/ttyGS0", terminals=(Holder(9, "agetty"),)), FAIL, "serial-getty@ttyGS0"),
        (LinkReadings(uri="serial:/dev/ttyS0", terminals=(Holder(9, "bash"),)), FAIL, "two readers"),
        (LinkReadings(uri="serial:/dev/ttyS0", console=True), FAIL, "console=ttyS0"),
    ],
)
def test_a_link_is_judged_by_who_has_it(link: LinkReadings, verdict: Severity, word: str) -> None:
    """Free, ours, another's, a getty's, the console's, or unavailable: each is reported, and each fault has its remedy."""
    finding = check_link(link, AGENT.pid)
    assert finding.severity is verdict
    assert word in finding.message + finding.remedy


def unit(**fields: object) -> Unit:
    """An installed, running unit with some fields set."""
    state = {
        "load": "loaded",
        "active": "active",
        "sub": "running",
        "enabled": "enabled",
        "pid": 412,
        "status": "30.0 fps",
    }
    return Unit("board-agent", **(state | fields))  # type: ignore[arg-type]  # names and types as in Unit


@pytest.mark.parametrize(
    ("state", "verdict", "word"),
    [
        (unit(), OK, "30.0 fps"),
        (unit(restarts=3), OK, "restarted 3 times"),
        (unit(active="activating", sub="auto-restart", result="exit-code"), FAIL, "journalctl"),
        (unit(active="failed", result="watchdog"), FAIL, "watchdog"),
        (unit(active="inactive", pid=0), WARN, "enable --now"),
        (unit(enabled="disabled"), WARN, "systemctl enable"),
        (Unit("board-agent", load="not-found"), OK, "not installed"),
        (Unit("board-agent"), OK, "no systemd"),
    ],
)
def test_the_service_is_judged_by_its_state(state: Unit, verdict: Severity, word: str) -> None:
    """A failing service fails and says how to find the reason, a stopped one warns, none at all is fine."""
    finding = check_unit(state)
    assert finding.severity is verdict
    assert word in finding.message + finding.remedy


@given(st.lists(st.tuples(st.sampled_from(Severity), st.text(max_size=5))))
def test_exit_code_and_counts_agree(drawn: list[tuple[Severity, str]]) -> None:
    """Exit 4 exactly when the object counts a failed check."""
    findings = [Diagnostic(text, "", verdict, "x", CHECK_FAILED) for verdict, text in drawn]
    assert (exit_code(findings) == 4) is (values(findings)["failed"] > 0)


def test_keys_are_judged_without_making_any(tmp_path: Path) -> None:
    """No folder and no host warn, a host is named, other people's and open files fail; looking does not create an absent key."""
    me = Account("me", os.geteuid(), frozenset(), is_me=True)
    folder = KeyFolder(tmp_path / "keys")
    assert check_keys(folder, me).severity is Severity.WARN
    assert not folder.path.exists()
    folder.path.mkdir(mode=0o700)
    assert check_keys(folder, me).severity is Severity.WARN
    assert not list(folder.path.iterdir())
    own = folder.own()
    folder.add(Peer(name="phone", key=own.public, added=""))
    known = check_keys(folder, me)
    assert known.severity is Severity.OK
    assert "phone" in known.message
    stranger = check_keys(folder, replace(me, name="tandemscan", uid=os.geteuid() + 1))
    assert stranger.severity is Severity.FAIL
    assert "chown -R tandemscan" in stranger.remedy
    (folder.path / "key").chmod(0o644)
    opened = check_keys(folder, me)
    assert opened.severity is Severity.FAIL
    assert "chmod 600" in opened.remedy
