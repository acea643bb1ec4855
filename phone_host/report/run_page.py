"""A run's page: the last pair, every delay, who waits for whom, how the own camera fared. The demo's page uses parts of it."""

from collections.abc import Sequence

import cv2
import numpy as np

from common import now
from common.camera.base import CameraHealth
from common.ledger import PairLedger
from phone_host.measure.accounts import rung_lines
from phone_host.measure.headline import headline
from phone_host.measure.regime import judge
from phone_host.measure.run_snapshot import RunSnapshot, concerns, figures
from phone_host.measure.unused import unused
from phone_host.model import Image, Processed, Side
from phone_host.output.preview import colour_disparity, colour_range_px
from phone_host.report.report_page import Figure, Headline, PageData, Picture, Table, delay_series, page
from phone_host.report.summary import phase_lines


def run_page(run: RunSnapshot, last: Processed | None, board_side: Side, ledgers: Sequence[PairLedger]) -> str:
    """Make the page.

    Args:
        run: the run.
        last: its last pair; None if there was none.
        board_side: which of its views is the board's.
        ledgers: of all pairs, or of evenly chosen ones, in order.

    Returns:
        One self-contained HTML document.
    """
    verdict, sentence = _verdict(run)
    return page(
        PageData(
            title="tandemscan run",
            subtitle=f"ended: {run.ended.replace('_', ' ')}; {now.wall_time()}",
            verdict=verdict,
            sentence=sentence,
            figures=_figures(run) if run.processed else (),
            pictures=pictures(last, board_side),
            delays=delay_series(ledgers),
            tables=(*links_tables(run), unused_table(run), camera_table(run.camera)),
            notes=notes(run),
        )
    )


def notes(run: RunSnapshot) -> tuple[str, ...]:
    """Say who waits for whom and what would help, what makes depth wrong, and how the cameras' exposures relate in time."""
    judgement = judge(figures(run))
    return (
        f"Queue: {judgement.sentence}.",
        *(f"What would help: {remedy}." for remedy in judgement.remedies),
        *(f"Warning: {item.sentence}. Remedy: {item.remedy}." for item in concerns(run)),
        *phase_lines(run.phase, run.alignment),
        *rung_lines(run.link),
    )


def links_tables(run: RunSnapshot) -> tuple[Table, ...]:
    """Make a table of the links side by side, if there were several."""
    if len(run.link.links) < 2:
        return ()
    rows = []
    for tally in run.link.links:
        age = tally.age.spread()
        ages = f"{age.p50_ns / 1e6:.1f} ms; {age.p95_ns / 1e6:.1f} ms" if age.count else "-"
        rows.append((tally.name, str(tally.frames), str(tally.carried), str(tally.lost), ages))
    title = f"Links: the stream changed links {run.link.switches} times"
    columns = ("link", "frames", "times it took over", "times it was lost", "age of frames on arrival: median; p95")
    return (Table(title, columns, tuple(rows)),)


def camera_table(health: CameraHealth) -> Table:
    """Make a table of how the own camera fared."""
    rows = [
        ("measured rate", "unknown" if health.period_ns is None else f"{1e9 / health.period_ns:.2f} frames/s"),
        ("unplugged", str(health.unplugged)),
        ("stalled", str(health.stalls)),
        ("failed", str(health.failures)),
        ("came back afterwards", str(health.returned)),
        ("frames that its driver missed", str(health.missed)),
        *((f"spoiled frames: {fault.value.replace('_', ' ')}", str(count)) for fault, count in health.faults),
        ("stamps not believed", str(health.distrusted_stamps)),
        ("controls that its driver refused", str(health.refused_controls)),
        *((f"held: {name.replace('_', ' ')}", str(value)) for name, value in health.held),
    ]
    return Table("This machine's camera", ("what", "value"), tuple(rows))


def _verdict(run: RunSnapshot) -> tuple[Headline, str]:
    said = headline(run)
    return Headline(said.grade.value), said.sentence


def _figures(run: RunSnapshot) -> tuple[Figure, ...]:
    skew = run.delays.spread("time_skew")
    return (
        rate_figure(run),
        end_to_end_figure(run),
        Figure(
            label="time skew",
            value=f"{skew.p50_ns / 1e6:.1f}",
            unit="ms",
            note=f"median; 95 % below {skew.p95_ns / 1e6:.1f} ms",
        ),
        clock_figure(run),
        _measured("image motion", run.motion_px_s, 0, "px/s", "the fastest tenth of the host camera's image"),
    )


def rate_figure(run: RunSnapshot) -> Figure:
    """How many pairs per second were processed."""
    pairs = f"{run.processed} pairs in {run.seconds:.1f} s"
    return _measured("pairs per second", run.pairs_per_second, 1, "/s", pairs)


def end_to_end_figure(run: RunSnapshot) -> Figure:
    """The age of the results."""
    spread = run.delays.spread("end_to_end")
    note = f"median; 99 % below {spread.p99_ns / 1e6:.0f} ms"
    return Figure(label="end-to-end", value=f"{spread.p50_ns / 1e6:.0f}", unit="ms", note=note)


def clock_figure(run: RunSnapshot) -> Figure:
    """How well the host knew the board's clock."""
    spread = run.delays.spread("uncertainty")
    return Figure(
        label="clock uncertainty", value=f"{spread.p50_ns / 1e3:.0f}", unit="us", note="median over the pairs"
    )


def _measured(label: str, value: float, decimals: int, unit: str, note: str) -> Figure:
    """Make a figure that may be unknown (NaN)."""
    return (
        Figure(label=label, value="-", unit="", note=f"not measured; {note}")
        if np.isnan(value)
        else Figure(label=label, value=f"{value:.{decimals}f}", unit=unit, note=note)
    )


def pictures(last: Processed | None, board_side: Side = Side.LEFT) -> tuple[Picture, ...]:
    """Return the views of a pair, and its disparity if there is one.

    Args:
        last: the pair; None if there was none.
        board_side: which of the views is the board's.
    """
    if last is None:
        return ()
    whose = ("the board's", "the host's") if board_side is Side.LEFT else ("the host's", "the board's")
    rectified = "" if last.disparity is None else ", rectified"
    views = (
        Picture(f"left: {whose[0]} camera{rectified}", _jpeg(last.pair.left)),
        Picture(f"right: {whose[1]} camera{rectified}", _jpeg(last.pair.right)),
    )
    if last.disparity is None or not np.isfinite(last.disparity).any():
        return views
    coloured = colour_disparity(last.disparity, *colour_range_px(last.disparity))
    return (*views, Picture("disparity: bright is near, black is none", _png(coloured)))


def unused_table(run: RunSnapshot) -> Table:
    """Make a table of what was not used, by place and reason."""
    rows = tuple((item.words, str(item.count)) for item in unused(run))
    return Table("Frames and pairs that were not used", ("what", "count"), rows)


def _jpeg(image: Image) -> bytes:
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 88])
    assert done
    return data.tobytes()


def _png(image: Image) -> bytes:
    done, data = cv2.imencode(".png", image)
    assert done
    return data.tobytes()
