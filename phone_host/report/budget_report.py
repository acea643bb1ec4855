"""Shows how a run held its time budget: for report.json and for the page. Pure."""

import math
from typing import Final

from phone_host.model import BudgetAccount, BudgetStep
from phone_host.output.json_text import json_number
from phone_host.report.report_page import Table

_MS: Final = 1e6


def budget_values(account: BudgetAccount | None) -> dict[str, object] | None:
    """Return the account for report.json; times in ms, None where nothing was measured. None without a budget."""
    if account is None:
        return None
    return {
        "budget_ms": account.budget_ns / _MS,
        "processing_ms": _ms(account.processing_ns),
        "match_ms": _ms(account.match_ns),
        "pairs": account.pairs,
        "held_pairs": account.held,
        "narrowed_pairs": account.narrowed,
        "is_missed": account.is_missed,
        "chosen": _step(account.now),
        "best": _step(account.best),
        "changed": account.changed,
        "changes": [
            {
                "pair": change.pair,
                "at_s": round(change.at_s, 3),
                "reason": change.reason.value,
                "processing_ms": _ms(change.processing_ns),
                "chosen": _step(change.step),
            }
            for change in account.changes
        ],
    }


def budget_tables(account: BudgetAccount | None) -> tuple[Table, ...]:
    """Return the table of the changes for the page; nothing without any."""
    if account is None or not account.changes:
        return ()
    rows = tuple(
        (
            f"{change.at_s:.1f} s",
            "-" if math.isnan(change.processing_ns) else f"{change.processing_ns / _MS:.1f} ms",
            change.step.matcher,
            f"{change.step.width_px}x{change.step.height_px}",
            str(change.step.disparities),
        )
        for change in account.changes
    )
    heads = ("after", "pairs took", "matcher then", "size, px", "disparities")
    return (Table(f"Changes to hold {account.budget_ns / _MS:g} ms for each pair", heads, rows),)


def _step(step: BudgetStep) -> dict[str, object]:
    return {
        "matcher": step.matcher,
        "scale": round(step.scale, 4),
        "width_px": step.width_px,
        "height_px": step.height_px,
        "disparities": step.disparities,
        "nearest_m": json_number(step.nearest_m),
    }


def _ms(value_ns: float) -> float | None:
    return json_number(value_ns / _MS)
