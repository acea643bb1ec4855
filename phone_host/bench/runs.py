"""The delay benchmark: for each interface, image size, quality and rate it runs a real board-agent process and a host, and records every delay.

Root beside `host`. It measures the product itself over rendered films; only what carries the bytes may be emulated, and
is then named so. The first second of a run (`WARM_UP_S`) is left out of its statistics, because caches, the clock
estimate and credit settle then. Counts cover the whole run.
"""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from common import now
from common.camera.factory import open_camera
from common.keys import usual_keys
from common.ledger import PairLedger
from common.link.factory import open_link, parse_link
from common.stamp import HOST_CLOCK
from phone_host.accounts.link_account import LinkAccount
from phone_host.bench.cases import Case, Size
from phone_host.bench.links import Ends, open_ends
from phone_host.bench.relay import RelayAccount
from phone_host.demo.demonstration import NEAR_M
from phone_host.model import CameraModel, PairCounts, Result, Rig, StereoGeometry
from phone_host.run.host import Host
from phone_host.run.host_settings import HostSettings
from phone_host.run.sinks import FunctionSink
from phone_host.scene.film import JPEG_QUALITY, Film, render_films
from phone_host.scene.scene import DEMO_PERIOD_S, WEBCAM_LOOK, demo_scene, matched_rig
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import AnyMatcher
from phone_host.stereo.reproject import disparities_for_near
from phone_host.subprocesses.board_process import BoardAccount
from phone_host.sync.fifo import FifoSettings

WARM_UP_S: Final = 1.0

_FILM_FPS: Final = 8
"""Images of the film per second of its scene. A run shows them at its own rate; the scene then only moves faster."""

PATIENCE_NS: Final = 15_000_000_000
"""Time for the board process to start and the first pair to be done on a small, busy machine."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseResult:
    """One measured combination.

    Attributes:
        case: the case.
        ledgers: of the pairs after the warm-up, in the order in which they were done.
        measured_s: from the last pair of the warm-up to the last pair, s; 0 if no pair came after it.
        uncertainty_ns: of the clock estimate at the run's end; NaN without one.
        bound_ns: hard bound of the same estimate; never smaller than the uncertainty.
        board: the board's account of the whole run.
        link: the receiver's account of the whole run.
        counts: of frames and pairs on the host.
        processed: pairs that were done.
        undecodable: pairs whose bytes were not images.
        relay: the account of the process that emulated the line; None if there was none.
    """

    case: Case
    ledgers: tuple[PairLedger, ...]
    measured_s: float
    uncertainty_ns: float
    bound_ns: float
    board: BoardAccount
    link: LinkAccount
    counts: PairCounts
    processed: int
    undecodable: int
    relay: RelayAccount | None = None

    @property
    def pairs_per_second(self) -> float:
        """Rate of results after the warm-up, 1/s; NaN without any."""
        return len(self.ledgers) / self.measured_s if self.ledgers and self.measured_s > 0 else float("nan")


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Settings that all cases share.

    Attributes:
        matcher: of the stereo core.
        fifo: depth and policy of the queue before it.
        seconds: length of each run after its warm-up, s.
    """

    matcher: AnyMatcher
    fifo: FifoSettings
    seconds: float


def rig_of(size: Size) -> Rig:
    """Return the rendered rig of that size: two ideal cameras, already rectified, with the field of view of `matched_rig`."""
    full = matched_rig()
    focal_px = float(full.left.matrix[0, 0]) * size.width_px / full.left.width_px
    centre_px = ((size.width_px - 1) / 2, (size.height_px - 1) / 2)
    matrix = np.array([[focal_px, 0.0, centre_px[0]], [0.0, focal_px, centre_px[1]], [0.0, 0.0, 1.0]])
    model = CameraModel(width_px=size.width_px, height_px=size.height_px, matrix=matrix, distortion=np.zeros(5))
    return replace(full, left=model, right=model)


def render(size: Size, qualities: Sequence[int], folder: Path, advance: Callable[[], None]) -> dict[int, Film]:
    """Render the films of one size.

    Args:
        size: size of the images.
        qualities: JPEG qualities; for a remote board's BOARD_SETS, the own camera's images have the usual quality.
        folder: receives a folder for each quality and camera.
        advance: called after each of `film_images()` images.

    Raises:
        OSError: the folder cannot be written to.
    """
    looks = (WEBCAM_LOOK, replace(WEBCAM_LOOK, seed=WEBCAM_LOOK.seed + 1))
    folders = {quality or JPEG_QUALITY: folder / str(quality) for quality in qualities}
    films = render_films(
        demo_scene(), rig_of(size), looks, folders, fps=_FILM_FPS, seconds=DEMO_PERIOD_S, advance=advance
    )
    made = dict(zip(folders, films, strict=True))
    return {quality: made[quality or JPEG_QUALITY] for quality in qualities}


def film_images() -> int:
    """Return how many images are rendered for one size, over both cameras."""
    return 2 * round(_FILM_FPS * DEMO_PERIOD_S)


def run_case(
    case: Case, film: Film, folder: Path, settings: RunSettings, *, stop: Callable[[], bool]
) -> CaseResult | None:
    """Measure one combination.

    Args:
        case: the case.
        film: of its size and quality; for a remote board only the host's side is shown.
        folder: for sockets and names of terminals.
        settings: for all cases.
        stop: asked several times a second.

    Returns:
        What was measured, over a shorter time if `stop` ended it; None if `stop` ended it before the warm-up was over.

    Raises:
        UnavailableError: a process did not start, or died.
    """
    shown = replace(film, fps=case.rate_hz)
    ledgers: list[PairLedger] = []

    def keep(result: Result) -> None:
        ledgers.append(result.ledger)

    with open_ends(case.interface, shown.replay_uri(shown.left), folder) as ends:
        host = Host(
            HostSettings(wait_ns=PATIENCE_NS, save_every=0, fifo=settings.fifo),
            open_camera(shown.replay_uri(shown.right), HOST_CLOCK, now.monotonic_ns()),
            [
                open_link(
                    parse_link(ends.address, listens_by_default=False),
                    usual_keys() if case.interface.is_remote else None,
                )
            ],
            _core(case.size, settings.matcher),
            [FunctionSink("bench", keep, waits=True)],
        )
        host.run(_finished(host, ends, settings.seconds, stop))
        kept, measured_s = after_warm_up(ledgers)
        if stop() and not kept:
            return None
        run = host.snapshot("stopped")
        board, relay = ends.stop(run.link)
    estimate = run.estimate
    uncertainty_ns = float("nan") if estimate is None else float(estimate.uncertainty_ns)
    bound_ns = float("nan") if estimate is None else float(estimate.bound_ns)
    return CaseResult(
        case=case,
        ledgers=kept,
        measured_s=measured_s,
        uncertainty_ns=uncertainty_ns,
        bound_ns=bound_ns,
        board=board,
        link=run.link,
        counts=run.counts,
        processed=run.processed,
        undecodable=run.undecodable,
        relay=relay,
    )


def _finished(host: Host, ends: Ends, seconds: float, stop: Callable[[], bool]) -> Callable[[], bool]:
    run_ns = round((WARM_UP_S + seconds) * 1e9)

    def finished() -> bool:
        if stop():
            return True
        ends.check()
        now_ns = now.monotonic_ns()
        begun_ns = host.first_done_ns
        return now_ns - begun_ns > run_ns if begun_ns else now_ns - host.started_ns > run_ns + PATIENCE_NS

    return finished


def after_warm_up(ledgers: Sequence[PairLedger]) -> tuple[tuple[PairLedger, ...], float]:
    """Leave out the pairs of the first second: the pairs done later, and the time from the last pair of the warm-up to the last of them, s: as many intervals as pairs."""
    if not ledgers:
        return (), 0.0
    end_ns = ledgers[0].done_ns + round(WARM_UP_S * 1e9)
    first = bisect_right(ledgers, end_ns, key=lambda ledger: ledger.done_ns)
    return tuple(ledgers[first:]), (ledgers[-1].done_ns - ledgers[first - 1].done_ns) / 1e9


def _core(size: Size, matcher: AnyMatcher) -> StereoCore:
    rig = rig_of(size)
    focal_px, cx_px, cy_px = (float(rig.left.matrix[at]) for at in ((0, 0), (0, 2), (1, 2)))
    geometry = StereoGeometry(focal_px=focal_px, baseline_m=-float(rig.t_right_left_m[0]), cx_px=cx_px, cy_px=cy_px)
    disparities = disparities_for_near(geometry, NEAR_M, size.width_px)
    return StereoCore(MatchSettings(matcher, disparities), None, geometry)
