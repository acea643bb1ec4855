"""A print over a serial line: every line once, in order, whatever happens to it on the way."""

import errno
import os
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import suppress

import pytest

from common.errors import DataError, UnavailableError
from phone_host.printers.door import Phase, Wishes
from phone_host.printers.gcode import lines_of
from phone_host.printers.line import PrinterGoneError, open_line
from phone_host.printers.marlin import MarlinSender
from phone_host.printers.marlin_rules import SenderOptions
from phone_host.printers.printer_uri import LineUri, read_uri
from phone_host.printers.sending import send
from tests.support.marlin_printer import Faults, MarlinPrinter, cube, printer
from tests.support.programs import until

S = 1_000_000_000


def line_uri(text: str) -> LineUri:
    """The address of a printer on a line."""
    uri = read_uri(text)
    assert isinstance(uri, LineUri)
    return uri


def printed(
    on: MarlinPrinter,
    lines: list[str],
    wishes: Wishes | None = None,
    tell: Callable[[MarlinSender], None] = lambda _: None,
) -> MarlinSender:
    """Print over the line; return what has sent it."""
    line = open_line(line_uri(f"serial:{on.path}?baud=115200"))
    options = SenderOptions(usual_ns=S // 2)  # a printer that is simulated answers at once, or never
    sender = MarlinSender(lines_of(lines, "cube.gcode"), time.monotonic_ns() - 3 * S, options)  # it has said start
    try:
        send(line, sender, wishes or Wishes(), lambda: tell(sender))
    finally:
        line.close()
    return sender


@pytest.mark.parametrize(
    "faults",
    [
        Faults(),
        Faults(corrupted=0.02),
        Faults(corrupted=0.02, answers_ok_after_resend=False),
        Faults(silent={"G28": 2.0}),
    ],
    ids=["clean", "corrupted", "no ok after resend", "silent homing"],
)
def test_every_line_is_done_once_and_in_order(faults: Faults) -> None:
    """1500 lines arrive as they stand in the file."""
    lines = cube(1500)
    with printer(faults) as there:
        sender = printed(there, lines)
    assert there.done == lines
    assert (sender.phase, sender.done) == (Phase.DONE, 1500)
    assert (sender.resent > 0) == (there.resends > 0) == bool(faults.corrupted)


@pytest.mark.parametrize(
    "wire",
    [
        pytest.param({"baud": 115200}, id="usb"),
        pytest.param(
            {"baud": 9600, "delay_s": 0.02}, id="bluetooth", marks=[pytest.mark.slow, pytest.mark.timeout(600)]
        ),
    ],
)
def test_answers_that_are_lost_cost_time_and_nothing_else(wire: dict[str, float]) -> None:
    """The line is sent again, the printer has it already and says so; it is not done twice. An HC-05 is set to 9600 baud when it is new."""
    lines = cube(1500)
    with printer(Faults(corrupted=0.02, lost=0.003, **wire), seed=4) as there:  # type: ignore[arg-type]  # numbers
        sender = printed(there, lines)
    assert there.done == lines
    assert sender.phase is Phase.DONE
    assert there.lost > 0
    assert there.resends > 10


def test_cancelling_switches_the_heaters_off_at_once() -> None:
    """In the middle of drawing, nothing of the print follows but what was under way."""
    wishes, cancelled_at = Wishes(), list[int]()

    def watch(progress: MarlinSender) -> None:
        if progress.done > 100 and not cancelled_at:
            cancelled_at.append(progress.done)
            wishes.cancel()

    with printer(Faults(delay_s=0.004)) as there:
        sender = printed(there, cube(1500), wishes, watch)
        assert (there.nozzle, there.bed) == (0.0, 0.0)
        assert len(there.done) - cancelled_at[0] < 50, "lines that were under way, and five that cool"
        assert there.done[-5:] == ["M108", "M104 S0", "M140 S0", "M107", "M84"]
    assert sender.phase is Phase.CANCELLED


def test_a_pause_sends_nothing_until_it_ends() -> None:
    """The heaters stay on meanwhile, and the print is whole afterwards."""
    wishes, counts = Wishes(), list[int]()

    def watch(progress: MarlinSender) -> None:
        if progress.phase is Phase.PAUSED:
            counts.append(progress.done)
            if len(counts) == 4:
                wishes.toggle_pause()
        elif progress.done > 50 and not counts and not wishes.is_paused:
            wishes.toggle_pause()

    lines = cube(600)
    with printer(Faults(delay_s=0.003)) as there:
        sender = printed(there, lines, wishes, watch)
    assert len(counts) >= 4
    assert len(set(counts[1:4])) == 1
    assert there.done == lines
    assert sender.phase is Phase.DONE


@pytest.mark.parametrize("said", ["Resend: 9000", "Resend: 1", "Resend: 17"])
def test_a_request_that_the_cable_has_spoiled_harms_nothing(said: str) -> None:
    """It names a line of the future, the first or an old one: every line is done once, in order."""
    lines = cube(100)
    with printer(Faults(says={50: said})) as there:
        sender = printed(there, lines)
    assert sender.phase is Phase.DONE
    assert there.done == lines


def test_a_printer_that_is_unplugged_cannot_be_cooled_from_here() -> None:
    """At half of the print its plug is pulled: one line says so."""
    with printer(Faults(dies_after=200)) as there, pytest.raises(PrinterGoneError, match="cannot be cooled from here"):
        printed(there, cube(400))
    assert len(there.done) == 200


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("Error:Thermal Runaway, system stopped! Heater_ID: 0", "Thermal Runaway"),
        ("Error:Printer halted. kill() called!", "kill"),
        ("start", "restarted"),
    ],
)
def test_a_printer_that_fails_is_told(said: str, words: str) -> None:
    """What it says ends the print, with what it said."""
    with printer(Faults(says={50: said})) as there:
        sender = printed(there, cube(300))
        until(lambda: there.nozzle == there.bed == 0.0, "it was told to be cold, should it hear that")
    assert sender.phase is Phase.FAILED
    assert words in sender.failure.message
    assert sender.failure.remedy
    assert len(there.done) < 60


def test_a_broken_file_cools_the_printer() -> None:
    """A line that is none of G-code in the middle: the heaters are off, then the line is named."""

    def broken() -> Iterator[str]:
        yield from cube(200)[:100]
        yield "\x00\x01"

    with printer() as there:
        line = open_line(line_uri(f"serial:{there.path}"))
        with pytest.raises(DataError, match="line 101 is no G-code"):
            send(line, MarlinSender(lines_of(broken(), "cube.gcode"), time.monotonic_ns()), Wishes(), lambda: None)
        line.close()
        assert there.nozzle == there.bed == 0.0


def test_a_file_that_cannot_be_read_any_more_cools_the_printer() -> None:
    """Its stick is pulled in the middle: the heaters are off, then that is said."""

    def pulled() -> Iterator[str]:
        yield from cube(200)[:100]
        raise OSError(errno.EIO, "Input/output error")

    with printer() as there:
        line = open_line(line_uri(f"serial:{there.path}"))
        with pytest.raises(DataError, match="cannot be read any more"):
            send(line, MarlinSender(lines_of(pulled(), "cube.gcode"), time.monotonic_ns()), Wishes(), lambda: None)
        line.close()
        assert there.nozzle == there.bed == 0.0


@pytest.mark.parametrize(
    ("uri", "words"),
    [
        ("serial:/dev/ttyNOPE9", "there is no printer"),
        ("serial:/dev/null", "/dev/null is no serial port"),
        ("socket://127.0.0.1:9", "no printer answers"),
        ("socket://..:9", "no name of a host"),
    ],
)
def test_a_printer_that_is_not_there_is_named(uri: str, words: str) -> None:
    """With a remedy."""
    with pytest.raises(UnavailableError, match=words):
        open_line(line_uri(uri))


def test_lines_that_cool_and_cannot_be_written_are_told() -> None:
    """The port takes no byte any more, and the user leaves: nobody says that the printer is cold."""
    master, slave = os.openpty()
    tty.setraw(slave)
    line = open_line(line_uri(f"serial:{os.ttyname(slave)}?baud=115200"))
    os.set_blocking(slave, False)
    for _ in range(5):  # the kernel moves what it has got from one buffer into the next
        with suppress(BlockingIOError):
            while True:
                os.write(slave, b"x")
        time.sleep(0.05)
    wishes = Wishes()
    wishes.leave()
    try:
        with pytest.raises(PrinterGoneError, match="could not be written"):
            send(line, MarlinSender(lines_of(cube(40), "cube.gcode"), time.monotonic_ns()), wishes, lambda: None)
    finally:
        os.close(master)
        line.close()
        os.close(slave)
