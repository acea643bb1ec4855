"""The Python API of tandemscan: open two cameras and iterate over the results.

    from phone_host.api import open_scanner

    with open_scanner(link="tcp://192.168.7.2:5555", camera="v4l2:/dev/video0", rig="rig.yaml") as scanner:
        for result in scanner:
            print(result.number, result.ledger.end_to_end_ns, result.processed.cloud.shape)

A result holds the rectified images, the disparity, the point cloud in metres and the pair's delays
(`phone_host.model.Result`). A program that is slower than the cameras gets the newest results; `scanner.snapshot()`
counts those it missed. With `lossless=True`, or if the host camera gives images on demand, the scanner waits for the
program and skips no result.

This module stays backward compatible. The modules below it may change.
"""

import math
import threading
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from types import TracebackType
from typing import Self

from common import now
from common.camera.base import Camera
from common.errors import SettingsError
from common.link.base import Link
from common.link.factory import LinkUri, open_links, parse_link, tell_insecure
from common.protocol.message import Pacing
from common.stamp import HOST_CLOCK
from phone_host.camera.factory import open_camera
from phone_host.camera.http_uri import without_password
from phone_host.declared_settings import NEAR_M
from phone_host.geometry.se3 import SE3
from phone_host.geometry.triangulate import Intersections, triangulate
from phone_host.measure.delays import Series
from phone_host.measure.run_snapshot import RunSnapshot
from phone_host.measure.sink_account import SinkAccount
from phone_host.measure.trouble import trouble_of
from phone_host.model import Result, Rig, Side, StereoGeometry, TimeOffset
from phone_host.output.meshes.printable import Printer, Problem
from phone_host.output.ply import PointCloud, write_surface
from phone_host.output.rig_files.imported import Imported, import_rig, read_own_rig
from phone_host.printers.door import Wishes
from phone_host.printers.progress import Ended, Phase, Progress
from phone_host.report.run_json import build
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.model_job import check_model, export_model, print_model
from phone_host.scan.scan import Scan, ScannedPair, ScanWanted
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.turntable import scan_for
from phone_host.settings import key_folder
from phone_host.stereo.core import StereoCore
from phone_host.stereo.default_matcher import default_matcher, default_note
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import matcher_named
from phone_host.stereo.matcher_protocol import Matcher
from phone_host.stereo.rectifier import Rectifier
from phone_host.sync.fifo import FifoSettings

__all__ = [
    "SE3",
    "Ended",
    "Imported",
    "Intersections",
    "Phase",
    "Printer",
    "Problem",
    "Progress",
    "Result",
    "RunSnapshot",
    "Scan",
    "ScanModel",
    "ScanWanted",
    "ScannedPair",
    "Scanner",
    "StereoGeometry",
    "Wishes",
    "check_model",
    "export_model",
    "import_rig",
    "open_scanner",
    "print_model",
    "scan_for",
    "triangulate",
    "write_model",
]

_DEPTH = 2


def open_scanner(
    *,
    link: str | Sequence[str],
    camera: str,
    rig: str | Path | Rig | None = None,
    geometry: StereoGeometry | None = None,
    matcher: str | Matcher | None = None,
    disparities: int | None = None,
    near_m: float = NEAR_M,
    board_side: str | None = None,
    fifo: str = "1:drop-oldest",
    tolerance_ms: float | None = None,
    pairs: int = 0,
    wait_s: float | None = None,
    lossless: bool = False,
    out: str | Path | None = None,
    save_every: int = 0,
    keys: str | Path | None = None,
) -> "Scanner":
    """Open both cameras. The scan begins when the scanner is entered with `with`.

    Args:
        link: address of the board (`tcp://HOST:5555`, `serial:DEVICE` …), or several. The best link that is up is used.
        camera: the host camera (`v4l2:/dev/video0?size=640x480`, `http://…/video`, `replay:FOLDER` …).
        rig: a rig, or the path of a rig.yaml. None: if `disparities` is given, the images are taken as rectified;
            otherwise no depth is computed, only pairs and delays.
        geometry: geometry of images that arrive rectified. None: disparities are not converted to metres.
        matcher: name of a matcher, or any object with `match(pair) -> disparity` (`phone_host.stereo.matcher_protocol.Matcher`).
            None: the default of this machine.
        disparities: the matcher searches 0 <= d < disparities, px. None with a rig: computed from `near_m`.
        near_m: nearest depth to search for, m.
        board_side: which view the board's camera is, `left` or `right`. None: as in the rig; without a rig, left.
        fifo: depth and overflow policy of the queue before the matcher.
        tolerance_ms: greatest time skew of a pair, ms. None: half of the longer frame period.
        pairs: end after this many pairs. 0: no limit.
        wait_s: how long to wait for an absent board, s. None: for ever.
        lossless: give every result, and wait if the program is slower than the cameras.
        out: folder for delays.jsonl, report.json and saved pairs. None: nothing is written.
        save_every: save every Nth pair in `out`. 0: none.
        keys: folder of keys. None: the default folder.

    Returns:
        The scanner.

    Raises:
        SettingsError: the arguments are invalid or contradict each other.
        DataError: rig.yaml is invalid.
        UnavailableError: a camera, link or folder cannot be opened.
    """
    given = dict(locals())
    _check_numbers(pairs=pairs, save_every=save_every, tolerance_ms=tolerance_ms, wait_s=wait_s, near_m=near_m)
    uris = _addresses(link)
    known = read_own_rig(Path(rig)) if isinstance(rig, str | Path) else rig
    if known is not None and geometry is not None:
        raise SettingsError("rig and geometry are both given", "leave geometry out: the rig has its own")
    side = _side(board_side, known)
    core = _core(known, geometry, matcher, disparities, near_m)
    settings = HostSettings(
        board_side=side,
        tolerance_ns=None if tolerance_ms is None else round(tolerance_ms * 1e6),
        fifo=FifoSettings.parse(fifo),
        pairs=pairs,
        wait_ns=None if wait_s is None else round(wait_s * 1e9),
        out=None if out is None else Path(out),
        save_every=save_every,
        time_offset=TimeOffset() if known is None else known.time_offset,
        resolved=_shown(given),
        matcher_note="" if core is None or matcher is not None else default_note(),
    )
    with ExitStack() as opened:  # if one part cannot be opened, close those that were
        own = opened.enter_context(closing(open_camera(camera, HOST_CLOCK, now.monotonic_ns())))
        links = open_links(uris, key_folder("" if keys is None else str(keys)))
        for item in links:
            opened.enter_context(closing(item))
        scanner = Scanner(settings, own, links, core, lossless=lossless)
        opened.pop_all()
    return scanner


def write_model(path: str | Path, model: ScanModel) -> None:
    """Write the surface of a scan as PLY: metres, in the axes of the rectified left camera at the first pair that has depth, or of the mat or table.

    Args:
        path: the file; it appears whole or not at all.
        model: from `Scan.model()`.

    Raises:
        OSError: it cannot be written.
    """
    mesh = model.mesh
    seen = model.seen if model.is_closed else None
    write_surface(Path(path), PointCloud(mesh.points_m, mesh.colours), mesh.triangles, seen=seen)


def _addresses(link: str | Sequence[str]) -> list[LinkUri]:
    """Read the links' addresses; warn of those that anybody can listen to.

    Raises:
        SettingsError: there is none, or one is invalid.
    """
    named = [link] if isinstance(link, str) else list(link)
    if not named:
        raise SettingsError("no link is given", "give link='tcp://HOST:5555', or several")
    uris = [parse_link(address, listens_by_default=False) for address in named]
    for uri in uris:
        tell_insecure(uri)
    return uris


class Scanner:
    """A running scan: a context manager and an iterable of results, in the order of the pairs. Made by `open_scanner`.

    Args:
        settings: settings of the run.
        camera: the host camera, open.
        links: links to the board, open.
        core: computes the depth. None: pairs and delays only.
        lossless: whether the program gets every result.
    """

    def __init__(
        self,
        settings: HostSettings,
        camera: Camera,
        links: Sequence[Link],
        core: StereoCore | None,
        *,
        lossless: bool,
    ) -> None:
        self._results = _ResultQueue(waits=lossless or camera.description.pacing is Pacing.DEMAND)
        self._host = Host(settings, camera, links, core, [self._results])
        self._opened: tuple[Camera | Link, ...] = (camera, *links)
        self._was_entered = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="scanner", daemon=True)
        self._failure: BaseException | None = None
        self._is_failure_told = False
        self.ended: EndReason | None = None
        self.is_complete = True
        """After the run: whether the results folder holds everything that was asked for."""

    def __enter__(self) -> Self:
        if self._was_entered:
            raise RuntimeError("a scanner runs once: open another")
        self._was_entered = True
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stopping.set()
        self._results.leave()
        self._thread.join()
        if error is None:
            self._tell_failure()

    def _tell_failure(self) -> None:
        """Raise the error that ended the run, but only once."""
        if self._failure is not None and not self._is_failure_told:
            self._is_failure_told = True
            raise self._failure

    def close(self) -> None:
        """Release camera, links and folder of a scanner that was never entered. An entered one releases them itself."""
        if not self._was_entered:
            self._was_entered = True
            self._host.abandon()
            for item in self._opened:
                item.close()

    def __iter__(self) -> Iterator[Result]:
        """Yield results until the run ends.

        Raises:
            TandemError: as in `phone-host run`: no board, images that do not fit the rig, or a lost link.
            RuntimeError: called outside `with`.
        """
        if not self._was_entered:
            raise RuntimeError("the scan has not begun: use `with open_scanner(…) as scanner`")
        while (result := self._results.take()) is not None:
            yield result
        self._thread.join()
        self._tell_failure()

    def snapshot(self) -> RunSnapshot:
        """Return delays, accounts, clock, doubts and drops as of now, or as of the end of the run."""
        if self._failure is not None:
            return self._host.snapshot("failed", trouble_of(self._failure))
        return self._host.snapshot("running" if self.ended is None else self.ended.value)

    def _run(self) -> None:
        try:
            self.ended = self._host.run(self._stopping.is_set)
        except BaseException as error:  # noqa: BLE001 - a thread's root: the iterator raises it
            self._failure = error
        try:
            self.is_complete = self._host.write_report(build(self.snapshot()))
        except Exception as error:  # noqa: BLE001 - as above
            self._failure = self._failure or error
        finally:
            self._results.finish()


class _ResultQueue:
    """The sink that the calling program reads. When full, it drops the oldest result, or waits if `waits` is set."""

    def __init__(self, *, waits: bool) -> None:
        self._waits = waits
        self._items: deque[tuple[Result, int]] = deque()
        self._changed = threading.Condition()
        self._ended = self._left = False
        self._given = self._dropped = 0
        self._delay = Series()

    def await_place(self, number: int) -> None:
        """See Sink."""
        del number  # all are alike
        if self._waits:
            with self._changed:
                self._changed.wait_for(lambda: len(self._items) < _DEPTH or self._left)

    def offer(self, result: Result) -> None:
        """See Sink."""
        with self._changed:
            if self._left:
                return
            if len(self._items) >= _DEPTH:
                self._items.popleft()
                self._dropped += 1
            self._items.append((result, now.monotonic_ns()))
            self._changed.notify_all()

    def take(self) -> Result | None:
        """Return the oldest result; wait if there is none. Return None at the end of the run."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._items) or self._ended)
            if not self._items:
                return None
            result, since_ns = self._items.popleft()
            self._given += 1
            self._delay.add(now.monotonic_ns() - since_ns)
            self._changed.notify_all()
            return result

    def leave(self) -> None:
        """Accept no more results: the program has left the `with` block."""
        with self._changed:
            self._left = True
            self._changed.notify_all()

    def finish(self) -> None:
        """See Sink."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    @property
    def failure(self) -> Exception | None:
        """See Sink; it cannot fail."""
        return None

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """See Sink."""
        with self._changed:
            given, dropped, waiting, delay = self._given, self._dropped, len(self._items), self._delay.copy()
        spread = delay.spread()
        return (SinkAccount(name="program", written=given, dropped=dropped, failed=0, waiting=waiting, delay=spread),)


def _check_numbers(**numbers: float | None) -> None:
    """Reject invalid numbers.

    Raises:
        SettingsError: a number is below 0 or not finite, or `near_m` is 0.
    """
    for name, value in numbers.items():
        if value is not None and not (math.isfinite(value) and value >= 0 and (value > 0 or name != "near_m")):
            raise SettingsError(
                f"{name} is {value:g}", "give a number above 0" if name == "near_m" else "give 0 or more"
            )


def _shown(arguments: Mapping[str, object]) -> dict[str, object]:
    """Return the arguments as settings.json stores them. An object is stored as its type name."""
    plain = (str, int, float, bool, type(None))
    told = {name: str(value) if isinstance(value, Path) else value for name, value in arguments.items()}
    told["camera"] = without_password(str(told["camera"]))
    told["link"] = told["link"] if isinstance(told["link"], str) else " ".join(str(item) for item in arguments["link"])  # type: ignore[attr-defined]  # texts, as annotated
    return {
        name: {"value": value if isinstance(value, plain) else type(value).__name__, "origin": "open_scanner"}
        for name, value in told.items()
    }


def _side(asked: str | None, rig: Rig | None) -> Side:
    if asked not in {None, *(side.value for side in Side)}:
        raise SettingsError(f"board_side is {asked!r}", "give 'left' or 'right'")
    if rig is not None and asked not in {None, rig.board_side.value}:
        raise SettingsError(
            f"board_side {asked!r} contradicts the rig", "leave it out, or calibrate with the board there"
        )
    if asked is not None:
        return Side(asked)
    return Side.LEFT if rig is None else rig.board_side


def _core(
    rig: Rig | None,
    geometry: StereoGeometry | None,
    matcher: str | Matcher | None,
    disparities: int | None,
    near_m: float,
) -> StereoCore | None:
    if rig is None and geometry is None and disparities is None and (matcher is None or isinstance(matcher, str)):
        return None
    rectifier = None if rig is None else Rectifier(rig)
    wanted = DepthWanted(search_from_m=near_m if disparities is None else math.nan)
    return StereoCore(_matcher(matcher, disparities, rectifier), rectifier, geometry, wanted)


def _matcher(
    matcher: str | Matcher | None, disparities: int | None, rectifier: Rectifier | None
) -> Matcher | MatchSettings:
    if not (matcher is None or isinstance(matcher, str)):
        return matcher
    chosen = default_matcher() if matcher is None else matcher_named(matcher)
    if disparities is not None:
        return MatchSettings(chosen, disparities)
    if rectifier is None:
        raise SettingsError("rectified images without disparities", "give the number of disparities, for example 64")
    return MatchSettings(chosen)
