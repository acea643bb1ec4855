"""The demo: a rendered moving scene, a real board-agent process and the host on this machine, compared with the scene's truth."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from common import now
from common.ledger import PairLedger
from common.program.settings import Resolved
from common.words import counted
from phone_host.declared_settings import PhoneHostSettings
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.jobs.options import RunCameraOptions
from phone_host.jobs.run import Opened, open_run
from phone_host.jobs.run_request import RunRequest
from phone_host.model import CloudImage, Processed, Result, Rig, Side
from phone_host.output.ply import write_ply
from phone_host.output.preview import disparity_picture, write_png
from phone_host.report.page_links import FileLink, NextCommand
from phone_host.report.report_page import Figure, Headline, PageData, delay_series, page
from phone_host.report.run_page import (
    camera_table,
    clock_figure,
    depth_card,
    end_to_end_figure,
    files,
    notes,
    pictures,
    rate_figure,
    steps,
    unused_table,
)
from phone_host.run.sinks import FunctionSink
from phone_host.scene.film import Film
from phone_host.scene.scene import truth
from phone_host.scene.scene_model import RectifiedView, Scene, rig_poses
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import disparities_for_near
from phone_host.subprocesses.board_process import board_process

FPS: Final = 15
"""Leaves the stereo pipeline enough time on two small cores, so that the demo shows delays and not an overload."""

NEAR_M: Final = 0.6
"""Nearest depth searched; the demo's scene begins at 0.7 m."""

_CHECKED_PAIRS: Final = 8
"""Number of pairs whose depth is compared with the truth; each costs about 0.1 s afterwards."""

_CHECK_EVERY: Final = 15
_BOARD_PATIENCE_S: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedPair:
    """One pair kept for the comparison with the truth.

    Attributes:
        processed: the pipeline's output.
        ledger: its marks and delays.
        left_index: number of the film image that the board showed.
        right_index: number of the film image that the host's own camera showed.
    """

    processed: Processed
    ledger: PairLedger
    left_index: int
    right_index: int


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthErrors:
    """Errors of the measured depth against the truth, over all checked pairs and all pixels that both cameras see; NaN where nothing was measured.

    Attributes:
        pairs: pairs compared.
        pixels: pixels compared.
        density: share of them that have a depth.
        disparity_px: median |disparity error|, px.
        outliers: share of measured pixels whose error exceeds 2 px.
        depth_mm: median |depth error|, mm.
        depth_p95_mm: its 95th percentile, mm.
        depth_percent: median |depth error| / depth, percent.
        at_1_m_mm: median |depth error| of pixels between 0.9 and 1.1 m, mm; NaN if there are none.
        at_2_m_mm: the same between 1.8 and 2.2 m.
        wrong_pairs: checked pairs whose two images show different moments.
    """

    pairs: int
    pixels: int
    density: float = math.nan
    disparity_px: float = math.nan
    outliers: float = math.nan
    depth_mm: float = math.nan
    depth_p95_mm: float = math.nan
    depth_percent: float = math.nan
    at_1_m_mm: float = math.nan
    at_2_m_mm: float = math.nan
    wrong_pairs: int


def open_demo(camera: str, address: str, core: StereoCore, out: Path | None) -> Opened:
    """Open a run of a camera's URI and a board that will listen at an address, with a folder for the results, or None."""
    request = RunRequest(command="demo", cameras=RunCameraOptions(wait_s=_BOARD_PATIENCE_S), out=out, save_every=0)
    found = Resolved(PhoneHostSettings(link=(address,), camera=camera), (("matcher", "demo"),))
    return open_run(request, found, lambda _: None, core=core)


class DemoRun:
    """One run of both programs over a film.

    Args:
        film: what both cameras replay.
        rig: the cameras.
        out: folder for results.
        sockets: folder of this user alone, in which the two programs meet.
        resolved: the settings of the run with their origins.
    """

    def __init__(self, film: Film, rig: Rig, out: Path, sockets: Path, resolved: Mapping[str, object]) -> None:
        self._film = film
        self._rectifier = Rectifier(rig)
        self._rig = rig
        self._checked: list[CheckedPair] = []
        self.ledgers: list[PairLedger] = []
        self.address = f"ipc://{sockets}/board"
        near = disparities_for_near(self._rectifier.geometry, NEAR_M, self._rectifier.rectification.width_px)
        core = StereoCore(MatchSettings(disparities=near), self._rectifier)
        opened = open_demo(film.replay_uri(film.right), self.address, core, out)
        self.host = opened.prepared((), [FunctionSink("check", self._keep, waits=True)], resolved).host

    @property
    def last(self) -> CheckedPair | None:
        """The newest pair that was kept."""
        return self._checked[-1] if self._checked else None

    def run(self, seconds: float, stop: Callable[[], bool], watch: Callable[[], None] | None) -> None:
        """Stream for some seconds.

        Args:
            seconds: how long, from the first pair on.
            stop: asked repeatedly; True ends the run early.
            watch: called several times a second.

        Raises:
            UnavailableError: the board process did not start, or died.
        """
        with board_process(self._film.replay_uri(self._film.left), self.address) as board:

            def finished() -> bool:
                board.check()
                first_ns = self.host.first_done_ns
                return stop() or (first_ns > 0 and now.monotonic_ns() - first_ns > seconds * 1e9)

            self.host.run(finished, watch)

    def check(self, scene: Scene) -> DepthErrors:
        """Compare the kept pairs with the scene."""
        left_pose, right_pose = rig_poses(self._rig)
        sensors = ((self._rig.left, left_pose), (self._rig.right, right_pose))
        rectification = self._rectifier.rectification
        view = RectifiedView(
            rectification.geometry, rectification.width_px, rectification.height_px, rectification.R_left
        )
        disparity_errors, depths, measured = [], [], []
        for pair in self._checked:
            exact = truth(self._film.scene_at(scene, pair.left_index), view, sensors)
            assert pair.processed.disparity is not None
            assert pair.processed.cloud is not None
            disparity_errors.append((pair.processed.disparity - exact.disparity_px)[exact.visible])
            depths.append(exact.depth_m[exact.visible])
            measured.append(pair.processed.cloud[..., 2][exact.visible])
        wrong = sum(pair.left_index != pair.right_index for pair in self._checked)
        return _errors(
            pairs=len(self._checked), wrong=wrong, disparity_errors=disparity_errors, depths=depths, measured=measured
        )

    def write_pictures(self, out: Path) -> None:
        """Write cloud.ply and disparity.png of the newest kept pair.

        Raises:
            OSError: the folder cannot be written to.
        """
        if (pair := self.last) is None:
            return
        assert pair.processed.disparity is not None
        assert pair.processed.cloud is not None
        cloud: CloudImage = pair.processed.cloud
        write_ply(out / "cloud.ply", cloud, pair.processed.pair.left)
        write_png(out / "disparity.png", disparity_picture(pair.processed.disparity, pair.processed.geometry))

    def _keep(self, result: Result) -> None:
        processed, ledger = result.processed, result.ledger
        self.ledgers.append(ledger)
        if (len(self.ledgers) - 1) % _CHECK_EVERY:
            return
        # The board's stamp is known on this clock to about 50 us; the images are 1 / 15 s apart.
        left_index, right_index = (
            self._film.index_at(ledger.board.exposed_ns),
            self._film.index_at(ledger.host.exposed_ns),
        )
        self._checked.append(
            CheckedPair(processed=processed, ledger=ledger, left_index=left_index, right_index=right_index)
        )
        if len(self._checked) > _CHECKED_PAIRS:
            del self._checked[0]


def truth_json(errors: DepthErrors) -> dict[str, float | int | None]:
    """Return the comparison as a JSON object; None where nothing was measured."""
    return {
        name: None if math.isnan(value) else value
        for name in DepthErrors.__slots__
        for value in (getattr(errors, name),)
    }


def _errors(
    *, pairs: int, wrong: int, disparity_errors: list[np.ndarray], depths: list[np.ndarray], measured: list[np.ndarray]
) -> DepthErrors:
    if not pairs:
        return DepthErrors(pairs=0, pixels=0, wrong_pairs=wrong)
    off_px, depth_m, measured_m = (np.concatenate(part) for part in (disparity_errors, depths, measured))
    found = np.isfinite(measured_m)
    off_px, depth_m, off_mm = np.abs(off_px[found]), depth_m[found], np.abs(measured_m[found] - depth_m[found]) * 1000

    def near(low_m: float, high_m: float) -> float:
        here = (depth_m >= low_m) & (depth_m <= high_m)
        return float(np.median(off_mm[here])) if here.any() else math.nan

    return DepthErrors(
        pairs=pairs,
        pixels=len(found),
        density=float(found.mean()),
        disparity_px=float(np.median(off_px)),
        outliers=float((off_px > 2).mean()),
        depth_mm=float(np.median(off_mm)),
        depth_p95_mm=float(np.percentile(off_mm, 95)),
        depth_percent=float(np.median(off_mm / depth_m) / 10),
        at_1_m_mm=near(0.9, 1.1),
        at_2_m_mm=near(1.8, 2.2),
        wrong_pairs=wrong,
    )


_GOOD_PERCENT = 0.6
"""Depth error at 2 m that the stereo core's figures allow; the demo's scene lies between 0.7 and 2.5 m."""


def demo_page(
    run: RunSnapshot,
    errors: DepthErrors,
    last: CheckedPair | None,
    ledgers: Sequence[PairLedger],
    commands: tuple[NextCommand, ...] = (),
) -> str:
    """Make the page.

    Args:
        run: the run.
        errors: errors of the depth against the truth.
        last: the pair to show; None if there was none.
        ledgers: of all pairs, in order.
        commands: what to type next.

    Returns:
        One self-contained HTML document.
    """
    verdict, sentence = _verdict(errors)
    return page(
        PageData(
            title="tandemscan demo",
            subtitle=f"two rendered cameras, two processes, one ipc link between them; {now.wall_time()}",
            verdict=verdict,
            sentence=sentence,
            figures=_figures(run, errors),
            depth=depth_card(last.processed if last else None, Side.LEFT, "A pair, and its depth"),
            pictures=pictures(last.processed if last else None),
            delays=delay_series(ledgers, after_gap_ns=run.after_gap_ns, statistics=run.delays),
            tables=(unused_table(run), camera_table(run.camera)),
            commands=commands,
            notes=(
                *steps(run),
                "The truth is the rendered scene itself: exact depth at every pixel that both cameras see.",
                "Board and host share one clock here, so the clock's true offset is 0; what is plotted is what the echoes could prove.",
                *notes(run),
            ),
            files=(FileLink("cloud.ply", "this pair's point cloud, metres: X right, Y down, Z forward"), *files(())),
        )
    )


def _verdict(errors: DepthErrors) -> tuple[Headline, str]:
    if not errors.pairs:
        return Headline.BAD, "No pair was compared with the truth: the run was too short or the programs did not meet."
    if errors.wrong_pairs:
        return Headline.BAD, f"{errors.wrong_pairs} of {counted(errors.pairs, 'pair')} show two different moments."
    text = f"Every checked pair shows one moment, and its depth is right within {errors.depth_mm:.1f} mm ({errors.depth_percent:.2f} %) at the median."
    return (Headline.GOOD if errors.depth_percent <= _GOOD_PERCENT else Headline.WARNING), text


def _figures(run: RunSnapshot, errors: DepthErrors) -> tuple[Figure, ...]:
    skew = run.delays.spread("time_skew")
    return (
        rate_figure(run),
        Figure(
            label="depth error",
            value=f"{errors.depth_mm:.1f}",
            unit="mm",
            note=f"median; {errors.at_1_m_mm:.1f} mm at 1 m, {errors.at_2_m_mm:.1f} mm at 2 m",
        ),
        Figure(
            label="pixels with depth",
            value=f"{errors.density * 100:.0f}",
            unit="%",
            note="of those that both cameras see",
        ),
        end_to_end_figure(run),
        Figure(
            label="time skew",
            value=f"{skew.p50_ns / 1e3:.0f}",
            unit="\u00b5s",
            note=f"median; 99 % below {skew.p99_ns / 1e3:.0f} \u00b5s",
        ),
        clock_figure(run),
    )
