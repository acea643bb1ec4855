"""The button that records a run: what it does, and what its line tells."""

from dataclasses import replace

import pytest

from common.diagnostic import Diagnostic, Severity
from phone_host.web.source import Activity, Answer, Do
from tests.web.conftest import LAPTOP, PHONE, Complaints, Opener
from tests.web.played import RECORDING, Played


@pytest.mark.parametrize("size", [PHONE, LAPTOP])
def test_a_recording_is_begun_watched_and_ended(
    program: Played, opened: Opener, complaints: Complaints, size: dict[str, int]
) -> None:
    """Nothing to record without a run; then one button begins and ends it, and its line tells time, size and space, or that the disk is full."""
    page = opened("run", size)
    page.wait_for_selector("#record[aria-disabled=true]")
    page.click("#record", force=True)
    program.change(activity=Activity.RUNNING)
    program.emit()
    page.wait_for_selector("#record[aria-disabled=false]")
    assert page.is_hidden("#recording")
    page.click("#record")
    page.wait_for_selector("#recording[data-on=yes]")
    assert page.text_content("#recording") == "Recording: 0:12, 720 images, 37 MB, 41.2 GB left."
    assert page.text_content("#record") == "End recording"
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    page.click("#record")
    page.wait_for_selector("#recording[data-on=no]")
    assert "36.9 MB in /home/me" in page.text_content("#recording")
    assert page.text_content("#record") == "Record"
    assert [command.do for command in program.commands] == [Do.RECORD, Do.END_RECORDING]
    full = Diagnostic(
        "the recording s.mcap ended early (No space left on device)",
        "make room; what is in it can be used",
        Severity.FAIL,
    )
    program.change(recording=replace(RECORDING, is_over=True, failure=full))
    page.wait_for_selector("#recording.bad")
    assert "No space left on device" in page.text_content("#recording")
    program.answers[Do.RECORD] = Answer(trouble=Diagnostic("the cameras have no clock", "give one", Severity.FAIL))
    page.click("#record")
    page.wait_for_selector("#run-answer.bad")
    assert page.text_content("#run-answer") == "The cameras have no clock. Give one."
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    assert complaints == ["Failed to load resource: the server responded with a status of 409 (Conflict)"]
