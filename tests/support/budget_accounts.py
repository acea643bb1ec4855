"""Accounts of a time budget, for tests of what presenters say of it."""

from dataclasses import replace
from typing import Final

from phone_host.model import BudgetAccount, BudgetChange, BudgetReason, BudgetStep

MS: Final = 1_000_000

BEST: Final = BudgetStep(matcher="sgbm", scale=1.0, width_px=640, height_px=480, disparities=96, nearest_m=0.3)
SMALL: Final = replace(BEST, scale=0.25, width_px=160, height_px=120)
NARROW: Final = replace(SMALL, disparities=48, nearest_m=0.6)
ACCOUNT: Final = BudgetAccount(
    budget_ns=20 * MS, now=NARROW, best=BEST, processing_ns=14.2 * MS, match_ns=6 * MS, pairs=200, held=190, narrowed=7,
    changed=3, changes=(BudgetChange(pair=40, at_s=2.5, reason=BudgetReason.TOO_SLOW, processing_ns=31e6, step=NARROW),),
)  # fmt: skip
