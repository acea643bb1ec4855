"""Pacing by demand: every image is asked for by the frame that it belongs to, and labels are compared only with labels."""

import threading

import pytest

from common.protocol.message import Pacing
from common.protocol.session import MS
from phone_host.stream.demand_clock import DemandClock


class Shown:
    """A host camera that notes what it is told to show."""

    def __init__(self, demand: DemandClock) -> None:
        self._demand = demand
        self.anchors: list[tuple[int, int]] = []
        self.images = 0

    def anchor(self, label_ns: int, number: int) -> None:
        """Set which image is next."""
        self.anchors.append((label_ns, number))

    def show(self) -> None:
        """Show the next image."""
        self.images += 1

    def answer(self) -> None:
        """Let it answer the oldest request."""
        self._demand.show_next(self.anchor, self.show)


def test_images_of_one_number_belong_together() -> None:
    """Beside a board that shows labels each image is the one with the frame's number: labels are set once, and again after a missing frame."""
    demand = DemandClock(Pacing.DEMAND)
    shown = Shown(demand)
    demand.begin(Pacing.DEMAND)
    for number in (0, 1, 2, 5, 6):
        demand.frame_came(1000 + number, number)
        shown.answer()
    assert shown.images == 5
    assert shown.anchors == [(1000, 0), (1005, 5)]


def test_beside_a_clock_images_come_in_their_order() -> None:
    """Beside a board with a clock the host camera shows its images from the first one on, with labels that start at the first frame's stamp."""
    demand = DemandClock(Pacing.DEMAND)
    shown = Shown(demand)
    demand.begin(Pacing.CLOCK)
    for number in (7, 8, 11):
        demand.frame_came(1000 + number, number)
        shown.answer()
    assert shown.images == 3
    assert shown.anchors == [(1007, 0)]


def test_nothing_asked_for_before_a_new_life_comes_after_it() -> None:
    """A board that starts again with image 0 gets image 0: requests from the previous life are dropped."""
    demand = DemandClock(Pacing.DEMAND)
    shown = Shown(demand)
    demand.begin(Pacing.DEMAND)
    demand.frame_came(1000, 0)
    shown.answer()
    demand.frame_came(1001, 1)
    demand.begin(Pacing.DEMAND)
    demand.frame_came(5000, 0)
    shown.answer()
    assert shown.images == 1
    shown.answer()
    assert shown.images == 2
    assert shown.anchors == [(1000, 0), (5000, 0)]


def test_a_new_life_waits_for_the_image_that_is_being_shown() -> None:
    """The image in hand is delivered before the new life begins, not during it."""
    demand = DemandClock(Pacing.DEMAND)
    demand.begin(Pacing.DEMAND)
    order: list[str] = []
    showing, may_end = threading.Event(), threading.Event()

    def show() -> None:
        showing.set()
        may_end.wait(60)
        order.append("shown")

    def begin() -> None:
        demand.begin(Pacing.DEMAND)
        order.append("begun")

    demand.frame_came(1000, 0)
    camera = threading.Thread(target=demand.show_next, args=(lambda _label_ns, _number: None, show))
    camera.start()
    showing.wait(60)
    board = threading.Thread(target=begin)
    board.start()
    may_end.set()
    camera.join(60)
    board.join(60)
    assert order == ["shown", "begun"]


def test_a_camera_with_a_clock_is_asked_for_nothing() -> None:
    """Frames of any board leave a host camera with a clock alone; only `wake` ends its wait."""
    demand = DemandClock(Pacing.CLOCK)
    shown = Shown(demand)
    demand.begin(Pacing.CLOCK)
    demand.frame_came(1000, 0)
    demand.wake()
    shown.answer()
    assert (shown.images, shown.anchors) == (0, [])


@pytest.mark.parametrize(
    ("own", "board", "paces_own", "labels", "timeless", "one_sided"),
    [
        (Pacing.CLOCK, Pacing.CLOCK, False, False, False, False),
        (Pacing.CLOCK, Pacing.DEMAND, False, True, True, True),
        (Pacing.DEMAND, Pacing.CLOCK, True, False, True, False),
        (Pacing.DEMAND, Pacing.DEMAND, True, True, True, False),
    ],
)
def test_what_stamps_mean(
    *, own: Pacing, board: Pacing, paces_own: bool, labels: bool, timeless: bool, one_sided: bool
) -> None:
    """One camera on demand is enough to make stamps that no clock can judge; a board's labels need a host camera that follows them."""
    demand = DemandClock(own)
    demand.begin(board)
    told = (demand.paces_own_camera, demand.labels_board, demand.is_timeless, demand.is_one_sided)
    assert told == (paces_own, labels, timeless, one_sided)


def test_labels_of_a_life_go_by_its_first_offset() -> None:
    """A better estimate of the clock moves no label, and the next life's labels use their own offset; times move with the estimate."""
    demand = DemandClock(Pacing.DEMAND)
    for first_ns in (5 * MS, -3 * MS):
        demand.begin(Pacing.DEMAND)
        offsets_ns = (first_ns, 0, 7 * MS)
        stamps = [demand.stamp_ns(number * MS + offset_ns, offset_ns) for number, offset_ns in enumerate(offsets_ns)]
        assert stamps == [first_ns + number * MS for number in range(3)]
    demand.begin(Pacing.CLOCK)
    assert demand.stamp_ns(9 * MS, 2 * MS) == 9 * MS
