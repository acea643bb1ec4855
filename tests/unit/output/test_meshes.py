"""Mesh files: what is written is read back, and nothing that arrives is believed."""

import json
import math
import struct
import zipfile
from io import BytesIO
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from common.errors import DataError, TandemError
from phone_host.output.axes import Axes
from phone_host.output.meshes.decimated import decimated
from phone_host.output.meshes.formats import FORMATS, READABLE, mesh_bytes, read_mesh
from phone_host.output.meshes.solid import Solid
from phone_host.output.meshes.three_ds import MOST, three_ds_bytes
from phone_host.output.model_file import read_model
from phone_host.output.upright import upright_model
from phone_host.run.model_job import fewer_triangles

_NONE = np.zeros((0, 3), np.uint8)


def ball(subdivisions: int = 3, *, coloured: bool = True) -> Solid:
    """A closed ball of 50 mm radius; its colours follow its places."""
    shape = trimesh.creation.icosphere(subdivisions=subdivisions, radius=0.05)
    points = np.asarray(shape.vertices, np.float32)
    colours = np.rint((points + 0.05) * 2550).astype(np.uint8) if coloured else _NONE
    return Solid(points, np.asarray(shape.faces, np.int32), colours)


def by_trimesh(solid: Solid, kind: str) -> trimesh.Trimesh:
    """What trimesh reads of our file."""
    found = trimesh.load(BytesIO(mesh_bytes(solid, kind, None)), file_type=kind, force="mesh")
    assert isinstance(found, trimesh.Trimesh)
    return found


@pytest.mark.parametrize(("kind", "unit"), [("stl", 1), ("obj", 1), ("ply", 1), ("glb", 1000)])
def test_another_reader_finds_the_same_closed_mesh(kind: str, unit: float) -> None:
    """Trimesh finds a closed mesh of the right size, volume and number of triangles; a GLB is in metres, the others in millimetres."""
    solid = ball()
    found = by_trimesh(solid, kind)
    exact = trimesh.Trimesh(solid.points_mm, solid.triangles)
    assert found.is_watertight
    assert len(found.faces) == len(solid.triangles)
    assert found.extents * unit == pytest.approx([100, 100, 100], abs=0.01)
    assert found.volume * unit**3 == pytest.approx(exact.volume, rel=1e-5)


@pytest.mark.parametrize("kind", ["obj", "ply"])
def test_colours_are_kept(kind: str) -> None:
    """Each point has the colour that it had."""
    solid = ball()
    found = by_trimesh(solid, kind)
    assert isinstance(found.visual, trimesh.visual.ColorVisuals)
    places = {
        tuple(np.rint(place * 1000)): tuple(colour)
        for place, colour in zip(solid.points_mm, solid.colours.tolist(), strict=True)
    }
    for place, colour in zip(found.vertices, found.visual.vertex_colors[:, :3].tolist(), strict=True):
        assert colour == pytest.approx(places[tuple(np.rint(np.float32(place) * 1000))], abs=1)


def test_a_glb_holds_linear_colours_and_y_up() -> None:
    """By glTF's specification colours are linear, and y is up: the camera's y and z change their signs."""
    solid = ball()
    content = mesh_bytes(solid, "glb", Axes.CAMERA)
    length = struct.unpack_from("<I", content, 12)[0]
    told, body = json.loads(content[20 : 20 + length]), content[28 + length :]
    points, shades = told["bufferViews"][:2]
    found = np.frombuffer(body, "<f4", points["byteLength"] // 4).reshape(-1, 3)
    assert np.array_equal(found, solid.points_m * [1, -1, -1])
    linear = np.frombuffer(body, "<u2", shades["byteLength"] // 2, points["byteLength"]).reshape(-1, 4) / 65535
    assert linear[:, 3].min() == 1
    back = np.where(linear[:, :3] <= 0.0031308, 12.92 * linear[:, :3], 1.055 * linear[:, :3] ** (1 / 2.4) - 0.055)
    assert 255 * back == pytest.approx(solid.colours, abs=0.6)
    assert len(content) == struct.unpack_from("<I", content, 8)[0]


_TOPS: Final = {
    Axes.CAMERA: (0, -1, 0),
    Axes.Y_UP: (0, 1, 0),
    Axes.GLTF: (0, 1, 0),
    Axes.MAT: (0, 0, 1),
    Axes.TABLE: (0, 0, 1),
}


@pytest.mark.parametrize("axes", list(Axes))
def test_a_glb_stands_upright_for_other_programs(axes: Axes) -> None:
    """A needle from where the thing stands upwards goes along y, as trimesh reads it, and nothing is mirrored."""
    shape = trimesh.creation.icosphere(subdivisions=1, radius=0.01)
    shape.vertices[0] = 0.1 * np.array(_TOPS[axes])
    solid = Solid(np.asarray(shape.vertices, np.float32), np.asarray(shape.faces, np.int32), _NONE)
    found = trimesh.load(BytesIO(mesh_bytes(solid, "glb", axes)), file_type="glb", force="mesh")
    assert isinstance(found, trimesh.Trimesh)
    assert found.bounds[1] == pytest.approx((0.01, 0.1, 0.01), abs=0.002)
    assert found.volume == pytest.approx(shape.volume, rel=1e-5)
    assert found.volume > 0


def test_a_glb_of_another_program_stands_on_what_y_points_away_from(tmp_path: Path) -> None:
    """Its specification says that y is up, so a print of it is turned without being asked."""
    content = mesh_bytes(ball(1), "glb", None).replace(b'"tandemscan"', b'"other tool"')
    (tmp_path / "cup.glb").write_bytes(content)
    upright = upright_model(tmp_path / "cup.glb", None, None)
    read = upright.model.solid.points_m
    assert upright.model.axes is Axes.GLTF
    assert upright.points_mm[:, 2] == pytest.approx(1000 * read[:, 1], abs=1e-3)


def test_a_3mf_says_its_unit_and_keeps_colours() -> None:
    """The XML says millimetres, holds each triangle, and gives each of its corners the colour of its point."""
    solid = ball(1)
    with zipfile.ZipFile(BytesIO(mesh_bytes(solid, "3mf", None))) as archive:
        assert archive.testzip() is None
        root = ET.fromstring(archive.read("3D/3dmodel.model"))
    core, paint = (f"{{http://schemas.microsoft.com/3dmanufacturing/{word}/2015/02}}" for word in ("core", "material"))
    assert root.get("unit") == "millimeter"
    colours = [one.get("color", "") for one in root.iter(f"{paint}color")]
    places = [[float(one.get(axis, "nan")) for axis in "xyz"] for one in root.iter(f"{core}vertex")]
    assert np.array(places) == pytest.approx(solid.points_mm, abs=1e-4)
    faces = list(root.iter(f"{core}triangle"))
    assert len(faces) == len(solid.triangles)
    for face, corners in zip(faces, solid.triangles, strict=True):
        for key, corner in zip("123", corners, strict=True):
            assert int(face.get(f"v{key}", "")) == corner
            red, green, blue = solid.colours[corner]
            assert colours[int(face.get(f"p{key}", ""))] == f"#{red:02X}{green:02X}{blue:02X}FF"


def test_a_mesh_without_colours_tells_of_none() -> None:
    """A GLB has no colours but each place, a 3MF no colour group but each triangle, and a mesh no colours of its faces."""
    solid = ball(1, coloured=False)
    content = mesh_bytes(solid, "glb", None)
    (mesh,) = json.loads(content[20 : 20 + struct.unpack_from("<I", content, 12)[0]])["meshes"]
    assert set(mesh["primitives"][0]["attributes"]) == {"POSITION"}
    with zipfile.ZipFile(BytesIO(mesh_bytes(solid, "3mf", None))) as archive:
        text = archive.read("3D/3dmodel.model").decode()
    assert text.count("<triangle ") == len(solid.triangles)
    assert "colorgroup" not in text
    assert 'pid="' not in text
    assert solid.face_colours().shape == (0, 3)


def chunks(content: bytes, begin: int, end: int) -> list[tuple[int, int, int]]:
    """Number, begin and end of the body of each 3DS chunk in a stretch."""
    found = []
    while begin < end:
        number, length = struct.unpack_from("<HI", content, begin)
        assert 6 <= length <= end - begin
        found.append((number, begin + 6, begin + length))
        begin += length
    return found


def pieces_of(content: bytes) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points and triangles of each piece of a 3DS file."""
    [(_, begin, end)] = chunks(content, 0, len(content))
    editor = next(one for one in chunks(content, begin, end) if one[0] == 0x3D3D)
    pieces = []
    for number, first, last in chunks(content, *editor[1:]):
        if number != 0x4000:
            continue
        name_end = content.index(b"\0", first)
        assert name_end - first <= 10
        [(_, mesh, mesh_end)] = chunks(content, name_end + 1, last)
        inside = {kind: at for kind, at, _ in chunks(content, mesh, mesh_end)}
        count = struct.unpack_from("<H", content, inside[0x4110])[0]
        points = np.frombuffer(content, "<f4", 3 * count, inside[0x4110] + 2).reshape(-1, 3)
        faces = struct.unpack_from("<H", content, inside[0x4120])[0]
        corners = np.frombuffer(content, "<u2", 4 * faces, inside[0x4120] + 2).reshape(-1, 4)[:, :3]
        pieces.append((points, corners))
    return pieces


def test_a_large_mesh_is_3ds_pieces_that_weld_to_the_whole() -> None:
    """81 920 triangles need two pieces, each within the format's limits; welded, they are the closed mesh again."""
    solid = ball(6)
    pieces = pieces_of(three_ds_bytes(solid))
    assert len(pieces) == math.ceil(len(solid.triangles) / MOST)
    assert all(max(len(points), len(corners)) <= MOST for points, corners in pieces)
    soup = np.concatenate([points[corners] for points, corners in pieces])
    whole = trimesh.Trimesh(soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3))
    whole.merge_vertices(digits_vertex=4)
    assert whole.is_watertight
    assert whole.volume == pytest.approx(trimesh.Trimesh(solid.points_mm, solid.triangles).volume, rel=1e-5)


def test_points_that_share_nothing_are_cut_into_more_pieces() -> None:
    """A mesh of single triangles has three points to each: a piece then holds a third as many."""
    count = 50_000
    points = np.random.default_rng(1).random((3 * count, 3), np.float32)
    solid = Solid(points, np.arange(3 * count, dtype=np.int32).reshape(-1, 3), _NONE)
    pieces = pieces_of(three_ds_bytes(solid))
    assert all(len(points) <= MOST for points, _ in pieces)
    assert sum(len(corners) for _, corners in pieces) == count


@pytest.mark.parametrize("kind", READABLE)
@pytest.mark.parametrize("coloured", [True, False])
def test_what_is_written_is_read_back(kind: str, *, coloured: bool) -> None:
    """Places to a hundredth of a millimetre, triangles in their order, colours where the format has them."""
    solid = ball(2, coloured=coloured)
    found = read_mesh(mesh_bytes(solid, kind, None), f"ball.{kind}").solid
    assert found.points_m[found.triangles] == pytest.approx(solid.points_m[solid.triangles], abs=1e-5)
    assert found.has_colours is (coloured and kind != "stl")
    if found.has_colours:
        assert found.colours[found.triangles] == pytest.approx(solid.colours[solid.triangles], abs=1)


TEXT_STL = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"
TEXT_PLY = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\nproperty list uchar uint vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
BIG_PLY = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float quality\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" + np.array(
    [[0, 0, 0, 9], [1, 0, 0, 9], [0, 1, 0, 9]], ">f4"
).tobytes() + b"\3" + np.array([0, 1, 2], ">i4").tobytes()  # fmt: skip
SQUARE_OBJ = b"# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf -4//1 -3//1 -2//1 -1//1\n"


@pytest.mark.parametrize(
    ("name", "content", "triangles"),
    [("a.stl", TEXT_STL, 1), ("a.ply", TEXT_PLY, 1), ("a.PLY", BIG_PLY, 1), ("a.obj", SQUARE_OBJ, 2)],
)
def test_files_of_others_are_read(name: str, content: bytes, triangles: int) -> None:
    """Text STL, text and big-endian PLY, and an OBJ with a square counted from its end."""
    solid = read_mesh(content, name, 1.0).solid
    assert len(solid.triangles) == triangles
    assert solid.size_mm == pytest.approx((1000, 1000, 0))


NAN_OBJ = b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("a.stl", mesh_bytes(ball(1), "stl", None)[:-7], "cut short"),
        ("a.stl", b"solid a\nfacet", "no whole STL"),
        ("a.stl", TEXT_STL.replace(b"vertex 0 1 0", b"vertex 0 1 x"), "no number"),
        ("a.stl", TEXT_STL.replace(b"vertex 0 1 0\n", b""), "three corners"),
        ("a.stl", TEXT_STL.replace(b"vertex 0 1 0", b"vertex 1 0 0"), "three corners"),
        ("a.stl", b"", "no whole STL"),
        ("a.ply", mesh_bytes(ball(1), "ply", None)[:-7], "cut short"),
        ("a.ply", TEXT_PLY[:-9], "cut short"),
        ("a.ply", TEXT_PLY[: TEXT_PLY.index(b"end_header") + 11], "cut short"),
        ("a.ply", mesh_bytes(ball(1), "ply", None)[:-13] + b"\x04" + bytes(12), "cut short"),
        ("a.ply", b"ply\nno header", "no PLY"),
        ("a.ply", TEXT_PLY.replace(b"property double z\n", b"").replace(b" 0\n", b"\n"), "no points"),
        ("a.ply", TEXT_PLY.replace(b"face 1", b"face 99999999999"), "cut short"),
        ("a.ply", TEXT_PLY.replace(b"3 0 1 2", b"4 0 1 2"), "cut short"),
        ("a.ply", TEXT_PLY.replace(b"element", b"elephant", 1), "no PLY"),
        ("a.ply", mesh_bytes(Solid(ball(1).points_m, np.zeros((0, 3), np.int32), _NONE), "ply", None), "no triangle"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "no point of it"),
        ("a.obj", b"v 0 0 0\nf 1 1\n", "no triangle"),
        ("a.obj", b"v 0 0 0\nf 1 1 0\n", "line 2"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999999\n", "line 4"),
        ("a.obj", b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", "three numbers"),
        ("a.obj", NAN_OBJ, "no place"),
        ("a.obj", NAN_OBJ.replace(b"nan", b"1e300"), "no place"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nf 1 2 2\n", "three corners"),
        ("a.obj", b"", "no triangle"),
        ("a.png", b"", "no mesh that is read"),
    ],
)  # fmt: skip
def test_what_is_no_sound_mesh_is_refused_in_one_line(name: str, content: bytes, word: str) -> None:
    """The line names the file and what is wrong."""
    with pytest.raises(DataError, match=word) as refused:
        read_mesh(content, name, 1.0)
    assert name in refused.value.problem
    assert "\n" not in str(refused.value)


@given(
    kind=st.sampled_from(READABLE), at=st.integers(0, 4000), value=st.binary(min_size=1, max_size=6), cut=st.booleans()
)
def test_spoiled_bytes_give_a_mesh_or_one_error(kind: str, at: int, value: bytes, *, cut: bool) -> None:
    """However a file is spoiled or cut, either a sound mesh comes out or a DataError."""
    content = mesh_bytes(ball(1), kind, None)
    at = min(at, len(content))
    spoiled = content[:at] if cut else content[:at] + value + content[at + len(value) :]
    try:
        solid = read_mesh(spoiled, f"a.{kind}", 1.0).solid
    except DataError:
        return
    assert 0 <= solid.triangles.min() <= solid.triangles.max() < len(solid.points_m)
    assert np.isfinite(solid.points_m[solid.triangles]).all()


def test_fewer_triangles_stay_within_the_tolerance_and_closed() -> None:
    """A ball with a tenth of its triangles is closed, and its points lie within the tolerance of the sphere."""
    solid = ball(5)
    fewer = decimated(solid, 0.0002)
    assert fewer.is_closed
    assert len(fewer.solid.triangles) < 0.3 * len(solid.triangles)
    shape = trimesh.Trimesh(fewer.solid.points_mm, fewer.solid.triangles)
    assert shape.is_watertight
    middles = np.linalg.norm(shape.triangles_center, axis=1)
    assert np.abs(middles - 50).max() < 0.2 + 0.1  # the tolerance, and what the ball's own triangles cut off
    assert fewer.solid.colours == pytest.approx(np.clip((fewer.solid.points_m + 0.05) * 2550, 0, 255), abs=2)


def test_a_closed_mesh_that_cannot_do_with_less_stays() -> None:
    """A cube of 12 triangles without colours keeps its 8 corners; where the tolerance leaves no body, the mesh stays as it is."""
    box = trimesh.creation.box((0.02, 0.02, 0.02))
    solid = Solid(np.asarray(box.vertices, np.float32), np.asarray(box.faces, np.int32), _NONE)
    told = decimated(solid, 0.0001)
    assert told.is_closed
    assert len(told.solid.triangles) == 12
    assert not told.solid.has_colours
    gone = decimated(solid, 10.0)
    assert gone.is_closed
    assert gone.solid.size_mm == pytest.approx((20, 20, 20))
    assert not fewer_triangles(solid, 0.0001)[1]
    assert "give a smaller --tolerance" in fewer_triangles(solid, 10.0)[1][0]


def test_an_open_mesh_keeps_its_triangles() -> None:
    """A library that wants closed meshes is not asked to change it."""
    solid = ball(2)
    open_one = Solid(solid.points_m, solid.triangles[:-5], solid.colours)
    told = decimated(open_one, 0.001)
    assert not told.is_closed
    assert told.solid is open_one


def test_the_same_mesh_gives_the_same_bytes() -> None:
    """No time and no chance is in any file."""
    solid = ball(1)
    assert all(mesh_bytes(solid, kind, Axes.CAMERA) == mesh_bytes(solid, kind, Axes.CAMERA) for kind in FORMATS)


def test_a_ply_does_not_begin_with_what_other_readers_take_for_blanks() -> None:
    """Assimp skips blanks after the header, though numbers follow: the point in front has none, and the mesh stays the same."""
    blank_m = np.frombuffer(bytes([0x0A, 0x84, 0xBB, 0x3C]), "<f4")[0] / 1000
    points = np.array([[blank_m, 0, 0], [0.01, 0, 0], [0, 0.02, 0], [0, 0, 0.03]], np.float32)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
    solid = Solid(points, triangles, np.arange(12, dtype=np.uint8).reshape(4, 3))
    content = mesh_bytes(solid, "ply", None)
    assert content.partition(b"end_header\n")[2][:1] not in b"\t\n\v\f\r "
    found = read_mesh(content, "x.ply", 0.001).solid
    assert found.points_m[found.triangles] == pytest.approx(points[triangles], abs=1e-8)
    assert np.array_equal(found.colours[found.triangles], solid.colours[triangles])


def test_our_own_files_are_read_in_their_unit(tmp_path: Path) -> None:
    """They say that they are in mm, so 100 mm are not 100 m; a user who says otherwise is believed."""
    for kind in READABLE:
        path = tmp_path / f"ball.{kind}"
        path.write_bytes(mesh_bytes(ball(1), kind, None))
        assert read_model(path).solid.size_mm[0] == pytest.approx(100, abs=0.1)
        assert read_model(path, "m").solid.size_mm[0] == pytest.approx(100 if kind == "glb" else 100_000, rel=0.001)


@pytest.mark.parametrize("name", ["missing", "folder"])
def test_a_model_that_is_not_there_is_told(tmp_path: Path, name: str) -> None:
    """Neither a missing path nor a folder without a scan is a model."""
    (tmp_path / "folder").mkdir()
    with pytest.raises(TandemError, match=name):
        read_model(tmp_path / name)


def test_a_scan_says_its_fineness_when_another_report_has_taken_its_name(tmp_path: Path) -> None:
    """Another command that writes into the folder moves the scan's report aside."""
    (tmp_path / "model.ply").write_bytes(mesh_bytes(ball(1), "ply", None))
    (tmp_path / "report.json").write_text(json.dumps({"command": "quality", "model": "a phone"}))
    (tmp_path / "report-scan.json").write_text(json.dumps({"model": {"voxel_m": 0.002, "axes": Axes.Y_UP.text}}))
    model = read_model(tmp_path)
    assert model.voxel_m == 0.002
    assert model.axes is Axes.Y_UP


@pytest.mark.parametrize("axes", [None, *Axes])
@pytest.mark.parametrize("kind", READABLE)
def test_a_file_of_ours_says_its_axes(tmp_path: Path, kind: str, axes: Axes | None) -> None:
    """Alone, without its scan's folder: what is made of it stands as the scan did, with its points where they were."""
    solid = ball(1)
    (tmp_path / f"cup.{kind}").write_bytes(mesh_bytes(solid, kind, axes))
    found = read_model(tmp_path / f"cup.{kind}")
    assert found.axes is axes
    places = found.solid.points_m[found.solid.triangles]
    assert places == pytest.approx(solid.points_m[solid.triangles], abs=1e-7)


@pytest.mark.parametrize(
    ("report", "voxel_m", "axes"),
    [
        (json.dumps({"model": {"voxel_m": 0.002, "axes": Axes.Y_UP.text}}), 0.002, Axes.Y_UP),
        ('{"model": {"voxel_m": "large"}}', math.nan, None),
        ("{", math.nan, None),
        ("[1]", math.nan, None),
    ],
)
def test_a_scan_says_its_fineness_and_axes(tmp_path: Path, report: str, voxel_m: float, axes: Axes | None) -> None:
    """They stand in its report; a spoiled report costs these two only."""
    (tmp_path / "model.ply").write_bytes(
        mesh_bytes(ball(1), "ply", None).replace(b"tandemscan; unit mm", b"unit metre         ")
    )
    (tmp_path / "report.json").write_text(report)
    model = read_model(tmp_path, "mm")
    assert model.voxel_m == pytest.approx(voxel_m, nan_ok=True)
    assert model.axes is axes
    assert model.stem == tmp_path.name
    assert model.solid.size_mm[0] == pytest.approx(100_000, abs=100)
