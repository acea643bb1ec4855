"""What moves rows: derivatives against exact projections, features taken back to the calibrated rig, fits and what they prove."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phone_host.calibration.drift.fit import PARAMETERS, Sighting, departure_of, fit_rows, proven, values_of
from phone_host.model import AS_CALIBRATED, Departure
from tests.support.drift_sightings import sight

TURNED = Departure(turn_rad=(0.0052, -0.004, 0.003), focal=1.006)


@pytest.mark.parametrize("is_stacked", [False, True])
@pytest.mark.parametrize("at", range(PARAMETERS))
def test_a_small_departure_moves_rows_as_the_model_says(at: int, *, is_stacked: bool) -> None:
    """Each parameter, projected exactly through both lenses, moves points across their lines by its column, to 2 % of it."""
    made = sight(is_stacked=is_stacked)
    values = np.zeros(PARAMETERS)
    values[at] = 1e-3
    seen = made.model.sighting(made.features(3, departure_of(values)), made.calibrated, made.calibrated)
    expected = seen.columns @ values
    assert np.abs(expected).max() > 0.1
    assert np.abs(seen.off_px - expected).max() < 0.02 * np.abs(expected).max() + 1e-3


def test_features_of_a_corrected_pair_say_the_same() -> None:
    """Images rectified with a correction, partly right, give the sighting that uncorrected ones give."""
    made = sight()
    plain = made.model.sighting(made.features(1, TURNED), made.calibrated, made.calibrated)
    half = Departure(turn_rad=(0.004, 0.001, 0.002), focal=1.003)
    again = made.model.sighting(made.features(1, TURNED, half), made.through(half), made.calibrated)
    assert np.abs(plain.off_px - again.off_px).max() < 1e-3
    assert np.abs(plain.slopes - again.slopes).max() < 1e-5


def test_what_could_not_be_followed_is_left_out_where_motion_is_known() -> None:
    """A feature without a speed counts among stills, where no feature has one; elsewhere it moves too fast to be followed."""
    made = sight()
    seen = made.features(1, AS_CALIBRATED)
    unknown = seen.velocity_px_s.copy()
    unknown[:20] = np.nan
    some = made.model.sighting(replace(seen, velocity_px_s=unknown), made.calibrated, made.calibrated)
    none = made.model.sighting(
        replace(seen, velocity_px_s=np.full_like(unknown, np.nan)), made.calibrated, made.calibrated
    )
    assert (len(some.off_px), len(none.off_px)) == (100, 120)


def test_a_fit_finds_the_departure_within_its_own_uncertainty() -> None:
    """With noise and wrong matches, every parameter lies within 4 sigmas, and the rows are known to less than 0.1 px."""
    made = sight()
    fit = fit_rows(made.model, [made.sighting(seed, TURNED) for seed in range(4)])
    sigma = np.sqrt(np.diag(fit.covariance))[:PARAMETERS]
    assert (np.abs(fit.values[:PARAMETERS] - values_of(TURNED)) < 4 * sigma + 2e-5).all()
    assert fit.rows_sigma_px(made.model.everywhere()) < 0.1
    assert 0.85 < fit.share < 1
    assert proven(fit, 4.0) == pytest.approx(values_of(TURNED), abs=6e-4)


def test_more_of_the_same_scene_does_not_make_the_rows_known_better() -> None:
    """What a lens model leaves is the same in every pair: a hundred sightings know hardly more than ten."""
    made = sight()
    few, many = (fit_rows(made.model, [made.sighting(s, AS_CALIBRATED) for s in range(n)]) for n in (10, 100))
    everywhere = made.model.everywhere()
    assert many.rows_sigma_px(everywhere) > 0.9 * few.rows_sigma_px(everywhere)


def test_only_what_is_proven_is_said() -> None:
    """A turn of 0.01 degrees is not proven, beside one of 0.3 degrees that is; nothing is proven of a steady rig."""
    made = sight()
    departure = Departure(turn_rad=(math.radians(0.3), math.radians(0.01), 0.0))
    found = proven(fit_rows(made.model, [made.sighting(5, departure)]), 4.0)
    assert found[0] == pytest.approx(math.radians(0.3), abs=math.radians(0.01))
    assert not found[1:].any()
    assert departure_of(proven(fit_rows(made.model, [made.sighting(6, AS_CALIBRATED)]), 4.0)) == AS_CALIBRATED


def test_late_images_are_no_turn() -> None:
    """Half of the image moves while the left image is 20 ms late: the lateness is found, and nothing of a turn is proven."""
    made = sight()
    seen = [made.sighting(seed, AS_CALIBRATED, speed_px_s=150.0, late_s=0.02) for seed in range(6)]
    fit = fit_rows(made.model, seen)
    assert fit.values[PARAMETERS] == pytest.approx(0.02, abs=0.002)
    assert fit.speed_px_s == pytest.approx(150.0)
    assert not proven(fit, 4.0).any()
    known = [made.sighting(seed, AS_CALIBRATED, speed_px_s=150.0, late_s=0.02, stated_s=0.02) for seed in range(6)]
    assert fit_rows(made.model, known).values[PARAMETERS] == pytest.approx(0.0, abs=0.002)


def test_a_fit_to_nothing_knows_nothing() -> None:
    """Without any feature the rows of the image stay unknown by many pixels."""
    made = sight()
    fit = fit_rows(made.model, [Sighting(np.zeros((0, 2)), np.zeros((0, 4)), np.zeros(0), np.zeros(0))])
    assert (fit.features, fit.share, fit.cells) == (0, 0.0, 0)
    assert fit.rows_sigma_px(made.model.everywhere()) > 10
