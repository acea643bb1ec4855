"""The way from nothing to a run on the page: each step does what the command line would, and leads on. Everybody can use it."""

import time
from pathlib import Path
from typing import Any

import pytest

from common.diagnostic import Diagnostic, Severity
from common.protocol.enrolment_code import read_code
from phone_host.web.source import Activity, Answer, Do, StepName
from tests.web.conftest import LAPTOP, PHONE, Complaints, Opener
from tests.web.played import BOARDS, CAMERAS, Played, guide_snapshot

EXPECTED_STEPS = ["board", "camera", "check", "calibration", "run", "scan"]


def asked(program: Played) -> list[tuple[Do, dict[str, str]]]:
    """What the page has asked for."""
    return [(command.do, dict(command.values)) for command in program.commands]


def until_asked(program: Played, do: Do) -> None:
    """Wait until the page has asked for something."""
    deadline = time.monotonic() + 60
    while do not in [command.do for command in program.commands]:
        assert time.monotonic() < deadline, program.commands
        time.sleep(0.02)


def test_the_page_leads_from_nothing_to_a_run(program: Played, opened: Opener, complaints: Complaints) -> None:
    """Board with its code, camera, check, calibration, run: every press is one command, done steps are ticked, the next one is offered."""
    page = opened()
    page.wait_for_selector("#panel-board:not([hidden])")
    assert "Choose the board" in page.text_content("#panel-board .words")
    assert page.get_attribute("#command-copy", "aria-disabled") == "true"
    page.check(f"input[value='{BOARDS[0].uri}']")
    assert "sudo board-agent pair" in page.text_content("#enrol label")
    page.wait_for_selector("#enrol[open]")  # the chosen board does not know this machine
    assert page.get_attribute("#enrol-code", "inputmode") == "numeric"
    page.fill("#enrol-code", f"{read_code('204 719'):06}")
    page.press("#enrol-code", "Enter")
    page.wait_for_function("() => document.querySelector('#link-answer').textContent === 'Enrol: done.'")
    assert asked(program) == [
        (Do.SET, {"link": BOARDS[0].uri}),
        (Do.ENROL, {"link": BOARDS[0].uri, "code": "204719"}),
    ]
    page.wait_for_selector("#enrol:not([open])")
    program.change(done={StepName.BOARD})
    page.click("#panel-board a.next")
    page.check(f"input[value='{CAMERAS[1].uri}']")
    page.wait_for_function("() => document.querySelector('#command').textContent.startsWith('phone-host run')")
    assert f"--camera {CAMERAS[1].uri}" in page.text_content("#command")
    program.change(done={StepName.BOARD, StepName.CAMERA})
    page.click("#panel-camera a.next")
    page.click("#check-go")
    until_asked(program, Do.CHECK)
    program.change(done={StepName.BOARD, StepName.CAMERA, StepName.CHECK})
    page.click("#panel-check a.next")
    page.fill("#board-square", "30mm")
    page.click("#calibrate-go")
    program.change(guide=guide_snapshot())
    page.wait_for_selector("#guide:not([hidden])")
    assert page.text_content("#guide-words") == "Tilt the board: bottom edge away."
    assert "usable" in page.text_content("#guide-verdict")
    assert "2.10 mm" in page.text_content("#guide-figures")
    assert page.locator("#guide-wanted .now").text_content() == "tilt the board: bottom edge away"
    assert "percent of it covered" in page.get_attribute("#guide-left", "aria-label")
    program.change(done=set(StepName), activity=Activity.IDLE)
    page.click("#panel-calibration a.next")
    page.click("#go")
    page.wait_for_selector("#go[data-running=yes]")
    assert asked(program)[2:] == [
        (Do.SET, {"camera": CAMERAS[1].uri}),
        (Do.CHECK, {}),
        (Do.CALIBRATE, {"board": "auto", "square": "30mm"}),
        (Do.RUN, {}),
    ]
    assert [page.get_attribute(f"#step-{name}", "data-done") for name in EXPECTED_STEPS] == ["yes"] * 6
    assert complaints == []


def test_what_went_wrong_is_said_with_what_to_do(program: Played, opened: Opener) -> None:
    """A refused command is answered beside its button, trouble of the program stands on top; both in words with a remedy."""
    program.answers[Do.CHECK] = Answer(
        trouble=Diagnostic("the board is silent", "see whether its lamp blinks", Severity.FAIL)
    )
    page = opened("check")
    page.click("#check-go")
    page.wait_for_selector("#check-answer.bad")
    assert page.text_content("#check-answer") == "The board is silent. See whether its lamp blinks."
    program.change(trouble=Diagnostic("the camera has gone", "plug it in again", Severity.FAIL))
    page.wait_for_selector("#trouble:not([hidden])")
    assert page.text_content("#trouble") == "The camera has gone. Plug it in again."


def test_nothing_is_claimed_that_nobody_looked_for(program: Played, opened: Opener) -> None:
    """Before anybody has looked, the page says so; addresses are shown as they are typed, to be copied."""
    program.change(boards=None, cameras=(), settings={"link": "tcp://10.0.0.9:5555"}, stranger="tcp://10.0.0.9:5555")
    page = opened("board")
    page.wait_for_selector("#enrol[open]")  # a typed address, too, leads to the code
    assert page.text_content("#link-none") == "Press Find to search for boards."
    program.answers[Do.FIND] = Answer(words="found 0 boards and 0 cameras")
    page.click("#link-find")
    page.wait_for_selector("#link-answer:has-text('Found 0 boards')")
    page.click("#step-camera")
    assert page.text_content("#camera-none") == "Press Find to search for cameras."
    program.change(boards=())
    page.wait_for_selector("#camera-none:has-text('None found on this machine. ')")
    program.change(trouble=Diagnostic("tcp://10.0.0.9:5555 does not answer", "see /etc/hosts", Severity.FAIL))
    page.wait_for_selector("#trouble:not([hidden])")
    assert page.text_content("#trouble") == "tcp://10.0.0.9:5555 does not answer. See /etc/hosts"


def test_the_skip_link_changes_no_step(opened: Opener) -> None:
    """It leads to the content of the step that is shown; only the steps' own links go on."""
    page = opened("check")
    page.wait_for_selector("#panel-check:not([hidden])")
    page.focus("a.skip")
    page.keyboard.press("Enter")
    page.wait_for_timeout(300)
    assert page.is_visible("#panel-check")
    assert page.evaluate("() => document.activeElement.id") == "main"
    page.click("#step-camera")
    page.wait_for_selector("#panel-camera:not([hidden])")


def test_every_control_is_reached_by_keys_and_shows_that(program: Played, opened: Opener) -> None:
    """Tab reaches every visible control of the live page once, in the order of the page, and each shows the focus."""
    program.change(activity=Activity.RUNNING, done=set(StepName))
    program.emit()
    page = opened("run")
    page.wait_for_selector("#views[data-pair]")
    wanted = page.evaluate(
        """() => [...document.querySelectorAll('a[href],button,input,select,[tabindex="0"]')].filter(one => one.checkVisibility() && !(one.type === 'radio' && !one.checked)).map(one => one.id || one.name || one.textContent)"""
    )
    reached, unseen = [], []
    for _ in range(len(wanted) + 5):
        page.keyboard.press("Tab")
        name, outline = page.evaluate(
            """() => { const one = document.activeElement, around = one.closest('.segments label') ?? one;
            return [one.id || one.name || one.textContent, getComputedStyle(around).outlineStyle]; }"""
        )
        if name in reached:
            break
        reached.append(name)
        if outline == "none" and name in wanted:
            unseen.append(name)
    assert [name for name in wanted if name not in reached] == []
    assert unseen == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [PHONE, LAPTOP], ids=["phone", "laptop"])
def test_axe_finds_no_violation(program: Played, opened: Opener, axe: str, size: dict[str, int], scheme: str) -> None:
    """On every step, on a phone and a laptop, light and dark, axe-core's rules (WCAG 2.2 AA and best practices) find nothing."""
    program.change(activity=Activity.RUNNING, guide=guide_snapshot(), settings={"link": BOARDS[0].uri})
    program.emit()
    page = opened("run", size, color_scheme=scheme, bypass_csp=True)
    page.evaluate(axe)
    found: dict[str, Any] = {}
    for step in EXPECTED_STEPS:
        page.evaluate("step => { location.hash = step; }", step)
        page.wait_for_selector(f"#panel-{step}:not([hidden])")
        if step == "run":
            page.wait_for_selector("#views[data-pair]")
        said = page.evaluate("() => axe.run()")
        for one in said["violations"]:
            found[f"{step}: {one['id']}"] = [node["html"][:120] for node in one["nodes"]]
    assert found == {}


def test_axe_is_not_in_the_package() -> None:
    """Only tests use it."""
    folder = Path(__file__).resolve().parents[2] / "phone_host"
    assert not [path for path in folder.rglob("*axe*") if path.suffix == ".js"]


def test_only_a_calibration_that_was_computed_is_called_done(opened: Opener) -> None:
    """Stopped with a verdict so far: there is no rig, and the heading says so."""
    page = opened("calibration")
    shown = "async guide => { (await import('/static/guide.js')).showGuide({ guide, activity: 'idle' }); return document.querySelector('#guide-words').textContent; }"
    over = {**guide_snapshot().as_json(), "result": "in one sentence"}
    for state, words in (("good", "Done: usable."), ("stopped", "No calibration was made.")):
        assert page.evaluate(shown, {**over, "state": state}) == words
