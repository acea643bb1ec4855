"""Meshes as other programs write them are read with their right answer, or refused in one line that names why (`make_meshes` wrote them)."""

import json
import re
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.meshes.formats import FORMATS, READABLE, mesh_bytes, read_mesh
from phone_host.output.meshes.printable import volume_mm3
from phone_host.output.meshes.solid import Solid
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
    return read_model(FOLDER / name, 0.001 if name.rpartition(".")[2] in NO_UNIT else float("nan")).solid


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
