"""Reading a mesh takes at most 12 times the size of a binary file and 40 times that of a text, whatever the file claims.

A 3MF counts by the text inside: one of a usual mesh keeps to 12 times, one that is nothing but objects or open elements to 40.
"""

import struct
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.meshes.formats import mesh_bytes, read_mesh
from phone_host.output.meshes.solid import NO_COLOURS, Solid
from tests.cases.make_three_mf import package

ROOT: Final = Path(__file__).resolve().parents[2]
SIDE: Final = 300
TEXTS: Final = (".obj", "-text.ply", "-text.stl", "many-objects.3mf", "nested.3mf")
SLACK: Final = 4 << 20
"""What the interpreter and parts of fixed size take beside the file, bytes."""


def _header(form: str, vertices: int, faces: int) -> str:
    return (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A rough surface of 180 000 triangles in each format, and what takes most memory for its size."""
    folder = tmp_path_factory.mktemp("files")
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    z = np.random.default_rng(1).random((SIDE, SIDE))
    points = (np.stack([x, y, z], -1).reshape(-1, 3) / 1000).astype(np.float32)
    at = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    quads = np.stack([at, at + 1, at + SIDE + 1, at + SIDE], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 3]], quads[:, [1, 2, 3]]]).astype(np.int32)
    solid = Solid(points, triangles, NO_COLOURS)
    made = {f"rough.{kind}": mesh_bytes(solid, kind, None) for kind in ("stl", "obj", "ply", "glb", "3mf")}
    packed = points.astype("<f4").tobytes()
    four = np.zeros(len(quads), [("n", "u1"), ("c", "<i4", 4)])
    four["n"], four["c"] = 4, quads
    mixed = b"".join(
        each.tobytes() + np.uint8(3).tobytes() + three.astype("<i4").tobytes()
        for each, three in zip(four[::4], triangles[::4], strict=False)
    )
    count = 2 * len(four[::4])
    made["quads.ply"] = _header("binary_little_endian", len(points), len(quads)).encode() + packed + four.tobytes()
    made["mixed.ply"] = _header("binary_little_endian", len(points), count).encode() + packed + mixed
    made["short-text.ply"] = (_header("ascii", 120_000, 120_000) + "1 2 3\n" * 120_000 + "3 1 2 3\n" * 120_000).encode()
    made["claims-text.ply"] = (_header("ascii", 2_000_000_000, 9) + "1 2 3\n" * 250_000).encode()
    made["short.obj"] = b"v 1 2 3\n" * 120_000 + b"f 1 2 3\n" * 120_000
    text = b'{"asset":{},"extras":[' + b"[]," * 1_000_000 + b"0]}"
    lists = struct.pack("<II", len(text), 0x4E4F534A) + text
    made["lists.glb"] = struct.pack("<III", 0x46546C67, 2, 12 + len(lists)) + lists
    made["many-objects.3mf"] = package("".join(f'<object id="{number}"/>' for number in range(99_000)))
    made["nested.3mf"] = package("<a>" * 1_000_000)
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    made["same-text.stl"] = f"solid a\n{facet * 15_000}endsolid\n".encode()
    for name, content in made.items():
        (folder / name).write_bytes(content)
    return [folder / name for name in made]


def test_reading_takes_a_bounded_multiple_of_the_file(files: list[Path]) -> None:
    """By the peak of a real process, less what it had before."""
    asked = [sys.executable, "-m", "tests.cases.peak_memory", *map(str, files)]
    said = subprocess.run(asked, capture_output=True, text=True, check=True, cwd=ROOT, timeout=300)
    peaks = [int(line) for line in said.stdout.split()][1:]
    assert len(peaks) == len(files)
    for path, peak in zip(files, peaks, strict=True):
        size = path.stat().st_size
        if path.suffix == ".3mf":
            with zipfile.ZipFile(path) as archive:
                size = sum(each.file_size for each in archive.infolist())
        most = (40 if path.name.endswith(TEXTS) else 12) * size + SLACK
        assert peak <= most, (path.name, peak / size)
    assert "claims-text.ply is cut short" in said.stderr
    assert "lists.glb is cut short, or no GLB file" in said.stderr


def test_a_text_that_is_too_long_is_refused_before_it_is_read() -> None:
    """513 MB of nothing: no page of it is touched."""
    with pytest.raises(DataError, match="text of 513 MB"):
        read_mesh(bytes(513 << 20), "a.obj")
