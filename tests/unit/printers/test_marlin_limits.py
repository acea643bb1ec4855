"""What a printer may say and do, and how long it is waited for: pure, so the test is the printer, and time is a number.

Rule that each test holds up: whatever the printer says, the print ends in bounded time, with one clear sentence.
"""

import itertools
from collections.abc import Callable, Iterable

import pytest

from phone_host.printers.cooling import heaters_off, last_lines
from phone_host.printers.door import Phase
from phone_host.printers.gcode import Line, examine
from phone_host.printers.marlin import MarlinSender
from phone_host.printers.marlin_reply import HostAction, ReplyKind, read_reply
from phone_host.printers.marlin_rules import SenderOptions, framed, may_outlast_guard

S = 1_000_000_000
STEP_NS = S // 20


class Bench:
    """A sender on a bench: the test answers, and the clock goes on in steps of 50 ms."""

    def __init__(self, lines: Iterable[str], options: SenderOptions | None = None) -> None:
        self.now_ns = 0
        self.sender = MarlinSender(iter([Line(n, text) for n, text in enumerate(lines, 1)]), 0, options)
        self.sent: list[tuple[float, str]] = []

    def run(
        self, answer: Callable[[str], Iterable[str]], seconds: float, chatter: str = "", each_s: float = 1.0
    ) -> None:
        """Let time pass; every line that is sent is answered at once.

        Args:
            answer: takes a line that was sent, gives what the printer says to it.
            seconds: at most.
            chatter: said in between by itself.
            each_s: between two of these.
        """
        if self.sender.phase is Phase.OPENING:
            self.sender.heard("start", self.now_ns)
        end_ns, next_ns = self.now_ns + round(seconds * S), self.now_ns
        while self.now_ns < end_ns and not self.sender.phase.is_over:
            if chatter and self.now_ns >= next_ns:
                next_ns = self.now_ns + round(each_s * S)
                self.sender.heard(chatter, self.now_ns)
            if data := self.sender.to_send(self.now_ns):
                text = data.decode().strip()
                self.sent.append((self.now_ns / S, text))
                for said in answer(text):
                    self.sender.heard(said, self.now_ns)
                continue
            self.now_ns += STEP_NS

    @property
    def texts(self) -> list[str]:
        """What was sent, without numbers and checksums."""
        return [text.partition(" ")[2].partition("*")[0] or text for _, text in self.sent]


def fine(_: str) -> list[str]:
    """A printer that takes everything."""
    return ["ok"]


DRAWN = [f"G1 X{n}" for n in range(1, 400)]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda _: ["Resend: 3", "ok"], "does not take line 3"),
        (lambda _: ["Resend: 3"], "does not take line 3"),
        (lambda _: ["Resend: 3"] * 500, "does not take line 3"),
        (lambda text: ["Resend: 2", "ok"] if text.startswith("N3 ") else ["ok"], "does not take line"),
        (lambda _: ["Error:checksum mismatch, Last Line: 2"], "does not take line 3"),
        (lambda _: ["wait"], "does not take line 3"),
        (lambda _: [], "does not answer"),
        (lambda _: ["Resend: 90"], "asks for line 90"),
    ],
    ids=["for ever", "without ok", "five hundred at once", "to and fro", "complaints", "one word", "silence", "the future"],
)  # fmt: skip
def test_a_line_that_makes_no_progress_ends_the_print(answer: Callable[[str], list[str]], words: str) -> None:
    """After some copies, not thousands, and within a minute of the printer's time."""
    bench = Bench(DRAWN)

    def answered(text: str) -> list[str]:
        number = int(text.partition(" ")[0].removeprefix("N"))
        return answer(text) if number >= 3 else ["ok"]

    bench.run(answered, 120)
    assert bench.sender.phase is Phase.FAILED
    assert words in bench.sender.failure.message
    assert bench.sender.failure.remedy
    assert sum("G1 X2" in text for text in bench.texts) <= 30
    assert bench.now_ns < 61 * S


def test_copies_of_a_requested_line_come_ever_slower() -> None:
    """The first come at once, as a spoiled cable needs it; in no second there are more than five after that."""
    bench = Bench(DRAWN)
    bench.run(lambda text: ["Resend: 3", "ok"] if text.startswith("N3 ") else ["ok"], 60)
    times = [at for at, text in bench.sent if text.startswith("N3 ")]
    assert len(times) == 21
    assert times[2] - times[0] < 0.3
    for begin in times[3:]:
        assert sum(begin <= at < begin + 1 for at in times) <= 5


@pytest.mark.parametrize(
    "chatter", [" T:200.1 /200.0 B:60.0 /60.0 @:50 B@:20", "wait", "echo:hello", "//action:notification Layer 3"]
)
def test_a_lost_answer_is_noticed_whatever_is_chattered(chatter: str) -> None:
    """The line is sent again within 10 s, though the printer talks all the time; it is not done twice."""
    bench, lost = Bench(DRAWN), ["N8 G1 X8"]

    def answered(text: str) -> list[str]:
        if lost and text.startswith(lost[0]):
            lost.pop()
            return []
        if text.startswith("N8 "):
            return ["Error:Line Number is not Last Line Number+1, Last Line: 8", "Resend: 9", "ok"]
        return ["ok"]

    bench.run(answered, 60, chatter, 1.0)
    times = [at for at, text in bench.sent if text.startswith("N8 ")]
    assert len(times) == 2
    assert times[1] - times[0] < 10
    assert bench.sender.phase is Phase.DONE
    assert bench.sender.done == len(DRAWN)


def test_heating_and_busy_are_waited_for() -> None:
    """For minutes, without a second copy: while temperatures rise towards the goal, and while the printer says that it is busy."""
    for text, chatter in (("M109 S200", "T:21.0 /200.0 B:60 /60"), ("M190 S60", "T:20 /0 B:59.9 /60.0 W:?"), ("G1 X1", "echo:busy: processing"), ("G28", "busy: processing")):  # fmt: skip
        bench = Bench([text])
        bench.run(lambda line: ["ok"] if "M110" in line else [], 1200, chatter, 3.0)
        assert bench.sender.phase is Phase.PRINTING, text
        assert len(bench.sent) == 2, text


def test_an_answer_lost_at_the_end_of_heating_is_noticed() -> None:
    """The heater has reached its goal, and reports go on: the line is sent again within 10 s."""
    bench = Bench(["M109 S200"])
    bench.run(lambda line: ["ok"] if "M110" in line else [], 20, "T:150.0 /200.0 B:60 /60 W:?")
    before = bench.now_ns
    bench.run(lambda _: ["ok"], 20, "T:200.1 /200.0 B:60 /60")
    assert bench.sender.phase is Phase.DONE
    assert bench.sent[-1][0] - before / S < 10


def test_endless_busy_is_bounded_and_told() -> None:
    """After the time that the settings allow; what it waits for is told all the while."""
    bench = Bench(["G28", "G1 X1"], SenderOptions(max_busy_ns=1800 * S))
    bench.run(lambda line: ["ok"] if "M110" in line else [], 1700, "echo:busy: processing")
    assert bench.sender.message == "busy: processing (G28, 28 min)"
    bench.run(lambda _: [], 200, "echo:busy: processing")
    assert bench.sender.phase is Phase.FAILED
    assert bench.sender.failure.message == "the printer has not finished G28 within 30 min"
    assert "max_busy_minutes" in bench.sender.failure.remedy


@pytest.mark.parametrize(
    "said", ["//action:cancel", "// action:cancel", "//action:poweroff", "//action:disconnect", "//action:shutdown"]
)
def test_a_print_that_is_ended_at_the_display_ends(said: str) -> None:
    """Nothing of it follows but what cools; then it has failed, because nobody here wanted that."""
    bench = Bench(DRAWN)
    bench.run(lambda text: ["ok", said] if text.startswith("N10 ") else ["ok"], 60)
    assert bench.sender.phase is Phase.FAILED
    assert "ended at the printer" in bench.sender.failure.message
    assert bench.sender.cooling.is_confirmed
    assert bench.texts[-9:] == ["G1 X10", "M108", "M104 S0", "M140 S0", "M107", "M105", "M105", "M105", "M84"]


@pytest.mark.parametrize(
    "said", ["//action:pause", "//action:paused", "//action:out_of_filament T0", "//action:filament_runout T0"]
)
def test_a_pause_at_the_display_is_obeyed(said: str) -> None:
    """No line of the print follows until the display goes on; the shell is told, so that keys here may go on, too."""
    bench = Bench(DRAWN)
    bench.run(lambda text: ["ok", said] if text.startswith("N10 ") else ["ok"], 60)
    assert bench.sender.phase is Phase.PAUSED
    assert bench.texts[-1] == "G1 X10"
    assert bench.sender.message
    assert bench.sender.heard("//action:resumed", bench.now_ns) is HostAction.RESUME
    bench.run(fine, 60)
    assert bench.texts[1:] == DRAWN
    assert bench.sender.done == len(DRAWN)


def test_other_words_of_the_display_are_told() -> None:
    """Notifications and questions; what only a host with buttons can answer changes nothing."""
    bench = Bench(DRAWN)
    bench.sender.heard("//action:notification Layer\x1b[2J 3", 0)
    assert bench.sender.message == "Layer [2J 3"
    bench.sender.heard("//action:prompt_begin Filament runout", 0)
    assert bench.sender.message == "Filament runout"
    for said in (
        "//action:prompt_button Continue",
        "//action:prompt_show",
        "//action:whatever",
        "//action:",
        "//action:" + "x" * 5000,
    ):
        assert bench.sender.heard(said, 0) is HostAction.NONE
    assert bench.sender.message == "Filament runout"
    bench.sender.heard("//action:prompt_end", 0)
    assert bench.sender.message == ""
    assert bench.sender.phase is Phase.OPENING


def test_a_printer_without_a_host_switches_itself_off() -> None:
    """The print begins with M85 and ends without it; a question every five minutes keeps it from its end in a pause."""
    bench = Bench(DRAWN[:20], SenderOptions(inactivity_s=900))
    bench.run(lambda text: ["ok", "//action:pause"] if text.startswith("N10 ") else ["ok"], 2000)
    assert bench.texts[:2] == ["M110 N0", "M85 S900"]
    asked = [at for at, text in bench.sent if "M105" in text]
    assert len(asked) == 6
    assert all(later - sooner <= 301 for sooner, later in itertools.pairwise(asked))
    bench.sender.resume()
    bench.run(fine, 10)
    assert bench.texts[-1] == "M85 S0"
    assert bench.sender.done == 20


def test_a_line_that_waits_for_people_is_not_ended_by_m85() -> None:
    """Nor is a long dwell; after it M85 is on again. A cancelled print takes it back."""
    bench = Bench(["M109 S200", "M600", "G4 S600", "G4 P500"], SenderOptions(inactivity_s=900))
    bench.run(fine, 10)
    off, on = "M85 S0", "M85 S900"
    assert bench.texts[1:] == [on, "M109 S200", off, "M600", on, off, "G4 S600", on, "G4 P500", off]
    assert bench.sender.done == 4
    assert [may_outlast_guard(text) for text in ("G4 P300001", "G4P1", "g4 s301", "G40", "M6000")] == [
        True,
        False,
        True,
        False,
        False,
    ]
    cancelled = Bench(DRAWN, SenderOptions(inactivity_s=900))
    cancelled.run(lambda text: ["ok", "//action:cancel"] if text.startswith("N10 ") else ["ok"], 10)
    assert cancelled.texts[-1] == "M85 S0"


@pytest.mark.parametrize(
    "said", ['echo:Unknown command: "M85 S900"', "Error: M85: Command is not supported", '// Unknown command:"M85"']
)
def test_a_printer_without_m85_is_told(said: str) -> None:
    """It says that it does not know the command: it is not given again, and the risk is told."""
    bench = Bench(DRAWN, SenderOptions(inactivity_s=900))
    bench.run(lambda text: [said, "ok"] if "M85" in text else ["ok"], 60)
    assert sum("M85" in text for text in bench.texts) == 1
    assert "M85" in bench.sender.message
    assert bench.sender.phase is Phase.DONE


def test_cancelling_before_the_first_line_begins_with_the_number() -> None:
    """The printer counts from anywhere: without M110 it would refuse the line that cools."""
    sender = MarlinSender(iter([Line(1, "G1 X1")]), 0)
    assert sender.cancel() == b"M108\n"
    assert sender.to_send(0) == framed(0, "M110 N0")
    sender.heard("ok", 0)
    assert sender.to_send(0) == framed(1, "M104 S0")


def test_nothing_of_a_cancelled_print_is_sent_however_far_the_printer_goes_back() -> None:
    """It asks for a line long before the one that was under way: it gets lines that cool."""
    bench = Bench(DRAWN)
    bench.run(lambda text: ["ok", "//action:cancel"] if text.startswith("N10 ") else ["Resend: 4", "ok"] if text.startswith("N11 M104") else ["ok"], 60)  # fmt: skip
    after = bench.texts[bench.texts.index("M108") :]
    assert len(after) > 10
    assert not any(text.startswith("G1") for text in after)


def test_a_deaf_printer_gets_no_second_copy_while_it_is_cancelled() -> None:
    """It waits for a temperature: a copy would be refused later, and Marlin drops all that stands behind a refused line."""
    bench = Bench(["M190 S60"])
    bench.run(lambda line: ["ok"] if "M110" in line else [], 5)
    bench.sender.cancel()
    bench.run(lambda _: [], 30)
    assert bench.texts[2:] == ["M104 S0"]


def test_the_last_lines_switch_off_every_heater() -> None:
    """Those of all tools and of the chamber, too; each line is whole, and the one before is ended."""
    assert last_lines(heaters_off()) == b"\nM108\nM104 S0\nM140 S0\nM141 S0\nM107\n"
    assert heaters_off((0,)) == ("M104 S0", "M140 S0")
    assert heaters_off((0, 2), has_chamber=True) == ("M104 S0", "M104 T0 S0", "M104 T2 S0", "M140 S0", "M141 S0")
    assert last_lines(heaters_off(has_chamber=True)).count(b"M141") == 1


def test_a_file_tells_which_tools_it_heats() -> None:
    """By number or by choice; a tool that no printer has is left out."""
    found = examine(["T1", "M104 S200", "M109 T3 S210", "M104 T99999 S200", "M191 S40", "G1 X1 E1"], "x.gcode")
    assert (found.tools, found.has_chamber) == ((1, 3), True)
    plain = examine(["M104 S200", "G1 X1 E1"], "x.gcode")
    assert (plain.tools, plain.has_chamber) == ((0,), False)


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("\0\0ok", ReplyKind.OK),
        ("ok T:20 /0", ReplyKind.OK),
        ("startled", ReplyKind.OTHER),
        ("start", ReplyKind.START),
        ("N5 G1 X1*33", ReplyKind.OTHER),
        ("Error:Heating failed, system stopped! Heater_ID: 0", ReplyKind.FATAL),
        ("Error:checksum mismatch", ReplyKind.ERROR),
        ("fatal:Heater/sensor error - Printer stopped", ReplyKind.FATAL),
        ("ERROR: Temperature reading went wrong, HALT asserted - reset or M999 required", ReplyKind.FATAL),
        ("ALARM: Kill button pressed - reset, or M999 to continue", ReplyKind.FATAL),
        ("// Klipper state: Shutdown", ReplyKind.FATAL),
        ("// Klipper state: Ready", ReplyKind.OTHER),
        (": Extruder switched off. MAXTEMP triggered !", ReplyKind.FATAL),
        ("// action:cancel", ReplyKind.ACTION),
        ("rs 5", ReplyKind.RESEND),
        ("Resend: x", ReplyKind.OTHER),
        ("", ReplyKind.OTHER),
    ],
)
def test_what_a_printer_says_is_read(text: str, kind: ReplyKind) -> None:
    """Zero bytes of a starting port, echoes of our own lines and words that only begin like others are not mistaken."""
    assert read_reply(text).kind is kind


def test_a_board_that_starts_late_is_begun_with_again() -> None:
    """Its loader takes longer than the usual wait: nothing was taken yet, so nothing is lost; one that starts again and again is given up."""
    for is_cancelled in (False, True):
        bench = Bench(DRAWN[:5])
        assert bench.sender.to_send(4 * S)
        if is_cancelled:
            bench.sender.cancel()
            assert bench.sender.to_send(4 * S)
        bench.sender.heard("start", 5 * S)
        bench.now_ns = 5 * S
        bench.run(fine, 60)
        assert bench.sender.phase is (Phase.CANCELLED if is_cancelled else Phase.DONE)
        assert bench.texts[0] == "M110 N0"
        assert bench.sent[0][1].startswith("N0 ")
    again = Bench(DRAWN)
    again.run(lambda _: ["start"], 60)
    assert again.sender.phase is Phase.FAILED
    assert "restarted" in again.sender.failure.message
    assert len(again.sent) == 4


def test_what_cools_counts_and_not_what_follows() -> None:
    """The heaters are confirmed to be off; the answer to M84 never comes: it is cold, and the print can be ended."""
    bench = Bench(DRAWN)
    bench.run(
        lambda text: [] if "M84" in text else ["ok", *(["//action:cancel"] if text.startswith("N10 ") else [])], 3
    )
    assert bench.texts[-1] == "M84"
    assert bench.sender.cooling.is_confirmed
    bench.sender.finish_cancelling()
    assert bench.sender.phase is Phase.FAILED
    assert "ended at the printer" in bench.sender.failure.message
