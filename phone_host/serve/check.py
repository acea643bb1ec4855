"""What a check of the two chosen cameras came to: what the doctor said, what a run of some seconds without depth saw, and how far a film is. Pure."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final

from common.diagnostic import Diagnostic, Severity
from common.doctor.finding import ok
from common.doctor.machine_checks import LOG_UNREADABLE
from common.words import counted
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.doctor.camera_check.check import ENOUGH, Progress
from phone_host.doctor.camera_check.words import CHECK_AGAIN, stage_words

_OF_THE_CHOICE: Final = frozenset(
    {
        "camera",
        "format",
        "controls",
        "stamps",
        "stream",
        "board",
        "network",
        "permission",
        "rig",
        "capture",
        "out",
        "disk",
    }
)
"""Findings about the chosen cameras, their link, the calibration and the results: shown although nothing is wrong."""

_OF_A_LINK: Final = {"serial": "serial:", "bluetooth": "rfcomm:"}
"""Findings that matter only to a link of this scheme."""


_STEPS: Final = 20
"""So often at the most the page is told how far a film is."""


def relevant(findings: Iterable[Diagnostic], links: str) -> list[Diagnostic]:
    """Return the findings that matter to the chosen cameras and links; of the rest of the machine only what is wrong.

    Args:
        findings: of the doctor.
        links: addresses of the chosen links, with spaces between.
    """
    return [each for each in findings if _matters(each, links.split())]


def _matters(finding: Diagnostic, links: list[str]) -> bool:
    scheme = _OF_A_LINK.get(finding.code)
    if scheme is not None:
        return any(link.startswith(scheme) for link in links)
    if finding.severity is Severity.OK:
        return finding.code in _OF_THE_CHOICE
    return finding.message != LOG_UNREADABLE  # a page cannot ask as root


def checked(findings: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return findings as the page shows them: it has a button for what the command line has an option for."""
    remedy = "press \u201cCheck for image stabilisation\u201d"
    return [replace(each, remedy=remedy) if each.remedy == CHECK_AGAIN else each for each in findings]


def obstacle(findings: list[Diagnostic]) -> Diagnostic | None:
    """Return the first finding that nothing works with; None: there is none."""
    failed = next((each for each in findings if each.severity is Severity.FAIL), None)
    return None if failed is None else Diagnostic(f"{failed.code}: {failed.message}", failed.remedy, Severity.FAIL)


def seen(snapshot: RunSnapshot) -> str:
    """Say what the trial run saw; empty: no pair.

    Args:
        snapshot: its last one.
    """
    if not snapshot.processed:
        return ""
    skew_ms = snapshot.delays.spread("time_skew").p50_ns / 1e6
    rate = (snapshot.processed - 1) / snapshot.seconds if snapshot.seconds > 0 else math.nan
    speed = f", {rate:.0f} pairs/s" if math.isfinite(rate) else ""
    return f"both cameras work: {counted(snapshot.processed, 'pair')}{speed}, time skew {skew_ms:.1f} ms"


def unseen(snapshot: RunSnapshot) -> Diagnostic:
    """Return why the trial run saw no pair.

    Args:
        snapshot: its last one.
    """
    received, own = snapshot.counts.received, snapshot.counts.host_frames
    if not received:
        return Diagnostic(
            "no image came from the board", "see what board-agent says there, or run board-agent doctor", Severity.FAIL
        )
    if not own:
        return Diagnostic(
            "no image came from this machine's camera", "check whether another program uses it", Severity.FAIL
        )
    return Diagnostic(
        "images came from both cameras, but none match in time",
        "give a greater tolerance, or the same frame rate",
        Severity.FAIL,
    )


class CaptureGuide:
    """Guides whoever holds the camera, no oftener than there is something new.

    Args:
        show: takes what the page shall show.
    """

    def __init__(self, show: Callable[[Sequence[Diagnostic]], None]) -> None:
        self._show, self._shown = show, ("", -1, -1)

    def wait(self) -> None:
        """Say that the camera is waited for; a phone's may take seconds."""
        self._show([ok("film", "waiting for the camera")])

    def tell(self, progress: Progress) -> None:
        """Take the progress; called with each frame."""
        now = (stage_words(progress), int(progress.share * _STEPS), progress.told)
        if now == self._shown:
            return
        self._shown = now
        done = f"{100 * now[1] // _STEPS} % done, {min(progress.told, ENOUGH)} of {ENOUGH} segments were usable"
        self._show([Diagnostic(now[0], done, Severity.OK, "film")])
