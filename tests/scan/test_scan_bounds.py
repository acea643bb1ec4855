"""What the parts of a scan say where there is nothing, too little, or too much of what they are given."""

import io
import math
import zlib

import numpy as np
import pytest

from common.errors import DataError
from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.blocks import Box, Cells
from phone_host.scan.carving import Carving
from phone_host.scan.circle_bundle import TurnAxis, tracks_of
from phone_host.scan.closing import CellField, cell_field
from phone_host.scan.field_bytes import field_bytes, field_of
from phone_host.scan.full_turn import TurnView, full_turn
from phone_host.scan.ground import above, table_height_m
from phone_host.scan.mesh import Mesh, without_loose_bodies
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.submap_bytes import submap_bytes, submap_of
from phone_host.scan.turning_mask import Turning, TurningMask, ball_of
from phone_host.scan.view import View
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.turning_things import processed_of

SETTINGS = VolumeSettings(voxel_m=0.01, far_m=2.0)
GEOMETRY = StereoGeometry(focal_px=100.0, baseline_m=0.06, cx_px=31.5, cy_px=23.5)
UPRIGHT = TurnAxis(np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.1, 1.0]))


def grey_view(depth_m: float, seed: int = 1) -> View:
    """A speckled picture, at one depth all over."""
    grey = np.random.default_rng(seed).integers(0, 256, (48, 64), np.uint8)
    colours = np.repeat(grey[..., np.newaxis], 3, axis=2)
    depth = np.full(grey.shape, depth_m, np.float32)
    return View(grey=grey, colours=colours, depth_m=depth, geometry=GEOMETRY, noise_px=0.5)


def test_a_large_box_has_cells_of_several_voxels() -> None:
    """A cube of 8 m at 1 cm would be 512 million cells: they are wider then, at most 4 million, and still hold the box."""
    cells = Cells.of(Box((-4.0, -4.0, 0.0), (4.0, 4.0, 8.0)), 0.01)
    assert cells.voxels > 1
    assert math.prod(cells.counts) <= 4_000_000
    wide_m = cells.voxels * cells.voxel_m
    assert (np.array(cells.low) * wide_m <= (-4.0, -4.0, 0.0)).all()
    assert ((np.array(cells.low) + cells.counts) * wide_m >= (4.0, 4.0, 8.0)).all()


def test_a_field_of_wide_cells_is_linear_between_their_middles() -> None:
    """Values that rise by 1 a cell along x, in cells of four voxels: a quarter a voxel, and no more outside."""
    cells = Cells((0, 0, 0), (3, 3, 3), 4, 0.01)
    values = np.broadcast_to(np.arange(5, dtype=np.float32), (5, 5, 5))
    found = CellField(cells, np.ascontiguousarray(values)).at(np.array([[at, 5, 5] for at in (-99, 2, 3, 6, 99)]))
    assert found == pytest.approx([0.0, 1.125, 1.375, 2.125, 4.0])


def test_a_box_that_no_view_looked_into_is_empty() -> None:
    """Of its cells nothing is known, and the field around them is outside: there is no surface anywhere."""
    cells = Cells.of(Box((0.0, 0.0, 1.0), (0.1, 0.1, 1.1)), 0.01)
    field = cell_field(Carving(cells), Volume(SETTINGS).blocks, 1, has_floor=True)
    assert field.values.min() > 0


def test_a_mesh_of_nothing_has_no_loose_bodies() -> None:
    """Without triangles it comes back as it is."""
    assert without_loose_bodies(Mesh.empty()).triangles.shape == (0, 3)


@pytest.mark.parametrize("settings", [(-0.01, 2, 1e8, 4), (0.01, 0, 1e8, 4), (0.01, 2, 0, 4), (0.01, 2, 1e8, 0)])
def test_a_field_of_impossible_settings_is_refused(settings: tuple[float, ...]) -> None:
    """Sound bytes that say voxels of no size, no reach, no memory or no band are no field."""
    content = field_bytes(Volume(SETTINGS))
    head = content.index(b"\n") + 1
    with np.load(io.BytesIO(zlib.decompress(content[head:]))) as held:
        arrays = dict(held) | {"model": np.array(settings, np.float64)}
    changed = io.BytesIO()
    np.savez(changed, **arrays)
    with pytest.raises(DataError, match=r"a\.field is damaged"):
        field_of(content[:head] + zlib.compress(changed.getvalue()), "a.field")


def test_a_box_of_impossible_cells_is_refused() -> None:
    """What the views told of a box has three kinds of counts: with another number the submap is no submap."""
    view = grey_view(1.0)
    scan = scan_for(ScanWanted(voxel_m=0.02, box=Box((-0.1, -0.1, 0.9), (0.1, 0.1, 1.1))))
    scan.take("0", 0.0, processed_of(view))
    content = submap_bytes(scan.close_submap())
    head = content.index(b"\n") + 1
    with np.load(io.BytesIO(zlib.decompress(content[head:]))) as held:
        arrays = dict(held)
    assert arrays["carved"].shape[0] == 3
    changed = io.BytesIO()
    np.savez(changed, **(arrays | {"carved": arrays["carved"][:2]}))
    with pytest.raises(DataError, match=r"a\.submap is damaged"):
        submap_of(content[:head] + zlib.compress(changed.getvalue()), "a.submap")


def test_before_anything_turned_no_pixel_is_the_things() -> None:
    """A mask that has seen no view knows none."""
    view = grey_view(1.0)
    assert not TurningMask().before(view.depth_m, view.geometry).any()


def test_what_changes_without_a_depth_tells_no_thing() -> None:
    """A part of the picture changes, but nothing of it has a depth: nothing turns, as far as can be told."""
    mask, first, second = TurningMask(), grey_view(math.nan), grey_view(math.nan)
    changed = second.grey.copy()
    changed[14:34, 20:44] = 255 - changed[14:34, 20:44]
    mask.take(first.grey, first.depth_m, GEOMETRY)
    assert mask.take(changed, second.depth_m, GEOMETRY).turning is Turning.NOTHING
    assert mask.ball is None


def test_a_ball_is_where_the_change_is_and_needs_depths() -> None:
    """A square of 20 px at 1 m and 100 px of focal length is 0.2 m wide: its ball lies around its middle; without depths there is none."""
    view = grey_view(1.0)
    changed = np.zeros(view.grey.shape, np.bool_)
    changed[14:34, 22:42] = True
    ball = ball_of(view.depth_m, changed, GEOMETRY)
    assert ball is not None
    assert ball.middle_m == pytest.approx([0.0, 0.0, 1.0], abs=0.01)
    assert 0.1 < ball.radius_m < 0.3
    assert ball_of(np.full_like(view.depth_m, np.nan), changed, GEOMETRY) is None


def test_still_points_at_all_heights_are_no_table() -> None:
    """A wall beside the thing, evenly from 0 to 1 m below it, has no height; a view is not cut by a table that is not there."""
    heights = np.linspace(0.2, 1.2, 400)
    wall = np.column_stack([np.full(400, 0.05), heights, np.full(400, 1.0)])
    thing = np.array([[0.1, 0.0, 1.0], [-0.1, 0.0, 1.0], [0.0, 0.05, 1.1], [0.0, 0.05, 0.9]])
    assert table_height_m(wall, thing, UPRIGHT, 0.001) == -math.inf
    view = grey_view(1.0)
    assert above(view, UPRIGHT, -math.inf, 0.001) is view


def test_views_without_depth_have_no_tracks() -> None:
    """Corners without a depth are no points: none is found, and no view sees any."""
    tracks = tracks_of([grey_view(math.nan), grey_view(math.nan)], UPRIGHT, np.array([0.0, 0.1]))
    assert tracks.points_m.shape == (0, 3)
    assert [len(each.points) for each in tracks.seen] == [0, 0]
    assert tracks.closing == 0


def turned(angles: list[float]) -> list[TurnView]:
    """Views without depth that were tracked on a circle."""
    return [TurnView(grey_view(math.nan), UPRIGHT.camera_world(angle).inverse(), is_sure=True) for angle in angles]


def test_too_few_views_or_none_that_turn_are_no_turn() -> None:
    """Ten views from one place have no axis; four on a circle are too few for one."""
    assert full_turn([TurnView(grey_view(1.0), SE3.identity(), is_sure=True)] * 10, SETTINGS, 1) is None
    assert full_turn(turned([0.0, 0.2, 0.4, 0.6]), SETTINGS, 1) is None


def test_a_turn_without_corners_is_what_tracking_says() -> None:
    """Nothing can be fitted: the angles are those of the poses from the first on, and the turn is not closed."""
    angles = [0.3 + 0.2 * number for number in range(10)]
    turn = full_turn(turned(angles), SETTINGS, 1)
    assert turn is not None
    assert turn.angles == pytest.approx(np.array(angles) - angles[0], abs=1e-9)
    assert turn.used.all()
    assert not turn.is_closed
    assert math.isnan(turn.gap)
