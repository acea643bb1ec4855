"""What a check of the two chosen cameras came to: what the doctor said, and what a run of some seconds without depth saw. Pure."""

import math
from collections.abc import Iterable
from typing import Final

from common.doctor.finding import Finding, Grade
from common.doctor.machine_checks import LOG_UNREADABLE
from common.words import counted
from phone_host.diagnostics.concern import Trouble
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.doctor.camera_check.words import CHECK_AGAIN
from phone_host.web.source import Checked

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


def relevant(findings: Iterable[Finding], links: str) -> list[Finding]:
    """Return the findings that matter to the chosen cameras and links; of the rest of the machine only what is wrong.

    Args:
        findings: of the doctor.
        links: addresses of the chosen links, with spaces between.
    """
    return [each for each in findings if _matters(each, links.split())]


def _matters(finding: Finding, links: list[str]) -> bool:
    scheme = _OF_A_LINK.get(finding.what)
    if scheme is not None:
        return any(link.startswith(scheme) for link in links)
    if finding.verdict is Grade.OK:
        return finding.what in _OF_THE_CHOICE
    return finding.text != LOG_UNREADABLE  # a page cannot ask as root


def checked(findings: Iterable[Finding]) -> list[Checked]:
    """Return findings as the page shows them."""
    return [Checked(each.what, each.verdict.value, each.text, _remedy(each)) for each in findings]


def _remedy(finding: Finding) -> str:
    return "press \u201cCheck for image stabilisation\u201d" if finding.remedy == CHECK_AGAIN else finding.remedy


def obstacle(findings: list[Finding]) -> Trouble | None:
    """Return the first finding that nothing works with; None: there is none."""
    failed = next((each for each in findings if each.verdict is Grade.FAIL), None)
    return None if failed is None else Trouble(f"{failed.what}: {failed.text}", failed.remedy)


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


def unseen(snapshot: RunSnapshot) -> Trouble:
    """Return why the trial run saw no pair.

    Args:
        snapshot: its last one.
    """
    received, own = snapshot.counts.received, snapshot.counts.host_frames
    if not received:
        return Trouble("no image came from the board", "see what board-agent says there, or run board-agent doctor")
    if not own:
        return Trouble("no image came from this machine's camera", "check whether another program uses it")
    return Trouble(
        "images came from both cameras, but none match in time", "give a greater tolerance, or the same frame rate"
    )
