"""Depth, calibration and link at their edges: features and cells that are too few, images alike everywhere, locks that a board keeps."""

import math

import numpy as np
import pytest

from common.camera_identity import Lock
from common.ledger import StageTimes
from common.protocol.message import Lane, LockState, SetLocks
from common.protocol.session import MS
from phone_host.calibration.solve.bundle import BundleResult, free_flags
from phone_host.calibration.solve.bundle_problem import GLOBALS, BundleState
from phone_host.calibration.solve.next_view import next_view
from phone_host.geometry.schur import Flags
from phone_host.model import Crop, CutCounts, Image, Processed, RectifiedPair, Search, StereoGeometry
from phone_host.stereo.evidence_features import Matches
from phone_host.stereo.evidence_search import beyond_search, measure_fit
from phone_host.stereo.match_tandem import MOST_PIXELS, untold
from phone_host.stereo.plane_fit import fit_plane, plane_at
from phone_host.stereo.plane_quality import NoTruth, measure_plane
from phone_host.stereo.point_match import PointMatch, Unmatched, match_point
from phone_host.stereo.rectifier import Rectifier
from tests.support.planes import noise, plane
from tests.support.rigs import unlike_rig
from tests.support.talk import NAMES, Talk

_GEOMETRY = StereoGeometry(focal_px=400.0, baseline_m=0.1, cx_px=79.5, cy_px=59.5)


def test_features_beyond_the_search_that_stand_alone_tell_nothing() -> None:
    """Twenty features beyond a search of 16 px, all beside each other, but 60 px apart in disparity in an image of 1000 px: chance."""
    left_px = np.full((20, 2), 500.0)
    alone = 100.0 + 60.0 * np.arange(20, dtype=np.float64)
    share, enough = beyond_search(left_px, alone, 16, (1000, 800))
    assert math.isnan(share)
    assert enough == 0
    # The same disparities twice: each is confirmed by another one.
    share, enough = beyond_search(np.vstack([left_px, left_px]), np.tile(alone, 2), 16, (1000, 800))
    assert share == 1.0
    assert enough > 1000


def test_a_crop_without_any_disparity_leaves_all_features() -> None:
    """Where a crop shows no disparity, it is not known where depth was wanted: all features count, and all need 50 px of 16."""
    rng = np.random.default_rng(3)
    left_px = np.column_stack([rng.uniform(60, 300, 80), rng.uniform(5, 230, 80)])
    matches = Matches(left_px, left_px - np.array([50.0, 0.0]), np.zeros(80, np.float32))
    nothing = np.full((240, 320), np.nan, np.float32)
    grey = np.full((240, 320), 90, np.uint8)
    cropped = Processed(
        RectifiedPair(grey, grey),
        nothing,
        None,
        StageTimes(decode=0, interpolate=0, rectify=0, match=0, reproject=0, write=0),
        cut=CutCounts(unmatched=1000, outside=240 * 320 - 1000),
        search=Search(scale=1.0, disparities=16),
    )
    fit = measure_fit(matches, cropped, nothing)
    assert fit.beyond_share == 1.0
    assert fit.enough_disparities == 64  # the next step of 16 above 1.05 * 50 px
    assert math.isnan(fit.enough_from_m)


def test_a_large_map_without_any_value_has_nothing_to_drop() -> None:
    """Above the size that is looked at as it is, an empty map still has no untold area."""
    height, width = 400, MOST_PIXELS // 400 + 2
    empty = np.full((height, width), np.nan, np.float32)
    image = noise(width, height)
    assert untold(image, image, empty, np.zeros((height, width), np.uint8)) is None


def test_values_spread_over_many_cells_say_nothing_of_bending() -> None:
    """Sixty-four values, one in each of 8 by 8 places: a plane is fitted through them, and a bend of cells is not told."""
    disparity = np.full((120, 160), np.nan, np.float32)
    counts = np.zeros((120, 160), np.bool_)
    counts[4::15, 5::20] = True
    disparity[counts] = 40.0
    found = measure_plane(
        disparity, _GEOMETRY, counts, area=Crop(x_px=0, y_px=0, width_px=160, height_px=120), truth=NoTruth(79.5, 59.5)
    )
    assert found.pixels == 64
    assert found.bend_px == 0.0
    assert found.distance_m == pytest.approx(1.0)


def test_a_fit_whose_bounds_never_settle_ends_near_the_plane() -> None:
    """Errors of a Cauchy distribution have values at every bound of wrong matches: these values come and go without end. The median of 400 is off by 0.08 px."""
    rng = np.random.default_rng(656)
    x_px, y_px = rng.uniform(0, 300, 400), rng.uniform(0, 200, 400)
    disparity_px = 40 + rng.standard_cauchy(400)
    fit = fit_plane(x_px, y_px, disparity_px)
    assert float(plane_at(fit.plane, np.array(150.0), np.array(100.0))) == pytest.approx(40, abs=0.3)
    assert not fit.on_plane[np.abs(disparity_px - 40) > 20].any()
    assert fit.on_plane[np.abs(disparity_px - 40) < 1].all()


def test_a_small_surface_with_a_spoiled_block_is_unlike() -> None:
    """8 by 8 px without the surface's edge are just enough; with 3 by 3 of them inverted in the right image they are not."""
    seen = plane(slope_x=0.0, slope_y=0.0)
    disparity = np.full((160, 320), np.nan, np.float32)
    disparity[74:86, 144:156] = 20.0
    assert isinstance(match_point(seen.pair, disparity, (150.0, 80.0)), PointMatch)
    spoiled = seen.pair.right.copy()
    spoiled[76:79, 126:129] = 255 - spoiled[76:79, 126:129]
    found = match_point(RectifiedPair(seen.pair.left, spoiled), disparity, (150.0, 80.0))
    assert found is Unmatched.UNLIKE


def _striped(wave_levels: float, shift_px: float, rng: np.random.Generator) -> Image:
    """Strong stripes along the rows, a weak wave across them moved to the left, noise of 2 levels."""
    y, x = np.mgrid[:160, :320].astype(np.float64)
    level = 128 + 60 * np.sin(2 * np.pi * y / 12) + wave_levels * np.sin(2 * np.pi * (x + shift_px) / 8)
    return np.asarray(np.clip(np.rint(level + rng.normal(0, 2, y.shape)), 0, 255), np.uint8)


def test_stripes_along_the_rows_are_alike_and_tell_no_disparity() -> None:
    """Both windows look alike wherever they lie on their rows: a wave of half a level under noise of 2 is too little, one of 20 is plenty."""
    rng = np.random.default_rng(0)
    searched = np.full((160, 320), 20.0, np.float32)
    weak = RectifiedPair(_striped(0.5, 0.0, rng), _striped(0.5, 20.0, rng))
    assert match_point(weak, searched, (150.0, 80.0)) is Unmatched.UNSURE
    strong = match_point(RectifiedPair(_striped(20, 0.0, rng), _striped(20, 20.0, rng)), searched, (150.0, 80.0))
    assert isinstance(strong, PointMatch)
    assert strong.disparity_px == pytest.approx(20.0, abs=0.1)


def _result(covariance: float, baseline_m: float = 0.1) -> tuple[BundleResult, Flags]:
    """A fitted rig with this variance of each shared parameter."""
    rig = unlike_rig()
    state = BundleState(
        left=rig.left,
        right=rig.right,
        rotation=np.zeros(3),
        translation_m=np.array([-baseline_m, 0.0, 0.0]),
        poses=np.array([[0.0, 0, 0, -0.1, -0.1, 1.0]]),
    )
    errors = np.full((1, 4, 2), 0.1)
    free = free_flags(np.ones(12, np.bool_), np.ones(12, np.bool_))
    result = BundleResult(
        state=state, left_errors_px=errors, right_errors_px=errors, covariance=np.eye(GLOBALS) * covariance
    )
    return result, free


_CORNERS = np.array([[0.0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0.2, 0.2, 0]])


def test_a_rig_of_unknown_uncertainty_has_no_next_view() -> None:
    """Which view would teach most is not known where nothing is known of the uncertainty."""
    result, free = _result(math.nan)
    assert next_view(result, free, _CORNERS, Rectifier(unlike_rig()).rectification) is None


def test_cameras_that_never_see_the_board_together_have_no_next_view() -> None:
    """Two cameras 100 m apart: wherever the board stands, one of them sees none of it."""
    result, free = _result(1e-6, baseline_m=100.0)
    assert next_view(result, free, _CORNERS, Rectifier(unlike_rig()).rectification) is None


def _asked(talk: Talk) -> list[SetLocks]:
    """Return what the host asks now of the board's camera."""
    talk.said.clear()
    talk.reception.tick(talk.now_ns)
    return [outgoing.message for outgoing in talk.said if isinstance(outgoing.message, SetLocks)]


def test_a_host_asks_for_locks_until_the_board_says_how_it_is_held() -> None:
    """The controls are asked for at once and again after a second, until the board's answer comes; then its state is known."""
    talk = Talk()
    talk.run()
    before = talk.reception.locks
    wanted = ((Lock.WHITE_BALANCE, 4600),)
    talk.reception.hold(wanted)
    assert [_asked(talk), _asked(talk)] == [[SetLocks(wanted)], []]
    talk.now_ns += 1000 * MS
    assert _asked(talk) == [SetLocks(wanted)]
    state = LockState(session="first", asked=wanted, held=wanted)
    talk.reception.receive(NAMES[Lane.CONTROL], state, talk.now_ns)
    assert (before, talk.reception.locks) == (None, state)
    talk.now_ns += 1000 * MS
    assert _asked(talk) == []


def test_another_version_on_a_link_that_is_up_is_noise() -> None:
    """A board that talks to this host is of its version: a message of another one is counted as garbage and refuses nothing."""
    talk = Talk()
    talk.run()
    talk.reception.refuse_version(NAMES[Lane.CONTROL], 4, talk.now_ns)
    assert talk.reception.account.garbage == 1
    assert talk.reception.refused(talk.now_ns) is None
    assert talk.reception.connected
