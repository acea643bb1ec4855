"""A run's page: what did not happen has no row, and what the terminal says stands there too."""

import html
from dataclasses import replace

import numpy as np
import pytest

from common.camera.base import CameraHealth, CameraState
from common.camera.image_numbers import ImageNumbers
from phone_host.diagnostics.image_numbers import ImageEvidence, pairing_words
from phone_host.model import Side
from phone_host.report.run_page import camera_table, run_page
from phone_host.report.summary import summary
from phone_host.sync.stills import PairedBy, WhyOrder
from tests.support.html import Page
from tests.support.run_snapshots import MS, run
from tests.support.stereo_pages import processed


def test_what_did_not_happen_has_no_row() -> None:
    """A camera without troubles has no row of zeros on the page; one of which nothing at all is known has no card."""
    assert camera_table(CameraHealth(CameraState.RUNNING)).rows == ()
    health = CameraHealth(CameraState.RUNNING, stalls=2, period_ns=50 * MS)
    assert camera_table(health).rows == (("measured rate", "20.00 frames/s"), ("stalled", "2"))
    page = run_page(run(5), None, Side.LEFT, ())
    assert "This machine's camera" not in page
    assert "not used" not in page


def test_a_runs_page_shows_the_last_pair_and_leads_to_the_saved_ones() -> None:
    """The page shows which pair it is, its density and its depth under the pointer, and has a link to each saved cloud; many are cut short in words."""
    saved = [f"pair-{number:06d}/cloud.ply" for number in range(0, 500, 10)]
    page = Page(run_page(run(31), processed(), Side.RIGHT, (), saved))
    assert not page.open
    share = 100 * np.isfinite(processed().cloud[..., 2]).mean()  # type: ignore[index]
    for words in ("number 30 of this run", f"{share:.0f} % of the pixels have a depth", "15 % farther than 4 m"):
        assert words in page.words
    assert "left: the host's camera, rectified" in page.words
    links = [one["href"] for one in page.every("a")]
    assert links[:2] == ["pair-000000/cloud.ply", "pair-000010/cloud.ply"]
    assert "and 10 more" in page.words
    assert {"report.json", "delays.jsonl"} <= set(links)
    assert len([one for one in page.every("canvas") if "tabindex" in one]) == 1


@pytest.mark.parametrize("why", [None, *WhyOrder])
def test_page_and_terminal_say_alike_what_paired_the_stills(why: WhyOrder | None) -> None:
    """The line that says that images are paired in their order, and why, is on the page too."""
    images = ImageNumbers(count=30, first=0, last=29)
    by = PairedBy.NUMBER if why is None else PairedBy.ORDER
    evidence = ImageEvidence(paired_by=by, why_order=why, board=images, own=images, pairs=30)
    seen = replace(run(30), replayed=evidence, timeless=True, period_ns=0)
    words = pairing_words(evidence)
    assert words in summary(seen).splitlines()
    assert words.removeprefix("s") in html.unescape(run_page(seen, None, Side.LEFT, ()))
