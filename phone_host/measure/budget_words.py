"""Says how a run held its time budget, and what that costs: coarser depth, or near objects that are not looked for. Pure."""

import math
from dataclasses import replace
from typing import Final

from common.words import counted, distance_text, times
from phone_host.measure.trust import Concern, Doubt
from phone_host.model import BudgetAccount, BudgetReason, BudgetStep

_MS: Final = 1e6

_WHY: Final = {
    BudgetReason.TOO_SLOW: "pairs took too long",
    BudgetReason.ROOM: "there was time to spare",
    BudgetReason.AS_FAST: "a better matching method takes no longer",
    BudgetReason.OTHER_SIZE: "images came in another size",
}


def budget_lines(account: BudgetAccount | None) -> list[str]:
    """Say what was chosen, how well the budget was held, and what is lost; nothing without a budget.

    Args:
        account: of the run; None: it has no budget, or no pair yet.
    """
    if account is None:
        return []
    took = "" if math.isnan(account.processing_ns) else f", the newest pairs took {account.processing_ns / _MS:.1f} ms"
    held = f"{account.held / account.pairs:.0%} of {counted(account.pairs, 'pair')} held it"
    lines = [f"budget: {account.budget_ns / _MS:g} ms for each pair: {_way(account.now, account.best)}{took}; {held}"]
    if account.changes:
        newest = account.changes[-1]
        took = "" if math.isnan(newest.processing_ns) else f" ({newest.processing_ns / _MS:.1f} ms)"
        lines.append(
            f"budget: changed {times(account.changed)}, last after {newest.at_s:.1f} s because {_WHY[newest.reason]}{took}"
        )
    if narrowed := narrowed_words(account):
        lines.append(f"budget: {narrowed}: nearer things get no depth, or a wrong one")
    elif account.narrowed:
        lines.append(
            f"budget: for {counted(account.narrowed, 'pair')} near things were not looked for; budget.changes in report.json says when"
        )
    return lines


def missed_words(account: BudgetAccount | None) -> str:
    """Say that the budget cannot be held, and what helps; empty if it can."""
    if account is None or not account.is_missed:
        return ""
    return (
        f"--budget {account.budget_ns / _MS:g} cannot be held: pairs take {account.processing_ns / _MS:.1f} ms,"
        f" of which matching takes {account.match_ns / _MS:.1f} ms, and nothing is left to choose that would hold it:"
        " give a longer --budget, or smaller images"
    )


def narrowed_words(account: BudgetAccount | None) -> str:
    """Say from which depth on nothing is found now, because the search is narrower; empty if it is not."""
    if account is None or not account.is_narrowed:
        return ""
    now, best = account.now, account.best
    if math.isnan(now.nearest_m + best.nearest_m):
        return f"disparities are now searched to {now.disparities - 1} px only, not to {best.disparities - 1} px"
    return f"nearest depth is now {distance_text(now.nearest_m)}, not {distance_text(best.nearest_m)}"


def with_budget(concern: Concern, account: BudgetAccount | None) -> Concern:
    """Return a doubt; if the budget has narrowed the search that is too short, with the remedy that helps then."""
    if concern.doubt is not Doubt.SEARCH_TOO_SHORT or account is None or not account.is_narrowed:
        return concern
    return replace(concern, remedy="give a longer --budget: it has narrowed the search")


def _way(now: BudgetStep, best: BudgetStep) -> str:
    """Name how pairs are matched, and what that is of the best."""
    size = f"{now.width_px}x{now.height_px} px"
    share = "" if now.scale == best.scale else f" ({now.scale / best.scale:.0%} of the size)"
    return f"{now.matcher} at {size}{share}, disparities to {now.disparities - 1} px"
