"""Meshes as other programs write them are read with their right answer, or refused in one line that names why (`make_meshes` wrote them)."""

import io
import json
import re
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.meshes.assembly import Part, assemble, require_count
from phone_host.output.meshes.formats import FORMATS, READABLE, mesh_bytes, read_mesh
from phone_host.output.meshes.printable import volume_mm3
from phone_host.output.meshes.solid import NO_COLOURS, Solid
from phone_host.output.model_file import read_model
from tests.cases.make_meshes import all_cases

FOLDER: Final = Path(__file__).parent / "meshes"
ANSWERS: Final[dict[str, dict[str, Any]]] = json.loads((FOLDER / "answers.json").read_text())
READ: Final = [name for name, answer in ANSWERS.items() if "refused" not in answer]
REFUSED: Final = [name for name, answer in ANSWERS.items() if "refused" in answer]
NO_UNIT: Final = ("stl", "obj", "ply")


def area_mm2(solid: Solid) -> float:
    """Area of all triangles."""
    corners = solid.points_mm[solid.triangles].astype(np.float64)
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(doubled, axis=1).sum() / 2)


def require(solid: Solid, answer: dict[str, Any]) -> None:
    """Compare a mesh with its answer."""
    near = answer.get("rel", 3e-5)
    assert len(solid.triangles) == answer["triangles"]
    assert solid.size_mm == pytest.approx(tuple(answer["size"]), rel=near)
    assert area_mm2(solid) == pytest.approx(answer["area"], rel=2 * near)
    assert volume_mm3(solid.points_mm[solid.triangles].astype(np.float64)) == pytest.approx(
        answer["volume"], rel=3 * near
    )
    assert len(solid.points_m) == answer.get("points", len(solid.points_m))
    if "colour" in answer:
        assert solid.has_colours
        assert np.abs(solid.colours.astype(int) - answer["colour"]).max() <= 1


def read(name: str) -> Solid:
    """Read a case; formats without a unit are in mm."""
    return read_model(FOLDER / name, "mm" if name.rpartition(".")[2] in NO_UNIT else None).solid


@pytest.mark.parametrize("name", READ)
def test_a_mesh_of_another_program_is_read_as_it_is_meant(name: str) -> None:
    """Triangles, size, area, volume and colours are what geometry says."""
    require(read(name), ANSWERS[name])


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_with_its_true_reason(name: str) -> None:
    """One line names the file and the reason."""
    with pytest.raises(DataError, match=ANSWERS[name]["refused"]) as refused:
        read(name)
    assert name in refused.value.problem
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", READ)
def test_what_was_read_is_written_whole_in_every_format(name: str) -> None:
    """What we write of it says the same when it is read again: no point that is no place reaches a file."""
    solid, answer = read(name), ANSWERS[name]
    assert np.isfinite(solid.points_m).all()
    for kind in FORMATS:
        content = mesh_bytes(solid, kind, None)
        if kind in READABLE:
            told = {key: value for key, value in answer.items() if key != "colour" or kind != "stl"}
            require(read_mesh(content, f"x.{kind}").solid, told)
        if kind in {"obj", "3mf"}:
            assert b"nan" not in content.lower()


def test_the_files_are_those_that_are_made() -> None:
    """`python -m tests.cases.make_meshes` writes these bytes and answers."""
    made = {name: (content, answer) for name, content, answer in all_cases()}
    assert sorted(made) == sorted(ANSWERS) == sorted(path.name for path in FOLDER.iterdir() if path.suffix != ".json")
    for name, (content, answer) in made.items():
        assert json.loads(json.dumps(answer)) == ANSWERS[name]
        if not name.endswith(".3mf"):  # what zlib makes of the same text may change
            assert (FOLDER / name).read_bytes() == content


def test_a_file_is_what_its_bytes_say() -> None:
    """A GLB, a 3MF or a PLY under another name is read as what it is."""
    for name in ("indices-u2.glb", "plain.3mf", "quads-binary.ply"):
        content = (FOLDER / name).read_bytes()
        assert len(read_mesh(content, "model.stl", 0.001).solid.triangles) == ANSWERS[name]["triangles"]


def test_the_documentation_names_every_case_and_no_other() -> None:
    """Each row of the table in docs/files.md is backed by the files that it names."""
    text = (
        (FOLDER.parents[2] / "docs/files.md")
        .read_text()
        .partition("## Meshes of other programs")[2]
        .partition("\n## ")[0]
    )
    rows = [line.split("|") for line in text.splitlines() if line.startswith("| ") and "`" in line]
    named = [name for row in rows for name in re.findall(r"`([^`]+)`", row[4])]
    assert sorted(named) == sorted(ANSWERS)
    for row in rows:
        assert all(f".{row[1].strip().lower()}`" in name for name in row[4].split())


def changed_glb(change: Callable[[dict[str, Any]], object]) -> bytes:
    """A GLB of a box whose JSON was changed."""
    content = (FOLDER / "colours-u2.glb").read_bytes()
    length = struct.unpack_from("<I", content, 12)[0]
    tree = json.loads(content[20 : 20 + length])
    change(tree)
    text = json.dumps(tree).encode()
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + content[20 + length :]
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda tree: tree["bufferViews"][0].update(byteOffset=1 << 40), "cut short"),
        (lambda tree: tree["accessors"][0].update(count=1 << 40), "cut short"),
        (lambda tree: tree["accessors"][0].update(count=-1), "cut short"),
        (lambda tree: tree["accessors"][0].pop("bufferView"), "cut short"),
        (lambda tree: tree["accessors"][0].update(type="VEC4"), "cut short"),
        (lambda tree: tree["accessors"][2].update(count=3), "cut short"),
        (lambda tree: tree["accessors"][0].update(sparse={"count": 10**12}, count=10**12, bufferView=None), "cut short"),
        (lambda tree: (tree["accessors"][0].update(sparse={}, count=10**9), tree["accessors"][0].pop("bufferView")), "cut short"),
        (lambda tree: tree["nodes"][0].update(mesh=7), "cut short"),
        (lambda tree: tree.update(meshes=[]), "cut short"),
        (lambda tree: tree["nodes"][0].pop("mesh"), "no triangle"),
        (lambda tree: tree["nodes"][0].update(scale=[1e200, 1, 1]), "no place"),
        (lambda tree: tree.pop("asset"), "cut short"),
        (lambda tree: tree.update(nodes=[{"mesh": 0}] * 100_001), "more than 100000 nodes"),
        (lambda tree: tree.update(nodes=[{"mesh": 0, "children": [1] * 9}, *[{}] * 9]), None),
        (lambda tree: tree.update(extras=json.loads("[" * 900 + "]" * 900)), None),
        (lambda tree: (tree.pop("scenes"), tree.pop("scene")), None),
        (lambda tree: tree["accessors"][0].update(count=True), "cut short"),
    ],
)  # fmt: skip
def test_a_glb_that_contradicts_itself_is_refused(change: Callable[[dict[str, Any]], object], word: str | None) -> None:
    """Whatever its JSON says: one line, or the box; None: that is no contradiction."""
    content = changed_glb(change)
    if word is None:
        assert len(read_mesh(content, "a.glb").solid.triangles) == 12
        return
    with pytest.raises(DataError, match=word) as refused:
        read_mesh(content, "a.glb")
    assert "a.glb" in refused.value.problem


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("a.glb", b"glTF" + bytes(30), "version 0"),
        ("a.glb", b"no glTF at all, whatever its name", "no GLB"),
        ("a.glb", b"glTF\2\0\0\0" + struct.pack("<III", 60_032, 60_012, 0x4E4F534A) + b"[" * 60_012, "cut short"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nelement tristrips 1\nproperty int n\nend_header\n1 2 3\n4\n", "no triangle"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nelement face 1\nproperty list uchar int near\nend_header\n1 2 3\n1 0\n", "no triangle"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nend_header\n-1\n", "cut short"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", "no PLY"),
        ("a.obj", b"v 1 2 \\\n3\nf 1 \\\n 2 \\\n x\n", "line 3 is not read"),
        ("a.obj", b"v 1 2 \\\n3\nv 1 2 \\\r\n3\nv 1 2 x\n", "line 5 is not read"),
        ("a.ply", b"ply\nelement vertex 1\nend_header\n", "no PLY"),
        ("a.ply", b"ply\nformat ascii 1.0\nproperty int x\nend_header\n", "no PLY"),
    ],
)  # fmt: skip
def test_what_is_no_mesh_is_refused(name: str, content: bytes, word: str) -> None:
    """In one line."""
    with pytest.raises(DataError, match=word):
        read_mesh(content, name)


def test_a_3mf_that_contradicts_itself_is_refused() -> None:
    """An object that is not there, and more objects than any thing has."""
    with zipfile.ZipFile(FOLDER / "plain.3mf") as archive:
        text = archive.read("3D/3dmodel.model").decode()
    for changed, word in (
        (text.replace('objectid="1"', 'objectid="2"'), "does not hold"),
        (text.replace("<build>", "<build>" + '<item objectid="1"/>' * 110_000), "more than 100000"),
        (text.replace('unit="millimeter"', 'unit="mile"'), "no 3MF"),
        (text.replace("</mesh>", ""), "no 3MF"),
        (text.replace('version="1.0"', 'version="1.0" encoding="F-16"'), "no 3MF"),
    ):
        held = io.BytesIO()
        with zipfile.ZipFile(held, "w") as archive:
            archive.writestr("3D/3dmodel.model", changed)
        with pytest.raises(DataError, match=word):
            read_mesh(held.getvalue(), "a.3mf")
    with pytest.raises(DataError, match="no 3MF"):
        read_mesh(b"PK\x03\x04 and no more", "a.3mf")


@pytest.mark.parametrize(
    ("config", "triangles"),
    [
        ('<config><object id="1"><volume firstid="6" lastid="99"><metadata key="modifier" value="1"/></volume></object></config>', 6),
        ('<config><object id="1"><volume firstid="6" lastid="9"><metadata key="modifier" value="0"/></volume></object></config>', 12),
        ('<config><object id="7"><volume firstid="0" lastid="11"><metadata key="modifier" value="1"/></volume></object></config>', 12),
        ('<config><object id="1"><volume firstid="-9" lastid="-1"><metadata key="modifier" value="1"/></volume></object></config>', 12),
        ("<!DOCTYPE config><config/>", None),
        ('<config><object id="1"><volume/></object></config>', None),
        ("no XML", None),
    ],
)  # fmt: skip
def test_what_a_slicer_says_of_a_mesh_is_checked(config: str, triangles: int | None) -> None:
    """Ranges beyond the mesh and objects that are not there change nothing; what cannot be read is refused, for a modifier may be in it."""
    held = io.BytesIO((FOLDER / "plain.3mf").read_bytes())
    with zipfile.ZipFile(held, "a") as archive:
        archive.writestr("Metadata/Slic3r_PE_model.config", config)
    if triangles is not None:
        assert len(read_mesh(held.getvalue(), "a.3mf").solid.triangles) == triangles
        return
    with pytest.raises(DataError, match="no 3MF"):
        read_mesh(held.getvalue(), "a.3mf")


def test_a_concave_face_of_thousands_of_corners_is_refused() -> None:
    """Cutting it would take for ever."""
    star = "".join(f"v {x % 2} {x} 0\n" for x in range(2000)) + "v 9 0 0\n"
    with pytest.raises(DataError, match="concave faces"):
        read_mesh(f"{star}f {' '.join(map(str, range(1, 2002)))}\n".encode(), "a.obj")


def test_a_part_is_not_repeated_without_end() -> None:
    """A small file may place a part often, but not more than memory holds."""
    part = Part(np.eye(3), np.tile(np.arange(3, dtype=np.int32), (500_000, 1)), NO_COLOURS, np.eye(4))
    assert len(assemble("a.glb", [part] * 2, 1.0).triangles) == 1_000_000
    with pytest.raises(DataError, match="more than 4 million"):
        assemble("a.glb", [part] * 9, 1.0)
    with pytest.raises(DataError, match="more than 20 million"):
        require_count("a.glb", 20_000_001)
