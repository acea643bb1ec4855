"""Reads --budget: what may change to hold it is what the user has not fixed."""

import argparse

from common.errors import SettingsError
from common.program.settings import Resolved
from phone_host.declared_settings import PhoneHostSettings
from phone_host.run.pair_budget import usable_matchers
from phone_host.settings import matcher_is_given
from phone_host.stereo.budget_ladder import BudgetWanted
from phone_host.stereo.core import StereoCore
from phone_host.stereo.matcher_names import matcher_named


def budget_wanted(
    options: argparse.Namespace, resolved: Resolved[PhoneHostSettings], core: StereoCore | None
) -> BudgetWanted | None:
    """Return the time budget; None without one, or without depth.

    Args:
        options: of `run`.
        resolved: the settings, checked, and their origins.
        core: the stereo core, if there is one.

    Raises:
        SettingsError: there is nothing to choose, or no depth to compute though the option asks for it.
    """
    settings = resolved.values
    if not settings.budget:
        return None
    if core is None:
        if options.budget is not None:
            raise SettingsError(
                "--budget without --calibration or --rectified, so no depth is computed",
                "add one of them, or leave it out",
            )
        return None
    is_named = matcher_is_given(resolved)
    has_range = options.disparities is not None or options.near is not None
    wanted = BudgetWanted(
        budget_ns=round(settings.budget * 1e6),
        matchers=(matcher_named(settings.matcher),) if is_named else usable_matchers(),
        may_scale=options.scale is None,
        may_narrow=not has_range,
    )
    if is_named and has_range and not wanted.may_scale:
        range_option = "--near" if options.disparities is None else "--disparities"
        raise SettingsError(
            f"--budget beside --matcher, --scale and {range_option} has nothing left to choose", "leave one of them out"
        )
    return wanted
