"""The delay benchmark: for each link, image size and rate a real board-agent process and a host, with every delay of every pair.

Root beside `host`: what is measured is the product itself over rendered films, nothing is simulated. The first second of a run (`WARM_UP_S`)
is left out of its statistics: caches, the clock estimate and credit settle there. Counts are of the whole run.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Final

import numpy as np

from common import now
from common.camera.factory import open_camera
from common.errors import SettingsError
from common.ledger import PairLedger
from common.link.factory import open_link, parse_link
from common.stamp import HOST_CLOCK
from phone_host.boardprocess import BoardAccount, board_process, free_port
from phone_host.demo import NEAR_M
from phone_host.film import Film, render_film
from phone_host.host import Host, HostSettings
from phone_host.model import Camera, Rig, StereoGeometry
from phone_host.pairqueue import PairCounts
from phone_host.pipeline import Processed
from phone_host.receiver import LinkAccount
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatcherName, MatchSettings, create_matcher
from phone_host.stereo.reproject import disparities_for_near
from phone_host.stereo.scene import DEMO_PERIOD_S, WEBCAM_LOOK, demo_scene, matched_rig

LINKS: Final = ("tcp", "ipc")
"""The kinds of link that can be measured."""

WARM_UP_S: Final = 1.0

_FILM_FPS: Final = 8
"""Images of the film per second of its scene; a run shows them at its own rate, then the scene only moves faster."""

_PATIENCE_S: Final = 15.0
"""For the board process to come up and the first pair to be done, on a small and busy machine."""

_PATIENCE_NS: Final = round(_PATIENCE_S * 1e9)
_LEAST_PX, _MOST_PX = 64, 4096
_MOST_HZ: Final = 240


@dataclass(frozen=True, slots=True, order=True)
class Size:
    """An image size, px."""

    width_px: int
    height_px: int

    def __str__(self) -> str:
        return f"{self.width_px}x{self.height_px}"


@dataclass(frozen=True, slots=True)
class Case:
    """One combination that is measured."""

    link: str
    size: Size
    rate_hz: int

    def __str__(self) -> str:
        return f"{self.link} {self.size} {self.rate_hz}/s"


@dataclass(frozen=True, slots=True)
class CaseResult:
    """One measured combination.

    Attributes:
        case: which.
        ledgers: of the pairs after the warm-up, in the order in which they were done.
        measured_s: from the end of the warm-up to the last pair, s.
        board: the board's account of the whole run.
        link: the receiver's account of it.
        counts: of frames and pairs on the host.
        processed: pairs that were done.
        undecodable: pairs whose bytes were no images.
    """

    case: Case
    ledgers: tuple[PairLedger, ...]
    measured_s: float
    board: BoardAccount
    link: LinkAccount
    counts: PairCounts
    processed: int
    undecodable: int

    @property
    def pairs_per_second(self) -> float:
        """Rate of results after the warm-up, 1/s; NaN without any."""
        return len(self.ledgers) / self.measured_s if self.ledgers and self.measured_s > 0 else float("nan")


def parse_links(text: str) -> tuple[str, ...]:
    """Read names of links, for example `tcp,ipc`.

    Raises:
        SettingsError: one is not there.
    """
    names = _items(text)
    for name in names:
        if name not in LINKS:
            raise SettingsError(f"--links names {name!r}, which is not there", f"the links are {', '.join(LINKS)}")
    if not names:
        raise SettingsError("--links names no link", f"the links are {', '.join(LINKS)}")
    return names


def parse_sizes(text: str) -> tuple[Size, ...]:
    """Read image sizes, for example `320x240,640x480`.

    Raises:
        SettingsError: that is no size, or one of no use.
    """
    sizes = []
    for item in _items(text):
        width, _, height = item.partition("x")
        if not all(
            part.isascii() and part.isdigit() and _LEAST_PX <= int(part) <= _MOST_PX for part in (width, height)
        ):
            raise SettingsError(
                f"--size {item!r}", f"give WIDTHxHEIGHT from {_LEAST_PX} to {_MOST_PX} px, for example 640x480"
            )
        sizes.append(Size(int(width), int(height)))
    if not sizes:
        raise SettingsError("--size names no size", "give WIDTHxHEIGHT, for example 640x480")
    return tuple(sizes)


def parse_rates(text: str) -> tuple[int, ...]:
    """Read frame rates, for example `15,30`.

    Raises:
        SettingsError: that is no whole number from 1 to 240.
    """
    rates = []
    for item in _items(text):
        if not (item.isascii() and item.isdigit() and 1 <= int(item) <= _MOST_HZ):
            raise SettingsError(f"--fps {item!r}", f"give whole numbers of frames per second from 1 to {_MOST_HZ}")
        rates.append(int(item))
    if not rates:
        raise SettingsError("--fps names no rate", "give frames per second, for example 30")
    return tuple(rates)


def cases(links: Sequence[str], sizes: Sequence[Size], rates_hz: Sequence[int]) -> tuple[Case, ...]:
    """All combinations; links side by side, so that a change of the machine's load touches all of them."""
    return tuple(Case(link, size, rate_hz) for size, rate_hz, link in product(sizes, rates_hz, links))


def rig_of(size: Size) -> Rig:
    """The rendered rig of that size: two ideal cameras, already rectified, with the field of view of `matched_rig`."""
    full = matched_rig()
    focal_px = float(full.left.matrix[0, 0]) * size.width_px / full.left.width_px
    centre_px = ((size.width_px - 1) / 2, (size.height_px - 1) / 2)
    matrix = np.array([[focal_px, 0.0, centre_px[0]], [0.0, focal_px, centre_px[1]], [0.0, 0.0, 1.0]])
    camera = Camera(size.width_px, size.height_px, matrix, np.zeros(5))
    return replace(full, left=camera, right=camera)


def render(size: Size, folder: Path, advance: Callable[[], None]) -> Film:
    """Render the film of one size.

    Args:
        size: of the images.
        folder: gets a folder for each camera.
        advance: called after each of `film_images()` images.

    Raises:
        OSError: the folder cannot be written to.
    """
    looks = (WEBCAM_LOOK, replace(WEBCAM_LOOK, seed=WEBCAM_LOOK.seed + 1))
    return render_film(demo_scene(), rig_of(size), looks, folder, fps=_FILM_FPS, seconds=DEMO_PERIOD_S, advance=advance)


def film_images() -> int:
    """How many images a film has, over both cameras."""
    return 2 * round(_FILM_FPS * DEMO_PERIOD_S)


def run_case(
    case: Case, film: Film, folder: Path, matcher: MatcherName, *, seconds: float, stop: Callable[[], bool]
) -> CaseResult | None:
    """Measure one combination.

    Args:
        case: which.
        film: of its size.
        folder: for the socket of an ipc link.
        matcher: for the stereo core.
        seconds: how long, after the warm-up.
        stop: asked several times a second.

    Returns:
        What was measured; None when `stop` ended it.

    Raises:
        UnavailableError: the board process did not come up, or died.
    """
    shown = replace(film, fps=case.rate_hz)
    address = f"ipc://{folder / 'board'}" if case.link == "ipc" else f"tcp://127.0.0.1:{free_port()}"
    ledgers: list[PairLedger] = []

    def keep(processed: Processed, ledger: PairLedger) -> None:
        del processed
        ledgers.append(ledger)

    with board_process(shown.replay_uri(shown.left), address) as board:
        host = Host(
            HostSettings(wait_ns=_PATIENCE_NS, save_every=0),
            open_camera(shown.replay_uri(shown.right), HOST_CLOCK, now.monotonic_ns()),
            open_link(parse_link(address, listens_by_default=False)),
            _core(case.size, matcher),
            keep,
        )
        run_ns = round((WARM_UP_S + seconds) * 1e9)

        def finished() -> bool:
            if stop():
                return True
            board.check()
            now_ns = now.monotonic_ns()
            begun_ns = host.first_done_ns
            return now_ns - begun_ns > run_ns if begun_ns else now_ns - host.started_ns > run_ns + _PATIENCE_NS

        host.run(finished)
        if stop():
            return None
        account = board.stop()
    kept, measured_s = after_warm_up(ledgers)
    accounts = (host.receiver.account, host.queue.counts, host.processed, host.undecodable)
    return CaseResult(case, kept, measured_s, account, *accounts)


def after_warm_up(ledgers: Sequence[PairLedger]) -> tuple[tuple[PairLedger, ...], float]:
    """Leave out the pairs of the first second.

    Args:
        ledgers: of a run, in the order in which they were done.

    Returns:
        The pairs done later, and the time from the end of the warm-up to the last of them, s.
    """
    if not ledgers:
        return (), 0.0
    begin_ns = ledgers[0].done_ns + round(WARM_UP_S * 1e9)
    return tuple(ledger for ledger in ledgers if ledger.done_ns > begin_ns), (ledgers[-1].done_ns - begin_ns) / 1e9


def _items(text: str) -> tuple[str, ...]:
    """The parts between commas, each once, in their order."""
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))


def _core(size: Size, matcher: MatcherName) -> StereoCore:
    rig = rig_of(size)
    focal_px, cx_px, cy_px = (float(rig.left.matrix[at]) for at in ((0, 0), (0, 2), (1, 2)))
    geometry = StereoGeometry(focal_px, -float(rig.t_right_left_m[0]), cx_px, cy_px)
    disparities = disparities_for_near(geometry, NEAR_M, size.width_px)
    return StereoCore(create_matcher(MatchSettings(matcher, disparities)), None, geometry)
