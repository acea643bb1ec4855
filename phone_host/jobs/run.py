"""A run as its request describes it, whoever asks: `run` itself, `scan`, or the page. Prepares it, and writes its report."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from common import now
from common.camera.base import Camera, upright_px
from common.diagnostic import Diagnostic
from common.errors import SettingsError
from common.link.base import Link
from common.places import Kind, kind_of, resolved
from common.program.settings import Resolved, with_origins
from common.recording.recording_file import require_new
from common.stamp import HOST_CLOCK
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import open_camera
from phone_host.camera.uris import EXAMPLE, without_password
from phone_host.declared_settings import PhoneHostSettings
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.discovery.discovery import remember
from phone_host.discovery.opened import open_named
from phone_host.jobs.output_folders import announce_other_report, require_alone, spare_inputs
from phone_host.jobs.run_request import RunRequest, budget_wanted, with_own_rig
from phone_host.jobs.stereo_core import build_core, overlay_of
from phone_host.model import Rig, Side, TimeOffset
from phone_host.output.json_text import json_text
from phone_host.recording.playback import Playback, open_playback
from phone_host.recording.recorder import begin_recording
from phone_host.recording.switch import RecordingSwitch
from phone_host.report.run_json import build
from phone_host.report.run_page import run_page
from phone_host.run.course import patience_s
from phone_host.run.file_sink import NAMES
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.recording_sinks import ComputedSink
from phone_host.run.sinks import Sink
from phone_host.settings import key_folder, matcher_is_given
from phone_host.stereo.core import StereoCore
from phone_host.stereo.default_matcher import default_note
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.phase import Whose


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """Everything that a run needs, open, before it takes its results folder.

    Attributes:
        request: what was asked for.
        found: its settings.
        camera: of this machine; or a recording of both.
        links: to the board.
        named: its addresses.
        keys: folder that remembers it.
        core: computes depth; None: nobody asked for it.
        board_side: which view the board's camera gives.
        tell: takes a line that the user should know.
    """

    request: RunRequest
    found: Resolved[PhoneHostSettings]
    camera: Camera | Playback
    links: Sequence[Link]
    named: tuple[str, ...]
    keys: Path
    core: StereoCore | None
    board_side: Side
    tell: Callable[[str], None]

    def prepared(
        self, words: Sequence[str], sinks: Sequence[Sink] = (), told: Mapping[str, object] | None = None
    ) -> "PreparedRun":
        """Take the results folder; whatever cannot be had closes the rest.

        Args:
            words: of the command line, from which settings.json knows what was given.
            sinks: further ones.
            told: content of settings.json; None: the settings and options.

        Raises:
            SettingsError: options contradict each other.
            UnavailableError: the folder cannot be had.
            DataError: the overlay belongs to another rig.
        """
        with ExitStack() as opened:
            if not isinstance(self.camera, Playback):
                opened.enter_context(closing(self.camera))
            for link in self.links:
                opened.enter_context(closing(link))
            if self.request.out is not None:
                announce_other_report(self.request.out, self.request.command, self.tell)
            settings = _host_settings(self, words, told)
            recording = self._recording(settings)
            if recording is not None and self.request.record_topics:
                sinks = (*sinks, ComputedSink(recording, self.request.record_topics, self.board_side))
            host = Host(settings, self.camera, self.links, self.core, sinks, recording=recording)
            opened.pop_all()
        pairs = self.request.pairs or 0
        is_replay = isinstance(self.camera, Playback)
        return PreparedRun(host, self.named, self.keys, self.board_side, self.request.out, pairs, is_replay)

    def _recording(self, settings: HostSettings) -> RecordingSwitch | None:
        """Return what records, begun if that was asked for; None: a recording is played."""
        if isinstance(self.camera, Playback):
            return None
        rig = self.found.values.calibration
        attached = {"settings.json": json_text(dict(settings.resolved or {}), indent=1).encode()}
        known = None if self.core is None else self.core.rig
        if rig:
            attached[Path(rig).name if known is None else "rig.yaml"] = Path(rig).read_bytes()
        camera = self.camera.description
        recording = RecordingSwitch(lambda path: begin_recording(path, camera, self.board_side, known, attached))
        if self.request.record is not None:
            recording.begin(self.request.record)
        return recording


@dataclass(frozen=True, slots=True, eq=False)
class Ended:
    """A run that has ended.

    Attributes:
        snapshot: its last one.
        report: content of report.json.
        is_complete: whether everything that was asked for was written.
        missing: what was not, and why, in words; empty: nothing.
    """

    snapshot: RunSnapshot
    report: dict[str, Any]
    is_complete: bool
    missing: str


@dataclass(frozen=True, slots=True, eq=False)
class PreparedRun:
    """A run that is ready to begin: its camera and links are open. `host.run` closes them, whenever it is stopped.

    Attributes:
        host: runs.
        named: addresses of the board.
        keys: folder that remembers the board.
        board_side: which view the board's camera gives.
        out: folder for results; None: none.
        pairs: after how many the run is whole; 0: it has no such number.
        is_replay: whether it plays a recording, which has an end.
    """

    host: Host
    named: tuple[str, ...]
    keys: Path
    board_side: Side
    out: Path | None
    pairs: int
    is_replay: bool

    def ended(self, ended: EndReason) -> Ended:
        """Write the report of a run that has ended, and remember its board.

        Args:
            ended: why it did.
        """
        is_plain = len(self.named) == 1 and "?" not in self.named[0] and self.named[0].startswith("tcp://")
        if self.host.has_met_board and is_plain:
            remember(self.keys, self.named[0])
        snapshot = self.host.snapshot(ended.value)
        return self._written(snapshot, is_whole=snapshot.processed > 0 and not self.is_cut_short(snapshot, ended))

    def is_cut_short(self, snapshot: RunSnapshot, ended: EndReason) -> bool:
        """Tell whether a run ended before all its pairs came: those that were asked for, or those of the recording.

        Args:
            snapshot: its last one.
            ended: why it ended.
        """
        return snapshot.processed < self.pairs or (self.is_replay and ended is EndReason.STOPPED)

    def failed(self, failure: Diagnostic) -> Ended:
        """Write the report of a run that an error ended.

        Args:
            failure: the error.
        """
        return self._written(self.host.snapshot("failed", failure), is_whole=False)

    def _written(self, snapshot: RunSnapshot, *, is_whole: bool) -> Ended:
        report = build(snapshot)
        recording = snapshot.recording
        place = self.host.results_place
        page = "" if place is None else _page(self.host, snapshot, self.board_side, place)
        is_complete = self.host.write_report(report, page, replaces_earlier=is_whole)
        missing = [self.host.missing_files] if self.host.missing_files else []
        if recording is not None and not recording.is_whole:
            missing.append(f"the whole of {recording.file}")
            is_complete = False
        return Ended(snapshot, report, is_complete, ", ".join(missing))


def open_run(
    request: RunRequest,
    found: Resolved[PhoneHostSettings],
    tell: Callable[[str], None],
    feed: BrowserFeed | None = None,
    core: StereoCore | None = None,
) -> Opened:
    """Open the camera, the core and the links of a run.

    Args:
        request: of the run.
        found: its settings, from `checked`.
        tell: takes a line that the user should know.
        feed: brings browsers that give their cameras; None: there is no page.
        core: computes depth; None: as the request says.

    Raises:
        SettingsError: options contradict each other.
        UnavailableError: the camera or a link cannot be had.
        DataError: the rig or the camera's images cannot be used.
    """
    settings = found.values
    if request.replay is not None:
        return _open_replay(request, request.replay, found, tell)
    if not settings.camera:
        raise SettingsError("no camera of this machine is given", f"use --camera {EXAMPLE}")
    if request.record is not None:
        require_alone(request.record.parent, request.record.name, "--record")
        require_new(request.record, "--record")
    if request.out is not None:
        spare(request.out, replayed(settings.camera), settings.calibration, request.depth.overlay)
    with ExitStack() as opened:  # what cannot be had closes what was
        camera = open_camera(settings.camera, HOST_CLOCK, now.monotonic_ns(), settings.most_pixels, feed)
        opened.enter_context(closing(camera))
        board_side = request.board_side or Side.LEFT
        if core is None:
            core, board_side = _core(request, settings, upright_px(camera), tell)
        overlay_of(request.depth, core)
        budget_wanted(request, found, core)
        keys = key_folder(settings.keys)
        named, links = open_named(settings.link, keys, patience_s(request.cameras.wait_s, request.duration_s))
        opened.pop_all()
    return Opened(request, found, camera, links, tuple(named), keys.path, core, board_side, tell)


def _open_replay(
    request: RunRequest, replay: str, found: Resolved[PhoneHostSettings], tell: Callable[[str], None]
) -> Opened:
    """Open the recording that a run plays, and the core."""
    for name in ("link", "camera", "record", "record_topics", "align_phase"):
        if request.given.get(name) is not None:
            raise SettingsError(f"--{name.replace('_', '-')} beside --replay", "leave one of them out")
    playback = open_playback(replay, None if request.board_side is None else request.board_side.value)
    if request.out is not None:
        spare(request.out, "", found.values.calibration, request.depth.overlay)
        spare_inputs(request.out, NAMES, {"--replay": playback.file})
    found, rig = with_own_rig(request, found, playback, tell)
    settings, size_px = replace(found.values, camera=""), playback.description.upright_px
    core, board_side = _core(request, settings, size_px, tell, playback.board_side, rig=rig)
    overlay_of(request.depth, core)
    budget_wanted(request, found, core)
    keys = key_folder(settings.keys).path
    return Opened(request, found, playback, (), (str(playback.file),), keys, core, board_side, tell)


def replayed(uri: str) -> str:
    """Return the path of a camera that replays images; empty for any other camera."""
    return uri.removeprefix("replay:").partition("?")[0] if uri.startswith("replay:") else ""


def spare(out: Path, replay: str, calibration: str, overlay: Path | None = None) -> None:
    """Refuse a results folder that would lose the inputs, or holds the replay's photographs.

    Args:
        out: folder for the results.
        replay: folder, glob or file that the own camera replays; empty: another camera.
        calibration: path of the rig; empty: none.
        overlay: correction of an earlier run; None: none.

    Raises:
        SettingsError: it is such a folder.
    """
    inputs = {"--camera": replay, "--calibration": calibration, "--overlay": "" if overlay is None else str(overlay)}
    spare_inputs(out, NAMES, {what: Path(path) for what, path in inputs.items() if path})
    if not replay:
        return
    try:
        folder = Path(replay) if kind_of(replay) is Kind.FOLDER else Path(replay).parent
    except OSError:  # the camera will say why
        return
    if resolved(out) == resolved(folder):
        raise SettingsError(
            f"--out {out} is the folder of the photographs of --camera",
            f"give a folder of its own, such as --out {out / 'scan'}",
        )


def _page(host: Host, snapshot: RunSnapshot, board_side: Side, out: Path) -> str:
    """Make the page of a run, with links to the clouds it saved (maps where it has no geometry)."""
    saved = sorted(path.relative_to(out).as_posix() for path in out.glob("pair-*/cloud.ply"))
    saved = saved or sorted(path.relative_to(out).as_posix() for path in out.glob("pair-*/disparity.pfm"))
    return run_page(snapshot, host.last, board_side, host.sample(), saved)


def _core(
    request: RunRequest,
    settings: PhoneHostSettings,
    size_px: tuple[int, int],
    tell: Callable[[str], None],
    usual: Side = Side.LEFT,
    *,
    rig: Rig | None = None,
) -> tuple[StereoCore | None, Side]:
    """Return the stereo core, if any, and the side of the board's camera: from the option, else the rig, else the usual one."""
    images = replayed(settings.camera)
    core, rig_side = build_core(
        request.depth,
        settings.calibration,
        settings.matcher,
        size_px,
        Path(images) if images else None,
        rig=rig,
    )
    board_side = request.board_side or rig_side or usual
    if rig_side not in {None, board_side}:
        raise SettingsError(
            f"--board-side {board_side.value} contradicts {settings.calibration}",
            "leave it out, or calibrate with the board there",
        )
    if request.record_topics is not None and (core is None or core.geometry is None):
        raise SettingsError(
            "--record-topics without depth in metres",
            "add --calibration rig.yaml, or leave it out: a replay computes depth",
        )
    if core is None:
        tell("no --calibration and not --rectified: pairs and delays only, no depth")
    return core, board_side


def _host_settings(opened: Opened, words: Sequence[str], told: Mapping[str, object] | None) -> HostSettings:
    request, found, core = opened.request, opened.found, opened.core
    settings, wait_s = found.values, patience_s(request.cameras.wait_s, request.duration_s)
    shown = replace(found, values=replace(settings, camera=without_password(settings.camera)))
    return HostSettings(
        matcher_note="" if core is None or matcher_is_given(found) else default_note(),
        resolved=told or with_origins(shown, request.given, words),
        board_side=opened.board_side,
        tolerance_ns=round(settings.tolerance * 1e6) if settings.tolerance else None,
        fifo=FifoSettings.parse(settings.fifo),
        pairs=request.pairs or 0,
        seconds_ns=round(request.duration_s * 1e9),
        wait_ns=None if wait_s is None else round(wait_s * 1e9),
        out=request.out,
        save_every=request.save_every,
        axes=request.depth.axes,
        corrects=not request.no_correction,
        time_offset=TimeOffset() if core is None or core.rig is None else core.rig.time_offset,
        interpolate=settings.interpolate,
        most_pixels=settings.most_pixels,
        steered=frozenset(whose for whose in Whose if settings.align_phase in {"either", whose.value}),
        budget=budget_wanted(request, found, core),
        overlay=overlay_of(request.depth, core),
        command=request.command,
    )
