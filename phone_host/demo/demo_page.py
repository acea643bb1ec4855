"""The demo's page: what the two cameras saw, the depth, its error, and every delay."""

from collections.abc import Sequence

from common import now
from common.ledger import PairLedger
from common.words import counted
from phone_host.demo.demonstration import CheckedPair, DepthErrors
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.model import Side
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
