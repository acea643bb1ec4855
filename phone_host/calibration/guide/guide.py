"""Decides which views are taken, which one is wanted next, what is said, and when it is enough. Pure.

A view passes the gates in this order: found in both images, whole, wanted and unlike those taken, still, paired well in time,
sharp. Whether it is wanted comes before whether it is still, because nobody is told to hold a board still that shows nothing new.

Every kind of view is wanted once. Which one is asked for first, the calibration so far tells: the one that would lower the depth
error most. One that is not reached within some time is given up: not every rig can show a board in every corner of both
images. Meanwhile any view is taken that is far from all others. It ends when the verdict is good and no view that is still wanted
would help much. If all kinds are there before, they are wanted once more.
"""

import math
from collections import Counter
from typing import Final

from phone_host.calibration.guide.coverage import Coverage, Depth, placement, usual_camera
from phone_host.calibration.guide.gates import (
    NOT_SEEN,
    STILL_NS,
    Gate,
    Glance,
    View,
    found,
    is_alike,
    is_far,
    is_paired_well,
    is_still,
    sharp,
    speed_widths_s,
)
from phone_host.calibration.guide.snapshot import Ended, GuideSnapshot, Outline, Progress
from phone_host.calibration.guide.wants import (
    ORDER,
    Placed,
    Speech,
    Want,
    Words,
    ahead,
    back,
    done,
    is_guessed,
    is_there,
    missing,
    taken,
    unseen,
    with_corners,
)
from phone_host.calibration.solve.verdict import Assessment
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.sharpness import BoardLook
from phone_host.model import Rig, Verdict

_PATIENCE_NS: Final = 8_000_000_000
"""A wanted view that is not reached in this time is given up."""

_NEVER_NS: Final = 20_000_000_000
"""A board that was never seen for so long needs more than a few words."""

_LOST_NS: Final = 1_000_000_000
"""A board that is not found for a shorter time is not spoken of: it may be between two looks."""

_LEFT_NS: Final = 4_000_000_000
"""A board that left over an edge may have gone anywhere after this time."""

_TOO_FAR_NS: Final = 12_000_000_000
"""So long a board that was small when it was lost is asked closer: its squares or marks had become too small."""

_REACTION_NS: Final = 500_000_000
"""So long after the words a hand stops. In this time a board that is moved to an edge leaves the picture."""

_COMPLAINT_NS: Final = 2_000_000_000
"""So long it is said that a view was blurred or glared, unless the board leaves: a person needs the time to do something about it."""

_HEARD_NS: Final = 1_200_000_000
"""So long it takes to say that a view was taken."""

_RETHINK_NS: Final = 1_500_000_000
"""The wanted view may still change so long after it was asked for, when the calibration of the views before comes."""

_VAIN_NS: Final = 4_000_000_000
"""A view that was asked for in vain for so long gives way to any that is new: silence teaches less."""

_LEAST_VIEWS: Final = 10
"""It does not end with fewer: from 7 on all lenses are tried (`lens_choice`), and some views are left to choose by."""

_LONG_NS, _LONG_VIEWS = 90_000_000_000, 8
"""After a minute and a half these are enough, if the verdict is good: a person is to be done in two."""

_HOPELESS_VIEWS: Final = 6
_LEAST_GAIN, _LEAST_SAVED_M = 0.08, 0.0005
"""A view that lowers the depth error at 1 m by a smaller share, or by less, no longer helps: with twelve views every further one does
so by about 4 %, and a matcher's own error is larger."""

_VAIN_TRIES: Final = 3
"""A corner that was asked for so often in vain, after a minute and a half, cannot be shown, it seems."""

_COMPLAINTS: Final = {Gate.BLURRED: Words.BLURRED, Gate.GLARE: Words.GLARE}
_ABSENT: Final = {
    Gate.NOT_FOUND: Words.SHOW_BOTH,
    Gate.NOT_FOUND_LEFT: Words.SHOW_LEFT,
    Gate.NOT_FOUND_RIGHT: Words.SHOW_RIGHT,
    Gate.PART: Words.PART,
    Gate.SAME: Words.SAME,
}


class Guide:
    """Guides one live calibration.

    Args:
        board: the board.
        most_views: end after this many.
        now_ns: now.
        seen: the image corners that are known from an earlier calibration.
    """

    def __init__(self, board: Board, most_views: int, now_ns: int, seen: frozenset[Want] = frozenset()) -> None:
        self.board, self._most, self._seen = board, most_views, seen
        self.views: list[View] = []
        self.ended = Ended.RUNNING
        self._began_ns = self._seen_ns = now_ns
        self._has_seen = False
        self._gate = Gate.NOT_FOUND
        self._last: Glance | None = None
        self._placed: Placed | None = None
        self._still_since_ns: int | None = None
        self._sharpest_px = (math.nan, math.nan)
        self._coverage: tuple[Coverage, ...] = ()
        self._refused = Counter[Gate]()
        self._asked, self._asked_ns = Want.ANY, now_ns
        self._open: set[Want] = set(ORDER)
        self._given_up = Counter[Want]()
        self._places = list[Placed]()
        self._progress: Progress | None = None
        self._speech = Speech()
        self._complaint, self._complained_ns = "", now_ns
        self._taken_ns: int | None = None

    def see(self, glance: Glance, now_ns: int) -> Gate:
        """Judge a look at a pair.

        Returns:
            READY: `examine` is to be called with its exact corners; else why the view is refused.
        """
        gate = found(glance)
        speed = speed_widths_s(self._last, glance)
        if gate is Gate.READY:
            placed = self._place(glance)
            gate = self._judged(glance, placed, speed, now_ns)
            if gate is Gate.NOTHING_NEW and self._is_coming(glance, placed):
                gate = Gate.MOVING
            self._last, self._placed, self._has_seen, self._seen_ns = glance, placed, True, now_ns
        else:
            self._last = self._still_since_ns = None
        self._give_up(now_ns)
        return self._note(gate)

    def examine(self, glance: Glance, looks: tuple[BoardLook, BoardLook], now_ns: int) -> Gate:
        """Judge a view that was READY by its exact corners, and take it unless it is blurred.

        Returns:
            TAKEN, or why not.
        """
        gate = found(glance)
        if gate is Gate.READY:
            gate = sharp(looks, glance.sizes_px, self._sharpest_px)
            best = [
                look.edge_px if math.isnan(known) else min(known, look.edge_px)
                for known, look in zip(self._sharpest_px, looks, strict=True)
            ]
            self._sharpest_px = best[0], best[1]
        if gate in _COMPLAINTS:
            self._complaint, self._complained_ns = _COMPLAINTS[gate].value, now_ns
        if gate is not Gate.READY:
            return self._note(gate)
        placed = self._place(glance)
        self._places.append(placed)
        self.views.append(View(f"{len(self.views) + 1:02}", glance, looks))
        coverage = self._coverage or tuple(Coverage(size_px) for size_px in glance.sizes_px)
        self._coverage = tuple(
            each.with_view(corners, where)
            for each, corners, where in zip(
                coverage, (glance.left_px, glance.right_px), (placed.left, placed.right), strict=True
            )
        )
        self._open -= {want for want in self._open if is_there(want, placed)}
        self._taken_ns, self._still_since_ns, self._complaint = now_ns, None, ""
        self._ask(now_ns)
        return self._note(Gate.TAKEN)

    def grow(self, progress: Progress, now_ns: int) -> None:
        """Take the calibration of the views so far; end if it is enough."""
        self._progress = progress
        if self._asked not in self._open or now_ns - self._asked_ns < _RETHINK_NS:
            self._ask(now_ns)
        if progress.views < len(self.views) or self.ended is not Ended.RUNNING:
            return
        if progress.is_hopeless and progress.views >= _HOPELESS_VIEWS:
            self.ended = Ended.HOPELESS
        elif self._is_enough(progress, now_ns) and not self._unseen:
            self.ended = Ended.GOOD
        elif len(self.views) >= self._most:
            self.ended = Ended.ENOUGH

    @property
    def is_full(self) -> bool:
        """Whether no more views are to be taken."""
        return self.ended is not Ended.RUNNING or len(self.views) >= self._most

    def words(self, now_ns: int) -> str:
        """Return what is to be said now."""
        is_news = self.ended is not Ended.RUNNING or self._is_heard(now_ns)
        return self._speech.say(self._wanted_words(now_ns), now_ns, is_news=is_news)

    def snapshot(self, now_ns: int) -> GuideSnapshot:
        """Return everything that presenters show."""
        progress = self._stated
        return GuideSnapshot(
            ended=self.ended,
            words=self._speech.words,
            gate=self._gate,
            board=f"{self.board.columns}x{self.board.rows}",
            views=len(self.views),
            most_views=self._most,
            seconds=(now_ns - self._began_ns) / 1e9,
            coverage=self._coverage,
            outlines=self._outlines,
            asked=self._asked,
            wanted=tuple(want for want in ORDER if want in self._open),
            depth_error_m=math.nan if progress is None else progress.depth_error_m,
            next_error_m=math.nan if progress is None else progress.after_m(self._asked),
            verdict="" if progress is None else self._verdict(progress).verdict.value,
            remedy="" if progress is None else self._verdict(progress).remedy,
            refused=tuple((gate, self._refused[gate]) for gate in Gate if self._refused[gate]),
        )

    def _judged(self, glance: Glance, placed: Placed, speed: float, now_ns: int) -> Gate:
        """Judge a view in which the board was found."""
        if not is_still(speed):
            self._still_since_ns = None
        elif self._still_since_ns is None:
            self._still_since_ns = glance.at_ns
        rests = self._still_since_ns is not None and glance.at_ns - self._still_since_ns >= STILL_NS
        wanted = self._is_wanted(placed) or (rests and self._is_new(glance, now_ns))
        if self.is_full or not wanted or any(is_alike(glance, each.glance) for each in self.views):
            return Gate.NOTHING_NEW
        if not rests:
            return Gate.MOVING
        return Gate.READY if is_paired_well(glance, speed) else Gate.APART

    def _is_coming(self, glance: Glance, placed: Placed) -> bool:
        """Return whether the wanted view will be there by the time a person has heard to hold still."""
        if self._last is None or self._placed is None or self._still_since_ns is not None or self.is_full:
            return False
        steps = _REACTION_NS / max(1, glance.at_ns - self._last.at_ns)
        return bool(self.views) and is_there(self._asked, ahead(self._placed, placed, steps))

    def _is_wanted(self, placed: Placed) -> bool:
        wants = {Want.ANY} if not self.views else self._open | {self._asked}
        return any(is_there(want, placed) for want in wants)

    def _is_new(self, glance: Glance, now_ns: int) -> bool:
        """Return whether a view that nobody asked for is to be taken, because what was asked for is not reached."""
        return now_ns - self._asked_ns > _VAIN_NS and all(is_far(glance, each.glance) for each in self.views)

    def _place(self, glance: Glance) -> Placed:
        rig = self._rig
        left, right = map(usual_camera, glance.sizes_px) if rig is None else (rig.left, rig.right)
        return Placed(placement(glance.left_px, self.board, left), placement(glance.right_px, self.board, right))

    @property
    def _outlines(self) -> tuple[Outline, Outline]:
        """The board in the newest pair."""
        if self._placed is None or self._gate in NOT_SEEN:
            return (), ()
        return self._placed.left.outline, self._placed.right.outline

    @property
    def _rig(self) -> Rig | None:
        """The calibration so far, once it is no guess."""
        progress = self._progress
        if progress is None or progress.calibration is None or progress.verdict is Verdict.REJECT:
            return None
        return progress.calibration.rig

    @property
    def _stated(self) -> Progress | None:
        """The calibration so far, if it may be told."""
        return self._progress if self._progress is not None and self._progress.is_stated else None

    @property
    def _unseen(self) -> frozenset[Want]:
        """The image corners that no view shows of those that the calibration uses, if its lens is guessed there."""
        found = None if self._progress is None else self._progress.calibration
        if found is not None and not is_guessed(found.bends):
            return frozenset()
        rejected = set() if found is None else {each.name for each in found.rejected}
        used = (where for view, where in zip(self.views, self._places, strict=True) if view.name not in rejected)
        return unseen(used) - self._seen

    def _verdict(self, progress: Progress) -> Assessment:
        return with_corners(Assessment(progress.verdict, progress.remedy), self._unseen)

    def _ask(self, now_ns: int) -> None:
        """Choose the view that is wanted next: the one that would lower the depth error most, of those asked for least often in vain."""
        if not self.views:
            return
        if not self._open:
            self._open.update(each for each in ORDER if not self._given_up[each])
        if not self._open:
            self._open.update(ORDER)
        self._open.update(self._unseen)
        is_enough = self._progress is not None and self._is_enough(self._progress, now_ns)
        self._asked = min((is_enough and self._unseen) or self._open, key=self._rank)
        self._asked_ns = now_ns

    def _rank(self, want: Want) -> tuple[int, float, int]:
        after_m = math.nan if self._progress is None else self._progress.after_m(want)
        known = self._progress is not None and any(map(math.isfinite, self._progress.taught.values()))
        teaches = (after_m if math.isfinite(after_m) else math.inf) if known else 0.0
        return self._given_up[want], teaches, ORDER.index(want)

    def _give_up(self, now_ns: int) -> None:
        """Ask for another view if this one is not reached; end if nothing is left but corners that cannot be shown."""
        if now_ns - self._seen_ns > _PATIENCE_NS / 2:  # nobody is there, so nobody tries
            self._asked_ns = now_ns
        if not self.views or now_ns - self._asked_ns <= _PATIENCE_NS:
            return
        self._given_up[self._asked] += 1
        self._open.discard(self._asked)
        self._ask(now_ns)
        progress, in_vain = self._progress, all(self._given_up[want] >= _VAIN_TRIES for want in self._unseen)
        in_vain = in_vain and now_ns - self.views[0].glance.at_ns > _LONG_NS
        if in_vain and progress is not None and progress.views == len(self.views) and self._is_enough(progress, now_ns):
            self.ended = Ended.ENOUGH if self._unseen else Ended.GOOD

    def _is_enough(self, progress: Progress, now_ns: int) -> bool:
        """Return whether the figures are good and more views no longer help, or it has taken long. Of unseen corners they know nothing."""
        if progress.verdict is not Verdict.GOOD:
            return False
        if now_ns - self.views[0].glance.at_ns > _LONG_NS and len(self.views) >= _LONG_VIEWS:
            return True
        best_m = min(
            (progress.after_m(want) for want in self._open if math.isfinite(progress.after_m(want))), default=0
        )
        saved_m = progress.depth_error_m - best_m
        helps = best_m > 0 and saved_m >= max(_LEAST_SAVED_M, _LEAST_GAIN * progress.depth_error_m)
        return len(self.views) >= min(_LEAST_VIEWS, self._most) and not helps

    def _note(self, gate: Gate) -> Gate:
        self._gate = gate
        if gate not in {Gate.READY, Gate.TAKEN}:
            self._refused[gate] += 1
        return gate

    def _is_heard(self, now_ns: int) -> bool:
        """Return whether it is being said that a view was taken."""
        return self._taken_ns is not None and now_ns - self._taken_ns < _HEARD_NS

    def _wanted_words(self, now_ns: int) -> str:
        if self.ended is not Ended.RUNNING:
            verdict = "" if self._stated is None else self._verdict(self._stated).verdict.value
            return done(verdict, len(self.views))
        if self._is_heard(now_ns):
            return taken(len(self.views))
        if self._gate in NOT_SEEN:
            return self._words_for_absent(now_ns)
        if self._gate is Gate.NOTHING_NEW and self._placed is not None:
            return missing(self._asked, self._placed) or Words.ELSEWHERE.value
        if self._complaint and now_ns - self._complained_ns < _COMPLAINT_NS:
            return self._complaint
        return Words.STILL.value

    def _words_for_absent(self, now_ns: int) -> str:
        if not self._has_seen or self._gate is Gate.SAME:
            never = self._gate is Gate.NOT_FOUND and now_ns - self._began_ns > _NEVER_NS
            return Words.HELP.value if never else _ABSENT[self._gate].value
        since_ns = now_ns - self._seen_ns
        if since_ns < _LOST_NS:
            return self._speech.words
        way = ""
        if self._placed is not None and since_ns < _LEFT_NS:
            left, right = self._placed.left, self._placed.right
            lost = {Gate.NOT_FOUND_LEFT: Placed(left, left), Gate.NOT_FOUND_RIGHT: Placed(right, right)}
            way = back(lost.get(self._gate, self._placed))
        if not way and self._placed is not None and self._placed.fills < Depth.FAR.value and since_ns < _TOO_FAR_NS:
            way = Want.NEAR.value
        return way or _ABSENT[self._gate].value
