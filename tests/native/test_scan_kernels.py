"""The scan's jobs in the native library, with shapes that no real camera gives: as numpy has them, and no access outside (see test_sanitized.py)."""

import numpy as np
import pytest

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.native.library import Library
from phone_host.scan.blocks import Cells
from phone_host.scan.carving import Carving
from phone_host.scan.view import Depth, View
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings

NONE = Diagnostic(message="left out by this test", remedy="none")
SETTINGS = VolumeSettings(voxel_m=0.02, far_m=3.0)
SHAPES = [(1, 1), (29, 1), (17, 23)]
POSES = [SE3.identity(), SE3.of(np.array([0.4, -0.3, 0.2, 0.1, -0.05, -0.3])), SE3.of(np.array([0, 3.0, 0, 0, 0, 1.0]))]


def odd_view(shape: tuple[int, int], seed: int = 1) -> View:
    """A view of any size with depths from 1 mm to 3 m, some infinite and some missing."""
    draw = np.random.default_rng(seed)
    depth: Depth = draw.uniform(0.6, 1.4, shape).astype(np.float32)
    depth[draw.random(shape) < 0.1] = np.nan
    depth[draw.random(shape) < 0.1] = np.inf
    depth[draw.random(shape) < 0.05] = 0.001
    grey = draw.integers(0, 256, shape, np.uint8)
    height, width = shape
    geometry = StereoGeometry(focal_px=40.0, baseline_m=0.1, cx_px=(width - 1) / 2, cy_px=(height - 1) / 2)
    return View(grey=grey, colours=np.dstack([grey] * 3), depth_m=depth, geometry=geometry, noise_px=0.2)


def carved(cells: Cells, view: View, threads: int, library: Library | Diagnostic) -> Carving:
    """Cells that a view has looked through from all places, the last one twice."""
    carving = Carving(cells, threads, library)
    for pose in (*POSES, POSES[-1]):
        carving.see(view, pose)
    return carving


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("counts", [(1, 1, 1), (3, 33, 5)])
def test_cells_are_carved_as_numpy_does(library: Library, shape: tuple[int, int], counts: tuple[int, int, int]) -> None:
    """Grids and images of any size, also one cell and one pixel, a camera inside the grid and one that looks away; threads change nothing."""
    cells, view = Cells((-2, -1, 10), counts, 2, 0.03), odd_view(shape)
    mine, judge = carved(cells, view, 1, library), carved(cells, view, 1, NONE)
    # A cell whose pixel, or whose clearance, is on the border by rounding may go either way.
    assert np.count_nonzero(mine.counts != judge.counts) <= 0.01 * mine.counts.size
    assert np.array_equal(mine.counts, carved(cells, view, 3, library).counts)


def test_counts_end_at_255(library: Library) -> None:
    """However many views look through a cell, its number does not begin again."""
    carving = Carving(Cells((0, 0, 5), (1, 1, 1), 1, 0.03), 1, library)
    empty = odd_view((5, 5))
    empty.depth_m[:] = np.inf
    for _ in range(300):
        carving.see(empty, SE3.identity())
    assert carving.counts[:, 0, 0, 0].tolist() == [255, 0, 0]


@pytest.mark.parametrize(("shape", "pose"), list(zip(SHAPES, POSES, strict=True)))
def test_a_field_is_taken_in_as_numpy_does(native_library: Library, shape: tuple[int, int], pose: SE3) -> None:
    """Fields with lone voxels, empty ones, at any motion: the same values and weights, colours within one step; threads change nothing."""
    found = []
    for threads, is_numpy in ((1, False), (3, False), (1, True)):
        of, into = Volume(SETTINGS, threads, native_library), Volume(SETTINGS, threads, native_library)
        of.fuse(odd_view(shape), SE3.identity())
        into.fuse(odd_view(shape, 2), POSES[1])
        if is_numpy:
            fused, into = into, Volume(SETTINGS, threads, NONE)
            into.blocks = fused.blocks
        into.take_in(of, pose)
        into.take_in(Volume(SETTINGS, threads, native_library), pose)
        found.append(into.blocks)
    mine, threaded, judge = found
    assert np.array_equal(mine.places[: mine.count], judge.places[: judge.count])
    for name in ("field", "weights", "colours"):
        assert np.array_equal(getattr(mine, name), getattr(threaded, name))
    assert np.array_equal(mine.weights, judge.weights)
    assert np.array_equal(mine.field, judge.field)
    assert np.abs(mine.colours.astype(int) - judge.colours).max() <= 1
