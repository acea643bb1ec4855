"""Completing holes from their surroundings: exact on planes, the far surface where one is hidden, edges of the image elsewhere, and never in a cloud."""

from itertools import count

import numpy as np
import pytest

from phone_host.model import Crop, Disparity, Epipolar, Image, Processed, StereoGeometry
from phone_host.stereo.completion import completed
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.stacked import upright_again
from tests.support.layers import Layer, layers

_HEIGHT, _WIDTH = 80, 120
_PLAIN: Image = np.full((_HEIGHT, _WIDTH), 100, np.uint8)
_GEOMETRY = StereoGeometry(focal_px=300, baseline_m=0.1, cx_px=159.5, cy_px=119.5)


def slanted() -> Disparity:
    """A plane: 10 + 0.05 x + 0.02 y."""
    y, x = np.mgrid[:_HEIGHT, :_WIDTH]
    return np.asarray(10 + 0.05 * x + 0.02 * y, np.float32)


def two_surfaces(near_from: int, near_to: int) -> Disparity:
    """A near surface of 30 px before a far one of 10 px."""
    disparity = np.full((_HEIGHT, _WIDTH), 10, np.float32)
    disparity[:, near_from:near_to] = 30
    return disparity


def with_hole(disparity: Disparity, rows: slice, columns: slice) -> Disparity:
    """The disparity without the values of a rectangle."""
    holed = disparity.copy()
    holed[rows, columns] = np.nan
    return holed


def test_a_hole_in_a_slanted_plane_gets_the_plane() -> None:
    """To a hundredth of a pixel: a straight line between two points of a plane lies in it."""
    truth = slanted()
    found = completed(_PLAIN, with_hole(truth, slice(20, 60), slice(30, 90)))
    assert np.abs(found.disparity - truth).max() < 0.01


def test_what_the_near_surface_hides_from_the_right_camera_is_the_far_one() -> None:
    """30 - 10 = 20 px to the left of the near surface are hidden: all of them get 10 px, whatever the image shows there."""
    truth = two_surfaces(70, 100)
    image = _PLAIN.copy()
    image[:, 40:50] = 200  # an edge between the far surface and the hole would give it to the near one
    found = completed(image, with_hole(truth, slice(None), slice(50, 70)))
    assert (found.disparity == truth).all()


def test_an_edge_of_the_image_divides_a_hole_between_two_surfaces() -> None:
    """To the right of a near surface nothing is hidden: what has its colour is near, what lies beyond the edge is far."""
    truth = two_surfaces(20, 60)
    image = _PLAIN.copy()
    image[:, :60] = 180
    found = completed(image, with_hole(truth, slice(None), slice(50, 75)))
    wrong = found.disparity != truth
    assert not wrong[:, :58].any()
    assert not wrong[:, 62:].any()


def test_a_hole_without_an_edge_goes_to_the_far_surface() -> None:
    """Where nothing says that the near surface goes on, it does not."""
    found = completed(_PLAIN, with_hole(two_surfaces(20, 60), slice(None), slice(60, 75)))
    assert (found.disparity[:, 60:75] == 10).all()


def test_the_marks_are_just_the_completed_pixels_and_all_others_keep_their_bits() -> None:
    """Every pixel is measured, marked or NaN, and never two of these."""
    truth = slanted() + np.random.default_rng(1).normal(0, 0.3, (_HEIGHT, _WIDTH)).astype(np.float32)
    holed = with_hole(with_hole(truth, slice(10, 40), slice(50, 80)), slice(None), slice(0, 15))
    found = completed(_PLAIN, holed)
    assert found.mask.dtype == np.bool_
    assert (found.mask == (np.isnan(holed) & np.isfinite(found.disparity))).all()
    assert found.mask[10:40, 50:80].all()
    assert found.disparity[~found.mask].tobytes() == holed[~found.mask].tobytes()


def test_nothing_is_completed_where_nothing_is_known() -> None:
    """Neither in an empty map, nor in a margin that values reach from one side only, nor farther than a quarter of the width from any value."""
    empty = np.full((_HEIGHT, _WIDTH), np.nan, np.float32)
    assert not completed(_PLAIN, empty).mask.any()
    margin = with_hole(slanted(), slice(None), slice(0, 20))
    assert not completed(_PLAIN, margin).mask.any()
    frame = with_hole(slanted(), slice(1, -1), slice(1, -1))
    marks = completed(_PLAIN, frame).mask
    assert not marks[31:-31, 31:-31].any()
    assert marks[2:20, 2:20].all()


@pytest.mark.parametrize("epipolar", [Epipolar.UP, Epipolar.DOWN])
def test_cameras_above_each_other_hide_along_columns(epipolar: Epipolar) -> None:
    """The same pair, turned upright, gives the same result, turned upright."""
    holed = with_hole(two_surfaces(70, 100), slice(20, 60), slice(50, 70))
    lying = completed(_PLAIN, holed)
    upright = completed(upright_again(_PLAIN, epipolar), upright_again(holed, epipolar), epipolar)
    assert upright.disparity.tobytes() == upright_again(lying.disparity, epipolar).tobytes()


def test_colour_images_count_by_their_grey_levels() -> None:
    """Three equal channels give what one gives."""
    holed = with_hole(two_surfaces(20, 60), slice(None), slice(50, 75))
    image = _PLAIN.copy()
    image[:, :60] = 180
    colour = completed(np.repeat(image[:, :, np.newaxis], 3, axis=2), holed)
    assert colour.disparity.tobytes() == completed(image, holed).disparity.tobytes()


def test_specks_do_not_spread_over_a_hole() -> None:
    """A speck of 4 x 4 px amid a hole keeps its value, and the hole around it gets the surface's; a map of specks alone is completed."""
    truth = slanted()
    holed = with_hole(truth, slice(20, 60), slice(30, 90))
    holed[38:42, 58:62] = 60
    found = completed(_PLAIN, holed)
    assert (found.disparity[38:42, 58:62] == 60).all()
    assert np.abs(found.disparity - truth)[found.mask].max() < 0.01
    alone = np.full_like(truth, np.nan)
    alone[30:34, 30:34] = alone[30:34, 50:54] = 12
    assert completed(_PLAIN, alone).mask[30:34, 34:50].all()


def test_nothing_is_completed_that_nobody_saves() -> None:
    """The option holds for saved pairs; the others cost no time."""
    scene = layers([Layer(disparity=14)])
    core = StereoCore(MatchSettings(MatcherName.SGBM, 64), None, _GEOMETRY, DepthWanted(complete=True))
    ticks = count()
    done = core.compute(scene.pair.left, scene.pair.right, lambda: next(ticks), is_saved=False)
    assert done.completed is None


def processed(*, complete: bool, crop: Crop | None = None) -> Processed:
    """A box before a wall, with depth."""
    scene = layers([Layer(disparity=40, x=140, y=80, width=80, height=80, seed=2), Layer(disparity=14)])
    wanted = DepthWanted(complete=complete, crop=crop)
    core = StereoCore(MatchSettings(MatcherName.SGBM, 64), None, _GEOMETRY, wanted)
    ticks = count()
    return core.compute(scene.pair.left, scene.pair.right, lambda: next(ticks))


def test_clouds_and_measured_disparities_do_not_contain_completed_pixels() -> None:
    """With the option they have the bits that they have without it, and so have the counts; only `completed` is new."""
    plain, more = processed(complete=False), processed(complete=True)
    assert plain.completed is None
    assert more.completed is not None
    assert more.completed.mask.sum() > 500
    for one, other in ((plain.disparity, more.disparity), (plain.cloud, more.cloud)):
        assert one is not None
        assert other is not None
        assert one.tobytes() == other.tobytes()
    assert plain.cut == more.cut
    assert more.cloud is not None
    assert np.isnan(more.cloud[more.completed.mask]).all()


def test_only_the_crop_is_completed() -> None:
    """Outside of it nothing has a value."""
    crop = Crop(x_px=100, y_px=60, width_px=120, height_px=100)
    found = processed(complete=True, crop=crop).completed
    assert found is not None
    assert found.mask[60:160, 100:220].any()
    assert np.isfinite(found.disparity[60:160, 100:220]).sum() == np.isfinite(found.disparity).sum()
    assert found.mask.sum() == found.mask[60:160, 100:220].sum()
