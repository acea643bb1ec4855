"""The live guide: a person who follows its words, what it says, what it asks for, when it ends, and its pictures."""

import json
import math
from dataclasses import replace
from functools import cache
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.calibration.guide.gates import Gate, Glance, View, is_alike
from phone_host.calibration.guide.guide import Guide
from phone_host.calibration.guide.snapshot import (
    Ended,
    Progress,
    before_board,
    figure_lines,
    guide_svg,
    lessons,
    picture_lines,
)
from phone_host.calibration.guide.wants import CORNERS, ORDER, Speech, Want, Words, is_guessed, unseen_in, with_corners
from phone_host.calibration.solve.bundle_problem import Bend
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.next_view import Spot, after_one_m, depth_sigma_m
from phone_host.calibration.solve.verdict import Assessment, Calibration
from phone_host.calibration.target.pairs import BoardPair
from phone_host.calibration.target.sharpness import BoardLook
from phone_host.model import Side, Verdict
from tests.support.boards import exact_pairs, poses
from tests.support.guided import follow
from tests.support.rigs import unlike_rig
from tests.unit.calibration.guide.test_guide_gates import BOARD, NONE, SIZES, corners, tilted

SECOND_NS = 1_000_000_000
LOOK_NS = SECOND_NS // 10
SHARP = BoardLook(2.0, 0.0, 0.0)


def grown(views: tuple[View, ...], verdict: Verdict, *taught: tuple[Want, float], hopeless: bool = False) -> Progress:
    """A calibration whose figures nobody asks for."""
    return Progress(
        views=len(views), calibration=None, verdict=verdict, remedy="more", is_hopeless=hopeless, taught=dict(taught)
    )


class Show:
    """Shows boards to a guide, ten times a second."""

    def __init__(self, most_views: int = 25, seen: frozenset[Want] = frozenset()) -> None:
        self.guide = Guide(BOARD, most_views, 0, seen)
        self.now_ns = 0

    def show(
        self, left: NDArray[np.float64], seconds: float = 0.5, look: BoardLook = SHARP, *, right_sees: bool = True
    ) -> Gate:
        """Hold a board before both cameras for a while; return what became of the last look."""
        gate = Gate.NOT_FOUND
        step_ns = LOOK_NS if seconds < 3 else 4 * LOOK_NS
        for _ in range(math.ceil(seconds * SECOND_NS / step_ns)):
            self.now_ns += step_ns
            scale = np.array(SIZES[1]) / SIZES[0]
            seen = Glance(
                at_ns=self.now_ns,
                skew_ns=0,
                left_px=left,
                right_px=left * scale if right_sees else NONE,
                sizes_px=SIZES,
            )
            gate = self.guide.see(seen, self.now_ns)
            if gate is Gate.READY:
                gate = self.guide.examine(seen, (look, SHARP), self.now_ns)
                if gate is Gate.TAKEN:
                    return gate
            self.guide.words(self.now_ns)
        return gate

    @property
    def words(self) -> str:
        """What is said now."""
        return self.guide.words(self.now_ns)


def test_a_person_who_follows_the_words_is_done_with_few_views() -> None:
    """Two minutes and 25 views at most; views are unlike each other, and no kind of view is forgotten."""
    guide = follow(unlike_rig(), BOARD, np.random.default_rng(1), lambda views: grown(views, Verdict.GOOD), most_s=150)
    assert guide.ended is Ended.GOOD
    assert 10 <= len(guide.views) <= 25
    assert guide.views[-1].glance.at_ns < 120 * SECOND_NS
    glances = [view.glance for view in guide.views]
    assert not any(is_alike(a, b) for i, a in enumerate(glances) for b in glances[:i])
    wanted = guide.snapshot(guide.views[-1].glance.at_ns).coverage[0]
    assert all(wanted.tilts[1:])
    rig = unlike_rig()
    assert not unseen_in([view.pair for view in guide.views], BOARD, rig.left, rig.right)


def test_it_ends_with_the_most_views_whatever_the_verdict() -> None:
    """Four views are the most: the fourth ends it once the calibration of all four is there, not that of three."""
    show = Show(most_views=4)
    for view in (corners(), tilted(25, 0), tilted(-25, 0), tilted(0, 25)):
        assert show.show(view) is Gate.TAKEN
    guide = show.guide
    assert show.show(tilted(0, -25)) is Gate.NOTHING_NEW
    ended = []
    for views, verdict in ((3, Verdict.USABLE), (4, Verdict.USABLE), (4, Verdict.GOOD)):
        guide.grow(grown(tuple(guide.views[:views]), verdict), show.now_ns)
        ended.append((guide.ended, show.words))
    assert [each for each, _ in ended] == [Ended.RUNNING, Ended.ENOUGH, Ended.ENOUGH]
    assert ended[1][1] == "done: verdict usable"


@pytest.mark.parametrize(
    ("views", "after_m", "late_s", "ended"),
    [
        (9, 0.0039, 0.0, Ended.RUNNING),
        (10, 0.0039, 0.0, Ended.GOOD),
        (10, 0.003, 0.0, Ended.RUNNING),
        (10, math.nan, 0.0, Ended.GOOD),
        (8, 0.003, 95.0, Ended.GOOD),
        (7, 0.003, 95.0, Ended.RUNNING),
    ],
)
def test_it_ends_when_the_verdict_is_good_and_no_wanted_view_helps(
    views: int, after_m: float, late_s: float, ended: Ended
) -> None:
    """Depth at 1 m is known to 4 mm. A view that leaves 3.9 mm is not waited for, one that leaves 3 mm is; after a minute and a half neither is."""
    show = Show()
    shown = [corners(x, y) for x in (0.34, 0.66) for y in (0.36, 0.64)]
    shown += [tilted(a, b) for a, b in ((25, 0), (-25, 0), (0, 25), (0, -25))]
    for view in (*shown, corners(square=0.03), corners(square=0.06))[:views]:
        show.show(view)
    assert len(show.guide.views) == views
    calibration = replace(_calibration(), depths=((0.3, 0.0), (0.5, 0.0), (1.0, 0.004), (2.0, 0.0)))
    progress = grown(tuple(show.guide.views), Verdict.GOOD, *((want, after_m) for want in ORDER))
    begun = show.guide.views[0].glance.at_ns
    now_ns = begun + 80 * SECOND_NS if not late_s else begun + round(late_s * SECOND_NS)
    show.guide.grow(replace(progress, calibration=calibration), now_ns)
    assert show.guide.ended is ended


def test_a_verdict_promises_nothing_of_corners_that_were_not_seen() -> None:
    """All but one corner of the images were seen: good becomes usable, with that corner as the remedy, and the guide does not end."""
    show = Show()
    shown = [corners(0.34, 0.36), corners(0.66, 0.36), corners(0.34, 0.64)]
    shown += [tilted(a, b) for a, b in ((25, 0), (-25, 0), (0, 25), (0, -25))]
    held = (*shown, corners(square=0.03), corners(square=0.06), corners(0.28, 0.5, 0.03))
    for view in held:
        show.show(view, 7.0)
    guide = show.guide
    assert len(guide.views) == 10
    guide.grow(grown(tuple(guide.views), Verdict.GOOD), show.now_ns)
    snapshot = guide.snapshot(show.now_ns)
    assert (guide.ended, snapshot.verdict, snapshot.asked) == (Ended.RUNNING, "usable", Want.BOTTOM_RIGHT)
    assert snapshot.remedy.startswith("no board was seen in the bottom right corner of the pictures")
    show.show(corners(), 40.0)
    assert guide.ended is Ended.RUNNING, "asked for three times in vain, but a minute and a half is not over"
    show.show(corners(), 60.0)
    assert (guide.ended, show.words) == (Ended.ENOUGH, "done: verdict usable"), "it cannot be shown, it seems"
    known = Show(seen=CORNERS)
    for view in held:
        known.show(view, 7.0)
    known.guide.grow(grown(tuple(known.guide.views), Verdict.GOOD), known.now_ns)
    assert known.guide.ended is Ended.GOOD, "an earlier calibration saw the corners"


def test_only_good_is_lowered_by_unseen_corners() -> None:
    """Several corners are told in one sentence; any other verdict keeps its own remedy."""
    good, poor = Assessment(Verdict.GOOD, ""), Assessment(Verdict.REJECT, "fix it")
    assert with_corners(good, ()) is good
    assert with_corners(poor, CORNERS) is poor
    lowered = with_corners(good, {Want.BOTTOM_LEFT, Want.TOP_RIGHT})
    assert lowered.verdict is Verdict.USABLE
    assert "in the top right corner or bottom left corner of the pictures" in lowered.remedy
    one = BoardPair("1", corners(0.34, 0.36), corners(0.34, 0.36, size=SIZES[1]))
    rig = unlike_rig()
    left, right = (
        replace(model, width_px=size[0], height_px=size[1])
        for model, size in zip((rig.left, rig.right), SIZES, strict=True)
    )
    assert unseen_in([one], BOARD, left, right) == CORNERS - {Want.TOP_LEFT}


def test_words_stand_until_they_can_be_read() -> None:
    """Nothing but news replaces words within a second; what flickers for less than 0.4 s is never said."""
    speech, said = Speech(), []
    wants = [(0, "closer", False), (300, "hold still", False), (990, "hold still", False), (1000, "hold still", False)]
    wants += [(2100, "glare", False), (2300, "hold still", False), (2400, "glare", False), (2700, "glare", False)]
    wants += [(2800, "glare", False), (2900, "taken, 1", True), (3000, "", False)]
    for at_ms, words, is_news in wants:
        said.append(speech.say(words, at_ms * 1_000_000, is_news=is_news))
    assert said == [*["closer"] * 3, *["hold still"] * 5, "glare", "taken, 1", "taken, 1"]


def test_it_ends_early_if_no_view_can_mend_it() -> None:
    """Cameras that are turned or swapped must be set right first: six views tell."""
    show = Show()
    views = [corners(), tilted(25, 0), tilted(-25, 0), tilted(0, 25), tilted(0, -25), corners(square=0.03)]
    for number, view in enumerate(views, start=1):
        assert show.show(view) is Gate.TAKEN
        show.guide.grow(grown(tuple(show.guide.views), Verdict.REJECT, hopeless=True), show.now_ns)
        assert show.guide.ended is (Ended.HOPELESS if number == 6 else Ended.RUNNING)


def test_it_says_what_keeps_a_view_from_being_taken() -> None:
    """First where the board is missing, then that it moves, is blurred or glares; and that it was taken."""
    show = Show()
    show.show(NONE, 1.0)
    assert show.words == Words.SHOW_BOTH.value
    show.show(NONE, 20.0)
    assert show.words == Words.HELP.value
    for step in range(8):
        show.show(corners(0.4 + step / 50), 0.1)
    assert show.words == Words.STILL.value
    assert show.show(corners(), 1.0, BoardLook(9.0, 0.0, 0.0)) is Gate.BLURRED
    assert show.words == Words.BLURRED.value
    assert show.show(corners(), 1.0, BoardLook(2.0, 0.5, 0.0)) is Gate.GLARE
    assert show.words == Words.GLARE.value
    for step in range(8):
        show.show(corners(0.54 + step / 50), 0.1)
    assert show.words == Words.GLARE.value, "somebody who turns the board away from the lamp is not told to hold still"
    assert show.show(corners(), 1.0) is Gate.TAKEN
    assert show.words == "taken, 1"
    show.show(corners(), 2.0)
    assert show.words == Want.LEFT_AWAY.value
    show.show(corners(), 2.0, right_sees=False)
    assert show.words == Words.SHOW_RIGHT.value
    show.show(NONE, 2.0)
    assert show.words == Words.SHOW_BOTH.value
    refused = dict(show.guide.snapshot(show.now_ns).refused)
    assert {Gate.NOT_FOUND, Gate.NOT_FOUND_RIGHT, Gate.MOVING, Gate.BLURRED, Gate.GLARE, Gate.NOTHING_NEW} == set(
        refused
    )


def test_a_board_that_left_a_picture_is_told_the_way_back() -> None:
    """For some seconds; then it may be anywhere."""
    show = Show()
    show.show(corners())
    show.show(corners(0.32), 1.0)
    show.show(NONE, 2.0)
    assert show.words == "back from the left edge"
    show.show(NONE, 4.0)
    assert show.words == Words.SHOW_BOTH.value


def test_a_board_that_became_too_small_is_asked_closer() -> None:
    """A small board that is lost in the middle was too far away; after some seconds it may be anywhere."""
    show = Show()
    show.show(corners(square=0.028))
    show.show(NONE, 6.0)
    assert show.words == Want.NEAR.value
    show.show(NONE, 9.0)
    assert show.words == Words.SHOW_BOTH.value


def test_a_camera_that_never_sees_the_board_is_named() -> None:
    """From the start on, and however long it takes."""
    show = Show()
    show.show(corners(), 2.0, right_sees=False)
    assert show.words == Words.SHOW_RIGHT.value
    show.show(corners(), 30.0, right_sees=False)
    assert show.words == Words.SHOW_RIGHT.value


def test_few_views_state_nothing() -> None:
    """Four views have a calibration whose figures and verdict are not told; five have; why there is none is told at once."""
    show, rig = Show(), unlike_rig()
    sizes = ((rig.left.width_px, rig.left.height_px), (rig.right.width_px, rig.right.height_px))
    show.show(corners())
    for count, verdict in ((4, ""), (5, "usable")):
        made = calibrate(exact_pairs(rig, poses(count, seed=2), 0.1), BOARD, sizes)
        progress = replace(grown((), Verdict.USABLE), views=count, calibration=made)
        show.guide.grow(progress, show.now_ns)
        shown = show.guide.snapshot(show.now_ns)
        assert (shown.verdict, math.isfinite(shown.depth_error_m)) == (verdict, bool(verdict))
    show.guide.grow(grown((), Verdict.REJECT), show.now_ns)
    assert show.guide.snapshot(show.now_ns).remedy == "more"


def test_exact_corners_are_judged_too() -> None:
    """A board that is found small and not at full size is not taken."""
    show = Show()
    seen = Glance(at_ns=0, skew_ns=0, left_px=NONE, right_px=corners(), sizes_px=SIZES)
    assert show.guide.examine(seen, (SHARP, SHARP), 0) is Gate.NOT_FOUND_LEFT
    assert not show.guide.views


def test_a_view_like_one_taken_is_not_taken_again() -> None:
    """When the kinds are wanted once more, the same place is refused, and the person is told to move a little."""
    show = Show()
    for x in (0.34, 0.66):
        for y in (0.36, 0.64):
            show.show(corners(x, y))
    assert show.show(tilted(25, 0)) is Gate.TAKEN
    guide = show.guide
    guide.grow(grown((), Verdict.USABLE, (Want.LEFT_AWAY, 0.001)), show.now_ns)
    for want in ORDER:  # all others are given up, one after the other
        if guide.snapshot(show.now_ns).asked is Want.LEFT_AWAY:
            break
        show.show(corners(), 12.5)
        assert want in ORDER
    assert guide.snapshot(show.now_ns).asked is Want.LEFT_AWAY
    assert show.show(tilted(25, 0), 2.0) is Gate.NOTHING_NEW
    assert show.words == Words.ELSEWHERE.value


def test_what_is_not_reached_is_given_up_but_only_while_somebody_tries() -> None:
    """Twelve seconds with the board in view are enough; a person who has left is waited for."""
    show = Show()
    show.show(corners())
    first = show.guide.snapshot(show.now_ns).asked
    show.show(NONE, 60.0)
    assert show.guide.snapshot(show.now_ns).asked is first
    show.show(corners(), 12.5)
    assert show.guide.snapshot(show.now_ns).asked is not first


def test_it_asks_for_what_helps_most() -> None:
    """Of the views that are still wanted, the one that would lower the depth error most; one that cannot be seen comes last."""
    show = Show()
    show.show(corners())
    taught = ((Want.FAR, 0.003), (Want.NEAR, 0.002), (Want.TOP_LEFT, math.nan))
    show.guide.grow(grown((), Verdict.USABLE, *taught), show.now_ns)
    assert show.guide.snapshot(show.now_ns).asked is Want.NEAR
    show.now_ns += 5 * SECOND_NS
    show.guide.grow(grown((), Verdict.USABLE, (Want.FAR, 0.001)), show.now_ns)
    assert show.guide.snapshot(show.now_ns).asked is Want.NEAR, "a person on the way is not sent elsewhere"


def test_a_person_who_moves_fast_is_stopped_in_time() -> None:
    """Half a second before the wanted view is there, while it moves that way, it is said to hold still."""
    show = Show()
    show.show(corners())
    show.guide.grow(grown((), Verdict.USABLE, (Want.TOP_LEFT, 0.001)), show.now_ns)
    gates = [show.show(corners(0.5 - 0.02 * step, 0.5 - 0.02 * step), 0.1) for step in range(1, 6)]
    placed = show.guide.snapshot(show.now_ns)
    assert placed.asked is Want.TOP_LEFT
    assert gates[-1] is Gate.MOVING
    still = Show()
    still.show(corners())
    still.guide.grow(grown((), Verdict.USABLE, (Want.TOP_LEFT, 0.001)), still.now_ns)
    assert still.show(corners(0.4, 0.4), 1.0) is Gate.NOTHING_NEW


def test_pictures_show_what_the_snapshot_says() -> None:
    """Text of at most 48 characters, well-formed SVG, JSON with the same numbers; before the board is known there is nothing to see."""
    show = Show()
    nothing = before_board("show the board", 25, 3.0)
    assert picture_lines(nothing) == ()
    assert json.loads(json.dumps(nothing.as_json()))["board"] is None
    ET.fromstring(guide_svg(nothing))
    show.show(corners())
    calibration = _calibration()
    progress = replace(grown(tuple(show.guide.views), Verdict.USABLE, (Want.NEAR, 0.0021)), calibration=calibration)
    show.guide.grow(progress, show.now_ns)
    show.show(corners(0.6), 0.3)
    snapshot = show.guide.snapshot(show.now_ns)
    lines = picture_lines(snapshot)
    assert max(map(len, lines)) <= 48
    assert len(lines) == 11
    assert "++" in "".join(lines)
    assert "far0 mid1 near0" in lines[-2]
    error = f"+- {progress.depth_error_m * 1e3:.1f} mm"
    assert f"depth at 1 m {error}, after the next view +- 2.1 mm" in figure_lines(snapshot)
    root = ET.fromstring(guide_svg(snapshot))
    assert len(root.findall("{*}polygon")) == 2
    content = snapshot.as_json()
    assert content["cameras"]["left"]["depths"] == {"far": 0, "middle": 1, "near": 0}
    assert content["depth_error_after_next_view_mm"] == 2.1
    assert sum(map(sum, content["cameras"]["right"]["cells"])) == 54
    show.show(NONE, 0.1)
    assert show.guide.snapshot(show.now_ns).outlines == ((), ())


def test_what_a_view_would_teach_is_what_it_teaches() -> None:
    """The depth error after each kind of view lies below the present one; of a rig of unknown uncertainty nothing can be told."""
    calibration = _calibration()
    rig, rectification = calibration.rig, calibration.rectification
    assert rectification is not None
    now_m = depth_sigma_m(rig, rectification, 1.0)
    taught = lessons(calibration, BOARD)
    assert list(taught) == list(ORDER)
    assert all(0 < after_m < now_m for after_m in taught.values() if math.isfinite(after_m))
    assert sum(map(math.isfinite, taught.values())) >= 8
    unknown = replace(rig, covariance=np.full((30, 30), math.nan))
    assert math.isnan(after_one_m(unknown, rectification, BOARD.points_m(), Spot()))
    assert math.isnan(after_one_m(rig, rectification, BOARD.points_m(), Spot(aside=(3.0, 0.0))))
    assert lessons(replace(calibration, rectification=None), BOARD) == {}


def test_progress_without_a_calibration_has_no_figures() -> None:
    """Neither now nor after any view; a calibration whose depths are not known has none, either."""
    progress = grown((), Verdict.REJECT)
    assert math.isnan(progress.depth_error_m)
    assert math.isnan(progress.after_m(Want.NEAR))
    assert math.isnan(replace(progress, calibration=replace(_calibration(), depths=())).depth_error_m)


@cache
def _calibration() -> Calibration:
    rig = unlike_rig()
    sizes = ((rig.left.width_px, rig.left.height_px), (rig.right.width_px, rig.right.height_px))
    return calibrate(exact_pairs(rig, poses(6, 3), 0.1), BOARD, sizes, Side.LEFT)


def test_only_lenses_of_many_coefficients_are_guessed_where_nothing_was_seen() -> None:
    """Four coefficients stay near the truth; five, eight or a fisheye's may not."""
    assert not is_guessed((Bend.USUAL, Bend.USUAL))
    assert all(is_guessed((Bend.USUAL, bend)) for bend in (Bend.WIDE, Bend.RATIONAL, Bend.FISHEYE))
