"""Printers that count, and whose answers are doubled, spoiled or lost: no line is done twice, and what cannot go on ends. Pure."""

import re
from collections.abc import Callable

import pytest

from phone_host.printers.door import Phase
from tests.unit.printers.test_marlin_limits import DRAWN, Bench, S


class CountingPrinter:
    """A printer that takes its lines in order alone, as Marlin does.

    Args:
        is_spoiled: whether the cable spoils a line; it takes how many came before.
    """

    def __init__(self, is_spoiled: Callable[[int], bool] = lambda _: False) -> None:
        self._is_spoiled = is_spoiled
        self.last = self.came = 0
        self.done: list[str] = []

    def answer(self, sent: str) -> list[str]:
        """Take a line; return what it says."""
        self.came += 1
        found = re.fullmatch(r"N(\d+) (.*)\*\d+", sent)
        if found is None or "M110" in sent:
            return ["ok"]
        if self._is_spoiled(self.came):
            return [f"Error:checksum mismatch, Last Line: {self.last}", f"Resend: {self.last + 1}", "ok"]
        if int(found[1]) != self.last + 1:
            return [f"Error:Line Number is not Last Line Number+1, Last Line: {self.last}", f"Resend: {self.last + 1}", "ok"]  # fmt: skip
        self.last += 1
        self.done.append(found[2])
        return ["ok"]


@pytest.mark.parametrize("line", [20, 150, 300])
def test_a_printer_that_has_restarted_without_a_word_does_not_begin_again(line: int) -> None:
    """Its `start` is lost, and it asks for the first line: nothing is printed a second time on what is there, and the print ends."""
    printer, bench = CountingPrinter(), Bench(DRAWN)

    def answered(sent: str) -> list[str]:
        if printer.came == line:
            printer.last = 0
        return printer.answer(sent)

    bench.run(answered, 120)
    assert bench.sender.phase is Phase.FAILED
    assert re.search("has restarted|long after", bench.sender.failure.message)
    assert printer.done == DRAWN[: line - 1]
    assert len(bench.sent) <= line + 2


@pytest.mark.parametrize("spoiled", ["Resend: 1", "Resend: 17", "Resend: 0x1f", "Resend: 90", "Resend: 99999"])
def test_a_number_that_the_cable_has_spoiled_is_asked_for_again(spoiled: str) -> None:
    """A line is lost, and the request names another one: every line is done once, in order, and none is counted twice."""
    printer, bench = CountingPrinter(lambda came: came == 20), Bench(DRAWN)
    bench.run(lambda sent: [spoiled, "ok"] if len(said := printer.answer(sent)) == 3 and printer.came == 20 else said, 120)  # fmt: skip
    assert bench.sender.phase is Phase.DONE
    assert printer.done == DRAWN
    assert bench.sender.done == len(DRAWN)


@pytest.mark.parametrize("times", [2, 3])
def test_answers_that_are_repeated_do_not_stand_for_lines(times: int) -> None:
    """Every word comes again, and every seventh line is spoiled: the lines are done once, in order."""
    printer, bench = CountingPrinter(lambda came: came % 7 == 0), Bench(DRAWN[:100])
    bench.run(lambda sent: [each for each in printer.answer(sent) for _ in range(times)], 120)
    assert bench.sender.phase is Phase.DONE
    assert printer.done == DRAWN[:100]


def test_requests_that_never_end_end_the_print_though_each_is_acknowledged() -> None:
    """The printer takes nothing from the tenth line on, and says so and `ok` twice to each: some copies, not thousands."""
    printer, bench = CountingPrinter(lambda came: came > 10), Bench(DRAWN)
    bench.run(lambda sent: [each for each in printer.answer(sent) for _ in range(2)], 120)
    assert bench.sender.phase is Phase.FAILED
    assert "does not take line" in bench.sender.failure.message
    assert len(bench.sent) < 80


def test_a_printer_whose_answers_are_all_lost_is_given_up() -> None:
    """Only refusals of copies come: each shows that the line is there, but at a line in some seconds no print ends; an answer now and then is enough."""
    for lost, phase in ((lambda came: came > 20, Phase.FAILED), (lambda came: came % 9 < 7, Phase.DONE)):
        printer, bench = CountingPrinter(), Bench(DRAWN[:60])

        def answered(sent: str, printer: CountingPrinter = printer, lost: Callable[[int], bool] = lost) -> list[str]:
            said = printer.answer(sent)
            return [] if said == ["ok"] and lost(printer.came) else said

        bench.run(answered, 600, "wait")
        assert bench.sender.phase is phase, bench.sender.failure.message
        assert printer.done == DRAWN[: len(printer.done)]
        if phase is Phase.FAILED:
            assert "answers in a row were lost" in bench.sender.failure.message
            assert bench.now_ns < 120 * S
