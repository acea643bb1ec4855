"""The mat: which one, where it lies, and a scan of what stands on it."""

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from common import now
from common.errors import DataError, SettingsError
from phone_host.api import UnseenSurface, save_scan
from phone_host.cli import main
from phone_host.geometry.se3 import SE3, vectors_of
from phone_host.geometry.unseen_surface import PINK_RGB
from phone_host.model import Image, Processed
from phone_host.output.axes import Axes
from phone_host.output.meshes.formats import read_mesh
from phone_host.output.meshes.printable import Flaw, Printer, problems
from phone_host.output.meshes.solid import Solid
from phone_host.output.rig_yaml import write_rig
from phone_host.report.scan_report import mat_figures
from phone_host.scan.blocks import Box
from phone_host.scan.mat import ABOVE_M, USUAL_MAT, MatCorners, mat_corners, parse_mat
from phone_host.scan.mat_pose import MatPose, MatSaid, MatScale, fit_mat
from phone_host.scan.mesh import size_of
from phone_host.scan.scan import Scan, scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair
from phone_host.scan.submap_bytes import submap_bytes, submap_of
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_rig
from tests.support.html import Page
from tests.support.mat_rigs import rig_of
from tests.support.mats import BALL_M, MAT, MatPainter, looking_at, of_right

RIG = rig_of("small")
SURE = MatScale()
STANDS_M = np.array([0.0, 0.0, 0.05])
AT_M = np.array([0.0, 0.0, 0.035])


def from_side(degrees: float) -> SE3:
    """Where the mat lies for a left camera that looks at it from a side."""
    return looking_at(math.radians(degrees), math.radians(40), 0.38, AT_M)


@cache
def painters() -> tuple[MatPainter, MatPainter]:
    return MatPainter(RIG.left, fine=2), MatPainter(RIG.right, fine=2)


def pictures(degrees: float, stretch: float = 1.0) -> tuple[Image, Image]:
    left, right = painters()
    camera_mat = from_side(degrees)
    return left.image(camera_mat, 1, stretch), right.image(of_right(RIG, camera_mat), 2, stretch)


def found_in(images: tuple[Image, Image], scale: MatScale) -> MatPose | None:
    rectifier = Rectifier(RIG)
    pair = rectifier.rectify(*images)
    corners = mat_corners(pair.left, pair.right, MAT)
    return fit_mat(MAT.points_m(), corners, rectifier.geometry, pair.epipolar, scale)


def true_pose(degrees: float) -> SE3:
    return SE3(Rectifier(RIG).rectification.R_left, np.zeros(3)) @ from_side(degrees)


def test_the_usual_mat_is_that_of_the_target_command() -> None:
    """Without a value, --mat means 10x8 squares of 25 mm; its middle is the origin, its first corner upper left."""
    mat = parse_mat(USUAL_MAT)
    assert mat.name == USUAL_MAT
    assert mat.size_m == pytest.approx((0.25, 0.2))
    assert mat.points_m()[0] == pytest.approx([-0.1, 0.075, 0])
    assert mat.points_m().mean(axis=0) == pytest.approx([0, 0, 0])
    assert parse_mat(" 8x6:28mm:20mm:6x6 ").name == "8x6:28mm:20mm:6x6"


@pytest.mark.parametrize("text", ["left", "10x8", "10x8:25mm", "10x8:25mm:24mm:5x5", "10x8:25:18:5x5", "2x2:25mm:18mm:5x5", "10x8:25mm:18mm:7x7", "90x90:25mm:18mm:5x5"])  # fmt: skip
def test_what_is_no_mat_is_refused_in_one_line_that_shows_how(text: str) -> None:
    """Each bad value names the option, and the remedy shows a good one."""
    with pytest.raises(SettingsError) as refused:
        parse_mat(text)
    assert "--mat" in str(refused.value)
    assert USUAL_MAT in refused.value.remedy


def test_the_pose_is_that_of_the_rendered_mat() -> None:
    """From corners in both images, the pose is exact to 0.2 mm where the object stands and 0.1 degrees, and says how exact it is."""
    for degrees in (0, 130, 250):
        found, truth = found_in(pictures(degrees), SURE), true_pose(degrees)
        assert found is not None
        off_m = float(np.linalg.norm(found.camera_mat.apply(STANDS_M) - truth.apply(STANDS_M)))
        assert off_m < 0.0002
        assert off_m < 5 * found.sigma_at(STANDS_M)
        assert np.linalg.norm(vectors_of(found.camera_mat.R.T @ truth.R)) < math.radians(0.1)
        assert min(found.seen) >= 20


def test_a_sheet_that_was_printed_too_small_is_measured_by_the_rig() -> None:
    """Printed at 96 %, the squares come out so long, and the pose is that of the sheet as it lies there."""
    found = found_in(pictures(40, stretch=0.96), MatScale(1.0, 0.05))
    assert found is not None
    assert found.scale.value == pytest.approx(0.96, abs=0.002)
    assert found.scale.sigma < 0.002
    assert np.linalg.norm(found.camera_mat.t_m - true_pose(40).t_m) < 0.0005


def test_one_image_is_enough_and_none_gives_no_pose() -> None:
    """With the left image covered, the right one tells the pose; with both covered there is none."""
    left, right = pictures(0)
    black = np.zeros_like(left)
    alone = found_in((black, right), SURE)
    assert alone is not None
    assert alone.seen[0] == 0
    assert np.linalg.norm(alone.camera_mat.apply(STANDS_M) - true_pose(0).apply(STANDS_M)) < 0.001
    assert found_in((black, np.zeros_like(right)), SURE) is None


@cache
def walked(degrees: float) -> Processed:
    core = StereoCore(
        MatchSettings(matcher=MatcherName.TANDEM, disparities=96),
        Rectifier(RIG),
        wanted=DepthWanted(search_from_m=0.28),
    )
    return core.compute(*pictures(degrees), now.monotonic_ns)


def scanned(degrees: list[float], wanted: ScanWanted) -> tuple[Scan, list[ScannedPair]]:
    scan = scan_for(wanted)
    return scan, [scan.take(str(at), float(at), walked(at)) for at in degrees]


WANTED = ScanWanted(voxel_m=0.002, mat=MAT)


def test_what_stands_on_the_mat_becomes_a_model_in_the_mats_axes() -> None:
    """Steps of 60 degrees are no matter; only the ball remains, closed down to the sheet, and the same bytes come again."""
    scan, pairs = scanned([0, 60, 120, 180, 240, 300], WANTED)
    assert {pair.state for pair in pairs} == {Tracking.TRACKING}
    model = scan.model()
    mesh, points = model.mesh, model.mesh.points_m.astype(float)[model.seen]
    off = np.abs(np.linalg.norm(points - [0, 0, BALL_M], axis=1) - BALL_M)
    assert len(mesh.triangles) > 1000
    assert points[:, 2].min() >= ABOVE_M
    assert size_of(mesh).border_m == 0
    assert mesh.points_m[:, 2].min() == pytest.approx(0, abs=1e-4)
    assert 0.2 < model.unseen_share < 0.4
    assert off[points[:, 2] > 0.02].mean() < 0.0015
    again = scanned([0, 60, 120, 180, 240, 300], replace(WANTED, threads=2))[0].model().mesh
    assert mesh.points_m.tobytes() == again.points_m.tobytes()


def test_the_python_api_saves_it_in_the_mats_axes(tmp_path: Path) -> None:
    """A scan begun with the mat says in its files on what the model stands; one of which nothing came is refused with the reason."""
    save_scan(tmp_path / "ball", scanned([0, 60, 180, 240], WANTED)[0], matcher="tandem")
    report = json.loads((tmp_path / "ball" / "report.json").read_text())
    assert (report["in_model"], report["model"]["axes"], report["matcher"]) == (4, Axes.MAT.text, "tandem")
    unseen = scan_for(WANTED)
    unseen.take("0", 0.0, without_marks(0))
    with pytest.raises(DataError, match="is not seen in any of 1 pair"):
        save_scan(tmp_path / "none", unseen)
    assert not (tmp_path / "none").exists()


def coloured(path: Path) -> Solid:
    """A model file."""
    return read_mesh(path.read_bytes(), path.name).solid


def pink_share(solid: Solid) -> float:
    """Which share of a surface's area is pink; a triangle counts by its corners."""
    corners = solid.points_m.astype(np.float64)[solid.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    is_pink = (solid.colours == PINK_RGB).all(axis=1)[solid.triangles].mean(axis=1)
    return float((is_pink * areas).sum() / areas.sum())


def test_unseen_surface_is_grey_pink_or_cut_in_the_files_of_a_scan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A grey ball's file is grey by default, pink where nobody saw it if asked, or open; terminal, report.json and page tell the share each time."""
    said = {
        UnseenSurface.FILL: "was never in view and is filled in",
        UnseenSurface.PINK: "was never in view and is filled in, in pink",
        UnseenSurface.CUT: "was never in view and is cut, so the surface is open",
    }
    shares, stated = set(), {}
    for choice, words in said.items():
        save_scan(tmp_path / choice.value, scanned([0, 60, 180, 240], replace(WANTED, unseen=choice))[0])
        told = json.loads((tmp_path / choice.value / "report.json").read_text())
        assert told["model"]["unseen"] == choice.value
        shares.add(told["model"]["unseen_share"])
        stated[choice] = f"{100 * told['model']['unseen_share']:.0f} % {words}"
        assert told["headline"].endswith(f" {stated[choice]}.")
        assert f" {stated[choice]}." in Page((tmp_path / choice.value / "index.html").read_text()).words
    (share,) = shares  # the same each time
    fill, pink, cut = (coloured(tmp_path / choice.value / "model.ply") for choice in said)
    assert np.ptp(fill.colours.mean(axis=0)) < 3
    assert np.abs(fill.colours.mean(axis=0) - fill.colours[fill.seen].mean(axis=0)).max() < 20
    assert pink_share(pink) == pytest.approx(share, abs=1e-4)
    assert np.array_equal(pink.colours[pink.seen], fill.colours[fill.seen])
    assert len(cut.seen) == 0
    assert Flaw.OPEN in {
        each.flaw for each in problems(cut.points_mm.astype(np.float64), cut.triangles, Printer(), lambda _: None)
    }
    folder = str(tmp_path / "pink")
    for option, choice, wanted in (
        ([], UnseenSurface.PINK, pink),
        (["--unseen", "fill"], UnseenSurface.FILL, fill),
    ):
        assert main(["export", folder, "--to", "ply", "--tolerance", "0", "--out", str(tmp_path), *option]) == 0
        exported = coloured(tmp_path / "pink.ply")
        assert np.array_equal(np.sort(exported.colours, axis=0), np.sort(wanted.colours, axis=0))
        assert f"note: {stated[choice]}\n" in capsys.readouterr().out
    assert main(["export", folder, "--to", "ply", "--unseen", "cut", "--out", str(tmp_path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["triangles"] == len(cut.triangles)
    assert (told["unseen"], told["unseen_share"]) == ("cut", pytest.approx(share, abs=1e-4))
    assert main(["export", str(tmp_path / "cut"), "--to", "ply", "--unseen", "pink", "--out", str(tmp_path)]) == 0
    assert "--unseen changes nothing" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("wanted", "count"),
    [
        (ScanWanted(voxel_m=0.004, unseen=UnseenSurface.CUT), 1),
        (ScanWanted(voxel_m=0.004, unseen=UnseenSurface.PINK), 1),
        (ScanWanted(voxel_m=0.004), 0),
        (replace(WANTED, voxel_m=0.004, unseen=UnseenSurface.CUT), 0),
    ],
)
def test_a_choice_for_unseen_surface_that_changes_nothing_is_a_note(
    wanted: ScanWanted, count: int, tmp_path: Path
) -> None:
    """A surface that stays open has no unseen part: where pink or cut was asked for, one note says so and what closes it; elsewhere there is none."""
    save_scan(tmp_path / "out", scanned([0, 10], wanted)[0])
    words = f"--unseen {wanted.unseen.value} changes nothing, because the surface is not closed: give --box, --mat, --object or --turntable"
    said = json.loads((tmp_path / "out" / "report.json").read_text())["warnings"]
    assert sum("--unseen" in each for each in said) == said.count(words) == count
    assert Page((tmp_path / "out" / "index.html").read_text()).words.count(words) == count


def test_a_pair_without_the_mat_is_lost_with_a_reason_or_followed_by_what_stands_on_it() -> None:
    """Before the mat was seen nothing is fused. Later the ball alone tells where it is when it hardly moved, not when it was turned half around."""
    scan = scan_for(WANTED)
    first = scan.take("first", 0.0, without_marks(0))
    assert (first.state, first.weakness) == (Tracking.LOST, Weakness.NO_MAT)
    seen = scan.take("seen", 1.0, walked(0))
    assert seen.state is Tracking.TRACKING
    assert seen.mat is not None
    held = scan.take("held", 2.0, without_marks(3))
    assert (held.state, held.weakness, held.mat) == (Tracking.WEAK, Weakness.NO_MAT, None)
    truth = (SE3(Rectifier(RIG).rectification.R_left, np.zeros(3)) @ from_side(3)).inverse()
    assert np.linalg.norm(held.world_camera.t_m - truth.t_m) < 0.003
    turned = scan.take("turned", 3.0, without_marks(180))
    assert (turned.state, turned.weakness) == (Tracking.LOST, Weakness.NO_MAT)
    assert scan.fused == 2


def without_marks(degrees: float) -> Processed:
    """A pair in which only the ball is more than grey; its depth is whole."""
    whole = walked(degrees)
    assert whole.cloud is not None
    points = true_pose(degrees).inverse().apply(whole.cloud.reshape(-1, 3).astype(float))
    with np.errstate(invalid="ignore"):
        is_ball = np.linalg.norm(points - [0, 0, BALL_M], axis=1) < BALL_M + 0.004
    left = np.where(is_ball.reshape(whole.pair.left.shape), whole.pair.left, np.uint8(128))
    return replace(whole, pair=replace(whole.pair, left=left, right=np.full_like(whole.pair.right, 128)))


def test_the_command_scans_pictures_of_an_object_on_a_mat(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Four photographs a quarter turn apart become a model that stands upright; the report tells the squares; a mat that is not there is told, and a box in which nothing is."""
    write_rig(tmp_path / "rig.yaml", RIG, rectify_rig(RIG))
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
    for number, degrees in enumerate((0, 60, 180, 240)):
        for side, image in zip(("left", "right"), pictures(degrees), strict=True):
            cv2.imwrite(str(tmp_path / side / f"{number}.png"), image)
    given = ["scan", *(str(tmp_path / each) for each in ("left", "right")), "--calibration", str(tmp_path / "rig.yaml")]
    wanted = ["--near", "280mm", "--voxel", "2mm"]
    assert main([*given, *wanted, "--mat", "--out", str(tmp_path / "ball")]) == 0
    report = json.loads((tmp_path / "ball" / "report.json").read_text())
    assert report["in_model"] == 4
    assert report["model"]["axes"] == Axes.MAT.text
    assert report["mat"]["to_scale"]
    assert report["mat"]["measured_m"] == pytest.approx(0.025, rel=0.002)
    assert report["model"]["extent_m"][2] == pytest.approx(2 * BALL_M, abs=0.006)
    assert "its squares measure 25.0" in capsys.readouterr().out
    assert "The mat" in (tmp_path / "ball" / "index.html").read_text()
    elsewhere = ["--mat", "--box", "100x100x100@9000,0,0", "--out", str(tmp_path / "elsewhere")]
    capsys.readouterr()
    assert main([*given, *wanted, *elsewhere]) == 4
    assert "nothing of what the pairs show lies in the box: move or enlarge --box" in capsys.readouterr().err
    assert not (tmp_path / "elsewhere").exists()
    above = ["--mat", "--box", "100x100x100@0,0,200", "--out", str(tmp_path / "above")]
    assert main([*given, *wanted, *above]) == 4
    assert "warning: nothing of what the pairs show lies in the box: move or enlarge --box" in capsys.readouterr().out
    assert main([*given, *wanted, "--mat", "8x6:28mm:20mm:4x4", "--out", str(tmp_path / "none")]) == 4
    assert "the mat 8x6:28mm:20mm:4x4 is not seen in any of 4 pairs" in capsys.readouterr().err


def test_a_mat_that_was_printed_too_small_is_told() -> None:
    """At 97 % the report says how long the squares are and what to do; to scale it says nothing."""
    seen = MatSaid((30, 31), 0.03, 0.0001, MatScale(0.97, 0.0002))
    told = mat_figures(MAT, [seen])
    assert not told.is_to_scale
    assert "24.25 mm" in told.remarks[0].message
    assert mat_figures(MAT, [replace(seen, scale=MatScale(1.004, 0.0002))]).remarks == ()


def test_what_a_mat_told_is_kept_in_submaps() -> None:
    """A submap that is read again tells the same of the mat, and a scan goes on from it with the next pair as if it had never ended."""
    scan, pairs = scanned([0, 60], WANTED)
    kept = submap_of(submap_bytes(scan.close_submap()), "kept")
    assert [pair.mat for pair in kept.pairs] == [pair.mat for pair in pairs]
    later = scan_for(WANTED)
    later.go_on([kept])
    after, without_end = later.take("next", 2.0, walked(180)), scan.take("next", 2.0, walked(180))
    assert after.is_fused
    assert after.mat == without_end.mat
    assert np.array_equal(after.world_camera.t_m, without_end.world_camera.t_m)


def test_a_box_that_is_moved_before_the_first_pair_counts() -> None:
    """A scan whose box holds nothing begins once the box is taken away."""
    scan = scan_for(replace(WANTED, box=Box((0.5, 0.5, 0.0), (0.6, 0.6, 0.1))))
    assert scan.take("0", 0.0, walked(0)).weakness is Weakness.EMPTY_BOX
    scan.crop(None)
    assert scan.take("1", 1.0, walked(0)).is_fused


def test_a_scan_on_a_mat_goes_on_with_the_same_mat_and_box_only() -> None:
    """Without the mat, with another box, or with another sheet it is refused in one line."""
    kept = scanned([0], WANTED)[0].close_submap()
    box = Box((-0.05, -0.05, 0.0), (0.05, 0.05, 0.1))
    for wanted, told in (
        (replace(WANTED, mat=None), "had a mat"),
        (replace(WANTED, mat=None, box=WANTED.model_box), "had a mat"),
        (replace(WANTED, box=box), "another box"),
        (replace(WANTED, mat=parse_mat("8x6:28mm:20mm:5x5")), "another box"),
    ):
        with pytest.raises(SettingsError, match=told):
            scan_for(wanted).go_on([kept])


def test_corners_that_no_pose_explains_have_none() -> None:
    """Corners at places of chance: a best pose fits them by many pixels, and is not told."""
    chance = np.random.default_rng(3).uniform((40, 40), (600, 440), (len(MAT.points_m()), 2))
    rectifier = Rectifier(RIG)
    assert fit_mat(MAT.points_m(), MatCorners(chance, chance + 3), rectifier.geometry, scale=SURE) is None


def test_a_mat_with_nothing_on_it_begins_no_model() -> None:
    """The mat is seen, but all depths are far behind it: there is nothing to choose a fineness by, and the pair is lost."""
    whole = walked(0)
    assert whole.cloud is not None
    scan = scan_for(WANTED)
    pair = scan.take("bare", 0.0, replace(whole, cloud=3 * whole.cloud))
    assert pair.state is Tracking.LOST
    assert scan.volume is None
    assert scan.take("ball", 1.0, whole).state is Tracking.TRACKING
