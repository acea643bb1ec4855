"""A camera that is never lost comes back to what it saw long before: the drift of its way is taken out, and a place that only looks alike moves nothing."""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.scan.blocks import Box
from phone_host.scan.loop_closing import LoopCloser, LoopSettings
from phone_host.scan.piece import Piece, PoseGate
from phone_host.scan.scan import Scan, scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.stretches import Placed
from phone_host.scan.submap_bytes import submap_bytes, submap_of
from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.papered_room import WALLS, room_view, station
from tests.support.plane_films import distance, texture
from tests.support.turning_things import processed_of

pytestmark = pytest.mark.skipif(not isinstance(native(), Library), reason="numpy alone takes minutes")

SETTINGS = VolumeSettings(voxel_m=0.02, far_m=3.0)
PAPERS = tuple(range(30, 31 + WALLS))
"""Seeds of the walls' and the floor's pictures."""

ALIKE = (*PAPERS[: WALLS // 2], *PAPERS[: WALLS // 2], PAPERS[-1])
"""Opposite walls have the same picture."""
STEP = np.radians(9.0)
ONCE = 40
"""Views of the way once round the room."""


painted = cache(texture)


@cache
def seen(number: int, papers: tuple[int, ...]) -> View:
    """What the camera sees on its way."""
    return room_view(station(number * STEP), [painted(seed) for seed in papers])


class Walk:
    """A camera that goes round; its odometry turns by a share of the truth, and only loops correct it.

    Attributes:
        poses: where each view was taken, as is believed in the end.
    """

    def __init__(self, share: float, loops: LoopSettings | None, papers: tuple[int, ...] = PAPERS) -> None:
        self.model = Piece(SETTINGS, 1, PoseGate(), native())
        self.model.usual_off_sigmas = 0.7
        self.closer = None if loops is None else LoopCloser(loops, self.model, 1, PoseGate(), native())
        self._share, self._papers = share, papers
        self.poses: list[SE3] = []
        self.moved = 0

    def go(self, count: int) -> "Walk":
        """Take so many more views; in the end all loops so far are looked at together."""
        for number in range(len(self.poses), len(self.poses) + count):
            view, pose = self.view(number), station(0)
            if number:
                here, there = (station(at * self._share * STEP) for at in (number - 1, number))
                pose = (self.poses[-1] @ here.inverse() @ there).exact()
            self.model.fuse(view, pose, None)
            self.poses.append(pose)
            if self.closer is not None:
                self.closer.keep(number, view, SETTINGS.most_bytes)
                self._put(self.closer.fused(number, view, pose, was_lost=False))
        if self.closer is not None:
            self._put(self.closer.settled())
        return self

    def _put(self, placed: Sequence[Placed]) -> None:
        self.moved += bool(placed)
        for each in placed:
            self.poses[each.number] = each.world_camera

    def view(self, number: int) -> View:
        """What the camera sees."""
        return seen(number, self._papers)

    def worst_deg(self) -> float:
        """Greatest turn from the truth."""
        turns = [distance(pose, station(number * STEP))[0] for number, pose in enumerate(self.poses)]
        return float(np.degrees(max(turns)))

    def round_deg(self) -> float:
        """Turn between the first view and the one taken at the same place a round later."""
        return float(np.degrees(distance(self.poses[0], self.poses[ONCE])[0]))


@pytest.fixture(scope="module")
def looped() -> Walk:
    """A round and three views with 2 % less turn than there was, and loops."""
    return Walk(0.98, LoopSettings()).go(ONCE + 3)


def test_a_loop_takes_out_the_drift(looped: Walk) -> None:
    """The end misses the beginning by 7 degrees; with loops by less than one, and no view is farther off than a stretch's own drift of 0.9 and that."""
    without = Walk(0.98, None).go(ONCE + 3)
    assert without.round_deg() > 7
    assert without.worst_deg() > 7.5
    assert looped.round_deg() < 1
    assert looped.worst_deg() < 1.8


def test_the_field_is_that_of_the_moved_views(looped: Walk) -> None:
    """A view lies on the surface where it is believed to be; places have moved with it; there are no two surfaces any more."""
    seen = looped.model.laid(looped.view(ONCE + 2), looped.poses[ONCE + 2])
    assert seen.overlap > 0.8
    assert seen.near > 0.9
    at = looped.model.places.recognised(looped.view(ONCE + 1))
    assert at is not None
    assert (distance(at.world_camera, looped.poses[ONCE + 1]) < (0.02, 0.03)).all()


def test_a_model_that_was_built_of_few_views_is_built_of_all_in_the_end(looped: Walk) -> None:
    """While the camera goes on, of ten at most; then it holds as much as one that never was."""
    walk = Walk(0.98, LoopSettings(at_once=10)).go(ONCE + 3)
    assert walk.moved > 0
    here, there = (each.model.volume.blocks.weights.sum(dtype=np.int64) for each in (walk, looped))
    assert abs(int(here) - int(there)) < 0.02 * there


def test_the_same_views_close_the_same_loops(looped: Walk) -> None:
    """To the bit, poses and field."""
    again = Walk(0.98, LoopSettings()).go(ONCE + 3)
    assert looped.moved == again.moved > 0
    assert all(np.array_equal(one.pose(), other.pose()) for one, other in zip(looped.poses, again.poses, strict=True))
    assert np.array_equal(looped.model.volume.blocks.field, again.model.volume.blocks.field)


def test_a_place_that_looks_alike_moves_nothing() -> None:
    """Opposite halves of the room have the same papers, so a view is located half a round away; tracking knows better: the field is bit for bit as without loops."""
    walk, without = (Walk(1.0, loops, ALIKE).go(30) for loops in (LoopSettings(), None))
    found = walk.model.places.recognised(walk.view(20), range(3), 3)
    assert found is not None
    assert np.degrees(distance(found.world_camera, station(20 * STEP))[0]) > 170
    assert walk.moved == 0
    assert np.array_equal(walk.model.volume.blocks.field, without.model.volume.blocks.field)


def test_without_memory_no_loop_is_closed() -> None:
    """Where the copies of the views find no room, everything is as without loops, and no copy is kept."""
    walk = Walk(0.98, LoopSettings(most_bytes=100_000)).go(ONCE + 3)
    assert walk.moved == 0
    assert walk.closer is not None
    assert walk.closer.settled() == ()


NARROW = LoopSettings(least_voxels=0.01, least_turn=1e-5)
"""The model moves for next to nothing."""


@pytest.fixture(scope="module")
def scans() -> tuple[Scan, Scan]:
    """A round and three pairs, scanned with loops, in a box, and without them."""
    box, both = Box((-2.0, -1.0, -2.0), (2.0, 1.0, 2.0)), []
    for loops in (NARROW, None):
        scan = scan_for(ScanWanted(voxel_m=0.04, box=box if loops else None, loops=loops))
        for number in range(ONCE + 3):
            scan.take(str(number), float(number), processed_of(seen(number, PAPERS)))
        both.append(scan)
    return both[0], both[1]


def missed(scan: Scan) -> float:
    """By how much the pairs a round apart miss each other, rad."""
    poses = [pair.world_camera for pair in scan.pairs]
    return float(np.mean([distance(poses[at], poses[at + ONCE])[0] for at in range(3)]))


def test_pairs_are_told_where_a_loop_put_them(scans: tuple[Scan, Scan]) -> None:
    """All are in the model; their trajectory closes better than without loops; what was told at first is corrected by `final`, and views carve from there."""
    looped, without = scans
    assert looped.fused == without.fused == ONCE + 3
    before = looped.pairs
    model = looped.model()
    assert model.is_closed
    assert missed(looped) < missed(without)
    assert all(
        looped.final(pair).world_camera is now.world_camera for pair, now in zip(before, looped.pairs, strict=True)
    )
    carved = looped.close_submap().carved
    assert carved is not None
    assert carved.views == ONCE + 3


def test_a_scan_whose_model_was_moved_goes_on_from_its_submap(scans: tuple[Scan, Scan]) -> None:
    """The submap after a loop is whole; the scan that goes on from it finds the next view."""
    looped, _ = scans
    again = scan_for(ScanWanted(voxel_m=0.04, box=Box((-2.0, -1.0, -2.0), (2.0, 1.0, 2.0))))
    again.go_on([submap_of(submap_bytes(looped.close_submap(whole=True)), "a file")])
    told = again.take("next", 99.0, processed_of(seen(ONCE + 3, PAPERS)))
    assert told.is_fused
    assert (distance(told.world_camera, looped.pairs[3].world_camera) < (0.02, 0.04)).all()
