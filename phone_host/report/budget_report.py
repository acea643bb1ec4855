"""Shows how a run held its time budget: for report.json and for the page. Pure."""

import math
from dataclasses import dataclass
from typing import Final

from phone_host.model import BudgetAccount, BudgetChange, BudgetReason, BudgetStep
from phone_host.report.json_result import D3, D4, FieldOf, Number, made
from phone_host.report.report_page import Table

_MS: Final = 1e6


_step, _change, _account = FieldOf[BudgetStep](), FieldOf[BudgetChange](), FieldOf[BudgetAccount]()


@dataclass(frozen=True, slots=True, kw_only=True)
class StepResult:
    """A way to match pairs."""

    matcher: str
    scale: D4
    width_px: int
    height_px: int
    disparities: int
    nearest_m: Number


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangeOfStep:
    """From which pair on, and why, pairs were matched in another way."""

    pair: int
    at_s: D3
    reason: BudgetReason
    processing_ms: Number = _change(lambda change: change.processing_ns / _MS)
    chosen: StepResult = _change(lambda change: made(StepResult, change.step))


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetResult:
    """How the time budget for each pair was held."""

    budget_ms: float = _account(lambda account: account.budget_ns / _MS)
    processing_ms: Number = _account(lambda account: account.processing_ns / _MS)
    match_ms: Number = _account(lambda account: account.match_ns / _MS)
    pairs: int
    held_pairs: int = _account(lambda account: account.held)
    narrowed_pairs: int = _account(lambda account: account.narrowed)
    is_missed: bool
    chosen: StepResult = _account(lambda account: made(StepResult, account.now))
    best: StepResult = _account(lambda account: made(StepResult, account.best))
    changed: int
    changes: tuple[ChangeOfStep, ...] = _account(lambda account: made(ChangeOfStep, account.changes))


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
