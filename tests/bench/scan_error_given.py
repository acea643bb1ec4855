"""Free scans of given sequences, compared with the surface that the given poses make of the same depths: what drift alone does to the stated error.

street: 24 pairs of KITTI, matched by `tandem`. rest: 12 pairs of EuRoC, from one place, matched in the same way. room: a depth camera's 120 views of
7-Scenes, given as the disparities of a rig with as much noise. The room's poses come from another depth tracker and are no better than some 15 mm. Errors
that all depths share do not show, so the width says nothing.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from common import now
from phone_host.model import Disparity, Image, Processed, RectifiedPair
from phone_host.scan.scan import Scan, scan_for
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.view import view_of
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from tests.bench.scan_clips import Clip, at_rest, rest_pairs, room, street, street_pairs
from tests.bench.surface_errors import Surface, mesh_at, registered
from tests.support.surface_coverage import Coverage, coverage

GIVEN: Final = ("street", "room", "rest")

_FOCAL_BASELINE: Final = 200.0
"""px m of a rig whose depths have 2.5 mm of noise at 1 m with 0.5 px in a disparity, as the depth camera's have."""

_NEAR_M: Final = 0.4
_STEP_S: Final = {"street": 0.1, "room": 1 / 30, "rest": 0.05}


class _Given:
    """A matcher that gives what it was given."""

    def __init__(self) -> None:
        self.disparity = np.empty((0, 0), np.float32)

    def match(self, pair: RectifiedPair) -> Disparity:
        """Implement Matcher."""
        assert pair.left.shape[:2] == self.disparity.shape
        return self.disparity


def _of_street(data: Path) -> tuple[Clip, list[Processed]]:
    clip = street(data).left
    return clip, _matched(street_pairs(data), clip)


def _of_rest(data: Path) -> tuple[Clip, list[Processed]]:
    clip = at_rest(data)
    return clip, _matched([(pair.left, pair.right) for pair in rest_pairs(data)[0]], clip)


def _matched(pairs: Sequence[tuple[Image, Image]], clip: Clip) -> list[Processed]:
    core = StereoCore(MatchSettings(matcher=MatcherName.TANDEM, disparities=96), None, clip.views[0].geometry)
    return [core.compute(left, right, now.monotonic_ns) for left, right in pairs]


def _of_room(data: Path) -> tuple[Clip, list[Processed]]:
    clip, matcher, pairs = room(data), _Given(), []
    geometry = clip.views[0].geometry
    core = StereoCore(matcher, None, replace(geometry, baseline_m=_FOCAL_BASELINE / geometry.focal_px))
    for view in clip.views:
        depth = np.where(view.depth_m > _NEAR_M, view.depth_m, np.float32(np.nan))
        matcher.disparity = np.asarray(_FOCAL_BASELINE / depth, np.float32)
        pairs.append(core.compute(view.colours, view.colours, now.monotonic_ns))
    return clip, pairs


def scan_sequence(name: str, data: Path) -> tuple[Scan, ScanModel, Coverage]:
    """Scan a sequence.

    Args:
        name: one of `GIVEN`.
        data: folder of the given data.

    Returns:
        The scan, its model, and how its stated errors compare with those that the poses made.
    """
    clip, pairs = {"street": _of_street, "room": _of_room, "rest": _of_rest}[name](data)
    scan = scan_for(ScanWanted())
    for number, pair in enumerate(pairs):
        scan.take(str(number), number * _STEP_S[name], pair)
    model = scan.model()
    return scan, model, _compared(scan, model, clip, pairs)


def _compared(scan: Scan, model: ScanModel, clip: Clip, pairs: Sequence[Processed]) -> Coverage:
    assert scan.settings is not None
    fused = [at for at, pair in enumerate(scan.pairs) if pair.is_fused]
    same = Clip(tuple(view_of(pairs[at]) for at in fused), tuple(clip.truth[at] for at in fused))
    truth = Surface(mesh_at(same, same.truth, scan.settings, 1))
    start = same.truth[0] @ scan.pairs[fused[0]].world_camera.inverse()
    motion = registered(truth, model.mesh.points_m[model.seen].astype(np.float64), start)
    voxel_m = scan.settings.voxel_m
    return coverage(model, lambda points: truth.distances_m(motion.apply(points), voxel_m), None)
