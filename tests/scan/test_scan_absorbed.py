"""A field taken into another at a rigid motion: where it belongs, the same with the library and with numpy, as it was where nothing moves."""

import numpy as np
import pytest

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.scan.blocks import BLOCK_BYTES
from phone_host.scan.mesh import mesh_of
from phone_host.scan.view import Camera
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.plane_films import CORNER, plane_view, texture

SETTINGS = VolumeSettings(voxel_m=0.02, far_m=3.0)
THERE = SE3.of(np.array([0.05, 0.3, -0.1, 0.21, -0.07, 0.13]))
VIEW = plane_view(SE3.identity(), texture(), CORNER)


def field(library: Library | Diagnostic | None = None, settings: VolumeSettings = SETTINGS) -> Volume:
    """A corner, seen from its own origin."""
    volume = Volume(settings, 2, library)
    volume.fuse(VIEW, SE3.identity())
    return volume


def test_a_moved_field_shows_the_same_surface() -> None:
    """Taken into an empty field 0.26 m and 18 degrees away, the surface lies 0.5 mm from where it lay, on the median, and has its colours."""
    into = Volume(SETTINGS, 2)
    into.take_in(field(), THERE)
    depth = into.cast(Camera(VIEW.geometry, VIEW.grey.shape, THERE), VIEW.depth_m).points_m[..., 2]
    off = np.abs(depth - VIEW.depth_m)
    assert np.isfinite(off).mean() > 0.8
    assert float(np.nanmedian(off)) < 0.5e-3
    mesh = mesh_of(into.blocks, SETTINGS.voxel_m)
    before = mesh_of(field().blocks, SETTINGS.voxel_m)
    assert abs(float(mesh.colours.mean()) - float(before.colours.mean())) < 3


@pytest.mark.skipif(not isinstance(native(), Library), reason="the native library is not built")
def test_library_and_numpy_agree() -> None:
    """Into a field that holds something there already: the same values and weights to the last bit, colours within one step."""
    mine, judge = field(), Volume(SETTINGS, 2, Diagnostic("numpy judges", "none", code="native"))
    mine.take_in(field(), THERE)
    judge.blocks = field().blocks
    judge.take_in(field(), THERE)
    assert np.array_equal(mine.blocks.places[: mine.blocks.count], judge.blocks.places[: judge.blocks.count])
    assert np.array_equal(mine.blocks.weights, judge.blocks.weights)
    assert np.array_equal(mine.blocks.field, judge.blocks.field)
    assert np.abs(mine.blocks.colours.astype(int) - judge.blocks.colours).max() <= 1


def test_a_motion_that_moves_nothing_changes_nothing() -> None:
    """Taken into an empty field where it is: the same values, weights and colours."""
    of, into = field(), Volume(SETTINGS)
    into.take_in(of, SE3.identity())
    numbers = into.blocks.find(of.blocks.places[: of.blocks.count])
    assert (numbers >= 0).all()
    for name in ("field", "weights"):
        assert np.array_equal(getattr(into.blocks, name)[numbers], getattr(of.blocks, name)[: of.blocks.count])


def test_what_finds_no_memory_is_counted() -> None:
    """A field with room for 260 blocks takes in 260, and says how many were left out."""
    small = Volume(VolumeSettings(voxel_m=0.02, far_m=3.0, most_bytes=260 * BLOCK_BYTES))
    small.take_in(field(), THERE)
    assert small.blocks.count == 260
    assert small.left_out > 0
