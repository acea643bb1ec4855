"""From the board in the pictures to a rig: with the pairs of an earlier calibration, and without a drift of the cameras."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from common.diagnostic import Diagnostic
from common.errors import DataError
from phone_host.calibration.failure_modes.mistakes import Course, unturned
from phone_host.calibration.failure_modes.name import BoardSeries, name_mistake, placed
from phone_host.calibration.failure_modes.out_of_step import out_of_step
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.result import Calibration
from phone_host.calibration.target.board_views import BoardViews
from phone_host.calibration.target.pairs import BoardPair
from phone_host.verbs.calibrate.earlier import Series, calibrated, every_pair
from phone_host.verbs.calibrate.hints import out_of_step_error


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Solved:
    """What was made of the views.

    Attributes:
        views: what was found in the pictures.
        seen: all pairs to calibrate from, those of an earlier calibration first, as they were seen.
        pairs: the same as they were used: perhaps without a drift of the cameras.
        found: the rig; or why there is none.
        finding: what is wrong with the series; None: nothing.
    """

    views: BoardViews
    seen: list[BoardPair]
    pairs: list[BoardPair]
    found: Calibration | DataError
    finding: Diagnostic | None = None


def solve_series(series: Series, views: BoardViews, baseline_m: float, say: Callable[[str], None]) -> Solved:
    """Calibrate, and name what is wrong with the series. If the cameras turned against each other, the rig is that of the last view.

    Args:
        series: the board, and what an earlier calibration gives.
        views: what was found in the pictures.
        baseline_m: the distance of the cameras as the user measured it, m; NaN: not told.
        say: told what is being done.
    """
    seen, sizes_px = list(views.pairs), views.sizes_px
    say("fitting the rig")
    shifted = out_of_step(*views.in_order, series.board, sizes_px)
    if shifted is not None:
        return Solved(views=views, seen=seen, pairs=seen, found=out_of_step_error(shifted))
    try:
        seen = every_pair(series, seen, sizes_px)
    except DataError as failure:
        return Solved(views=views, seen=seen, pairs=seen, found=failure)
    found: Calibration | DataError
    try:
        found = calibrated(series, seen, sizes_px)
    except DataError as failure:
        found = failure
    say("looking for mistakes")
    taken = BoardSeries(
        pairs=tuple(seen), board=series.board, sizes_px=sizes_px, looks=views.looks, baseline_m=baseline_m
    )
    finding = _of_the_new(taken, seen[0 if series.views is None else len(series.views.names) :], found) or name_mistake(
        taken, found
    )
    straight = _straightened(seen, finding)
    try:
        without = calibrated(series, straight, sizes_px) if straight is not seen else found
    except DataError:
        without = found
    if isinstance(found, Calibration) and isinstance(without, Calibration) and len(without.used) < len(found.used):
        without = found  # no better
    pairs = seen if without is found else straight
    return Solved(views=views, seen=seen, pairs=pairs, found=without, finding=finding)


def _of_the_new(taken: BoardSeries, later: list[BoardPair], found: Calibration | DataError) -> Diagnostic | None:
    """Name how the new pictures hang, if most of them do not fit those of an earlier calibration: together, they only look as if of two moments."""
    names = {pair.name for pair in later}
    fit = 0 if isinstance(found, DataError) else sum(used.name in names for used in found.used)
    if len(later) == len(taken.pairs) or 2 * fit > len(later):
        return None
    alone: Calibration | DataError
    try:
        alone = calibrate(later, taken.board, taken.sizes_px)
    except DataError as failure:
        alone = failure
    return placed(replace(taken, pairs=tuple(later)), alone)


def _straightened(pairs: list[BoardPair], finding: Diagnostic | None) -> list[BoardPair]:
    """Return the pairs as the cameras would have seen them had they stood as they do in the last; the same if they did not turn, or this way and that."""
    turned = None if finding is None else finding.evidence.turned
    return pairs if turned is None or turned.course is Course.LOOSE else unturned(pairs, turned)
