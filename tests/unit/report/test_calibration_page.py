"""The page of `calibrate`: what it says and shows of a series, and that nothing in it comes from elsewhere."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phone_host.calibration.solve.series_snapshot import series_views
from phone_host.model import Verdict
from phone_host.model.calibration_series import CalibrationSeries
from phone_host.report.calibration_page import calibration_page, verdict_words
from tests.support.calibration_series import REJECTED, calibration, rectified, series, taken, turned
from tests.support.html import Page


def _page(shown: CalibrationSeries) -> Page:
    """Reads the page, whose elements are all closed and whose pictures are all inside it."""
    page = Page(calibration_page(shown))
    assert page.open == []
    outside = [
        value
        for _, attributes in page.elements
        for name, value in attributes.items()
        if name in {"src", "href"}
        and value
        and not value.startswith(("data:image/jpeg;base64,", "rig.yaml", "report.json"))
    ]
    assert outside == []
    return page


def test_a_page_shows_every_part_of_a_series() -> None:
    """Verdict with its remedy first, then figures with limits, coverage, rectified pair, views, rejected ones, field, order, space, cameras, files."""
    page = _page(series())
    words = page.words
    titles = (
        "Usable: take pairs with the board in the corners of both images.",
        "How good it is",
        "What the views cover",
        "Rectified pair",
        "What is left in each view",
        "Not used: 2 pairs",
        "What is left over the image",
        "Over the order of the views",
        "The rig in space",
        "The cameras",
        "Files",
    )
    places = [words.index(title) for title in titles]
    assert places == sorted(places)
    assert "8 of 10 pairs used; board of 9x6 corners; images left 640x480 px, right 1280x720 px" in words
    for said in (
        "0.25 px",
        "depth error at 1 m",
        "12.3 m (infinity ±",
        "board not found left: the board is not seen whole",
        "no partner",
        "2 more views",
    ):
        assert said in words
    policy = next(each["content"] for each in page.every("meta") if each.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert "script-src" not in policy


def test_figures_of_the_page_are_those_of_the_calibration() -> None:
    """The 95th percentile of rows, the baseline and the focal length of each camera, beside what is good."""
    found = calibration()
    page = _page(series())
    p95 = float(np.percentile(found.vertical_px, 95))
    baseline_mm = float(np.linalg.norm(found.rig.t_right_left_m)) * 1e3
    assert f"{p95:.3f} px" in page.words
    assert f"{baseline_mm:.2f} ± " in page.words
    assert f"fx{found.rig.left.matrix[0, 0]:.0f}"[:5] in page.words
    assert "squares held out" in page.words
    assert "(taken)" in page.words


@pytest.mark.parametrize(
    ("verdict", "changes", "said"),
    [
        (Verdict.GOOD, {"remedy": ""}, "Good: scan with it."),
        (
            Verdict.GOOD,
            {"remedy": "", "cause": "blurred", "cause_words": "the board is blurred"},
            "Good: scan with it. But mind: the board is blurred.",
        ),
        (Verdict.USABLE, {"remedy": "a +- b", "cause": "rig not stiff"}, "Usable, rig not stiff: a ± b."),
        (Verdict.REJECT, {"remedy": "r", "problem": "p"}, "Rejected: p: r."),
        (Verdict.REJECT, {"remedy": "r"}, "Rejected: r."),
    ],
)
def test_the_verdict_is_one_sentence_with_one_remedy_unless_it_is_good(
    verdict: Verdict, changes: dict[str, str], said: str
) -> None:
    """What is good needs none; a cause is named."""
    assert verdict_words(replace(series(), verdict=verdict, **changes)) == said  # type: ignore[arg-type]


def test_names_from_outside_stay_text() -> None:
    """A pair, a reason, a remedy and a file that look like elements."""
    evil = "<script>alert(1)</script>"
    whole = series()
    views = tuple(replace(view, name=evil, detail=evil if view.reason else "") for view in whole.views)
    assert whole.turns is not None
    assert whole.rectified is not None
    shown = replace(
        whole,
        remedy=evil,
        board=evil,
        views=views,
        turns=replace(whole.turns, names=(evil,) * 8),
        rectified=replace(whole.rectified, name=evil),
    )
    page = _page(shown)
    assert page.every("script") == []
    assert evil in page.words


def test_views_that_gave_no_rig_are_shown_with_what_was_found() -> None:
    """Coverage and pictures of the boards that were found, and no figures."""
    found = taken()
    shown = CalibrationSeries(
        verdict=Verdict.REJECT,
        problem="only 2 of at least 3 pairs can be used",
        remedy="take 15",
        board="b",
        sizes_px=found.views.sizes_px,
        views=series_views(found, None, REJECTED),
    )
    page = _page(shown)
    assert "Rejected: only 2 of at least 3 pairs can be used: take 15." in page.words
    assert "What the views cover" in page.words
    assert "no rig came of the views" in page.words
    assert "How good it is" not in page.words
    assert "4 more views" not in page.words
    assert "3 more views" in page.words


def test_a_series_without_any_board_has_only_its_reasons() -> None:
    """No coverage, no pictures of used views."""
    whole = series()
    shown = replace(whole, found=None, rectified=None, turns=None, views=tuple(v for v in whole.views if v.reason))
    page = _page(shown)
    assert "What the views cover" not in page.words
    assert "Not used: 2 pairs" in page.words
    assert "Over the order" not in page.words


def test_what_is_not_known_of_a_rig_is_left_out() -> None:
    """A rig whose lenses' uncertainty nobody stated has a baseline, but neither a sigma of it nor one of depth; no figure reads nan."""
    shown = series()
    assert shown.found is not None
    rig = replace(shown.found.rig, covariance=np.full((30, 30), np.nan), zero_sigma_px=math.nan)
    depths = tuple((depth_m, math.nan) for depth_m, _ in shown.found.depths)
    unknown = replace(shown.found, rig=rig, baseline_sigma_m=math.nan, depths=depths)
    words = _page(replace(shown, found=unknown)).words
    assert f"{np.linalg.norm(rig.t_right_left_m) * 1e3:.2f} mm" in words
    assert "nan" not in words.lower().split()
    assert "± nan" not in words
    assert "nan%" not in words


def test_a_rig_that_cannot_be_rectified_has_no_rows() -> None:
    """No vertical error, no depth, no far limit; boards and cameras are still drawn."""
    whole = series()
    assert whole.found is not None
    nothing = replace(
        whole.found,
        rectification=None,
        vertical_px=np.full(1, np.nan),
        depths=(),
        far_m=float("nan"),
        square_mean_m=float("nan"),
        tried=((), ()),
    )
    views = tuple(replace(view, vertical_px=np.empty(0), as_seen_px=np.empty(0)) for view in whole.views)
    page = _page(replace(whole, found=nothing, views=views, rectified=None, turns=None, rig_file=""))
    for said in ("vertical error, 95 %", "depth error", "far limit", "squares held out", "Lenses that were tried"):
        assert said not in page.words
    assert "nan" not in page.words
    assert "The rig in space" in page.words
    assert "rig.yaml" not in page.words


def test_a_drift_that_was_taken_out_is_shown_as_it_was_seen() -> None:
    """The right corners of the first view were used as if its camera had stood turned by 0.05 degrees: as seen and as used, its rows differ by that angle."""
    used = taken(turned(0.05, 0))
    assert used.is_straightened
    assert not taken().is_straightened
    views = series_views(used, calibration(), ())
    assert calibration().rectification is not None
    moved = np.abs(views[0].vertical_px - views[0].as_seen_px)
    focal_px = calibration().rig.left.matrix[0, 0]  # of the coarser camera: that of the rectified images
    assert moved == pytest.approx(np.radians(0.05) * focal_px, rel=0.15)
    assert all(np.array_equal(view.vertical_px, view.as_seen_px) for view in views[1:])
    assert "taken out before the rig was computed" in _page(replace(series(), is_straightened=True)).words


def test_cameras_above_each_other_are_shown_above_each_other() -> None:
    """The lines are columns then."""
    page = _page(replace(series(), rectified=rectified(is_vertical=True)))
    assert "a matcher only looks along the column" in page.words


def test_a_page_with_many_views_stays_small() -> None:
    """Of a hundred views only thirty have pictures."""
    whole = series()
    used = [view for view in whole.views if view.is_used]
    many = tuple(replace(used[index % 8], name=f"v{index}") for index in range(100))
    page = _page(replace(whole, views=many))
    assert len([each for each in page.every("svg") if str(each.get("aria-label", "")).endswith(", left")]) == 30
    assert "24 more views" in page.words
    assert "v99" in page.words


def test_a_single_view_of_two_corners_has_neither_a_mean_nor_an_order() -> None:
    """Its pictures are shown without a list of more views; no tile has enough corners, and one view has no order."""
    whole = series()
    one = next(view for view in whole.views if view.is_used)
    sides = {
        name: replace(side, corners_px=side.corners_px[:2], residuals_px=side.residuals_px[:2])
        for name, side in (("left", one.left), ("right", one.right))
    }
    page = _page(replace(whole, views=(replace(one, left=sides["left"], right=sides["right"]),), turns=None))
    assert "What is left in each view" in page.words
    assert len(page.every("details")) == 2  # what the figures mean, and the figures of all views
    for absent in ("What is left over the image", "Over the order", "Not used"):
        assert absent not in page.words
