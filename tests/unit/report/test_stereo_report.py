"""What `stereo` tells about pairs: limits, cuts, images without partner."""

from dataclasses import replace
from pathlib import Path
from textwrap import wrap

import pytest

from common.diagnostic import Diagnostic, Severity
from phone_host.diagnostics.headline import Answer, Grade
from phone_host.diagnostics.image_rules import ImageFigures
from phone_host.diagnostics.run_rules import no_depth
from phone_host.model import CutCounts, DepthLimits, Search, StereoGeometry
from phone_host.output.axes import Axes
from phone_host.output.pair_files import WrittenPair
from phone_host.report.report_page import Headline
from phone_host.report.stereo_json import pair_json
from phone_host.report.stereo_lines import cut_lines, pair_lines, set_lines
from phone_host.report.stereo_report import (
    FailedPair,
    PairReport,
    SetReport,
    set_verdict,
)
from phone_host.report.stereo_trust import PairTrust
from phone_host.run.stereo_remarks import files_remarks
from phone_host.stereo.view_files import ViewFiles

# 1000 pixels; f b = 50 px m, so an error of 0.25 px makes a depth of 40 m wrong by 0.25 * 40 / 50 = 20 %.
_GOOD = PairTrust(ImageFigures(), (), Answer(Grade.GOOD, "Depth looks right."))
BAD = PairTrust(ImageFigures(), (no_depth(None, None),), Answer(Grade.BAD, "Depth is wrong."))

PAIR = PairReport(
    name="",
    left="l.png",
    right="r.png",
    left_px=(40, 25),
    right_px=(40, 25),
    rectified_px=(40, 25),
    matcher="sgbm",
    search=Search(scale=0.5, disparities=64),
    geometry=StereoGeometry(focal_px=500, baseline_m=0.1, cx_px=20, cy_px=12),
    limits=DepthLimits(near_m=0.0, far_m=40.0, disparity_error_px=0.25, from_rig=True),
    cut=CutCounts(kept=700, unmatched=150, at_zero=30, too_far=120),
    density=0.82,
    axes=Axes.CAMERA,
    written=WrittenPair(files=("cloud.ply",), points=700),
    stages_ms=(("total", 123.4),),
    trust=_GOOD,
)


def test_what_was_cut_is_told_in_percent_with_the_limit_and_its_reason() -> None:
    """120 of 1000 pixels are farther than 40 m, where 0.25 px are a fifth of the disparity."""
    [line] = cut_lines(PAIR)
    assert "12 % farther than 40 m, where depth is wrong by more than 20%" in line
    assert "3.0 % too far to measure" in line


def test_limits_that_the_user_gave_have_no_other_reason() -> None:
    """--near 300mm and --far 2m are named, and no error is."""
    limits = DepthLimits(near_m=0.3, far_m=2.0, disparity_error_px=0.25, from_rig=False)
    [line] = cut_lines(replace(PAIR, limits=limits, cut=CutCounts(kept=980, too_far=10, too_near=10)))
    assert line == "cut: 1.0 % farther than 2 m; 1.0 % nearer than 300 mm"


def test_a_pair_of_which_nothing_was_cut_says_where_its_cloud_ends() -> None:
    """The far limit is told all the same."""
    assert cut_lines(replace(PAIR, cut=CutCounts(kept=1000))) == ["points up to 40 m are kept"]


def test_lines_of_a_pair_hold_its_size_search_density_points_and_axes() -> None:
    """The first line says whether the depth is right, the next two have what a user needs to judge it."""
    answer, *lines = pair_lines(PAIR, "scan")
    assert answer == "Depth looks right."
    for words in ("40x25 px", "sgbm", "64 disparities", "matched at 50% of the size", "82.0%", "123 ms"):
        assert words in lines[0]
    for words in ("700 points", "70.0%", "x right, y down, z forward", "metres"):
        assert words in lines[1]
    assert lines[-1] == "written to scan: cloud.ply, report.json, index.html"


def test_the_object_of_a_pair_states_limits_cuts_unit_and_axes() -> None:
    """Programs read them without words."""
    told = pair_json(PAIR)
    assert told["limits"] == {"near_m": 0.0, "far_m": 40.0, "disparity_error_px": 0.25, "from_rig": True}
    assert (told["cut"]["too_far"], told["cut"]["kept"]) == (120, 700)
    assert (told["verdict"], told["headline"], told["trust"]["doubts"]) == ("good", "Depth looks right.", [])
    assert (told["unit"], told["scale"], told["disparities"], told["points"]) == ("metre", 0.5, 64, 700)
    flat = pair_json(replace(PAIR, geometry=None, limits=None, written=WrittenPair(files=())))
    assert (flat["unit"], flat["axes"], flat["limits"]) == (None, None, None)


def _alike(count: int, *problems: str) -> SetReport:
    """Pairs that each have one of the problems in turn; the files have no shared numbers."""
    return SetReport(
        pairs=tuple(
            replace(
                PAIR,
                name=f"pair-{number:06d}",
                left=f"photos/Piano{number}L.png",
                remarks=(Diagnostic(problems[number % len(problems)], "check the rig"),),
            )
            for number in range(count)
        ),
        by_number=False,
    )


def test_a_remark_that_several_pairs_share_is_told_once_with_their_number() -> None:
    """Twenty-four pairs do not repeat the same warning; one with other figures each names the first pair as an example."""
    lines = set_lines(_alike(24, "nothing nearer than 478 mm is found"), "scans")
    assert lines.count("warning: in 24 of 24 pairs: nothing nearer than 478 mm is found: check the rig") == 1
    assert sum("478 mm" in line for line in lines) == 1
    unlike = set_lines(_alike(4, "only 10% have depth", "only 8.5% have depth"), "scans")
    [told] = [line for line in unlike if line.startswith("warning")]
    assert told.startswith("warning: in 4 of 4 pairs, such as pair-000000 Piano0L.png: only 10% have depth")


def test_the_verdict_of_24_pairs_is_the_last_thing_on_a_narrow_terminal() -> None:
    """What is printed last stays on 30 rows of 50 columns: the verdict, its warnings and where the files are."""
    report = _alike(24, "nothing nearer than 478 mm is found")
    lines = set_lines(report, "scans")
    rows = [row for line in lines for row in (wrap(line, 50) or [""])]
    assert lines[-1] == set_verdict(report)[1]
    assert any("in 24 of 24 pairs" in row for row in rows[-29:])


def test_pairs_without_numbers_of_their_own_are_told_with_a_file() -> None:
    """pair-000002 alone says nothing to whoever named the file Piano2L.png; where names share numbers, the folder's name does."""
    report = _alike(3, "x")
    assert set_lines(report, "scans")[2].startswith("pair-000002 Piano2L.png  good, 70% have depth, 700 points")
    assert set_lines(replace(report, by_number=True), "scans")[2].startswith("pair-000002  good")


def test_what_the_headline_tells_is_no_warning_beside_it() -> None:
    """A doubt is told once, by the headline with its remedy; report.json lists it all the same."""
    remarks = (Diagnostic(BAD.concerns[0].message, BAD.concerns[0].remedy), Diagnostic("something else"))
    bad = replace(PAIR, trust=BAD, remarks=remarks)
    assert [line for line in pair_lines(bad, "scan") if line.startswith("warning")] == ["warning: something else"]
    assert len(pair_json(bad)["warnings"]) == 2


def test_depths_beyond_a_16_bit_picture_are_a_note_and_no_warning() -> None:
    """Far points are no fault of the result."""
    lines = pair_lines(replace(PAIR, written=WrittenPair(files=("depth.png",), points=700, not_in_depth_png=12)), "s")
    assert "note: 12 depths beyond 65.5 m (or below 1 mm) missing from depth.png" in lines
    assert not any(line.startswith("warning") for line in lines)


def test_the_nearest_distance_searched_is_told_on_the_terminal_and_to_programs() -> None:
    """N = 64, so up to 63 px: f b = 50 px m are 50 / 63 = 0.794 m; with doffs of 17 px, 50 / 80 = 0.625 m; px alone tell none."""
    assert "searched from 794 mm" in pair_lines(PAIR, "scan")[1]
    assert pair_json(PAIR)["searched_from_m"] == pytest.approx(50 / 63, abs=1e-4)
    assert PAIR.geometry is not None
    shifted = replace(PAIR, geometry=replace(PAIR.geometry, doffs_px=17))
    assert shifted.searched_from_m == pytest.approx(0.625)
    assert pair_json(replace(PAIR, geometry=None))["searched_from_m"] is None


def test_pixels_outside_the_crop_do_not_lower_the_share() -> None:
    """700 points of the 800 pixels inside the crop are 87.5 %; without metres the share is that of the disparities."""
    assert replace(PAIR, cut=CutCounts(kept=700, unmatched=100, outside=200)).share == pytest.approx(0.875)
    assert replace(PAIR, written=WrittenPair(files=())).share == 0.82


@pytest.mark.parametrize(
    ("report", "sound"),
    [
        (SetReport(pairs=(PAIR,), by_number=True), True),
        (SetReport(pairs=(PAIR,), by_number=True, remarks=(Diagnostic("2 left images have no partner"),)), True),
        (
            SetReport(
                pairs=(replace(PAIR, remarks=(Diagnostic("same image", severity=Severity.FAIL),)),), by_number=True
            ),
            False,
        ),
        (
            SetReport(
                pairs=(PAIR, FailedPair(name="p", left="l", right="r", failure=Diagnostic("bad", "mend"))),
                by_number=True,
            ),
            False,
        ),
        (SetReport(pairs=(replace(PAIR, written=WrittenPair(files=(), points=0)),), by_number=True), False),
        (SetReport(pairs=(replace(PAIR, density=0.0, written=WrittenPair(files=())),), by_number=True), False),
    ],
    ids=["good", "alone", "blocking", "failed", "all cut", "nothing matched"],
)
def test_a_result_is_sound_if_nothing_failed_nothing_blocks_and_there_is_depth(
    report: SetReport, *, sound: bool
) -> None:
    """Exactly these decide on exit code 4."""
    assert report.is_sound is sound


def _files(pairs: int, left_alone: list[str], right_alone: list[str], *, by_number: bool) -> ViewFiles:
    """Files of both sides: so many pairs, and these without a partner."""
    paired = tuple((str(n), Path(f"l{n}.png"), Path(f"r{n}.png")) for n in range(pairs))
    return ViewFiles(paired, tuple(map(Path, left_alone)), tuple(map(Path, right_alone)), by_number=by_number)


def test_images_without_partner_are_counted_and_named_and_pairing_by_order_is_told() -> None:
    """Nothing is left out silently; a long list is cut short."""
    [one] = files_remarks(_files(4, [], ["r9.png"], by_number=True))
    assert one.text == "1 right image has no partner: r9.png"
    many, order = files_remarks(_files(4, [f"{n}.png" for n in range(7)], [], by_number=False))
    assert many.message == "7 left images have no partner: 0.png, 1.png, 2.png, 3.png, 4.png, …"
    assert "order of their names though the counts differ" in order.message
    alike = ViewFiles((("a", Path("a/l.png"), Path("a/r.png")),), (Path("b/l.png"),), (), by_number=False, by_name=True)
    assert files_remarks(alike)[0].message == "1 left image has no partner: b/l.png"
    assert files_remarks(_files(1, [], [], by_number=False)) == ()
    assert files_remarks(_files(1, [], [], by_number=False), "sgbm") == (Diagnostic("sgbm", severity=Severity.NOTE),)


def test_the_verdict_of_several_pairs_counts_them() -> None:
    """All good is good, all bad is bad, anything else is told in numbers."""
    bad = replace(PAIR, trust=BAD)
    failed = FailedPair(name="p", left="l", right="r", failure=Diagnostic("bad", "mend"))
    assert set_verdict(SetReport(pairs=(PAIR, PAIR), by_number=True))[0] is Headline.GOOD
    assert set_verdict(SetReport(pairs=(bad, failed), by_number=True))[0] is Headline.BAD
    verdict, sentence = set_verdict(SetReport(pairs=(PAIR, failed, bad), by_number=True))
    assert verdict is Headline.WARNING
    assert sentence == "1 of 3 pairs looks right, 2 gave no depth or cannot be right."
