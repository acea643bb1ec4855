"""The way from nothing to a run and a scan, in words. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass

from common.words import counted
from phone_host.web.source import Step, StepName


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """What the steps are told from.

    Attributes:
        choices: options of `run`, by name.
        stranger: the chosen board that has to be enrolled first; empty: there is none.
        checked: what the last check of these two cameras came to; empty: there was none, or it failed.
        pairs: how many pairs the last run processed.
        is_running: whether one goes on.
        scan: how the scan goes, or went; empty: there was none.
        has_scan: whether its files are written.
    """

    choices: Mapping[str, str]
    stranger: str = ""
    checked: str = ""
    pairs: int = 0
    is_running: bool = False
    scan: str = ""
    has_scan: bool = False


def steps(facts: Facts) -> tuple[Step, ...]:
    """Return the steps, each with what it has come to or what to do now."""
    link, camera = facts.choices.get("link", ""), facts.choices.get("camera", "")
    has_both = bool(link and camera)
    return (
        _board(link, facts.stranger),
        Step(name=StepName.CAMERA, done=bool(camera), words=camera or "choose this machine's camera"),
        _step(
            StepName.CHECK,
            facts.checked,
            "check both cameras before you calibrate" if has_both else "choose both cameras first",
        ),
        _calibration(facts.choices),
        _step(
            StepName.RUN,
            _run_words(facts),
            "start a run" if has_both else "choose both cameras first",
        ),
        _scan(facts, has_both=has_both),
    )


def _scan(facts: Facts, *, has_both: bool) -> Step:
    if facts.scan:
        return Step(name=StepName.SCAN, done=facts.has_scan, words=facts.scan)
    if not has_both:
        return Step(name=StepName.SCAN, done=False, words="choose both cameras first")
    if not {"calibration", "rectified"} & facts.choices.keys():
        return Step(name=StepName.SCAN, done=False, words="calibrate first: a scan needs metres")
    words = "press Start and slowly move the cameras around, or turn the turntable; press Stop when every side has been in view"
    return Step(name=StepName.SCAN, done=False, words=words)


def _run_words(facts: Facts) -> str:
    if facts.is_running:
        return "it runs"
    return f"the last run gave {counted(facts.pairs, 'pair')}" if facts.pairs else ""


def _step(name: StepName, come_to: str, to_do: str) -> Step:
    return Step(name=name, done=bool(come_to), words=come_to or to_do)


def _board(link: str, stranger: str) -> Step:
    if stranger:
        words = "run `sudo board-agent pair` on the board and type the code that it shows"
        return Step(name=StepName.BOARD, done=False, words=words)
    return _step(StepName.BOARD, link, "find the board, or type its address")


def _calibration(choices: Mapping[str, str]) -> Step:
    if "rectified" in choices:
        return Step(name=StepName.CALIBRATION, done=True, words="the images come rectified")
    return _step(
        StepName.CALIBRATION,
        choices.get("calibration", ""),
        "calibrate, or name a rig.yaml; without it there is no depth",
    )
