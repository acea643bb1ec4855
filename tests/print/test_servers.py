"""Prints over the network, by each kind of server: the same words and the same care as on a line."""

from collections.abc import Callable
from pathlib import Path
from threading import Timer

import pytest

from common.errors import SettingsError, TandemError, UnavailableError
from phone_host.printers.door import Ended, Job, Phase, Progress, Wishes
from phone_host.printers.doors import door_to
from phone_host.printers.line import PrinterGoneError
from phone_host.printers.printer_uri import ServerKind, read_uri
from phone_host.printers.printing import Place, RunningPrint
from phone_host.printers.server_door import ServerPatience
from phone_host.printers.slicing import facts_of
from tests.support.marlin_printer import cube
from tests.support.print_server import KEY, PASSWORD, PrintServerStandIn, ServerFaults, print_server
from tests.support.programs import until

BRISK = ServerPatience(ask_s=0.1)
"""What is asked ten times a second shows the same in a tenth of the time."""

CURT = ServerPatience(ask_s=0.1, obey_s=1.0, halted_s=1.0)
"""Of servers that do not obey, however long they are waited for."""

KINDS = pytest.mark.parametrize("kind", list(ServerKind), ids=lambda kind: kind.value)


@pytest.fixture
def job(tmp_path: Path) -> Job:
    """A print of 5000 lines, which is more than a server takes in one piece."""
    path = tmp_path / "my cup.gcode"
    path.write_text("\n".join(cube(5000)) + "\n")
    return Job(path, path.name, facts_of(path))


def printed(
    there: PrintServerStandIn,
    job: Job,
    key: str = KEY,
    wishes: Wishes | None = None,
    tell: Callable[[Progress], None] = lambda _: None,
    *,
    patience: ServerPatience = BRISK,
) -> Ended:
    """Print by the server."""
    return door_to(read_uri(there.uri), key, patience=patience).send(job, wishes or Wishes(), tell)


@KINDS
def test_a_file_is_handed_over_whole_and_watched(kind: ServerKind, job: Job) -> None:
    """Under a plain name that no other program uses; the share only grows, and the temperatures are told."""
    told: list[Progress] = []
    with print_server(kind) as there:
        ended = printed(there, job, tell=told.append)
    assert there.files == [("tandemscan-my_cup.gcode", job.gcode.read_bytes())]
    assert (ended.phase, ended.share, ended.notes) == (Phase.DONE, 1.0, ())
    assert told[0].phase is Phase.SENDING
    shares = [each.share for each in told if each.phase is Phase.PRINTING]
    assert shares == sorted(shares)
    assert any(each.heat.nozzle == (204.9, 205.0) for each in told)


@KINDS
def test_a_print_that_ends_between_two_questions_is_done(kind: ServerKind, job: Job) -> None:
    """A server that is asked twice for its state says first that it prints, and then that it does not: nobody has ended it."""
    with print_server(kind, ServerFaults(ends_between=True)) as there:
        ended = printed(there, job)
    assert (ended.phase, ended.share) == (Phase.DONE, 1.0)


@KINDS
@pytest.mark.parametrize(
    ("faults", "words"),
    [
        (ServerFaults(condition="printing", rate=0.0), "is busy"),
        (ServerFaults(condition="error", words="MCU 'mcu' shutdown"), "MCU 'mcu' shutdown"),
        (ServerFaults(refuses=409), "refuses the file: Could not upload the file"),
        (ServerFaults(raw=b"HTTP/1.1 302 Found\r\nLocation: http://elsewhere/\r\nContent-Length: 0\r\n\r\n"), "has moved to"),
        (ServerFaults(raw=b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n[]"), "unexpected kind of answer"),
        (ServerFaults(raw=b"HTTP/1.1 200 OK\r\n\r\n" + b"[" * (1 << 20) + b"1"), "an answer that does not end"),
        (ServerFaults(raw=b"SSH-2.0-OpenSSH_9.2\r\n"), "does not speak HTTP"),
        (ServerFaults(silent_after=0), "hangs up"),
    ],
    ids=["busy", "error", "refused", "moved", "other", "endless", "no http", "silent"],
)  # fmt: skip
def test_a_printer_that_takes_no_print_says_why(kind: ServerKind, job: Job, faults: ServerFaults, words: str) -> None:
    """In one line with a remedy; nothing is begun."""
    with print_server(kind, faults) as there, pytest.raises(UnavailableError, match=words) as refused:
        printed(there, job)
    assert there.files == []
    assert "127.0.0.1" in refused.value.problem
    assert refused.value.remedy


@KINDS
def test_a_wrong_key_and_a_missing_one_are_told_and_not_shown(kind: ServerKind, job: Job) -> None:
    """With the table of the settings file they belong into."""
    with print_server(kind) as there:
        with pytest.raises(SettingsError, match="does not take the key of the settings file") as refused:
            printed(there, job, key="fedcba")
        assert "fedcba" not in str(refused.value)
        with pytest.raises(SettingsError, match="wants a key") as missing:
            printed(there, job, key="")
        assert "[printers]" in missing.value.remedy
    assert there.files == []


def test_a_server_without_its_printer_is_told(job: Job) -> None:
    """OctoPrint that is not connected, Moonraker without Klipper."""
    for kind in (ServerKind.OCTOPRINT, ServerKind.MOONRAKER):
        with (
            print_server(kind, ServerFaults(condition="offline")) as there,
            pytest.raises(UnavailableError, match="has no printer"),
        ):
            printed(there, job)


def test_no_server_is_told(job: Job) -> None:
    """Its port is closed, or its name unknown."""
    for uri, words in (
        ("octoprint://127.0.0.1:9", "refuses the connection"),
        ("moonraker://no-such-host.invalid", "has no address"),
        ("moonraker://..", "has no address"),
    ):
        with pytest.raises(UnavailableError, match=words):
            door_to(read_uri(uri)).send(job, Wishes(), lambda _: None)


def test_prusalink_takes_a_password_without_seeing_it(job: Job) -> None:
    """USER:PASSWORD in the settings file answers its challenge; a wrong one is told."""
    with print_server(ServerKind.PRUSALINK, ServerFaults(wants_digest=True)) as there:
        assert printed(there, job, key=f"maker:{PASSWORD}").phase is Phase.DONE
        with pytest.raises(SettingsError, match="does not take the key"):
            printed(there, job, key="maker:wrong")


@KINDS
@pytest.mark.parametrize(
    ("faults", "words"),
    [
        (ServerFaults(fails_at=0.4, rate=0.4), "Thermal runaway"),
        (ServerFaults(ends_at=0.4, rate=0.4), "was ended at the printer"),
    ],
    ids=["error", "ended there"],
)
def test_a_print_that_ends_otherwise_is_told(kind: ServerKind, job: Job, faults: ServerFaults, words: str) -> None:
    """In the printer's words, with how far it came."""
    with print_server(kind, faults) as there:
        ended = printed(there, job)
    assert ended.phase is Phase.FAILED
    assert words in ended.problem
    assert ended.remedy


def test_a_proxy_that_errs_for_a_moment_ends_nothing(job: Job) -> None:
    """OctoPi's proxy says 503 while OctoPrint restarts; the print goes on, and so does the watching."""
    with print_server(ServerKind.OCTOPRINT, ServerFaults(rate=0.3)) as there:
        running = RunningPrint(Place(door_to(read_uri(there.uri), KEY), there.uri, "cup.gcode"), job)
        running.start()
        until(lambda: running.progress.phase is Phase.PRINTING, "it prints")
        there.faults.raw = b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\n\r\n"
        before = there.answers
        until(lambda: there.answers >= before + 2, "it was asked meanwhile")
        there.faults.raw = b""
        assert running.join(60)
        assert isinstance(running.outcome, Ended)
        assert running.outcome.phase is Phase.DONE


def test_a_key_that_may_not_cool_is_no_reason_to_call_it_cold(job: Job) -> None:
    """OctoPrint ends the print, and forbids the command for the heaters: nobody says that they are off."""
    wishes = Wishes()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.PRINTING:
            wishes.cancel()

    faults = ServerFaults(rate=0.01, forbids="/printer/command")
    with print_server(ServerKind.OCTOPRINT, faults) as there:
        with pytest.raises(PrinterGoneError, match="does not say that the print has ended"):
            printed(there, job, wishes=wishes, tell=watch, patience=CURT)
        assert there.condition == "cancelled"


def test_klipper_that_does_not_cool_is_stopped_at_once(job: Job) -> None:
    """Some time after cancelling; what has to be done before the next print is told."""
    wishes = Wishes()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.PRINTING:
            wishes.cancel()

    with print_server(ServerKind.MOONRAKER, ServerFaults(rate=0.01, cools=False)) as there:
        ended = printed(there, job, wishes=wishes, tell=watch, patience=CURT)
    assert ended.phase is Phase.CANCELLED
    assert there.goal == 0.0
    assert "FIRMWARE_RESTART" in ended.notes[0]


def test_prusalink_that_does_not_cool_is_told(job: Job) -> None:
    """Nothing more can be done from here, and that is said."""
    wishes = Wishes()
    wishes.cancel()
    with print_server(ServerKind.PRUSALINK, ServerFaults(rate=0.01, cools=False)) as there:
        ended = printed(there, job, wishes=wishes)
        assert (ended.phase, there.files) == (Phase.CANCELLED, [])  # before it was whole
        wishes = Wishes()

        def watch(progress: Progress) -> None:
            if progress.phase is Phase.PRINTING:
                wishes.cancel()

        with pytest.raises(PrinterGoneError, match="does not say that the print has ended"):
            printed(there, job, wishes=wishes, tell=watch, patience=CURT)


def test_a_print_runs_in_a_thread_of_its_own(job: Job) -> None:
    """Progress, pause, cancelling and the end are told; an error comes as itself."""
    outcomes: list[Ended | TandemError] = []
    with print_server(ServerKind.OCTOPRINT, ServerFaults(rate=0.01)) as there:
        place = Place(door_to(read_uri(there.uri), KEY), there.uri, "cup.gcode")
        running = RunningPrint(place, job, over=outcomes.append)
        running.start()
        until(lambda: running.progress.phase is Phase.PRINTING, "it prints")
        running.pause()
        until(lambda: running.progress.phase is Phase.PAUSED, "it waits")
        running.cancel()
        assert running.join(30)
        assert running.outcome is outcomes[0]
        wrong = RunningPrint(
            Place(door_to(read_uri(there.uri), "x"), there.uri, "cup.gcode"), job, over=outcomes.append
        )
        wrong.start()
        assert wrong.join(30)
    assert isinstance(outcomes[0], Ended)
    assert outcomes[0].phase is Phase.CANCELLED
    assert isinstance(outcomes[1], SettingsError)


def test_every_tool_of_a_server_s_printer_is_switched_off(job: Job) -> None:
    """OctoPrint lists two nozzles: both are off after cancelling, without stopping the printer in an emergency."""
    wishes = Wishes()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.PRINTING:
            wishes.cancel()

    with print_server(ServerKind.OCTOPRINT, ServerFaults(rate=0.01, second_nozzle=190.0)) as there:
        ended = printed(there, job, wishes=wishes, tell=watch)
        assert (there.goal, there.bed, there.faults.second_nozzle) == (0.0, 0.0, 0.0)
    assert (ended.phase, ended.notes) == (Phase.CANCELLED, ())


def test_a_user_who_leaves_asks_once_more(job: Job) -> None:
    """The server does not obey at once: the last order is the one that cools, and nobody says that it is cold."""
    wishes = Wishes()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.CANCELLING:
            wishes.leave()
        elif progress.phase is Phase.PRINTING:
            wishes.cancel()

    with print_server(ServerKind.MOONRAKER, ServerFaults(rate=0.01, cools=False)) as there:
        ended = printed(there, job, wishes=wishes, tell=watch)
        assert ended.phase is Phase.CANCELLED
        assert "nobody has waited" in ended.notes[0]
        assert there.asked[-1] == "POST /printer/gcode/script"
        assert "POST /printer/emergency_stop" not in there.asked


@KINDS
def test_orders_that_get_no_answer_do_not_keep_each_other_back(kind: ServerKind, job: Job) -> None:
    """The user leaves while the server says nothing any more: the end and cold heaters are ordered all the same, and nobody calls it cold."""
    wishes = Wishes()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.PRINTING and not there.faults.holds:
            there.faults.holds = frozenset({"GET", "POST", "DELETE"})
            Timer(0.3, wishes.leave).start()  # while a question waits for its answer

    with print_server(kind, ServerFaults(rate=0.001)) as there:
        with pytest.raises(PrinterGoneError, match="does not say that the print has ended"):
            printed(there, job, wishes=wishes, tell=watch)
        assert there.condition == "cancelled"
        assert (there.goal, there.bed) == (0.0, 0.0)


@KINDS
def test_a_refused_end_is_not_reported_as_ended(kind: ServerKind, job: Job) -> None:
    """The server answers 500 to the order to end the print, and the user leaves: the print goes on, and the error says to go and look."""
    wishes = Wishes()

    def watch(progress: Progress) -> None:
        if progress.phase is Phase.CANCELLING:
            wishes.leave()
        elif progress.phase is Phase.PRINTING:
            wishes.cancel()

    faults = ServerFaults(rate=0.001, cools=False, refuses_to_end=True)
    with print_server(kind, faults) as there, pytest.raises(PrinterGoneError, match="does not say") as left:
        printed(there, job, wishes=wishes, tell=watch)
    assert "go and look" in left.value.remedy


def test_an_order_to_cool_that_is_refused_is_no_cold_printer(tmp_path: Path) -> None:
    """A server that answers 404 to the order after a print that leaves its heaters on has not switched them off."""
    hot = tmp_path / "hot.gcode"
    hot.write_text("\n".join(cube(100)[:-3]) + "\n")
    with print_server(ServerKind.OCTOPRINT, ServerFaults(refuses_to_cool=True)) as there:
        ended = printed(there, Job(hot, hot.name, facts_of(hot)))
    assert ended.phase is Phase.DONE
    assert "could not be switched off" in ended.notes[0]
