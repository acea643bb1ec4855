"""Marlin's protocol, and the files and addresses that lead to it: pure, so the test is the printer."""

import fcntl
import math
import os
from contextlib import closing
from pathlib import Path

import pytest

from common.errors import DataError, SettingsError, TakenError, UnavailableError
from phone_host.printers.door import Phase
from phone_host.printers.gcode import GcodeFacts, Line, examine, lines_of, name_of
from phone_host.printers.journal import Entry, Journal
from phone_host.printers.line import require_allowed
from phone_host.printers.marlin import MarlinSender
from phone_host.printers.marlin_rules import framed
from phone_host.printers.printer_uri import FileUri, LineKind, LineUri, ServerKind, ServerUri, read_uri

S = 1_000_000_000


class Talk:
    """A sender whose printer is the test: what it sends, and what it hears."""

    def __init__(self, *texts: str) -> None:
        self.now_ns = 0
        self.sender = MarlinSender(iter([Line(n, text) for n, text in enumerate(texts, 1)]), 0)
        self.sender.heard("start", 0)
        assert self.sent() == framed(0, "M110 N0")
        self.hear("ok")

    def sent(self, after_ns: int = 0) -> bytes:
        """What it sends after a while."""
        self.now_ns += after_ns
        return self.sender.to_send(self.now_ns)

    def hear(self, *said: str) -> None:
        """The printer says something."""
        for each in said:
            self.sender.heard(each, self.now_ns)


def test_a_frame_is_what_marlin_documents() -> None:
    """N3 T0*57 is the example of the documentation."""
    assert framed(3, "T0") == b"N3 T0*57\n"


def test_one_line_is_under_way() -> None:
    """Without an answer nothing follows; busy and temperatures are signs of life, not answers."""
    talk = Talk("G1 X1", "G1 X2")
    assert talk.sent() == framed(1, "G1 X1")
    assert talk.sent(S) == b""
    for _ in range(5):
        talk.hear("echo:busy: processing", "T:199.5 /200.0 B:59 /60 @:0")
        assert talk.sent(3 * S) == b""
    assert talk.sender.heat.nozzle == (199.5, 200.0)
    assert talk.sender.heat.bed == (59.0, 60.0)
    talk.hear("ok")
    assert talk.sent() == framed(2, "G1 X2")
    talk.hear("ok P15 B3")
    assert talk.sent() == b""
    assert talk.sender.phase is Phase.DONE


def test_a_lost_answer_is_told_from_a_lost_line() -> None:
    """If the line had arrived, the printer asks for the next one; that is the answer, and nothing is sent twice."""
    talk = Talk("G1 X1", "G1 X2")
    talk.sent()
    assert talk.sent(5 * S) == framed(1, "G1 X1")
    talk.hear("Error:Line Number is not Last Line Number+1, Last Line: 1", "Resend: 2", "ok")
    assert talk.sent() == framed(2, "G1 X2")
    assert talk.sender.done == 1


def test_a_slow_answer_and_its_ghost_change_nothing() -> None:
    """The answer comes after the second sending; what the printer says of the second one is swallowed."""
    talk = Talk("G1 X1", "G1 X2", "G1 X3")
    talk.sent()
    assert talk.sent(5 * S) == framed(1, "G1 X1")
    talk.hear("ok")
    assert talk.sent() == framed(2, "G1 X2")
    talk.hear("Error:Line Number is not Last Line Number+1, Last Line: 1", "Resend: 2", "ok")
    assert talk.sent() == b""
    talk.hear("ok")
    assert talk.sent() == framed(3, "G1 X3")


def test_an_older_line_is_sent_again_with_all_that_followed() -> None:
    """The printer may go back some lines; beyond what is kept it cannot be helped."""
    talk = Talk(*[f"G1 X{n}" for n in range(1, 9)])
    for number in range(1, 5):
        assert talk.sent() == framed(number, f"G1 X{number}")
        talk.hear("ok")
    talk.sent()
    talk.hear("rs N3")
    assert talk.sent() == b""
    assert talk.sent(S // 5) == framed(3, "G1 X3")
    for number in (4, 5, 6):
        talk.hear("ok")
        assert talk.sent() == framed(number, f"G1 X{number}")
    assert talk.sender.resent == 1
    other = Talk(*["G1 X1"] * 300)
    for _ in range(250):
        other.sent()
        other.hear("ok")
    other.sent()
    other.hear("Resend: 3")
    assert other.sent(S) == framed(251, "G1 X1")  # the cable may have spoiled the number
    other.hear("Resend: 3")
    assert "long after" in other.sender.failure.message


def test_silence_ends_it() -> None:
    """After four sendings without a word the printer is given up; homing may take minutes."""
    talk = Talk("G28")
    assert talk.sent()
    assert talk.sent(500 * S) == b""
    quiet = Talk("G1 X1")
    quiet.sent()
    sent = [quiet.sent(5 * S) for _ in range(5)]
    assert [bool(each) for each in sent] == [True, True, True, False, False]
    assert "does not answer" in quiet.sender.failure.message


def test_a_pause_sends_nothing_and_a_print_that_is_over_is_not_cancelled() -> None:
    """The line under way is answered, none follows until it goes on; twice is as once, and nothing of that matters after the end."""
    talk = Talk("G1 X1", "G1 X2")
    talk.sender.resume()
    assert talk.sent() == framed(1, "G1 X1")
    talk.sender.pause()
    talk.sender.pause()
    talk.hear("ok", "", "echo:idle", "ok")
    assert talk.sent(S) == b""
    assert talk.sender.phase.value == "paused"
    talk.sender.resume()
    assert talk.sent() == framed(2, "G1 X2")
    talk.hear("ok")
    assert talk.sent() == b""
    assert talk.sender.phase is Phase.DONE
    assert talk.sender.cancel() == b""
    assert talk.sender.phase is Phase.DONE


def test_a_cancel_between_two_lines_cools() -> None:
    """Nothing is under way: heaters go off at once, and the next line of the print is never sent."""
    talk = Talk("G1 X1", "G1 X2")
    talk.sent()
    talk.hear("ok")
    assert talk.sender.cancel()
    sent = b""
    while talk.sender.phase is Phase.CANCELLING:
        sent += talk.sent()
        talk.hear("ok")
    assert talk.sender.phase is Phase.CANCELLED
    assert b"M104 S0" in sent
    assert b"G1 X2" not in sent


def test_it_is_told_when_there_is_something_to_send() -> None:
    """A printer that does not say `start` gets its time; a line under way has its patience; a line that is asked for again comes soon."""
    sender = MarlinSender(iter([Line(1, "G1 X1")]), 0)
    assert sender.to_send(0) == b""
    assert sender.to_send(sender.due_ns) == framed(0, "M110 N0")
    waits_until = sender.due_ns
    assert sender.to_send(waits_until - 1) == b""
    sender.heard("Resend: 0", waits_until - 1)
    assert waits_until - 1 < sender.due_ns < waits_until + S
    assert sender.to_send(waits_until - 1) == b""
    assert sender.to_send(sender.due_ns) == framed(0, "M110 N0")
    sender.heard("ok", waits_until + S)
    assert sender.due_ns <= waits_until + S


@pytest.mark.parametrize(
    ("said", "problem"),
    [
        ("start", "has restarted"),
        ("Error:Printer halted. kill() called!", "the printer says"),
        ("!! hot", "the printer says"),
    ],
)
def test_what_a_printer_says_ends_a_print(said: str, problem: str) -> None:
    """It has restarted, halted, or counts otherwise: the print has failed, and nothing more is sent."""
    talk = Talk("G1 X1", "G1 X2")
    talk.sent()
    talk.hear(said)
    assert talk.sender.phase is Phase.FAILED
    assert problem in talk.sender.failure.message
    talk.hear("ok")
    assert talk.sent(S) == b""


def test_a_request_between_two_lines_changes_nothing() -> None:
    """Nothing is under way: neither a late request for a line that was sent twice nor one out of the blue sends a line again."""
    talk = Talk("G1 X1", "G1 X2", "G1 X3")
    first = talk.sent()
    talk.now_ns = talk.sender.due_ns
    assert talk.sent() == first
    talk.hear("ok", "Resend: 2")
    assert talk.sent() == framed(2, "G1 X2")
    talk.hear("ok", "Resend: 3")
    assert talk.sent() == framed(3, "G1 X3")


def test_after_a_request_for_the_next_line_its_answer_is_awaited() -> None:
    """The line under way had arrived: what follows is not sent before the printer had time for the `ok` of its request."""
    talk = Talk("G1 X1", "G1 X2")
    talk.sent()
    talk.hear("Resend: 2")
    assert talk.sent() == b""
    talk.now_ns = talk.sender.due_ns
    assert talk.sent() == framed(2, "G1 X2")


def test_a_cancelled_line_is_never_sent_again() -> None:
    """If the printer asks for the line that was under way, it gets one that cools."""
    talk = Talk("M104 S200", "G1 X2")
    talk.sent()
    talk.hear("ok")
    assert talk.sent() == framed(2, "G1 X2")
    assert talk.sender.cancel() == b"M108\n"
    assert talk.sender.cancel() == b""
    assert talk.sent() == framed(3, "M104 S0")
    talk.hear("Error:Line Number is not Last Line Number+1, Last Line: 1", "Resend: 2", "ok")
    assert talk.sent(S // 5) == framed(2, "M104 S0")
    talk.hear("ok")
    assert talk.sent() == framed(3, "M104 S0")


def test_on_android_only_the_network_works() -> None:
    """Serial ports and Bluetooth end with the ways that work; a socket may be had."""
    for uri in ("serial:/dev/ttyUSB0", "rfcomm://00:11:22:33:44:55"):
        with pytest.raises(UnavailableError) as refused:
            require_allowed(line_uri(uri), on_android=True)
        assert "socket://HOST:PORT" in refused.value.remedy
        require_allowed(line_uri(uri), on_android=False)
    require_allowed(line_uri("socket://127.0.0.1:9"), on_android=True)


def facts(*lines: str) -> GcodeFacts:
    """Of a file with these lines."""
    return examine([f"{line}\n" for line in lines], "x.gcode")


def test_the_range_is_that_of_the_moves_that_extrude() -> None:
    """Travel, retraction and homing do not count; relative moves, offsets and inches do."""
    found = facts("G28", "G1 X300 Y300", "G1 X10 Y20 Z0.2", "G1 X50 Y60 E5 ; drawn", "G1 E3", "G1 X-20")
    assert (found.low_mm, found.high_mm, found.extruding) == ((10.0, 20.0, 0.2), (50.0, 60.0, 0.2), 1)
    relative = facts("G91", "G1 X5 Y5 Z1 E1", "G1 X5 E1", "G90", "M83", "G1 X2 E.5")
    assert (relative.low_mm, relative.high_mm) == ((0.0, 0.0, 0.0), (10.0, 5.0, 1.0))
    assert facts("G20", "G92 X1 Y0", "G1 X2 E1").high_mm[0] == pytest.approx(50.8)
    assert facts("G20", "G21", "G1 X2 E1").high_mm[0] == pytest.approx(2)
    assert facts("M82", "G92 E10", "G1 X5 Y1 E9", "G1 X6 E9.5").low_mm[0] == 5.0
    assert math.isnan(facts("G28", "M104 S0").low_mm[0])
    assert facts("G28", "G1 X200", "G92 X0", "G1 X150 E1").high_mm[0] == 350.0  # homed, it is where it is
    assert facts("G28", "G1 X200", "G92 X0", "G28", "G1 X150 E1").high_mm[0] == 150.0


@pytest.mark.parametrize("text", ["G1 X 500 Y20 E5", "N7 G1 X500 Y20 E5*104", "n7G1X500Y20E5", "g1 x+500.0 y20 e5"])
def test_a_move_is_seen_however_it_is_written(text: str) -> None:
    """With blanks, with a number and a checksum of its own, in small letters: what a printer does is followed."""
    assert facts("G28", text).high_mm == (500.0, 20.0, 0.0)
    [line] = lines_of([text], "x.gcode")
    assert line.text.upper().startswith("G1")
    assert "*" not in line.text


def test_an_arc_is_followed_where_it_bulges() -> None:
    """Half a circle beside the bed's edge reaches a radius beyond it on one side only; a full one on all; R is a radius, too."""
    half = ("G1 X200 Y10", "G3 X200 Y210 I0 J100 E5")
    assert facts(*half).high_mm[0] == pytest.approx(300)
    assert facts("G1 X200 Y10", "G2 X200 Y210 I0 J100 E5").high_mm[0] == pytest.approx(200)
    assert facts("G1 X200 Y10", "G2 X200 Y210 J100 E5").low_mm[0] == pytest.approx(100)
    assert facts("G1 X200 Y10", "G3 X200 Y210 R100 E5").high_mm[0] == pytest.approx(300)
    whole = facts("G1 X50 Y50", "G2 I10 E5")
    assert whole.low_mm[:2] == pytest.approx((50, 40))
    assert whole.high_mm[:2] == pytest.approx((70, 60))
    short, long = (facts("G1 X10 Y50", f"G3 X20 Y50 R{radius} E5").low_mm[1] for radius in (10, -10))
    assert short == pytest.approx(50 - 10 + 10 * math.sqrt(0.75))
    assert long == pytest.approx(50 - 10 - 10 * math.sqrt(0.75))


def test_a_place_without_numbers_is_refused() -> None:
    """A number of 400 digits is no place: it would be beyond every comparison with the bed."""
    with pytest.raises(DataError, match="line 2 moves to no place"):
        examine(["G28", f"G1 X{'9' * 400} E5"], "x.gcode", 4096)


def test_what_the_cable_spoils_in_an_answer_is_no_number() -> None:
    """Temperatures with a point or a sign too many, and a request for a line of many digits, end nothing."""
    talk = Talk("G1 X1", "G1 X2")
    assert talk.sent() == framed(1, "G1 X1")
    talk.hear("T:199.5.1 /200.0 B:59 /60", "T:-.- /. B:1..2 /3", f"Resend: {'9' * 500}")
    assert talk.sender.heat.bed == (59.0, 60.0)
    talk.hear("ok T:20.0.0 /0.0.0")
    assert talk.sent() == framed(2, "G1 X2")
    assert talk.sender.phase is Phase.PRINTING


def test_a_file_tells_its_time_and_whether_it_heats() -> None:
    """As PrusaSlicer and Cura write it."""
    told = facts("; estimated printing time (normal mode) = 1h 2m 3s", "M104 S200", "G1 X1 E1")
    assert (told.seconds, told.heats, told.lines) == (3723.0, True, 2)
    assert facts(";TIME:90", "G1 X1 E1").seconds == 90.0
    assert math.isnan(facts("G1 X1 E1").seconds)


def test_lines_are_sent_without_comments() -> None:
    """Blanks and comments of both kinds go; what is no G-code is named by its number."""
    read = list(lines_of(["; head\n", "\n", " G1 X1 ; on\n", "G1 (fast) Y2\n"], "x.gcode"))
    assert [(line.number, line.text) for line in read] == [(3, "G1 X1"), (4, "G1  Y2")]
    for bad in ("\x00\x01\n", "\ufffd\n", "123\n", "G1 " + "X1 " * 40):
        with pytest.raises(DataError, match="line 2"):
            list(lines_of(["G28\n", bad], "x.gcode"))
    with pytest.raises(DataError, match="no line"):
        facts("; nothing")
    assert [name_of(text) for text in ("g1 x1", "G28.1", "M104S200", "T0", "")] == ["G1", "G28", "M104", "T0", ""]


def line_uri(text: str) -> LineUri:
    """The address of a printer on a line."""
    uri = read_uri(text)
    assert isinstance(uri, LineUri)
    return uri


def test_addresses_of_printers() -> None:
    """A device, a Bluetooth address, a host; everything else is refused with the forms."""
    assert read_uri("serial:/dev/ttyUSB0") == LineUri("serial:/dev/ttyUSB0", LineKind.SERIAL, "/dev/ttyUSB0", 115200)
    assert line_uri("serial:ttyACM0?baud=250000").baud == 250000
    assert line_uri("rfcomm://00:11:22:aa:bb:CC?channel=3").port == 3
    assert (line_uri("socket://[::1]:80").place, line_uri("socket://h:80").port) == ("::1", 80)
    for bad in ("", "/dev/ttyUSB0", "usb:x", "serial:", "serial:x?baud=7", "serial:x?speed=9600", "rfcomm://x", "socket://h", "socket://\u00e9..x:9", "socket://h:0", "socket://h:1?x=2", "rfcomm://00:11:22:33:44:55?channel=99"):  # fmt: skip
        with pytest.raises(SettingsError, match="--printer"):
            read_uri(bad)


def test_addresses_of_servers_and_files() -> None:
    """A server has a usual port, and https where it is asked for; a key in an address is refused and not shown."""

    def server(text: str) -> tuple[ServerKind, str, int, bool]:
        uri = read_uri(text)
        assert isinstance(uri, ServerUri)
        return uri.kind, uri.host, uri.port, uri.is_secure

    assert server("octoprint://octopi.local") == (ServerKind.OCTOPRINT, "octopi.local", 80, False)
    assert server("octoprint://octopi.local?tls=1") == (ServerKind.OCTOPRINT, "octopi.local", 443, True)
    assert server("Moonraker://10.0.0.2/") == (ServerKind.MOONRAKER, "10.0.0.2", 7125, False)
    assert server("prusalink://[fe80::1]:8080") == (ServerKind.PRUSALINK, "fe80::1", 8080, False)
    assert server("moonraker://[::1]") == (ServerKind.MOONRAKER, "::1", 7125, False)
    assert read_uri("file:out/cup.gcode") == FileUri("file:out/cup.gcode", "out/cup.gcode")
    for bad in ("octoprint:", "octoprint://", "octoprint://h:0", "octoprint://h:99999", "octoprint://a b", "octoprint://h?key=1", "octoprint://h/x/y"):  # fmt: skip
        with pytest.raises(SettingsError, match="--printer"):
            read_uri(bad)
    with pytest.raises(SettingsError, match=r"table \[printers\]") as refused:
        read_uri("octoprint://SECRET@h")
    assert "SECRET" not in str(refused.value)


def test_a_file_tells_whether_it_leaves_heaters_on() -> None:
    """By tool, and by what waits; a macro of one firmware may have cooled."""
    assert facts("M104 S200", "M140 S60", "G1 X1 E1", "M104 S0").leaves_hot
    assert not facts("M104 S200", "M140 S60", "G1 X1 E1", "M104 S0", "M140 S0").leaves_hot
    assert facts("T1", "M104 S200", "T0", "M104 S200", "G1 X1 E1", "M104 S0").leaves_hot
    assert not facts("M104 T1 S200", "G1 X1 E1", "M104 T1 S0").leaves_hot
    assert not facts("M109 S200", "G1 X1 E1", "END_PRINT").leaves_hot
    assert facts("M190 R60", "G1 X1 E1").leaves_hot
    assert not facts("M104", "G1 X1 E1").leaves_hot


def test_the_journal_tells_of_prints_whose_programs_are_gone(tmp_path: Path) -> None:
    """Each of them once; not of one that goes on, nor of a file that is none."""
    folder = tmp_path / "deep"
    journal = Journal(folder)
    assert journal.take_left() == []
    left = Entry("cup.gcode", "serial:x", 50, 100, 2**22 + 1)
    for entry in (left, left, Entry("mug.gcode", "octoprint://h", 1, 2, 0)):
        begun = journal.begin(entry.printer)
        begun.note(entry)
        begun.close(is_reported=False)
    assert sorted(each.file for each in journal.take_left()) == ["cup.gcode", "cup.gcode", "mug.gcode"]
    assert journal.take_left() == []
    with closing(journal.begin("serial:x")) as begun:
        begun.note(Entry("cup.gcode", "serial:x", 50, 100, os.getpid()))
        assert journal.take_left() == []
        assert len(list(folder.glob("*.json"))) == 1
    assert list(folder.glob("*.json")) == []
    for text in ("{}", "[", "[" * 9000, '{"file": 1, "printer": "", "done": 0, "lines": 0, "pid": 1}'):
        (folder / "0.json").write_text(text)
        assert journal.take_left() == []


def test_what_a_killed_program_had_begun_to_write_is_removed(tmp_path: Path) -> None:
    """By the next print; not what another print writes just now."""
    journal = Journal(tmp_path)
    (tmp_path / "0123456789abcdef.part").write_text('{"file": "cup')
    with (tmp_path / "fedcba9876543210.part").open("w") as written:
        fcntl.flock(written, fcntl.LOCK_EX)
        journal.begin("serial:x").close()
        assert [path.name for path in tmp_path.glob("*.part")] == ["fedcba9876543210.part"]


def test_two_prints_never_go_to_one_printer(tmp_path: Path) -> None:
    """However its address is written; another printer is free, and a folder that cannot be written keeps nobody away."""
    (tmp_path / "by-id").symlink_to("/dev/ttyUSB7")
    journal = Journal(tmp_path / "printing")
    with closing(journal.begin("serial:/dev/ttyUSB7?baud=250000")), closing(journal.begin("octoprint://H")):
        for printer in (f"serial:{tmp_path}/by-id", "serial:ttyUSB7", "octoprint://h:80"):
            with pytest.raises(TakenError, match="another print goes to"):
                journal.begin(printer)
        journal.begin("serial:/dev/ttyUSB8").close()
    journal.begin("serial:/dev/ttyUSB7").close()
    (tmp_path / "file").write_text("")
    with closing(Journal(tmp_path / "file" / "no").begin("serial:x")) as begun:
        begun.note(Entry("cup.gcode", "serial:x", 1, 2, 1))
