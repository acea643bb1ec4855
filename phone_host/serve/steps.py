"""The way from nothing to a run and a scan, in words. Pure."""

from collections.abc import Mapping

from common.words import counted
from phone_host.web.source import Step, StepName


def steps(
    choices: Mapping[str, str],
    *,
    stranger: str = "",
    checked: str = "",
    pairs: int = 0,
    is_running: bool = False,
    scan: str = "",
    has_scan: bool = False,
) -> tuple[Step, ...]:
    """Return the steps, each with what it has come to or what to do now.

    Args:
        choices: options of `run`, by name.
        stranger: the chosen board that has to be enrolled first; empty: there is none.
        checked: what the last check of these two cameras came to; empty: there was none, or it failed.
        pairs: how many pairs the last run processed.
        is_running: whether one goes on.
        scan: how the scan goes, or went; empty: there was none.
        has_scan: whether its files are written.
    """
    link, camera = choices.get("link", ""), choices.get("camera", "")
    no_pair = "" if link and camera else "choose both cameras first"
    ran = "it runs" if is_running else f"the last run gave {counted(pairs, 'pair')}" if pairs else ""
    return (
        _board(link, stranger),
        _step(StepName.CAMERA, camera, "choose this machine's camera"),
        _step(StepName.CHECK, checked, no_pair or "check both cameras before you calibrate"),
        _calibration(choices),
        _step(StepName.RUN, ran, no_pair or "start a run"),
        Step(name=StepName.SCAN, done=bool(scan and has_scan), words=scan or no_pair or _scan_words(choices)),
    )


def _scan_words(choices: Mapping[str, str]) -> str:
    if not {"calibration", "rectified"} & choices.keys():
        return "calibrate first: a scan needs metres"
    return "press Start and slowly move the cameras around, or turn the turntable; press Stop when every side has been in view"


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
