"""When a stretch of film tells nothing, and when it is a rigid camera's: the limits, apart from the bundle that gives the numbers."""

import numpy as np
import pytest

from phone_host.doctor.camera_check.look import RIGID, WARPED, Reading, judged
from phone_host.doctor.camera_check.rigid import Compared
from phone_host.model.capture import Unseen

FRAMES, POINTS = 20, 100
SEEN = np.ones((FRAMES, POINTS), np.bool_)


def reading(excess: float, *, trust: float = 1.0, off_plane_px: float = 5.0, along: float = 0.1) -> Reading:
    """Judge a stretch whose warps explain so much more than noise does."""
    counted = FRAMES * POINTS
    compared = Compared(
        rigid=excess**2 * 2 * counted + 10,
        warped=10.0,
        common=np.array([0, 0, 0, 0, 0.5]),
        readout_sigma=0.1,
        trust=np.full((FRAMES, POINTS), trust),
        noise_px=0.1,
        parallax_px=10.0,
        off_plane_px=off_plane_px,
    )
    return judged(compared, SEEN, 30.0, along, along)


@pytest.mark.parametrize(
    ("options", "unseen"),
    [
        ({"excess": WARPED * 1.1}, None),
        ({"excess": RIGID * 0.5}, None),
        ({"excess": (RIGID + WARPED) / 2}, Unseen.VAGUE),
        ({"excess": RIGID * 0.5, "along": 0.001}, Unseen.STILL),
        ({"excess": 5.0, "off_plane_px": 0.3}, Unseen.FLAT),
        ({"excess": 5.0, "off_plane_px": 0.4}, None),
        ({"excess": 5.0, "trust": 0.1}, Unseen.LIVELY),
    ],
)
def test_what_a_stretch_tells(options: dict[str, float], unseen: Unseen | None) -> None:
    """Warped and rigid films tell; between the limits, without motion, before a plane and among walkers nothing is told."""
    read = reading(**options)
    assert read.unseen is unseen
    assert read.readout_ms == pytest.approx(15.0)
    if unseen is None:
        assert read.is_warped == (options["excess"] > WARPED)
