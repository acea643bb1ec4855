"""How bodies block each other's light: seen from far above, from below, and from beside."""

import numpy as np
import pytest

from phone_host.scene.scene_model import Body, Box, Light, Plane, Sphere
from phone_host.scene.shade import lamp_reaching, may_darken, shadow_balls, sky_blocked

UP = (0.0, 1.0, 0.0)
LIGHT = Light(towards=UP)
TABLE = Body("table", Plane(), (0.0, 0.0, 0.0))


def points(*places: tuple[float, float, float]) -> np.ndarray:
    """(3, N) float32."""
    return np.array(places, dtype=np.float32).T


@pytest.mark.parametrize(("shape", "radius_m"), [(Sphere(0.3), 0.3), (Box((0.6, 0.6, 0.6)), 0.3)])
def test_a_solid_body_hides_its_share_of_the_sky(shape: Sphere | Box, radius_m: float) -> None:
    """From half a metre straight above, a ball of radius r, or a cube of that size, hides (2 r)^2 of the sky minus what nobody sees; from behind a surface it hides nothing."""
    body = Body("it", shape, (0.0, 0.5, 0.0))
    normals = points(UP, (0.0, -1.0, 0.0))
    hidden = sky_blocked(body, points((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), normals)
    assert (2 * radius_m) ** 2 - 0.05 <= hidden[0] <= (2 * radius_m) ** 2 + 1e-6
    assert hidden[1] == 0.0


def test_a_plane_hides_no_sky_and_bodies_far_beside_leave_each_other_alone() -> None:
    """A plane does not count as a body that hides; two balls ten metres apart, neither in the other's light, do not darken each other."""
    assert not sky_blocked(TABLE, points((0.0, 1.0, 0.0)), points(UP)).any()
    ball, lower = Body("ball", Sphere(0.1), (0.0, 2.0, 0.0)), Body("lower", Sphere(0.1), (0.0, -8.0, 0.0))
    aside = Body("aside", Sphere(0.1), (10.0, 2.0, 0.0))
    assert not may_darken(LIGHT, ball, aside)
    assert may_darken(LIGHT, ball, lower)
    assert not may_darken(LIGHT, lower, ball)
    assert may_darken(LIGHT, ball, Body("touching", Sphere(0.1), (0.2, 2.0, 0.0)))


def test_a_plane_lets_the_lamp_through_and_hides_no_sky() -> None:
    """A poster casts no shadow on what is behind it, and what is half a metre beside it keeps its light; a ball there hides sky from it."""
    poster = Body("poster", Plane(0.6, 0.8), (0.0, 1.0, 0.0))
    through = lamp_reaching(poster, points((0.0, 0.5, 0.0), (0.1, 0.0, 0.2)), np.array(UP, dtype=np.float32))
    assert through.tolist() == [1.0, 1.0]
    assert poster.bounding_radius_m == pytest.approx(0.5)  # half of the diagonal: 3, 4, 5
    above = Body("above", Sphere(0.1), (0.8, 1.3, 0.0))
    assert not may_darken(LIGHT, poster, above)
    assert may_darken(LIGHT, Body("ball", Sphere(0.5), (0.0, 1.0, 0.0)), above)


def test_a_body_high_above_a_plane_takes_no_sky_from_it() -> None:
    """Near the plane a ball dims a disc around its foot and casts a shadow; five metres up it hides 0.04 % of the sky, which is ignored."""
    lamp, below = Light(towards=(0.0, 0.0, 1.0)), Light(towards=(0.0, 0.0, -1.0))
    near, high = (Body("ball", Sphere(0.1), (1.0, 2.0, height)) for height in (0.2, 5.0))
    assert [len(shadow_balls(light, body, TABLE)) for body in (near, high) for light in (lamp, below)] == [2, 1, 1, 0]
    [(foot, radius_m)] = shadow_balls(below, near, TABLE)
    assert foot == pytest.approx((1.0, 2.0, 0.0))
    rim = points((1.0 + 0.98 * radius_m, 2.0, 0.0), (1.0 + 1.02 * radius_m, 2.0, 0.0))
    hidden = sky_blocked(near, rim, points((0.0, 0.0, 1.0), (0.0, 0.0, 1.0)))
    assert hidden[0] > hidden[1] == 0.0
