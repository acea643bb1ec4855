"""phone-host calibrate --live: takes the views with both cameras, guides the person, then leaves the pictures to `calibrate`."""

import logging
import shlex
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common import now
from common.errors import DataError, SettingsError
from common.orientation import UPRIGHT
from common.program import logs
from common.program.settings import log_level
from common.program.signals import StopSignals
from common.program.terminal import say
from common.stamp import HOST_CLOCK
from common.words import counted
from phone_host.calibration.failure_modes.mistakes import Mistake
from phone_host.calibration.failure_modes.name import BoardSeries, name_mistake
from phone_host.calibration.failure_modes.remedies import arrangement_hint, assessed
from phone_host.calibration.guide.gates import View
from phone_host.calibration.guide.snapshot import LEAST_STATED, GuideSnapshot, Progress, lessons
from phone_host.calibration.guide.wants import CORNERS, Want, unseen_in
from phone_host.calibration.solve.earlier_views import board_of, pairs_of
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.board_views import BoardViews, Size
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.sharpness import SeenLook
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import open_camera
from phone_host.camera.uris import EXAMPLE
from phone_host.discovery.opened import open_named
from phone_host.jobs.calibrate.earlier import Asked, Series, calibrated, every_pair
from phone_host.jobs.calibrate.live_calibration import LiveCalibration, LiveSettings
from phone_host.jobs.calibrate.request import CalibrateRequest
from phone_host.jobs.calibrate.view import Lines, Picture, Shows, SnapshotFiles, Spoken, tell_sides
from phone_host.jobs.calibrate.voice import Voice, speech_program
from phone_host.jobs.output_folders import require_folder, unwritable
from phone_host.jobs.picture_pairs import VIEWS
from phone_host.model import Side, TimeOffset, Verdict
from phone_host.run.host_settings import HostSettings
from phone_host.run.sinks import Sink
from phone_host.settings import key_folder, most_pixels
from phone_host.sync.phase import Whose

_LOG = logging.getLogger(__name__)

_MOST_VIEWS: Final = 99
_LEAST_ADDED: Final = 3
"""So few views may be added to those of an earlier calibration."""

_WAITED_NS: Final = 1_000_000_000
"""A board that is there is met within a fifth of this; then there is nothing to say."""


@dataclass(frozen=True, slots=True)
class Live:
    """How a live calibration went.

    Attributes:
        last: its last snapshot.
        left: folder of the left pictures.
        right: folder of the right ones.
    """

    last: GuideSnapshot
    left: Path
    right: Path

    @property
    def folders(self) -> tuple[str, str]:
        """Both folders, as LEFT and RIGHT."""
        return str(self.left), str(self.right)

    def as_lines(self, request: CalibrateRequest) -> list[str]:
        """Return it for the summary: where the pictures are, and how they are calibrated again."""
        taken = f"live     {counted(self.last.views, 'view')} in {self.last.seconds:.0f} s"
        command = request.again(*self.folders)
        again = [f"{taken}; to calibrate from them again:", f"         {command}"] if command else [taken]
        if self.last.verdict != Verdict.GOOD.value:
            return again
        links = [word for uri in request.cameras.link or () for word in ("--link", uri)]
        run = ["phone-host", "run", *links, "--camera", request.cameras.camera or "", "--calibration", str(request.out)]
        return [*again, f"next     {shlex.join(run)}"]


@dataclass(frozen=True, slots=True, eq=False)
class PreparedViews:
    """A live calibration that is ready to begin.

    Attributes:
        live: takes the views.
        named: addresses of the board.
        left: folder of the left pictures.
        right: folder of the right ones.
        least: fewer views give no rig.
    """

    live: LiveCalibration
    named: tuple[str, ...]
    left: Path
    right: Path
    least: int

    @property
    def note(self) -> str:
        """What keeps views from coming; empty: nothing."""
        host = self.live.host
        if host.refused is not None:
            return f"waiting: {host.refused.message}: {host.refused.remedy}"
        if not host.has_met_board:
            waits = now.monotonic_ns() - host.started_ns > _WAITED_NS
            return f"waiting for a board at {' and '.join(self.named)}" if waits else ""
        return self.live.trouble

    def run(self, stop: Callable[[], bool], shows: Sequence[Shows]) -> None:
        """Take views before presenters.

        Args:
            stop: called several times a second.
            shows: they show how it goes.

        Raises:
            TandemError: as `LiveCalibration.run`.
        """

        def show() -> None:
            (snapshot, views), note = self.live.shown(), self.note
            for each in shows:
                each.show(snapshot, views, note)

        try:
            self.live.run(stop, show)
        except OSError as error:
            raise unwritable(self.left, error, "LEFT or --snapshots") from error
        show()

    def taken(self) -> Live:
        """Return how it went.

        Raises:
            DataError: too few views were taken to calibrate from.
        """
        last = self.live.snapshot()
        if last.views < self.least:
            raise _too_few(last, self.least)
        return Live(last, self.left, self.right)


def prepare_views(
    request: CalibrateRequest, asked: Asked, feed: BrowserFeed | None = None, sinks: Sequence[Sink] = ()
) -> PreparedViews:
    """Open everything that a live calibration needs.

    Args:
        request: of the calibration.
        asked: what it asks for, with what the earlier calibration says.
        feed: brings browsers that give their cameras; None: there is no page.
        sinks: for who wants to see the pictures.

    Raises:
        SettingsError: an option is missing or not valid.
        UnavailableError: the board, the camera or a folder cannot be had.
    """
    uri = request.cameras.camera
    if not uri:
        raise SettingsError("no camera of this machine is given", f"use --camera {EXAMPLE}")
    _check(request)
    settings = _settings(request, asked)
    for folder in (settings.left, settings.right, request.snapshots):
        if folder is not None:
            require_folder(folder)

    def grow(views: tuple[View, ...], board: Board, sizes_px: tuple[Size, Size]) -> Progress:
        series = Series(
            board=board,
            side=settings.host.board_side,
            path=request.earlier or Path(),
            rig=asked.rig,
            views=None if request.pose_only else asked.views,
        )
        return grown(views, series, sizes_px, request.measured_m)

    with ExitStack() as opened:  # what cannot be had closes what was
        camera = open_camera(uri, HOST_CLOCK, now.monotonic_ns(), settings.host.most_pixels, feed)
        opened.enter_context(closing(camera))
        keys = key_folder(request.cameras.keys or "")
        named, links = open_named(request.cameras.link or (), keys, request.cameras.wait_s)
        for link in links:
            opened.enter_context(closing(link))
        try:
            live = LiveCalibration(settings, camera, links, grow, sinks)
        except OSError as error:
            raise unwritable(settings.left, error, "LEFT or --snapshots") from error
        opened.pop_all()
    return PreparedViews(live, named, settings.left, settings.right, _least_views(request))


def take_views(request: CalibrateRequest, asked: Asked) -> tuple[Live, StopSignals]:
    """Take views until it is enough.

    Args:
        request: of the calibration.
        asked: what it asks for, with what the earlier calibration says.

    Returns:
        How it went, and what asked the process to stop, until now.

    Raises:
        SettingsError: an option is missing or not valid, or the person shows another board.
        UnavailableError: the board, the camera or a folder cannot be had.
        DataError: too few views were taken to calibrate from.
    """
    logs.set_up(log_level("error"))  # doubts about pairs are the gates' business
    prepared = prepare_views(request, asked)
    signals = StopSignals()
    _run(prepared, request, signals)
    try:
        return prepared.taken(), signals
    except DataError as reason:
        if not signals.interrupted:
            raise
        views = prepared.live.snapshot().views
        kept = f", kept in {prepared.left} and {prepared.right} until the next --live" if views else ""
        say(f"phone-host: no rig: {reason.problem}{kept}", sys.stderr, flush=True)
        raise KeyboardInterrupt from None


def grown(views: tuple[View, ...], series: Series, sizes_px: tuple[Size, Size], baseline_m: float) -> Progress:
    """Calibrate from the views so far and judge, as the command does at the end.

    Args:
        views: the views.
        series: the board, and what an earlier calibration gives.
        sizes_px: of the left and of the right images.
        baseline_m: as the user measured it, m; NaN: not told.
    """
    pairs = [view.pair for view in views]
    looks = tuple(
        SeenLook(view.name, side, look) for view in views for side, look in zip(Side, view.looks, strict=True)
    )
    found: Calibration | DataError
    try:
        found = calibrated(series, every_pair(series, pairs, sizes_px), sizes_px)
    except DataError as error:
        found = error
    board = series.board
    shown = BoardSeries(pairs=tuple(pairs), board=board, sizes_px=sizes_px, looks=looks, baseline_m=baseline_m)
    finding = name_mistake(shown, found)
    wrong = None if finding is None else finding.evidence.misplaced
    seen = BoardViews(pairs=tuple(pairs), rejected=(), sizes_px=sizes_px, looks=looks)
    hint = "" if wrong is None else arrangement_hint(seen, (UPRIGHT, UPRIGHT), wrong, is_live=True)
    hopeless = wrong is not None or (finding is not None and finding.code in {Mistake.SWAPPED, Mistake.MIRRORED})
    if isinstance(found, DataError):
        remedy = hint or (finding.text if finding is not None else str(found))
        return Progress(views=len(views), calibration=None, verdict=Verdict.REJECT, remedy=remedy, is_hopeless=hopeless)
    judgement = assessed(found, found.rejected, finding, hint)
    return Progress(
        views=len(views),
        calibration=found,
        verdict=judgement.verdict,
        remedy=judgement.remedy,
        is_hopeless=hopeless,
        taught=lessons(found, board),
    )


def _check(request: CalibrateRequest) -> None:
    least = _least_views(request)
    if not least <= request.most_views <= _MOST_VIEWS:
        raise SettingsError(f"--views is {request.most_views}", f"give {least} to {_MOST_VIEWS}")
    if len(request.images) not in {0, 2}:
        raise SettingsError(
            f"--live with {counted(len(request.images), 'folder')}",
            "name two folders for the pictures it takes, or none",
        )
    if request.pictures.mounted != (UPRIGHT, UPRIGHT):
        raise SettingsError(
            "--live does not take --rotate-left, --rotate-right, --flip-left or --flip-right",
            "add rotate= or flip= to the camera's address",
        )


def _least_views(request: CalibrateRequest) -> int:
    """Return how many views there must be for a rig to know how exact it is."""
    return LEAST_STATED if request.earlier is None else _LEAST_ADDED


def _settings(request: CalibrateRequest, asked: Asked) -> LiveSettings:
    rig = asked.rig
    side = request.board_side or (Side.LEFT if rig is None else rig.board_side)
    beside = request.out.parent / VIEWS
    left, right = map(Path, request.images) if request.images else (beside / "left", beside / "right")
    return LiveSettings(
        host=HostSettings(
            board_side=side,
            tolerance_ns=round(request.cameras.tolerance_ms * 1e6) if request.cameras.tolerance_ms else None,
            wait_ns=None if request.cameras.wait_s is None else round(request.cameras.wait_s * 1e9),
            time_offset=TimeOffset() if rig is None else rig.time_offset,
            most_pixels=most_pixels(None, request.pictures.max_megapixels),
            steered=frozenset(Whose),  # a view is worth as much as its two exposures are simultaneous
        ),
        board=asked.named.board,
        square_m=asked.named.square_mm / 1000,
        most_views=request.most_views,
        left=left,
        right=right,
        seen=_seen_before(asked, pose_only=request.pose_only),
    )


def _seen_before(asked: Asked, *, pose_only: bool) -> frozenset[Want]:
    """Return the image corners that the earlier calibration saw; all of them where its lenses are kept."""
    if pose_only:
        return CORNERS
    if asked.rig is None or asked.views is None:
        return frozenset()
    return CORNERS - unseen_in(pairs_of(asked.views), board_of(asked.views), asked.rig.left, asked.rig.right)


def _run(prepared: PreparedViews, request: CalibrateRequest, signals: StopSignals) -> None:
    """Run it before all presenters that are wanted."""
    command = speech_program() if request.sound else ()
    is_terminal = sys.stderr.isatty()
    with ExitStack() as ending:
        shows: list[Shows] = []
        picture = Picture(rings=request.sound and not command)
        if command:
            voice = Voice(command, lambda reason: ring_instead(picture, command[0], reason))
            ending.callback(voice.finish)
            shows.append(Spoken(voice.say))
        if request.snapshots is not None:
            try:
                shows.append(SnapshotFiles(request.snapshots))
            except OSError as error:
                raise unwritable(prepared.left, error, "LEFT or --snapshots") from error
        if is_terminal:
            tell_sides()
            shows.append(ending.enter_context(picture))
        else:
            shows.append(Lines())
        prepared.run(lambda: signals.stop, shows)


def ring_instead(picture: Picture, program: str, reason: OSError) -> None:
    """Let the bell tell of views where the speech program does not start, and say so."""
    picture.rings = True
    remedy = "the terminal's bell rings instead; install espeak-ng, or give --no-sound"
    _LOG.error(logs.event("voice_off", program=program, reason=reason.strerror, remedy=remedy))


def _too_few(last: GuideSnapshot, least: int) -> DataError:
    refused = max(last.refused, key=lambda each: each[1], default=None)
    reason = "" if refused is None else f"; most looks were refused: {refused[0].value}"
    return DataError(
        f"only {counted(last.views, 'view')} taken{reason}",
        f"show the board as it is told; {least} are the least",
    )
