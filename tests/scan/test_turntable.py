"""A thing that turns before cameras that stand still: its axis, its pixels, the closed turn, and words for what cannot be scanned."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host import api
from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.output.axes import Axes
from phone_host.output.meshes.ply_mesh import read_ply_mesh
from phone_host.scan.blocks import Box
from phone_host.scan.camera_pose import Observer
from phone_host.scan.circle_bundle import Circle, Seen, TurnAxis, axis_of, fitted_circle, unwrapped
from phone_host.scan.field_bytes import KeptField, field_bytes, field_of
from phone_host.scan.ground import table_height_m
from phone_host.scan.mesh import Mesh, size_of
from phone_host.scan.scan import Scan, scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.surface_match import Match
from phone_host.scan.tracking_words import Weakness
from phone_host.scan.turning_mask import Turning, TurningMask
from phone_host.scan.turntable import TurntablePoses
from phone_host.scan.view import View, points_of
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.turning_things import AXES, FOOT_M, UP, Size, exact_view, off_thing_m, processed_of, turned_scene

SMALL = Size(320, 240, 420.0, 0.06)
TRUE = TurnAxis(UP, FOOT_M)
WANTED = ScanWanted(turntable=True, voxel_m=0.0015)


def tilt_of(axis: TurnAxis) -> float:
    """How far the axis leans away from the true one, rad."""
    return math.acos(min(1.0, float(axis.direction @ UP)))


def aside_m(axis: TurnAxis) -> float:
    """How far it passes by the true one, m."""
    off = axis.point_m - FOOT_M
    return float(np.linalg.norm(off - off @ UP * UP))


def noisy_motions(turn_sigma: float, shift_m: float, seed: int = 1) -> list[SE3]:
    """40 motions by 3 to 60 degrees about the true axis, each with noise of its own."""
    draw = np.random.default_rng(seed)
    motions = []
    for angle in draw.uniform(math.radians(3), math.radians(60), 40):
        noise = np.concatenate([draw.normal(0, turn_sigma, 3), draw.normal(0, shift_m, 3)])
        motions.append(SE3.of(noise) @ TRUE.camera_world(float(angle)))
    return motions


def test_the_axis_of_exact_motions_is_exact() -> None:
    """To rounding, in direction, sense and place."""
    axis = axis_of(noisy_motions(0, 0))
    assert axis is not None
    assert tilt_of(axis) < 1e-7
    assert aside_m(axis) < 1e-9


def test_the_axis_of_noisy_motions_and_of_wrong_ones_among_them() -> None:
    """0.5 degrees and 1 mm of noise in each of 40: a tenth of a degree and half a millimetre are left, also when each fifth is wrong."""
    motions = noisy_motions(math.radians(0.5) / math.sqrt(3), 0.001 / math.sqrt(3))
    wrong = [SE3.of(np.array([0.4, -0.2, 0.3, 0.02, 0.0, -0.05])) @ each for each in motions[::5]]
    for given, most in ((motions, 1.0), ([*motions, *wrong], 2.0)):
        axis = axis_of(given)
        assert axis is not None
        assert tilt_of(axis) < most * math.radians(0.3)
        assert aside_m(axis) < most * 0.0015


def test_nothing_that_turns_has_no_axis() -> None:
    """Shifts alone tell none."""
    assert axis_of([SE3.of(np.array([0, 0, 0, 0.01, 0, 0.02]))] * 5) is None
    assert axis_of([]) is None


def test_an_angle_is_found_again() -> None:
    """Any within half a turn; in order they go on."""
    angles = np.linspace(-3, 9, 50)
    found = unwrapped([TRUE.angle_of(TRUE.camera_world(float(angle))) for angle in angles])
    assert found == pytest.approx(angles, abs=1e-9)


def drifted_turn(share: float) -> tuple[Circle, list[Seen], NDArray[np.float64]]:
    """A turn of 380 degrees in steps of 10, 300 points on a ball, each seen by the views that it faces; the start falls short by a share."""
    draw = np.random.default_rng(4)
    outward = draw.normal(size=(300, 3))
    outward -= np.minimum(outward @ UP + 0.5, 0)[:, np.newaxis] * UP  # the underside is seen by no view
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    middle = FOOT_M + 0.04 * UP
    points = middle + 0.04 * outward
    angles = np.radians(np.arange(0, 381, 10.0))
    observer = Observer(StereoGeometry(focal_px=600, baseline_m=0.06, cx_px=320, cy_px=240), 0.5)
    seen = []
    for angle in angles:
        pose = TRUE.camera_world(float(angle))
        facing = np.flatnonzero((pose.apply(points) * (outward @ pose.R.T)).sum(axis=1) < -0.015)
        noise = draw.normal(size=(len(facing), 3)) * (0.2, 0.2, 0.4)
        seen.append(Seen(facing, observer.projected(pose.apply(points[facing])) + noise))
    lean = TurnAxis(SE3.of(np.array([0.02, 0, 0.01, 0, 0, 0])).R @ UP, FOOT_M + 0.003)
    start = Circle(lean, angles * (1 - share), points + draw.normal(0, 0.002, points.shape))
    return fitted_circle(start, seen, observer), seen, angles


def test_a_turn_that_falls_short_is_closed_and_its_error_distributed() -> None:
    """12 degrees are missing after a turn: every angle is right within 0.15 degrees, the axis within 0.3 degrees and 0.5 mm."""
    found, _, angles = drifted_turn(0.03)
    assert np.abs(found.angles - angles).max() < math.radians(0.15)
    assert tilt_of(found.axis) < math.radians(0.3)
    assert aside_m(found.axis) < 0.0005


@pytest.fixture(scope="module")
def jerky() -> tuple[list[View], list[float]]:
    """A turn of more than 360 degrees by jerks of 7 to 15 degrees, with exact depths."""
    draw, angles = np.random.default_rng(7), [0.0]
    while angles[-1] < math.radians(378):
        angles.append(angles[-1] + math.radians(float(draw.uniform(7, 15))))
    return [exact_view(turned_scene(angle), SMALL, number) for number, angle in enumerate(angles)], angles


def test_what_turns_is_told_from_what_stands_still(jerky: tuple[list[View], list[float]]) -> None:
    """From the fourth view on, nine in ten of the thing's pixels are found, and few of the table's with them."""
    mask = TurningMask()
    for number, view in enumerate(jerky[0][:6]):
        found = mask.take(view.grey, view.depth_m, view.geometry)
        assert found.turning is (Turning.THING if number else Turning.NOTHING)
        if number < 3:
            continue
        points = TRUE.camera_world(jerky[1][number]).inverse().apply(points_of(view.depth_m, view.geometry))
        thing = np.zeros(view.grey.shape, np.bool_)
        thing[np.isfinite(view.depth_m)] = np.abs(off_thing_m(points)) < 1e-4
        assert np.count_nonzero(found.mask & thing) > 0.9 * np.count_nonzero(thing)
        assert np.count_nonzero(found.mask & ~thing) < 0.35 * np.count_nonzero(thing)


def scanned(views: list[View], wanted: ScanWanted = WANTED) -> Scan:
    """Scan views."""
    scan = scan_for(wanted)
    for number, view in enumerate(views):
        scan.take(str(number), float(number), processed_of(view))
    return scan


def poses_of(scan: Scan) -> TurntablePoses:
    """What tells its poses."""
    assert isinstance(scan.poses, TurntablePoses)
    return scan.poses


@pytest.fixture(scope="module")
def whole_turn(jerky: tuple[list[View], list[float]]) -> Scan:
    """The scan of that turn, whose model was made."""
    scan = scanned(jerky[0])
    scan.model()
    return scan


def test_a_jerky_turn_is_closed_to_one_surface(jerky: tuple[list[View], list[float]], whole_turn: Scan) -> None:
    """All views but one at most are in the model, which lies 0.6 mm off the thing on average, closed down to the table and without it; one thread and two give the same bits."""
    views, angles = jerky
    scan, model, turn = whole_turn, whole_turn.model(), poses_of(whole_turn).fit.turn
    assert np.count_nonzero([pair.is_fused for pair in scan.pairs]) >= len(views) - 1
    assert turn is not None
    assert turn.is_closed
    assert turn.closed_m < 0.001
    assert np.degrees(np.abs(turn.angles - angles)).max() < 1.0
    seen, points = model.seen_mesh.points_m.astype(np.float64), model.mesh.points_m.astype(np.float64)
    assert np.abs(off_thing_m(seen)).mean() < 0.0006
    assert model.is_closed
    assert size_of(model.mesh).border_m == 0
    assert ((points - FOOT_M) @ UP).min() == pytest.approx(0, abs=0.001)
    assert np.abs(off_thing_m(points)).max() < 0.01
    again = scanned(views, replace(WANTED, threads=2)).model()
    assert np.array_equal(again.mesh.points_m, model.mesh.points_m)
    assert np.array_equal(again.mesh.triangles, model.mesh.triangles)


def test_views_that_were_lost_together_do_not_double_the_surface(jerky: tuple[list[View], list[float]]) -> None:
    """Turned on by 115 degrees at once and back again, the views between agree with each other only: they stay out; those that show again what is in the model come in, and what is fused lies on the thing."""
    scan = scanned([jerky[0][number] for number in (0, 1, 2, 3, *range(14, -1, -1))])
    points = scan.model().seen_mesh.points_m.astype(np.float64)
    assert poses_of(scan).fit.turn is not None
    assert [pair.is_fused for pair in scan.pairs] == [True] * 4 + [False] * 10 + [True] * 5
    assert np.abs(off_thing_m(points)).mean() < 0.0006


def test_one_view_alone_does_not_lead_back_from_a_piece_that_refuses_it(jerky: tuple[list[View], list[float]]) -> None:
    """The first view that shows a place of the model again waits for a second one, whichever of the piece and the model its depths lie on by chance."""
    scan = scanned([jerky[0][number] for number in (0, 1, 2, 3, *range(14, 3, -1))])
    assert [pair.is_fused for pair in scan.pairs] == [True] * 4 + [False] * 11


def test_a_table_is_found_where_it_lies(jerky: tuple[list[View], list[float]]) -> None:
    """Within a millimetre; without anything that stands still there is none."""
    view = jerky[0][0]
    points = points_of(view.depth_m, view.geometry)
    thing = np.abs(off_thing_m(points)) < 1e-4
    height = table_height_m(points[~thing], points[thing], TRUE, 0.0015)
    assert abs(height) < 0.001
    assert table_height_m(points[:0], points[thing], TRUE, 0.0015) == -math.inf
    assert table_height_m(points, points[thing], TurnAxis(np.array([0.0, 0.0, 1.0]), FOOT_M), 0.0015) == -math.inf


def reasons(views: list[View]) -> set[Weakness]:
    """Why none of some views is in the model."""
    scan = scanned(views)
    assert scan.fused == 0
    assert scan.volume is None
    assert len(scan.model().mesh.triangles) == 0
    return {pair.weakness for pair in scan.pairs[1:]}


def test_what_cannot_be_scanned_is_told() -> None:
    """Nothing turns; everything turns; the thing reaches out of the picture."""
    still = [exact_view(turned_scene(0.0), SMALL, number) for number in range(3)]
    assert reasons(still) == {Weakness.NOTHING_TURNS}
    whole = [exact_view(turned_scene(0.12 * number, table_turns=True), SMALL, number) for number in range(3)]
    assert reasons(whole) == {Weakness.ALL_TURNS}
    aside = np.array([-0.155, 0.0, 0.0])
    cut = [exact_view(turned_scene(0.12 * number, shift_m=aside), SMALL, number) for number in range(3)]
    assert reasons(cut) == {Weakness.OUTSIDE}


def test_a_pause_is_no_loss(jerky: tuple[list[View], list[float]]) -> None:
    """While nothing turns the last pose holds."""
    views = jerky[0]
    scan = scanned([*views[:3], views[2], views[2], views[3]])
    assert all(pair.is_fused for pair in scan.pairs)
    assert np.array_equal(scan.pairs[4].world_camera.t_m, scan.pairs[2].world_camera.t_m)
    assert poses_of(scan).views == 4


COARSE = replace(WANTED, voxel_m=0.004)


def test_pairs_that_tell_nothing_leave_the_turn_alone(jerky: tuple[list[View], list[float]]) -> None:
    """One without depths, one in which everything moved, and one turned on by a degree only: none is kept, and those after them go on."""
    views, angles = jerky
    blind = replace(views[2], depth_m=np.full_like(views[2].depth_m, np.nan))
    pushed = exact_view(turned_scene(1.0, table_turns=True), SMALL, 50)
    little = exact_view(turned_scene(angles[2] + math.radians(1.2)), SMALL, 51)
    scan = scanned([*views[:3], little, blind, pushed, views[2], views[3]], COARSE)
    assert [pair.weakness for pair in scan.pairs[4:6]] == [Weakness.NO_DEPTH, Weakness.ALL_TURNS]
    assert poses_of(scan).views == 4
    assert scan.pairs[-1].is_fused


def test_a_box_is_carved_by_the_views_of_the_turn(jerky: tuple[list[View], list[float]]) -> None:
    """A third of a turn and a view from far on that is lost: a closed model within the box, made once, carved by the views that are in it."""
    low, high = FOOT_M - 0.09, FOOT_M + 0.09
    box = Box(tuple(low.tolist()), tuple(high.tolist()))
    scan = scanned([*jerky[0][:11], jerky[0][20], jerky[0][21]], replace(COARSE, box=box))
    model = scan.model()
    assert model.is_closed
    assert (model.mesh.points_m > low - 0.005).all()
    assert (model.mesh.points_m < high + 0.005).all()
    turn = poses_of(scan).fit.turn
    assert np.array_equal(scan.model().mesh.points_m, model.mesh.points_m)
    assert poses_of(scan).fit.turn is turn
    lowest = ((model.mesh.points_m - FOOT_M) @ UP).min()
    assert lowest == pytest.approx(0, abs=0.002)  # though the box reaches 50 mm below the table


def test_the_python_api_adds_a_pass_to_what_it_has_saved(jerky: tuple[list[View], list[float]], tmp_path: Path) -> None:
    """`scan_for` begins a turn, `save_scan` leaves the command's files and its field, and the next pass is put onto it."""
    views = jerky[0][:13]
    onto = None
    for out in ("first", "second"):
        scan = api.scan_for(api.ScanWanted(turntable=True, voxel_m=0.004, onto=onto))
        for number, view in enumerate(views):
            scan.take(str(number), float(number), processed_of(view))
        api.save_scan(tmp_path / out, scan)
        onto = api.read_field(tmp_path / out)
    report = json.loads((tmp_path / "second" / "report.json").read_text())
    assert (report["in_model"], report["model"]["axes"]) == (len(views), Axes.CAMERA.text)
    assert {path.name for path in (tmp_path / "second").iterdir()} >= set(report["files"])
    assert any("lie on the earlier one" in warning for warning in report["warnings"])
    mesh = read_ply_mesh((tmp_path / "second" / "model.ply").read_bytes(), "model.ply", 1.0)
    seen = mesh.points_m[mesh.seen].astype(np.float64)
    assert np.abs(off_thing_m(seen)).mean() < 0.002


def kept(volume: Volume) -> KeptField:
    """As the folder of an earlier pass holds it."""
    return field_of(field_bytes(volume), "field.bin")


def test_a_pass_is_laid_onto_an_earlier_one_or_stays_alone(jerky: tuple[list[View], list[float]]) -> None:
    """Onto the thing as it is, poses and model go into the axes of that; onto nothing, the pass is as without it."""
    views = jerky[0][:26:2]
    away = SE3.of(np.array([0.3, -0.2, 0.5, 0.1, 0.0, 0.2]))
    empty = scanned(views, replace(COARSE, onto=kept(Volume(VolumeSettings(voxel_m=0.004, far_m=1.0)))))
    alone = empty.model()
    match = poses_of(empty).fit.match
    assert match is not None
    assert match.match is Match.NONE
    assert np.abs(off_thing_m(alone.seen_mesh.points_m.astype(np.float64))).mean() < 0.002
    first = Volume(VolumeSettings(voxel_m=0.004, far_m=1.0))
    assert empty.volume is not None
    first.take_in(empty.volume, away)
    scan = scanned(views, replace(COARSE, onto=kept(first)))
    points = away.inverse().apply(scan.model().seen_mesh.points_m.astype(np.float64))
    match = poses_of(scan).fit.match
    assert match is not None
    assert match.match is Match.FOUND
    assert np.abs(off_thing_m(points)).mean() < 0.002
    moved = [away @ pair.world_camera for pair in empty.pairs if pair.is_fused]
    for pair, truth in zip([pair for pair in scan.pairs if pair.is_fused], moved, strict=True):
        assert np.linalg.norm(pair.world_camera.t_m - truth.t_m) < 0.004


def test_a_pass_turned_over_closes_what_the_first_stood_on(whole_turn: Scan) -> None:
    """Both passes carve: no edge is open, hardly anything was not seen, the content is right to 4 %, and the second pass saw the thing, as it stood first, from below."""
    first = whole_turn
    assert first.model().unseen_share > 0.1
    assert first.volume is not None
    over = [exact_view(turned_scene(math.radians(14.4) * number, is_over=True), SMALL, number) for number in range(27)]
    scan = scanned(over, replace(WANTED, onto=field_of(field_bytes(first.volume, first.carved), "field.bin")))
    model = scan.model()
    match = poses_of(scan).fit.match
    assert match is not None
    assert match.match is Match.FOUND
    assert size_of(model.mesh).border_m == 0
    assert model.unseen_share < 0.02
    points = model.mesh.points_m.astype(np.float64)
    assert np.abs(off_thing_m(points)).mean() < 0.0008
    assert np.abs(off_thing_m(points)).max() < 0.006
    assert content_m3(model.mesh) == pytest.approx(content_of_thing_m3(), rel=0.04)
    assert max((pair.world_camera.t_m - FOOT_M) @ UP for pair in scan.pairs if pair.is_fused) < 0


def content_m3(mesh: Mesh) -> float:
    """What a closed mesh encloses."""
    corners = mesh.points_m.astype(np.float64)[mesh.triangles]
    return float((np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum() / 6)


def content_of_thing_m3() -> float:
    """The same of the thing, counted in cubes of a millimetre."""
    axis = np.arange(-0.06, 0.06, 0.001)
    cubes = np.stack(np.meshgrid(axis, axis, np.arange(-0.005, 0.1, 0.001), indexing="ij"), axis=-1).reshape(-1, 3)
    return float(np.count_nonzero(off_thing_m(FOOT_M + cubes @ AXES.T) < 0)) * 1e-9
