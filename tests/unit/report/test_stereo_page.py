"""The page of a stereo result: whole, self-contained, and every figure on it follows from the depth it was given."""

import base64
import hashlib
import json
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from common.words import distance_text
from phone_host.model import CutCounts, Epipolar, Search
from phone_host.report import depth_data
from phone_host.report.match_words import cut_rows, cut_sentence
from phone_host.report.page_frame import document
from phone_host.report.page_links import FileLink, NextCommand
from phone_host.report.page_script import Script, script
from phone_host.report.report_page import Headline, Picture
from phone_host.report.stereo_page import (
    PairEntry,
    StereoIndexData,
    stereo_index,
    stereo_page,
    thumbnail,
)
from tests.support.html import Page
from tests.support.stereo_pages import GEOMETRY, LIMITS, page_data, processed

EVIL = '</script><img src=x onerror="boom()">&\''


def test_the_page_is_whole_and_loads_nothing() -> None:
    """Every element is closed; pictures are data URIs; links lead to given files only; there is one script, and no address in the page."""
    text = stereo_page(page_data(files=(FileLink("cloud.ply", "points"),), back="../index.html"))
    parsed = Page(text)
    assert not parsed.open
    without_script = text.replace(
        parsed.script, ""
    )  # which names a namespace of XML, a repository, and functions that are never called
    plain = re.sub(r"[A-Za-z0-9+/=]{200,}", "", without_script)  # without base64
    assert not re.search(r"https?:|//[a-z]|url\(|@import|\bimport\(|fetch\(|XMLHttp", plain)
    assert {str(one["src"]).split(",")[0] for one in parsed.every("img")} == {
        "data:image/jpeg;base64",
        "data:image/png;base64",
    }
    assert {one["href"] for one in parsed.every("a")} == {"cloud.ply", "../index.html"}
    assert len(parsed.every("script")) == 1
    assert not any(key.startswith("on") for _, attributes in parsed.elements for key in attributes)


def test_the_policy_allows_this_script_and_no_other() -> None:
    """The policy names the hash of the very text between the script's tags; a page without depth allows no script at all."""
    parsed = Page(stereo_page(page_data()))
    (policy,) = (one["content"] for one in parsed.every("meta") if one.get("http-equiv") == "Content-Security-Policy")
    digest = base64.b64encode(hashlib.sha256(parsed.script.encode()).digest()).decode()
    assert parsed.script == script(Script.DEPTH)
    assert f"script-src 'sha256-{digest}'" in str(policy)
    assert str(policy).startswith("default-src 'none'; img-src data:;")
    plain = document("t", "<p>x</p>")
    assert "script" not in plain
    assert "default-src 'none'" in plain


def test_hostile_names_stay_text() -> None:
    """Markup in any text is shown as it is: it makes no element, leaves no attribute and cannot end the script."""
    data = page_data(
        title=EVIL,
        subtitle=EVIL,
        sentence=EVIL,
        captions=(EVIL, EVIL),
        settings=((EVIL, EVIL),),
        times=((EVIL, 1000),),
        files=(FileLink(EVIL, EVIL),),
        commands=(NextCommand(EVIL, EVIL),),
        notes=(EVIL,),
        back=EVIL,
    )
    parsed = Page(stereo_page(data))
    assert not parsed.open
    assert len(parsed.every("img")) == 4
    assert len(parsed.every("script")) == 1
    # title twice, subtitle, sentence, two captions, two of the setting, the stage, two of the file, two of the command, the note
    assert parsed.words.count(EVIL) == 14
    entry = PairEntry(folder=EVIL, name=EVIL, thumbnail=None, density=0.5, verdict=Headline.GOOD, sentence=EVIL)
    index = Page(
        stereo_index(StereoIndexData(title=EVIL, subtitle=EVIL, verdict=Headline.BAD, sentence=EVIL, pairs=(entry,)))
    )
    assert not index.every("img")
    assert index.words.count(EVIL) == 6


def test_the_grid_holds_the_depth_of_every_pixel() -> None:
    """From the grid's cell, the page computes the pixel's depth to a thousandth; cells without match and cells that were cut are told apart."""
    pair = processed()
    assert pair.disparity is not None
    small = depth_data.grid(pair.disparity, pair.cloud)
    assert (small.step_px, small.cells.shape) == (1, (120, 160))
    assert small.cells[60, 5] == depth_data.NONE
    assert small.cells[5, 100] == depth_data.CUT
    for (row, column), depth_m in {(60, 80): 1.0, (100, 100): 2.0}.items():
        share = (int(small.cells[row, column]) - depth_data.FIRST) / 65533
        disparity = small.low_px + share * (small.high_px - small.low_px)
        assert GEOMETRY.focal_px * GEOMETRY.baseline_m / disparity == pytest.approx(depth_m, abs=1e-3)


def test_large_images_make_no_heavy_page() -> None:
    """A pair of 12 megapixels makes a page below 6 MB: the grid is reduced by a whole number, pictures are at most 1280 px wide."""
    pair = processed(4000, 3000)
    text = stereo_page(page_data(processed=pair))
    assert len(text) < 6_000_000
    (view,) = (json.loads(str(one["data-view"])) for one in Page(text).every("div") if one.get("class") == "depthview")
    assert (view["width"], view["height"]) == (4000, 3000)
    assert (view["step"], view["columns"], view["rows"]) == (7, 572, 429)
    for one in Page(text).every("img"):
        image = cv2.imdecode(np.frombuffer(base64.b64decode(str(one["src"]).split(",")[1]), np.uint8), cv2.IMREAD_COLOR)
        assert image is not None
        assert image.shape[:2] == (960, 1280)


def test_the_cloud_has_a_point_for_every_cell_with_depth() -> None:
    """Of a small cloud no point is left out; of a large one every k-th pixel's is there, and the page says how many of how many."""
    pair = processed()
    assert pair.disparity is not None
    assert pair.cloud is not None
    total = int(np.isfinite(pair.cloud[..., 2]).sum())
    assert depth_data.grid(pair.disparity, pair.cloud).points == total
    assert f"{total:,}".replace(",", "\u202f") + " points, metres" in Page(stereo_page(page_data())).words
    large = processed(1600, 1200)
    assert large.disparity is not None
    assert large.cloud is not None
    small = depth_data.grid(large.disparity, large.cloud)
    assert small.points == int(np.isfinite(large.cloud[::3, ::3, 2]).sum())


def test_the_figures_follow_from_the_depth() -> None:
    """Density, median depth, its uncertainty z^2 / (f b) dd and the cut shares are those of the scene."""
    words = Page(stereo_page(page_data())).words.replace("\u202f", "")
    kept = int(np.isfinite(processed().cloud[..., 2]).sum())  # type: ignore[index]
    assert f"density{100 * kept / 19200:.0f} %" in words
    assert f"points{kept}" in words
    assert "± 50 mm" in words
    assert "15 % farther than 4 m" in words  # a sixth of the rows, without the eighth that has no match: 7/48
    assert "12 % found no match" in words  # an eighth


def test_the_page_says_from_where_on_depth_was_searched() -> None:
    """Depth nearer than f b / (N - 1) cannot be found: 50 px m over 63 px with the page's geometry."""
    found = replace(processed(), search=Search(disparities=64))
    from_m = GEOMETRY.focal_px * GEOMETRY.baseline_m / (63 + GEOMETRY.doffs_px)
    assert f"Searched from {distance_text(from_m)}: nothing nearer" in stereo_page(page_data(processed=found))


def test_without_any_value_no_picture_has_a_scale() -> None:
    """A black picture beside "0.5 px" or "1.2 m" would promise values; with values, disparity and depth have one each."""
    full = processed()
    assert full.disparity is not None
    assert full.cloud is not None
    empty = replace(full, disparity=np.full_like(full.disparity, np.nan), cloud=np.full_like(full.cloud, np.nan))
    assert stereo_page(page_data(processed=full)).count('<div class="bar"') == 2
    assert '<div class="bar"' not in stereo_page(page_data(processed=empty))


def test_cut_pixels_are_told_in_words() -> None:
    """Shares are of all pixels; zeros are left out; a small share is never called 0 %."""
    cut = CutCounts(kept=50_000, unmatched=20_000, at_zero=30, too_far=12_000, too_near=3_000, outside=15_000 - 30)
    assert cut_sentence(cut, LIMITS) == (
        "< 0.1 % are too far to measure, 12 % farther than 4 m, 3.0 % nearer than 500 mm, 15 % outside the crop"
    )
    assert cut_rows(CutCounts(kept=5), None) == (("have a point", 5),)
    assert not cut_sentence(CutCounts(kept=5, unmatched=5), LIMITS)


def test_without_geometry_there_are_pixels_and_no_metres() -> None:
    """A rectified pair of unknown rig shows its disparity, and says why there is no metre; there is no cloud."""
    pair = replace(processed(), cloud=None, geometry=None, limits=None, cut=None)
    parsed = Page(stereo_page(page_data(processed=pair)))
    assert "No metres" in parsed.words
    assert not parsed.every("canvas")
    assert len(parsed.every("img")) == 3


def test_nothing_measured_makes_a_page_all_the_same() -> None:
    """A pair without a single match makes a whole page with density 0 and no cloud."""
    pair = processed()
    empty = replace(
        pair,
        disparity=np.full((120, 160), np.nan, np.float32),
        cloud=np.full((120, 160, 3), np.nan, np.float32),
        cut=CutCounts(unmatched=19200),
    )
    parsed = Page(stereo_page(page_data(processed=empty, verdict=Headline.BAD)))
    assert not parsed.open
    assert "density0 %" in parsed.words
    assert not parsed.every("canvas")
    assert "nan" not in parsed.words


def test_stacked_cameras_have_column_lines() -> None:
    """Where epipolar lines run along columns, the pictures stand above each other, and the lines and the match run along columns."""
    flat = processed()
    pair = replace(flat.pair, epipolar=Epipolar.DOWN)
    text = stereo_page(page_data(processed=replace(flat, pair=pair)))
    assert "column lines" in Page(text).words
    assert "views stack" in text
    assert "views rows" not in text


def test_the_page_of_several_pairs_leads_to_each() -> None:
    """Each pair has its picture, its words and a link to its own page; a pair without result has no link; the heading counts them."""
    entries = (
        PairEntry(
            folder="pair-000000",
            name="a.png and b.png",
            thumbnail=thumbnail(processed()),
            density=0.5,
            verdict=Headline.GOOD,
            sentence="Right.",
        ),
        PairEntry(
            folder="", name="c.png", thumbnail=None, density=float("nan"), verdict=Headline.BAD, sentence="Not read."
        ),
    )
    data = StereoIndexData(title="Two", subtitle="", verdict=Headline.WARNING, sentence="One failed.", pairs=entries)
    parsed = Page(stereo_index(data))
    assert [one["href"] for one in parsed.every("a")] == ["pair-000000/index.html"]
    assert len(parsed.every("img")) == 1
    for words in ("2 pairs", "a.png and b.png", "density 50\u00a0%", "Not read."):
        assert words in parsed.words
    assert "1 pair" in Page(stereo_index(replace(data, pairs=entries[:1]))).words
    assert isinstance(thumbnail(processed(1600, 1200)), Picture)


def test_the_geometry_of_the_scene_is_what_its_comments_say() -> None:
    """The wall at 2 m has 20 px, the box at 1 m has 40 px."""
    disparity = processed().disparity
    assert disparity is not None
    assert disparity[100, 100] == pytest.approx(GEOMETRY.focal_px * GEOMETRY.baseline_m / 2.0)
    assert disparity[60, 80] == pytest.approx(40.0)
