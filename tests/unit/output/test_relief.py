"""A relief of one pair: a closed plaque, true to scale, that invents nothing."""

import manifold3d
import numpy as np
import pytest
import trimesh

from common.errors import DataError
from phone_host.output.meshes.relief import Relief, Sizes, relief_of

FOCAL_PX = 100.0
SIZES = Sizes(width_m=0.1, height_m=1.0, base_m=0.002)


def scene(step_m: float, *, holes: bool = False) -> np.ndarray:
    """61 x 41 px of a wall at 1 m with a step towards the camera in its left half."""
    y, x = np.mgrid[0:41, 0:61].astype(np.float32)
    depth = np.where(x < 30, np.float32(1 - step_m), np.float32(1))
    if holes:
        depth[30:, :] = np.nan
    return np.stack([(x - 30) * depth / FOCAL_PX, (y - 20) * depth / FOCAL_PX, depth], axis=-1).astype(np.float32)


def shape_of(relief: Relief) -> trimesh.Trimesh:
    """Its mesh as an independent judge has it, mm."""
    return trimesh.Trimesh(relief.solid.points_mm, relief.solid.triangles, process=False)


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("grey", [False, True])
def test_it_is_one_closed_body(*, holes: bool, grey: bool) -> None:
    """Every edge has two triangles, they face outwards, and the volume is that of plate and step; where depth is missing only the plate."""
    colours = np.full((41, 61) if grey else (41, 61, 3), 90, np.uint8)
    relief = relief_of(scene(0.1, holes=holes), colours, FOCAL_PX, SIZES)
    shape = shape_of(relief)
    assert shape.is_watertight
    assert shape.is_winding_consistent
    judge = manifold3d.Manifold(manifold3d.Mesh(relief.solid.points_mm, relief.solid.triangles.astype(np.uint32)))
    assert judge.status() == manifold3d.Error.NoError
    assert len(judge.decompose()) == 1
    assert shape.extents[:2] == pytest.approx([100, 100 * 40 / 60], rel=1e-5)
    assert shape.bounds[0][2] == 0
    raised = 1000 * 0.1 * relief.scale
    assert shape.extents[2] == pytest.approx(2 + raised, rel=1e-4)
    rows = 29.5 if holes else 40  # the median leaves the step where it is, half a pixel beside the hole's edge
    expected = 100 * 100 * 40 / 60 * 2 + raised * (100 * 29.5 / 60) * (100 * rows / 60)
    assert shape.volume == pytest.approx(expected, rel=0.02)
    assert relief.covered == pytest.approx(30 / 41 if holes else 1)


def test_what_is_too_deep_is_flattened() -> None:
    """A street would be a tower: heights are limited, and the share is told."""
    sizes = Sizes(width_m=0.1, height_m=0.004, base_m=0.002)
    relief = relief_of(scene(0.5), np.zeros((41, 61, 3), np.uint8), FOCAL_PX, sizes)
    assert shape_of(relief).extents[2] == pytest.approx(6, rel=1e-4)
    assert relief.flattened == pytest.approx(4 / (1000 * 0.5 * relief.scale), rel=1e-4)


def test_a_plane_is_a_plate() -> None:
    """Without any depth there is nothing to divide by, and only the plate."""
    relief = relief_of(scene(0), np.zeros((41, 61, 3), np.uint8), FOCAL_PX, SIZES)
    assert relief.flattened == 1
    assert shape_of(relief).extents[2] == pytest.approx(2, rel=1e-4)


def test_a_large_picture_is_made_as_fine_as_a_print_shows() -> None:
    """2000 px across give at most 480 points across; the colours come from the same pixels, red first."""
    depth = np.ones((1000, 2000), np.float32)
    colours = np.zeros((1000, 2000, 3), np.uint8)
    colours[..., 2] = 200
    relief = relief_of(np.stack([depth] * 3, axis=-1), colours, FOCAL_PX, SIZES)
    assert len(relief.solid.points_m) <= 2 * 480 * 240
    assert (relief.solid.colours == [200, 0, 0]).all()
    assert shape_of(relief).extents[0] == pytest.approx(100, rel=1e-5)


def test_a_picture_without_depth_is_refused() -> None:
    """Two percent of a picture make no relief."""
    cloud = scene(0.1)
    cloud[1:] = np.nan
    with pytest.raises(DataError, match="2% of the picture"):
        relief_of(cloud, np.zeros((41, 61, 3), np.uint8), FOCAL_PX, SIZES)
