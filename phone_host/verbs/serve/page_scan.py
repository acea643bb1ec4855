"""A scan that the page begins: a run whose pairs become a model, in a folder of its own."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from common.errors import SettingsError, UnavailableError
from common.places import make_folder
from common.program.request import read_request, usual_values
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.jobs.run_request import RunRequest, checked
from phone_host.jobs.scan import PreparedScan, prepare_scan
from phone_host.jobs.scan_request import ModelOptions, axes_beside, box_of, model_wanted
from phone_host.live.scan import LiveScan
from phone_host.model.unseen import UnseenSurface
from phone_host.report.report_page import Headline
from phone_host.report.scan_report import MODEL, TRAJECTORY, ScanReport, scan_verdict
from phone_host.report.stereo_report import ALWAYS
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason
from phone_host.scan.box import Box
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.serve.program import Choices, Scanned, SinksOf

OF_SCAN: Final = ("voxel", "box", "mat", "turntable", "object", "unseen")
"""Options of `scan` that the page may give."""


@dataclass(frozen=True, slots=True, eq=False)
class PageScan:
    """A scan that is ready to begin.

    Attributes:
        scan: with the run beneath.
    """

    scan: PreparedScan

    @property
    def host(self) -> Host:
        """See ReadyScan."""
        return self.scan.host

    @property
    def live(self) -> LiveScan:
        """See ReadyScan."""
        return self.scan.live

    def finish(self, ended: EndReason) -> Scanned:
        """See ReadyScan."""
        report, snapshot = self.scan.ended(ended)
        verdict, words = _verdict(report)
        return self._scanned(words, verdict, snapshot)

    def save(self) -> Scanned | None:
        """See ReadyScan."""
        report = self.scan.failed()
        if report is None:
            return None
        verdict, words = _verdict(report)
        at_best = Headline.WARNING if verdict is Headline.GOOD else verdict
        return self._scanned(f"ended early: {words}", at_best, self.host.snapshot())

    def _scanned(self, words: str, verdict: Headline, snapshot: RunSnapshot) -> Scanned:
        files = (MODEL, TRAJECTORY, *ALWAYS)
        return Scanned(words=words, level=verdict.value, folder=self.scan.out, files=files, snapshot=snapshot)


def page_scan(
    request: RunRequest,
    values: Choices,
    folder: Path,
    sinks_of: SinksOf,
    *,
    tell: Callable[[str], None],
    feed: BrowserFeed,
) -> PageScan:
    """Open everything that a scan needs.

    Args:
        request: of the run.
        values: options of `scan` by name, those of OF_SCAN.
        folder: of all scans; created if missing.
        sinks_of: makes further sinks.
        tell: takes a line that the user should know.
        feed: brings browsers that give their cameras.

    Raises:
        SettingsError: options contradict each other, or give no depth in metres.
        UnavailableError: a camera, a link or the folder cannot be had.
        DataError: the rig cannot be used.
    """
    nothing = {"out": None, "save_every": 0}  # the run beneath writes nothing itself
    request = replace(request, out=None, save_every=0, given={**request.given, **nothing})
    found = checked(request)
    if not found.values.calibration and not (request.depth.rectified and request.depth.focal_px):
        raise SettingsError("there is no calibration, so there are no metres", "calibrate, or name a rig.yaml")
    if unknown := set(values) - set(OF_SCAN):
        raise SettingsError(
            f"{min(unknown)!r} is no option of a scan that the page can set", f"give some of {', '.join(OF_SCAN)}"
        )
    wanted = asked_scan(values)
    axes = axes_beside(request.depth.axes, wanted)
    out = _new_folder(folder)
    return PageScan(prepare_scan(request, found, wanted, axes, out, tell=tell, feed=feed, sinks_of=sinks_of))


def asked_scan(values: Choices) -> ScanWanted:
    """Return what the page wants, by the options of the command.

    Args:
        values: options of `scan` by name, those of OF_SCAN; what is missing or empty is as the command has it.

    Raises:
        SettingsError: one of them is invalid, or contradicts another.
    """
    chosen = {name: text for name in OF_SCAN if (text := values.get(name, "").strip())}
    given = {**usual_values(ModelOptions), **chosen}
    given |= {name: name in chosen for name in ("turntable", "object")}
    if given["unseen"] not in {each.value for each in UnseenSurface}:
        raise SettingsError(f"unseen is {given['unseen']!r}", "give fill, pink or cut")
    return model_wanted(read_request(ModelOptions, given), None)


def asked_box(values: Choices) -> Box | None:
    """Return the box that the page asks for; None: it asks for none.

    Args:
        values: options of `scan` by name.

    Raises:
        SettingsError: it is no box.
    """
    text = values.get("box", "").strip()
    return box_of(text) if text else None


def _verdict(report: ScanReport) -> tuple[Headline, str]:
    """Return the verdict of the report, and its sentence with the model's size."""
    verdict, sentence = scan_verdict(report)
    wide, high, deep = (1000 * side for side in report.model.size.extent_m)
    return verdict, f"{sentence} Size: {wide:.0f} x {high:.0f} x {deep:.0f} mm" if report.model.triangles else sentence


def _new_folder(folder: Path) -> Path:
    """Return a folder that is free, named by date and time of this place; it is made when something is written.

    Raises:
        UnavailableError: the folder above cannot be made.
    """
    try:
        make_folder(folder)
    except OSError as error:
        cause = error.strerror or str(error)
        raise UnavailableError(f"{folder} cannot be made ({cause})", "make room, or choose another out") from None
    stem = time.strftime("%Y-%m-%d-%H%M%S")
    path, number = folder / stem, 2
    while path.exists():
        path, number = folder / f"{stem}-{number}", number + 1
    return path
