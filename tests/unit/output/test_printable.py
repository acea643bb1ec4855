"""Whether a mesh can be printed: each flaw is found where it is, and a sound mesh has none."""

from collections.abc import Callable
from typing import Final

import manifold3d
import numpy as np
import pytest
import trimesh

from phone_host.output.meshes.decimated import NotClosedError, fixed
from phone_host.output.meshes.nearby import Grid, hits
from phone_host.output.meshes.printable import Flaw, Printer, Problem, bodies, fit_of, problems, volume_mm3
from phone_host.output.meshes.printable_view import picture

_USUAL: Final = Printer()


def checked(shape: trimesh.Trimesh, printer: Printer = _USUAL) -> dict[Flaw, Problem]:
    """What is found, by its kind."""
    told: list[str] = []
    found = problems(np.asarray(shape.vertices, np.float64), np.asarray(shape.faces, np.int32), printer, told.append)
    assert told
    return {problem.flaw: problem for problem in found}


def box(*size: float, at: tuple[float, float, float] = (0, 0, 0)) -> trimesh.Trimesh:
    """A box that stands on its place."""
    shape: trimesh.Trimesh = trimesh.creation.box(size)
    shape.apply_translation([at[0], at[1], at[2] + size[2] / 2])
    return shape


def both(*shapes: trimesh.Trimesh) -> trimesh.Trimesh:
    """Several meshes in one, which share nothing."""
    whole = trimesh.util.concatenate(list(shapes))
    assert isinstance(whole, trimesh.Trimesh)
    return whole


def test_a_box_has_no_flaw() -> None:
    """30 x 20 x 10 mm on its side."""
    assert checked(box(30, 20, 10)) == {}


def test_a_hole_is_found_where_it_is() -> None:
    """A missing triangle leaves three open edges, at its three neighbours."""
    shape = trimesh.creation.icosphere(subdivisions=2, radius=20)
    faces = np.asarray(shape.faces)[1:]
    found = checked(trimesh.Trimesh(shape.vertices, faces, process=False))
    assert found[Flaw.OPEN].blocks
    assert "3 edges" in found[Flaw.OPEN].sentence
    assert found[Flaw.OPEN].triangles.sum() == 3


def test_a_triangle_turned_round_and_a_third_one_at_an_edge_are_found() -> None:
    """Each makes edges that do not belong to two triangles of opposite directions."""
    shape = box(10, 10, 10)
    turned = np.asarray(shape.faces).copy()
    turned[0] = turned[0][::-1]
    assert Flaw.TANGLED in checked(trimesh.Trimesh(shape.vertices, turned, process=False))
    more = np.vstack([shape.faces, [0, 1, 7]])
    assert Flaw.TANGLED in checked(trimesh.Trimesh(shape.vertices, more, process=False))
    corners = [[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]]
    two = checked(trimesh.Trimesh(corners, [[0, 1, 2], [0, 1, 3]], process=False))
    assert two[Flaw.TANGLED].sentence.startswith("1 edge joins more than two triangles")
    assert two[Flaw.OPEN].sentence.startswith("4 edges end in nothing")


def test_what_is_inside_out_is_told() -> None:
    """Its volume is below zero."""
    shape = box(10, 10, 10)
    found = checked(trimesh.Trimesh(shape.vertices, np.asarray(shape.faces)[:, ::-1], process=False))
    assert found[Flaw.INSIDE_OUT].triangles.all()


def test_crumbs_are_counted() -> None:
    """A ball beside a box: the smaller share is the crumb."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=5)
    ball.apply_translation([40, 0, 5])
    found = checked(both(box(20, 20, 20), ball))
    assert "2 bodies" in found[Flaw.CRUMBS].sentence
    assert found[Flaw.CRUMBS].triangles.sum() == 12
    assert not found[Flaw.CRUMBS].blocks


def test_bodies_are_numbered_through_long_chains() -> None:
    """A strip of a thousand triangles is one body, whatever the order of its points."""
    chance = np.random.default_rng(3)
    number = chance.permutation(1002).astype(np.int32)
    strip = np.column_stack([number[:-2], number[1:-1], number[2:]])
    assert (bodies(1002, chance.permutation(strip)) == 0).all()


def test_two_boxes_that_cross_are_found() -> None:
    """Only triangles that meet others are marked; boxes that touch nothing are not."""
    found = checked(both(box(10, 10, 10), box(4, 4, 4, at=(5, 1, 3))))
    crossing = found[Flaw.CROSSING]
    assert crossing.blocks
    assert 4 <= crossing.triangles.sum() < 24
    assert Flaw.CROSSING not in checked(both(box(10, 10, 10), box(4, 4, 4, at=(20, 0, 0))))


@pytest.mark.parametrize("subdivisions", [3, 4])
def test_a_fine_ball_does_not_cross_itself(subdivisions: int) -> None:
    """Neighbours that share a corner are no crossing."""
    assert Flaw.CROSSING not in checked(trimesh.creation.icosphere(subdivisions=subdivisions, radius=20))


@pytest.mark.parametrize(("thick_mm", "is_thin"), [(0.5, True), (1.2, False)])
def test_a_wall_thinner_than_two_lines_is_found(thick_mm: float, *, is_thin: bool) -> None:
    """A wall of half a millimetre on a base; its faces are cut into small triangles, as a scan's are."""
    wall = box(20, thick_mm, 20)
    for _ in range(3):
        wall = wall.subdivide()
    found = checked(wall)
    assert (Flaw.THIN in found) is is_thin
    if is_thin:
        assert found[Flaw.THIN].triangles.mean() == pytest.approx(
            1 / 3
        )  # two of six sides, each with as many triangles


def test_an_overhang_is_found_beyond_its_angle() -> None:
    """A table's top hangs over, its feet stand on the bed; a cone on its base hangs nowhere, on its tip all round."""
    table = both(box(4, 4, 20), box(30, 30, 4, at=(0, 0, 20)))
    assert Flaw.OVERHANG in checked(table)
    cone = trimesh.creation.cone(radius=10, height=12)  # its side leans by 40 degrees
    assert Flaw.OVERHANG not in checked(cone)
    cone.vertices = cone.vertices * [1, -1, -1]  # on its tip
    assert Flaw.OVERHANG not in checked(cone)
    assert Flaw.OVERHANG in checked(cone, Printer(overhang_deg=35))


def test_a_ball_has_no_base() -> None:
    """It touches the bed in a point."""
    assert Flaw.NO_BASE in checked(trimesh.creation.icosphere(subdivisions=4, radius=20))


def test_what_is_larger_than_the_bed_is_told() -> None:
    """A board of 300 x 100 mm fits a bed of 100 x 310 when it is turned, and none of 250."""
    board = box(300, 99, 5)
    assert Flaw.TOO_LARGE not in checked(board, Printer(bed_mm=(100, 310, 50)))
    assert "300 x 99 x 5" in checked(board, Printer(bed_mm=(250, 250, 250)))[Flaw.TOO_LARGE].sentence


@pytest.mark.parametrize(
    ("size", "bed", "fit"), [((10, 20, 5), (40, 40, 40), 2), ((10, 20, 5), (20, 10, 40), 1), ((1, 1, 50), (40, 40, 25), 0.5)]
)  # fmt: skip
def test_how_often_it_fits(size: tuple[float, ...], bed: tuple[float, float, float], fit: float) -> None:
    """The least over the axes, turned about z where that is better."""
    assert fit_of(np.array(size), bed) == pytest.approx(fit)


def test_volume_is_that_of_geometry() -> None:
    """A box beside the origin encloses the product of its sides."""
    shape = box(3, 4, 5, at=(100, 0, 0))
    assert volume_mm3(np.asarray(shape.vertices)[shape.faces]) == pytest.approx(60)


def test_lines_meet_triangles_where_geometry_says() -> None:
    """A line of length 2 meets a triangle half way; beside it and along it, it does not."""
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 3, np.float64)
    begin = np.array([[0.2, 0.2, 1], [0.8, 0.8, 1], [-1, 0.2, 0]])
    way = np.array([[0, 0, -2], [0, 0, -2], [3.0, 0, 0]])
    assert hits(begin, way, corners) == pytest.approx([0.5, np.nan, np.nan], nan_ok=True)


def test_all_boxes_that_meet_are_pairs() -> None:
    """The grid misses none and gives none twice, beside a triangle a hundred times as large as the others."""
    chance = np.random.default_rng(5)
    corners = chance.random((300, 1, 3)) * 10 + chance.random((300, 3, 3))
    corners[0] *= 3
    low, high = corners.min(axis=1), corners.max(axis=1)
    meet = (low[:, None] <= high[None]).all(axis=2) & (low[None] <= high[:, None]).all(axis=2)
    expected = {(i, j) for i, j in np.argwhere(meet) if i < j}
    pairs = [tuple(pair) for pair in Grid(corners).pairs().tolist()]
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == expected


def test_a_heap_of_triangles_is_told_and_not_searched() -> None:
    """Five thousand times the same triangle are 12 million pairs in one place: that is said, and neither crossings nor walls are looked for."""
    one = np.array([[0, 0, 0], [50, 0, 0], [0, 50, 0]], np.float64)
    assert Grid(np.repeat(one[np.newaxis], 5000, axis=0)).is_crowded
    heap = trimesh.Trimesh(one, np.repeat([[0, 1, 2]], 5000, axis=0), process=False)
    found = checked(heap)
    assert "too many triangles" in found[Flaw.CROWDED].sentence
    assert not found[Flaw.CROWDED].blocks
    assert not {Flaw.CROSSING, Flaw.THIN} & found.keys()
    assert not Grid(np.asarray(box(30, 20, 10).triangles, np.float64)).is_crowded


@pytest.mark.parametrize(("side", "wall"), [(1e-6, 0.8), (20.0, 1e7)])
def test_walls_are_looked_for_no_farther_than_the_thing_is_long(side: float, wall: float) -> None:
    """A nanometre against a usual wall, and a usual box against a wall of ten kilometres: all of it is thin, and that is soon told."""
    found = checked(box(side, side, side), Printer(least_wall_mm=wall))
    assert found[Flaw.THIN].triangles.all()


@pytest.fixture
def mess() -> trimesh.Trimesh:
    """A large ball inside out, with a crumb."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=50)
    crumb = trimesh.creation.icosphere(subdivisions=1, radius=2)
    crumb.apply_translation([80, 0, 0])
    shape = both(ball, crumb)
    return trimesh.Trimesh(shape.vertices, np.asarray(shape.faces)[:, ::-1], process=False)


def test_what_can_be_mended_is_mended(mess: trimesh.Trimesh) -> None:
    """Afterwards it is one closed body with a base, that fits the bed; each thing done is told."""
    printer = Printer(bed_mm=(60, 60, 60))
    points, triangles = np.asarray(mess.vertices, np.float64), np.asarray(mess.faces, np.int32)
    mended = fixed(points, triangles, printer, needs_base=True)
    assert [words.split()[0] for words in mended.said] == ["dropped", "turned", "cut", "scaled"]
    again = trimesh.Trimesh(mended.points_mm, mended.triangles)
    assert again.is_watertight
    assert again.volume > 0
    assert (again.extents <= 60).all()
    assert again.bounds[0][2] == pytest.approx(0)
    left = checked(again, printer)
    assert not {Flaw.OPEN, Flaw.CRUMBS, Flaw.INSIDE_OUT, Flaw.NO_BASE, Flaw.TOO_LARGE, Flaw.CROSSING} & left.keys()
    status = manifold3d.Manifold(
        manifold3d.Mesh(mended.points_mm.astype(np.float32), mended.triangles.astype(np.uint32))
    )
    assert status.status() == manifold3d.Error.NoError


def test_a_sound_box_stays_as_it_is() -> None:
    """There is nothing to do, and nothing is said."""
    shape = box(10, 10, 10)
    mended = fixed(np.asarray(shape.vertices), np.asarray(shape.faces, np.int32), Printer(), needs_base=False)
    assert mended.said == ()
    assert len(mended.triangles) == 12


def test_a_spike_is_cut_as_far_as_allowed() -> None:
    """A cone on its tip has nowhere a tenth of its area within a tenth of its height: the largest cut is taken."""
    cone = trimesh.creation.cone(radius=10, height=30)
    cone.vertices = cone.vertices * [1, -1, -1]  # on its tip
    mended = fixed(np.asarray(cone.vertices), np.asarray(cone.faces, np.int32), Printer(), needs_base=True)
    assert np.ptp(mended.points_mm[:, 2]) == pytest.approx(27)


def test_an_open_mesh_cannot_be_mended() -> None:
    """Nobody can say what is inside."""
    shape = box(10, 10, 10)
    with pytest.raises(NotClosedError):
        fixed(np.asarray(shape.vertices), np.asarray(shape.faces, np.int32)[1:], Printer(), needs_base=False)


@pytest.mark.parametrize(
    "make", [lambda: box(30, 20, 10), lambda: trimesh.creation.icosphere(subdivisions=4, radius=20)]
)
def test_the_picture_shows_what_is_wrong(make: Callable[[], trimesh.Trimesh]) -> None:
    """Red appears where a triangle is wrong and nowhere else, and the thing fills a good part of each of four views."""
    shape = make()
    points, triangles = np.asarray(shape.vertices, np.float64), np.asarray(shape.faces, np.int32)
    sound = picture(points, triangles, np.zeros(len(triangles), np.bool_))
    wrong = np.zeros(len(triangles), np.bool_)
    wrong[0] = True
    marked = picture(points, triangles, wrong)
    is_red = (marked[..., 2] > 200) & (marked[..., 0] < 60)
    assert is_red.any()
    assert not ((sound[..., 2] > 200) & (sound[..., 0] < 60)).any()
    assert ((sound == marked).all(axis=2) | is_red).all()
    height, width = sound.shape[:2]
    for part in (sound[: height // 2, : width // 2], sound[height // 2 :, width // 2 :]):
        assert 0.1 < (part < 240).any(axis=2).mean() < 0.9
