"""Figures of depth on a plane: planes are made by geometry with known noise, and every figure must come out as it went in."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import Crop, Disparity, DisparityPlane, PlaneQuality, Seen, StereoGeometry
from phone_host.stereo.plane_fit import fit_plane, normal_over_distance, plane_in_disparity
from phone_host.stereo.plane_quality import KnownPlane, NoTruth, StatedDistance, Truth, measure_plane, middle_of

GEOMETRY = StereoGeometry(focal_px=525.0, baseline_m=0.1, cx_px=310.0, cy_px=250.0, doffs_px=4.0)
WIDTH, HEIGHT = 640, 480
WHOLE = Crop(x_px=0, y_px=0, width_px=WIDTH, height_px=HEIGHT)


def wall(
    normal: tuple[float, float, float], distance_m: float, noise_px: float = 0.0, bend_m: float = 0.0
) -> NDArray[np.float64]:
    """The disparity of the plane n . P = h, and of a bulge over it, by casting every pixel's ray.

    `bend_m`: the plane comes nearer by this much in the middle, and goes back by as much 200 px from there.
    """
    n = np.array(normal) / np.linalg.norm(normal)
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float64)
    away = np.hypot(x - WIDTH / 2, y - HEIGHT / 2) / 200
    h = distance_m + bend_m * (away**2 - 1)
    rays = np.stack([(x - GEOMETRY.cx_px) / GEOMETRY.focal_px, (y - GEOMETRY.cy_px) / GEOMETRY.focal_px, x * 0 + 1], -1)
    nearness = rays @ n / h  # 1 / z
    exact = GEOMETRY.focal_px * GEOMETRY.baseline_m * nearness - GEOMETRY.doffs_px
    return np.asarray(exact + np.random.default_rng(7).normal(0, 1, exact.shape) * noise_px)


ANYWHERE = NoTruth(320, 240)


def measured(
    disparity: NDArray[np.float64], truth: Truth = ANYWHERE, unit_px: float = 1.0, roi: Crop | None = None
) -> PlaneQuality:
    """The figures of a disparity map, by default in its middle."""
    counts = np.zeros(disparity.shape, np.bool_)
    one = roi or middle_of(WIDTH, HEIGHT)
    counts[one.y_px : one.y_px + one.height_px, one.x_px : one.x_px + one.width_px] = True
    image: Disparity = disparity.astype(np.float32)
    return measure_plane(image, GEOMETRY, counts, area=WHOLE, truth=truth, unit_px=unit_px)


TILTED = (0.25, -0.15, 1.0)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), TILTED])
@pytest.mark.parametrize("noise_px", [0.03, 0.1, 0.6])
def test_noise_is_found_as_it_was_put_in(normal: tuple[float, float, float], noise_px: float) -> None:
    """Sub-pixel RMS is the noise's sigma within 2 %; the depth's RMS is z^2 sigma / (f b), z from the plane, within 3 %; the fill rate is 1."""
    found = measured(wall(normal, 1.2, noise_px))
    assert found.seen is Seen.PLANE
    assert found.subpixel_rms_px == pytest.approx(noise_px, rel=0.02)
    exact = wall(normal, 1.2)[144:336, 192:448]
    z = GEOMETRY.focal_px * GEOMETRY.baseline_m / (exact + GEOMETRY.doffs_px)
    expected_m = np.sqrt(np.mean((z**2 * noise_px / (GEOMETRY.focal_px * GEOMETRY.baseline_m)) ** 2))
    assert found.rms_m == pytest.approx(expected_m, rel=0.03)
    assert found.rms_share == found.rms_m / found.distance_m
    assert (found.fill, found.pixels) == (1.0, 256 * 192)
    assert found.bend_px < 0.1 * noise_px


def test_distance_and_tilt_of_a_plane_without_noise_are_exact() -> None:
    """Depth on the ray of the pixel asked for, the shortest distance and the angle of a tilted plane come from its equation."""
    found = measured(wall(TILTED, 1.2), NoTruth(400, 100))
    n = np.array(TILTED) / np.linalg.norm(TILTED)
    ray = np.array([(400 - GEOMETRY.cx_px) / GEOMETRY.focal_px, (100 - GEOMETRY.cy_px) / GEOMETRY.focal_px, 1.0])
    assert found.distance_m == pytest.approx(1.2 / (n @ ray), rel=1e-6)
    assert found.perpendicular_m == pytest.approx(1.2, rel=1e-6)
    assert found.tilt_deg == pytest.approx(math.degrees(math.acos(n[2])), abs=1e-3)
    assert math.isnan(found.bias_m)
    assert math.isnan(found.bias_share)


def test_bias_against_a_stated_distance_is_exact() -> None:
    """A plane that crosses the left camera's own axis at 1.25 m, and was stated at 1.2 m, is 50 mm too far: the bias, in every tile too."""
    axis = np.array([0.05, -0.02, 1.0])
    axis /= np.linalg.norm(axis)
    n = np.array(TILTED) / np.linalg.norm(TILTED)
    seen = wall(TILTED, 1.25 * float(n @ axis))
    stated = StatedDistance(distance_m=1.2, axis=(float(axis[0]), float(axis[1]), float(axis[2])))
    found = measured(seen, stated)
    assert found.distance_m == pytest.approx(1.25, rel=1e-6)
    assert found.bias_m == pytest.approx(0.05, abs=1e-6)
    assert found.bias_share == pytest.approx(0.05 / 1.2, abs=1e-6)
    assert found.tiles.offset_share == pytest.approx(np.full((9, 12), 0.05 / 1.2), abs=1e-5)


def test_bias_against_a_known_plane_is_exact() -> None:
    """A wall at 1.3 m is 30 mm nearer than a plane at 1.33 m that is known, at its middle and in every tile along the rays."""
    true = plane_in_disparity(np.array([0.0, 0.0, 1 / 1.33]), GEOMETRY)
    found = measured(wall((0, 0, 1), 1.3, noise_px=0.05), KnownPlane(plane=true, x_px=300, y_px=200))
    assert found.true_m == pytest.approx(1.33)
    assert found.bias_m == pytest.approx(-0.03, abs=1e-4)
    assert np.nanmax(np.abs(found.tiles.offset_m + 0.03)) < 1e-3


def test_wrong_matches_and_holes_are_counted_and_do_not_move_the_figures() -> None:
    """With 15 % wrong matches all over the range and 30 % holes, the figures are those of the others, and both shares come out within 1 point.

    Wrong matches that chance puts within 1 px of the plane cannot be told from noise: 2 of 170, uniform there, of variance 1/3.
    """
    rng = np.random.default_rng(3)
    seen = wall(TILTED, 1.2, noise_px=0.1)
    wrong = rng.random(seen.shape) < 0.15
    seen[wrong] = rng.uniform(0, 170, np.count_nonzero(wrong))
    seen[rng.random(seen.shape) < 0.3] = np.nan
    found = measured(seen)
    assert found.seen is Seen.PLANE
    assert found.fill == pytest.approx(0.7, abs=0.01)
    assert found.off_plane == pytest.approx(0.15, abs=0.01)
    near = 0.15 * 2 / 170
    expected_px = math.sqrt((0.85 * 0.1**2 + near / 3) / (0.85 + near))
    assert found.subpixel_rms_px == pytest.approx(expected_px, rel=0.02)
    assert found.perpendicular_m == pytest.approx(1.2, rel=1e-4)
    assert np.nanmedian(found.tiles.fill) == pytest.approx(0.7, abs=0.02)


def test_tiles_tell_where_the_image_is_bad() -> None:
    """One corner lies 0.5 px off, one is noisier, one is empty and one shows another surface: only these tiles say so."""
    seen = wall((0, 0, 1), 1.2, noise_px=0.05)
    rows, columns = HEIGHT // 9, WIDTH // 12
    seen[:rows, :columns] += 0.5
    seen[:rows, -columns:] += np.random.default_rng(1).normal(0, 0.2, (rows, columns))
    seen[-rows:, :columns] = np.nan
    seen[-rows:, -columns:] += 20
    tiles = measured(seen).tiles
    assert tiles.offset_px[0, 0] == pytest.approx(0.5, abs=0.02)
    assert tiles.offset_m[0, 0] < 0  # a greater disparity is nearer
    assert tiles.scatter_px[0, -1] == pytest.approx(math.hypot(0.05, 0.2), rel=0.1)
    assert tiles.fill[-1, 0] < 0.05
    assert np.isnan(tiles.offset_px[-1, -1])
    inner = np.s_[1:-1, 1:-1]
    assert np.abs(tiles.offset_px[inner]).max() < 0.01
    assert tiles.scatter_px[inner] == pytest.approx(np.full((7, 10), 0.05), rel=0.1)


def test_what_is_no_plane_is_called_so() -> None:
    """A bulge is bent, a room's corner lies off every plane, noise of 1.5 px is scattered, a floor up to its horizon is endless, few values are too few."""
    assert measured(wall((0, 0, 1), 1.0, noise_px=0.1, bend_m=0.08)).seen is Seen.BENT
    room = np.minimum(wall((0.7, 0, 0.7), 1.0), wall((-0.7, 0, 0.7), 1.0))
    assert measured(room + 0).seen is not Seen.PLANE
    behind = wall((0, 0, 1), 1.0)
    behind[:, :300] += 12
    assert measured(behind).seen is Seen.OFF_PLANE
    assert measured(wall((0, 0, 1), 1.0, noise_px=1.5)).seen is Seen.SCATTERED
    floor = wall((0, 1, 0), 0.3, noise_px=0.3)  # its horizon is at row 250; above that it is behind the camera
    assert measured(np.where(floor > -GEOMETRY.doffs_px, floor, np.nan)).seen is Seen.ENDLESS
    few = wall((0, 0, 1), 1.0)
    few[:, 200:] = np.nan
    found = measured(few)
    assert found.seen is Seen.TOO_FEW
    assert 0 < found.fill < 0.1
    assert math.isnan(found.rms_m)


def test_the_error_of_a_smaller_match_is_no_bend() -> None:
    """Images matched at half the size have twice the error: the limits grow with the size of a matched pixel."""
    seen = wall((0, 0, 1), 1.0, noise_px=1.4)
    assert measured(seen).seen is Seen.SCATTERED
    assert measured(seen, unit_px=2.0).seen is Seen.PLANE


def test_a_region_may_have_any_place() -> None:
    """The figures belong to the pixels that count: a wall's half that is 3 px off is another plane."""
    seen = wall((0, 0, 1), 1.2)
    seen[:, 320:] += 3
    left = measured(seen, roi=Crop(x_px=0, y_px=0, width_px=320, height_px=480))
    right = measured(seen, roi=Crop(x_px=320, y_px=10, width_px=300, height_px=400))
    assert left.seen is right.seen is Seen.PLANE
    assert right.plane.at_origin_px - left.plane.at_origin_px == pytest.approx(3, abs=1e-3)
    assert right.roi == Crop(x_px=320, y_px=10, width_px=300, height_px=400)


def test_space_and_disparity_hold_the_same_plane() -> None:
    """A plane turned into disparity and back is itself."""
    over = np.array([0.2, -0.1, 0.7])
    assert normal_over_distance(plane_in_disparity(over, GEOMETRY), GEOMETRY) == pytest.approx(over)


def test_values_on_one_line_do_not_stop_the_fit() -> None:
    """Values of a single row leave the slope across it open; the plane still goes through them."""
    x = np.arange(100.0)
    fit = fit_plane(x, np.full(100, 5.0), 3 + 0.1 * x)
    assert isinstance(fit.plane, DisparityPlane)
    assert fit.on_plane.all()
    assert fit.plane.slope_x * x + fit.plane.slope_y * 5 + fit.plane.at_origin_px == pytest.approx(3 + 0.1 * x)
