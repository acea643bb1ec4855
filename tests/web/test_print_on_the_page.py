"""What the page makes of a scan that is over: it asks before anything is heated, and names file and printer."""

from pathlib import Path

import pytest

from phone_host.scan.patches import Patches
from phone_host.web.source import Do, PrintStage, PrintState, ScanState
from tests.support.programs import until
from tests.web.conftest import LAPTOP, PHONE, Complaints, Opener
from tests.web.played import Played

ASKS = "2026-11-26.gcode on octoprint://octopi.local"


def _last(program: Played) -> Do | None:
    """What the page asked for last."""
    return program.commands[-1].do if program.commands else None


@pytest.mark.parametrize("size", [PHONE, LAPTOP])
def test_a_print_asks_and_is_watched(
    program: Played, opened: Opener, complaints: Complaints, size: dict[str, int], tmp_path: Path
) -> None:
    """Printer and bed are handed on; the question is answered by a click that names both; progress, pause and cancel are there while it prints."""
    program.scan = ScanState(
        words="it is whole", level="good", pairs=9, fused=9, folder=str(tmp_path), files=("a.stl",)
    )
    program.patches = Patches(1)
    page = opened("scan", size)
    page.wait_for_selector("#scan-saved:not([hidden])")
    page.select_option("#make-format", "3mf")
    page.click("#make-save")
    until(lambda: _last(program) is Do.SAVE_MODEL, "the page asks for a file")
    assert program.commands[-1].values == {"format": "3mf"}
    page.fill("#make-printer", "octoprint://octopi.local")
    page.fill("#make-bed", "180,180,180")
    page.click("#make-check")
    until(lambda: _last(program) is Do.CHECK_MODEL, "the page asks whether it can be printed")
    assert program.commands[-1].values == {"bed": "180,180,180"}
    page.click("#make-print")
    until(lambda: _last(program) is Do.PREPARE_PRINT, "the page has a print prepared")
    assert program.commands[-1].values == {"printer": "octoprint://octopi.local", "bed": "180,180,180"}
    assert Do.PRINT not in {each.do for each in program.commands}
    program.change(printing=PrintState(stage=PrintStage.ASKS, words=f"print {ASKS} (12 lines, 3 min)?", asks=ASKS))
    page.wait_for_selector("#make-question[open]")
    assert "octoprint://octopi.local" in page.text_content("#make-asks")
    page.click("#make-yes")
    until(lambda: _last(program) is Do.PRINT, "the print is started")
    assert program.commands[-1].values == {"confirm": ASKS}
    program.change(printing=PrintState(stage=PrintStage.PRINTING, words="printing, nozzle 205, bed 60", share=0.4))
    page.wait_for_selector("#make-share:not([hidden])")
    page.wait_for_function("() => document.getElementById('make-share').value === 0.4")
    assert page.is_hidden("#make-print")
    page.click("#make-pause")
    until(lambda: _last(program) is Do.PAUSE_PRINT, "the print is paused")
    program.change(printing=PrintState(stage=PrintStage.PAUSED, words="paused", share=0.4))
    page.wait_for_function("() => document.getElementById('make-pause').textContent === 'Go on'")
    page.click("#make-cancel")
    until(lambda: _last(program) is Do.CANCEL_PRINT, "the print is cancelled")
    program.change(printing=PrintState(stage=PrintStage.OVER, words="cancelled; heaters are off", level="warning"))
    page.wait_for_selector("#make-print:not([hidden])")
    assert page.is_hidden("#make-share")
    assert "heaters are off" in page.text_content("#make-words")
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    assert complaints == []


def test_whoever_says_no_prints_nothing(program: Played, opened: Opener, tmp_path: Path) -> None:
    """Escape and the button take the print back."""
    program.scan = ScanState(words="it is whole", folder=str(tmp_path), files=("a.stl",))
    program.patches = Patches(1)
    page = opened("scan")
    page.wait_for_selector("#scan-saved:not([hidden])")
    asked = PrintState(stage=PrintStage.ASKS, words=f"print {ASKS}?", asks=ASKS)
    program.change(printing=asked)
    page.wait_for_selector("#make-question[open]")
    page.click("#make-no")
    until(lambda: _last(program) is Do.CANCEL_PRINT, "the print is taken back")
    program.change(printing=PrintState(stage=PrintStage.OVER, words="not printed"))
    page.wait_for_function("() => document.getElementById('make-words').textContent === 'Not printed.'")
    page.click("#make-print")
    program.change(printing=asked)
    page.wait_for_selector("#make-question[open]")
    page.keyboard.press("Escape")
    until(lambda: [each.do for each in program.commands].count(Do.CANCEL_PRINT) == 2, "Escape takes it back, too")
    assert Do.PRINT not in {each.do for each in program.commands}
