"""What `scan` tells: verdicts, stretches that went wrong, figures, lines, report.json, the page."""

import base64
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from common.diagnostic import Diagnostic, Severity
from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.report.model_view import MOST_TRIANGLES, ShownModel, model_view
from phone_host.report.page_links import NextCommand
from phone_host.report.report_page import Headline
from phone_host.report.scan_json import ScanResult, scan_json
from phone_host.report.scan_lines import area_text, scan_lines
from phone_host.report.scan_page import scan_page
from phone_host.report.scan_report import ModelFigures, ScanReport, scan_verdict, stretches
from phone_host.report.stereo_report import FailedPair
from phone_host.scan.mesh import Mesh, MeshSize
from phone_host.scan.scanned import ScannedPair
from phone_host.scan.surface_error import ErrorScope
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.volume_settings import VolumeSettings
from tests.docs.schemas import json_schema
from tests.support.html import Page
from tests.unit.report.test_json_result import problems

T, W, L = Tracking.TRACKING, Tracking.WEAK, Tracking.LOST
MODEL = ModelFigures(
    points=300,
    triangles=500,
    size=MeshSize(0.0321, 1.5, (0.2, 0.3, 0.1)),
    noise_m=0.0012,
    noise_p95_m=0.004,
    error_scope=ErrorScope.DRIFT,
)
WITHOUT_DRIFT = replace(MODEL, error_scope=ErrorScope.NOISE)
BROKEN = FailedPair(
    name="9", left="l/9.png", right="r/9.png", failure=Diagnostic("l/9.png is cut off", "copy it again")
)
MESH = Mesh(
    np.array([[0, 0, 1], [0.5, 0, 1], [0, 0.25, 2]], np.float32),
    np.array([[1, 2, 3], [4, 5, 6], [7, 8, 9]], np.uint8),
    np.array([[0, 1, 2]], np.int32),
)


def pair(number: int, state: Tracking = T, weakness: Weakness = Weakness.NONE) -> ScannedPair:
    """A pair; each is 100 mm beside the last one and 1 mm off the model."""
    return ScannedPair(
        name=str(number),
        stamp_s=float(number),
        world_camera=SE3(np.eye(3), np.array([0.1 * number, 0, 0])),
        state=state,
        weakness=weakness,
        density=0.8,
        corners=200,
        overlap=0.9 if number else math.nan,
        off_m=0.001 if number else math.nan,
    )


def report(*pairs: ScannedPair | FailedPair) -> ScanReport:
    """A report of these pairs."""
    return ScanReport(
        pairs=pairs,
        model=MODEL,
        settings=VolumeSettings(voxel_m=0.004, far_m=1.5),
        geometry=StereoGeometry(focal_px=500, baseline_m=0.1, cx_px=20, cy_px=12),
        rectified_px=(640, 480),
        matcher="tandem",
    )


GOOD = report(*(pair(number) for number in range(5)))
LOST = report(*(pair(number, L, Weakness.TOO_FAST) if number in {2, 3} else pair(number) for number in range(5)))


@pytest.mark.parametrize(
    ("told", "verdict", "words"),
    [
        (GOOD, Headline.GOOD, "All 5 pairs are in the model. Expected surface error: ±1.2 mm (drift included)."),
        (replace(GOOD, model=WITHOUT_DRIFT), Headline.WARNING,
         "All 5 pairs are in the model. Expected surface error: ±1.2 mm (drift not included)."),
        (LOST, Headline.WARNING, "3 of 5 pairs are in the model. Expected surface error"),
        (report(pair(0), *(pair(n, W, Weakness.FLAT) for n in range(1, 5))), Headline.WARNING, "All 5 pairs"),
        (report(pair(0), *(pair(n, L) for n in range(1, 5))), Headline.BAD, "Only 1 of 5 pairs are in the model."),
        (replace(GOOD, model=ModelFigures()), Headline.BAD, "There is no surface: 5 of 5 pairs could be aligned."),
        (replace(GOOD, model=replace(MODEL, unseen_share=1.0, noise_m=math.nan)), Headline.BAD,
         "No part of the surface was in view: 5 of 5 pairs could be aligned."),
        (replace(GOOD, model=replace(MODEL, noise_m=math.nan)), Headline.GOOD, "All 5 pairs are in the model."),
        (replace(GOOD, model=replace(MODEL, unseen_share=0.25)), Headline.GOOD,
         "All 5 pairs are in the model. Expected surface error: ±1.2 mm (drift included). 25 % was never in view and is filled in."),
        (replace(GOOD, remarks=(Diagnostic("left and right are exchanged", "x", severity=Severity.FAIL),)), Headline.BAD,
         "The model cannot be right: left and right are exchanged."),
        (replace(GOOD, interrupted_of=9), Headline.WARNING, "Interrupted after 5 of 9 pairs. All 5 pairs"),
        (replace(GOOD, model=ModelFigures(), interrupted_of=9), Headline.BAD, "Interrupted after 5 of 9 pairs. There"),
    ],
)  # fmt: skip
def test_a_scan_is_judged(told: ScanReport, verdict: Headline, words: str) -> None:
    """By what is in the model, how surely, and by what makes it wrong."""
    found, sentence = scan_verdict(told)
    assert found is verdict
    assert sentence.startswith(words)
    assert told.is_sound is (verdict is not Headline.BAD)


@pytest.mark.parametrize(
    ("scope", "headline", "is_included"), [(ErrorScope.DRIFT, "good", True), (ErrorScope.NOISE, "warning", False)]
)
def test_an_error_without_drift_is_a_warning_everywhere(scope: ErrorScope, headline: str, *, is_included: bool) -> None:
    """Terminal, page and report.json say what the stated error covers; where drift is not, the page is amber and no tick stands on it."""
    told = replace(GOOD, model=replace(MODEL, error_scope=scope))
    assert f"({scope.value})" in scan_lines(told, "cup")[0]
    values = scan_json(told)
    assert (values["verdict"], values["model"]["drift_included"]) == (headline, is_included)
    page = Page(scan_page(told, ShownModel(MESH, np.array([0.001, 0.002, np.nan], np.float32), 0.004)))
    assert page.words.count(f"({scope.value})") == 2
    assert ("\u2713" in page.words) is is_included
    assert any("warning" in str(attributes.get("class")) for _, attributes in page.elements) is not is_included


def test_a_pair_that_failed_makes_a_scan_unsound() -> None:
    """As with `stereo`: the exit code is 4, although the model may be good."""
    told = report(*GOOD.pairs, BROKEN)
    assert scan_verdict(told)[0] is Headline.WARNING or not told.is_sound
    assert not told.is_sound
    assert told.failed == (BROKEN,)


def test_what_went_wrong_is_told_by_stretches() -> None:
    """Neighbours with one reason are one sentence; each says what helps."""
    pairs = [pair(0), pair(1, L, Weakness.TOO_FAST), pair(2, L, Weakness.TOO_FAST), pair(3, W, Weakness.FLAT)]
    lost, weak = (stretch.sentence for stretch in stretches(pairs))
    assert lost == "pairs 1 to 2 are not in the model: moved too fast: go back to where it was, and move more slowly"
    assert weak.startswith("pair 3 is in the model, but uncertain: only a flat surface is in view")


def test_figures_come_from_the_pairs_in_the_model() -> None:
    """The path skips what is lost; without a second pair there is no distance from the model."""
    assert GOOD.path_m == pytest.approx(0.4)
    assert LOST.path_m == pytest.approx(0.4)
    assert GOOD.off_m == 0.001
    assert math.isnan(report(pair(0)).off_m)
    assert report(BROKEN).path_m == 0


def test_the_lines_lead_with_the_verdict_and_end_with_the_files() -> None:
    """Figures with units between; of many stretches the first eight, and a count of the others."""
    lines = scan_lines(LOST, "cup")
    assert lines[0].startswith("3 of 5 pairs")
    assert "voxels of 4 mm, depths to 1.5 m" in lines[1]
    assert lines[2] == "500 triangles, 321 cm², 200 mm x 300 mm x 100 mm; the camera went 400 mm"
    assert lines[3] == "a pair's depths lie 1 mm off the model (mean; median of the pairs)"
    assert lines[4].startswith("note: pairs 2 to 3 are not in the model")
    assert lines[-1] == "written to cup: model.ply, trajectory.txt, report.json, index.html"
    many = scan_lines(report(*(pair(n, L if n % 2 else T, Weakness.FLAT) for n in range(20)), BROKEN), "cup")
    assert "note: 12 further stretches: see report.json" in many
    assert "warning: 9 failed: l/9.png is cut off: copy it again" in many
    one = scan_lines(report(pair(0)), "cup")
    assert not any("off the model" in line for line in one)
    assert len(scan_lines(replace(GOOD, settings=None), "cup")) == 2
    assert area_text(1.234) == "1.23 m²"


def test_the_report_is_json_without_times() -> None:
    """Lengths in metres, null for what was not measured; a failed pair with its reason."""
    told = json.loads(json.dumps(scan_json(report(pair(0), pair(1), BROKEN))))
    assert (told["command"], told["verdict"], told["in_model"]) == ("scan", "warning", 2)
    assert told["model"]["area_m2"] == 0.0321
    assert told["pairs"][0]["overlap"] is None
    assert told["pairs"][1]["place_m"] == [0.1, 0, 0]
    assert told["pairs"][2] == {"name": "9", "problem": "l/9.png is cut off", "remedy": "copy it again"}
    none = json.loads(json.dumps(scan_json(replace(GOOD, settings=None, geometry=None, interrupted_of=7))))
    assert (none["focal_px"], none["model"]["voxel_m"], none["interrupted_of"]) == (None, None, 7)
    assert "_ms" not in json.dumps(told)
    schema = json_schema(ScanResult)
    assert [problems(values, schema, schema["$defs"]) for values in (told, none)] == [[], []]


def test_the_page_shows_the_model_and_what_went_wrong() -> None:
    """One verdict, the figures, a model to turn, links to the files; without a surface no model and no script for it."""
    shown = ShownModel(MESH, np.array([0.001, 0.002, np.nan], np.float32), 0.004)
    text = scan_page(replace(report(*LOST.pairs, BROKEN), remarks=(Diagnostic("dim", "give light"),)), shown)
    page = Page(text)
    assert page.open == []
    assert "3 of 6 pairs are in the model" in page.words
    assert "moved too fast" in page.words
    assert "9 failed: l/9.png is cut off" in page.words
    assert "dim: give light" in page.words
    assert [one for one in page.elements if one[1].get("class") == "clouds modelview"]
    assert {attributes["href"] for tag, attributes in page.elements if tag == "a"} >= {"model.ply", "trajectory.txt"}
    assert "distance of pairs from the model" in page.words
    on_mat = replace(GOOD, pairs=tuple(replace(each, off_m=math.nan) for each in GOOD.scanned))
    assert "pairs off the model" not in Page(scan_page(on_mat, shown)).words
    empty = replace(report(pair(0)), model=ModelFigures())
    bare = Page(scan_page(empty, ShownModel(Mesh.empty(), np.zeros(0, np.float32), 1.0)))
    assert "modelview" not in str(bare.elements)
    assert bare.script == ""
    words = (NextCommand("again", "phone-host scan"),)
    commands = Page(scan_page(empty, ShownModel(Mesh.empty(), np.zeros(0, np.float32), 1.0), words))
    assert commands.script
    none = Page(scan_page(report(), ShownModel(Mesh.empty(), np.zeros(0, np.float32), 1.0)))
    assert "no pairs" in none.words


def test_the_model_in_the_page_is_the_surface() -> None:
    """Points to a 65535th of the longest side, triangles, colours, and how exactly each point is known."""
    text = model_view(ShownModel(MESH, np.array([0.001, 0.002, np.nan], np.float32), 0.004), "model.ply")
    page = Page(text)
    [attributes] = [found for _, found in page.elements if found.get("class") == "clouds modelview"]
    view = json.loads(attributes["data-mesh"] or "")
    points = np.frombuffer(_bytes(attributes["data-points"]), "<u2").reshape(-1, 3)
    assert points * view["step"] + view["low"] == pytest.approx(MESH.points_m, abs=2e-5)
    assert np.frombuffer(_bytes(attributes["data-triangles"]), "<u4").tolist() == [0, 1, 2]
    assert list(_bytes(attributes["data-colours"])) == [1, 2, 3, 4, 5, 6, 7, 8, 9]
    assert list(_bytes(attributes["data-noise"])) == [0, 255, 255]
    assert "3 triangles" not in page.words
    assert "known: bright" in text
    once = model_view(ShownModel(MESH, np.full(3, np.nan, np.float32), 0.004), "model.ply")
    assert "known: bright" not in once  # each point was seen once: how exactly it is known, nobody knows
    assert model_view(ShownModel(Mesh.empty(), np.zeros(0, np.float32), 1.0), "model.ply") == ""


def test_a_large_model_is_shown_coarser() -> None:
    """No more triangles than a page can hold, and it says so."""
    side = 320
    rows, columns = np.mgrid[0:side, 0:side].astype(np.float32)
    points = np.column_stack([columns.ravel(), rows.ravel(), np.zeros(side**2)]).astype(np.float32) * np.float32(0.01)
    corner = np.arange(side**2).reshape(side, side)[:-1, :-1].ravel()
    upper, lower = (
        np.column_stack([corner, corner + 1, corner + side]),
        np.column_stack([corner + 1, corner + side + 1, corner + side]),
    )
    mesh = Mesh(points, np.zeros((side**2, 3), np.uint8), np.concatenate([upper, lower]).astype(np.int32))
    text = model_view(ShownModel(mesh, np.full(side**2, 0.001, np.float32), 0.01), "model.ply")
    shown, total = (int(re.sub(r"\D", "", number)) for number in re.findall(r"([\d\u202f]{5,})", Page(text).words)[:2])
    assert 10_000 < shown <= MOST_TRIANGLES
    assert total == len(mesh.triangles)


def _bytes(text: str | None) -> bytes:
    return base64.b64decode(text or "")
