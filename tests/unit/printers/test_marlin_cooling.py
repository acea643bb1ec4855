"""Whether a printer is cold, as far as its answers show: pure, so the test is the printer."""

import re
from collections.abc import Callable

import pytest

from phone_host.printers.door import Phase
from phone_host.printers.marlin_rules import SenderOptions
from tests.unit.printers.test_marlin_limits import DRAWN, Bench, fine

Answers = Callable[[str], list[str]]


def cancelling(answer: Answers) -> Bench:
    """A print whose printer ends it at line 10, and answers so from then on."""
    bench = Bench(DRAWN)
    bench.run(lambda text: ["ok", "//action:cancel"] if text.startswith("N10 ") else answer(text), 4)
    return bench


def test_the_last_line_that_cools_confirms_all_and_not_one_before_it() -> None:
    """Every answer belongs to the line before: only the answer that follows M107 shows that heaters are off."""

    def silent_at(name: str) -> Answers:
        return lambda text: [] if name in text else ["ok"]

    for name, is_confirmed in (("M104", False), ("M140", False), ("M107", False), ("M105", True), ("M84", True)):
        assert cancelling(silent_at(name)).sender.cooling.is_confirmed == is_confirmed, name


def test_a_printer_that_wants_a_cooling_line_again_is_not_cold() -> None:
    """It answers M107, and then requests the bed's line again: not confirmed until that has arrived, too."""
    bench, requests = Bench(DRAWN), iter([["Resend: 12", "ok"]])
    confirmed: list[tuple[str, bool]] = []

    def answer(text: str) -> list[str]:
        confirmed.append((text.partition(" ")[2].partition("*")[0], bench.sender.cooling.is_confirmed))
        return (
            next(requests, ["ok"])
            if "M105" in text
            else ["ok", *(["//action:cancel"] if text.startswith("N10 ") else [])]
        )

    bench.run(answer, 60)
    at = confirmed.index(("M105", True))
    assert confirmed[at + 1 : at + 4] == [("M140 S0", False), ("M107", False), ("M105", True)]
    assert bench.sender.cooling.is_confirmed


HOT = "ok T:210.0 /210.0 B:60.0 /0.0 @:0"
COLD = "ok T:209.0 /0.0 B:60.0 /0.0 T0:209.0 /0.0 T1:180.0 /0.0 @:0"


@pytest.mark.parametrize("options", [SenderOptions(), SenderOptions(inactivity_s=900)], ids=["plain", "guarded"])
def test_a_printer_that_answers_and_heats_all_the_same_is_told(options: SenderOptions) -> None:
    """It is told twice to cool, then the print fails with the heater and its goal; the printer's own guard stays on."""
    bench = Bench(DRAWN, options)
    bench.run(lambda text: ["ok", "//action:cancel"] if "G1 X10*" in text else [HOT] if "M105" in text else ["ok"], 60)
    assert bench.sender.phase is Phase.FAILED
    assert "but still heats (nozzle 210 C)" in bench.sender.failure.message
    assert not bench.sender.cooling.is_confirmed
    assert bench.texts.count("M104 S0") == bench.texts.count("M107") == 2
    assert "M85 S0" not in bench.texts


def test_a_second_telling_is_enough() -> None:
    """The first M104 S0 is answered and lost in the firmware: after the second all goals are zero, and it is cold."""
    answers = iter([HOT, COLD])
    bench = cancelling(lambda text: [next(answers)] if "M105" in text else ["ok"])
    assert "ended at the printer" in bench.sender.failure.message
    assert bench.sender.cooling.is_confirmed
    assert bench.texts.count("M140 S0") == 2


def test_goals_that_come_an_answer_late_are_heard() -> None:
    """Each answer belongs to the line before, because one of the print was still under way: M105 is asked until goals came."""
    late = iter(["ok", COLD])
    bench = cancelling(lambda text: [next(late)] if "M105" in text else ["ok"])
    assert not bench.sender.cooling.is_unreported
    assert bench.texts.count("M105") == 2


@pytest.mark.parametrize(("said", "phase"), [(COLD, Phase.DONE), ("ok", Phase.DONE), (HOT, Phase.FAILED)])
def test_the_end_of_a_print_that_heats_is_checked(said: str, phase: Phase) -> None:
    """Whatever its G-code says of heaters, the printer's own goals count; one that reports none is noted."""
    bench = Bench([*DRAWN[:5], "END_PRINT"], SenderOptions(heats=True))
    bench.run(lambda text: [said] if "M105" in text else ["ok"], 60)
    assert bench.sender.phase is phase
    assert bench.sender.cooling.is_unreported == (said == "ok")
    assert ("M104 S0" in bench.texts) == (phase is Phase.FAILED)
    cold = Bench(DRAWN[:5])
    cold.run(fine, 60)
    assert not any(re.match("M105", text) for text in cold.texts), "a print that heats nothing asks nothing"
