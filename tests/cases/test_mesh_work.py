"""Reading a mesh takes time that grows with the file: each of these small files would take hours if a step were repeated for each part.

No second is measured: whoever repeats such a step does not finish.
"""

import io
import zipfile
from typing import Any, Final

import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.meshes.formats import read_mesh
from tests.cases.make_glb import GlbFile
from tests.cases.make_three_mf import package

POINTS: Final = 2_000_000
PARTS: Final = 20_000


def many_primitives(file: GlbFile, attributes: dict[str, int]) -> bytes:
    """A GLB of primitives that are one triangle each, of one large table of points."""
    indices = file.add(np.array([0, POINTS // 2, POINTS - 1]), "u4")
    primitive = {"attributes": attributes, "indices": indices}
    return file.bytes([primitive] * PARTS, [{"mesh": mesh} for mesh in range(PARTS)], range(PARTS))


def places() -> np.ndarray[Any, Any]:
    """Points, all but two of them at the origin."""
    points = np.zeros((POINTS, 3), np.float32)
    points[POINTS // 2, 0] = points[-1, 1] = 0.04
    return points


def test_primitives_share_a_large_table_of_points() -> None:
    """Each takes the points and colours of its own triangles, not all."""
    file = GlbFile()
    colours = np.zeros((POINTS, 4), np.uint8)
    colours[-1] = 255
    attributes = {"POSITION": file.add(places(), "f4"), "COLOR_0": file.add(colours, "u1", normalized=True)}
    solid = read_mesh(many_primitives(file, attributes), "a.glb").solid
    assert len(solid.triangles) == PARTS
    assert solid.size_mm == pytest.approx((40, 40, 0))
    assert solid.colours[solid.points_m[:, 1] > 0.03].min() == 255
    assert solid.colours[solid.points_m[:, 1] < 0.03].max() == 0


def test_primitives_share_a_table_of_places_as_shares() -> None:
    """Integers that stand for shares become numbers where they are used alone."""
    file = GlbFile()
    points = np.zeros((POINTS, 3), np.int16)
    points[POINTS // 2, 0] = points[-1, 1] = 32767
    content = many_primitives(file, {"POSITION": file.add(points, "i2", normalized=True)})
    assert read_mesh(content, "a.glb").solid.size_mm == pytest.approx((1000, 1000, 0))


def test_primitives_share_a_few_sparse_places() -> None:
    """Most points are nowhere, two have places of their own."""
    file = GlbFile()
    file.add(places()[:10], "f4")  # bytes that bound how many points may be left at zero
    file.buffer += bytes(POINTS)
    rows = file.view(np.array([POINTS // 2, POINTS - 1], "<u4").tobytes())
    values = file.view(np.array([[0.04, 0, 0], [0, 0.04, 0]], "<f4").tobytes())
    sparse = {"count": 2, "indices": {"bufferView": rows, "componentType": 5125}, "values": {"bufferView": values}}
    accessor = file.add(np.zeros((0, 3)), "f4", count=POINTS, sparse=sparse)
    solid = read_mesh(many_primitives(file, {"POSITION": accessor}), "a.glb").solid
    assert solid.size_mm == pytest.approx((40, 40, 0))
    assert len(solid.points_m) == 3


def test_sparse_places_are_not_read_without_end() -> None:
    """A long table of changes that each of many primitives would read anew is refused."""
    file = GlbFile()
    rows = file.view(np.arange(POINTS, dtype="<u4").tobytes())
    values = file.view(places().tobytes())
    sparse = {"count": POINTS, "indices": {"bufferView": rows, "componentType": 5125}, "values": {"bufferView": values}}
    accessor = file.add(np.zeros((0, 3)), "f4", count=POINTS, sparse=sparse)
    with pytest.raises(DataError, match="more than 20 million"):
        read_mesh(many_primitives(file, {"POSITION": accessor}), "a.glb")


def test_a_face_goes_on_for_millions_of_lines() -> None:
    """The lines are put together once."""
    content = b"v 0 0 0\nv 40 0 0\nv 0 30 0\nf 1 2" + b" \\\n" * 3_000_000 + b" 3\n"
    assert read_mesh(content, "a.obj", 0.001).solid.size_mm == pytest.approx((40, 30, 0))


def test_objects_of_many_colours() -> None:
    """The list of colours is made into a table once, not for each object."""
    colours = "".join(f'<m:color color="#{shade:06X}"/>' for shade in range(250_000))
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="0"/>' for x, y in ((0, 0), (40, 0), (0, 30)))
    triangle = '<triangle v1="0" v2="1" v3="2" pid="1" p1="200"/>'
    mesh = f"<mesh><vertices>{vertices}</vertices><triangles>{triangle}</triangles></mesh>"
    objects = "".join(f'<object id="{number}">{mesh}</object>' for number in range(2, 9002))
    content = package(f'<resources><m:colorgroup id="1">{colours}</m:colorgroup>{objects}</resources>')
    solid = read_mesh(content, "a.3mf").solid
    assert len(solid.triangles) == 9000
    assert (solid.colours == (0, 0, 200)).all()


def test_a_3mf_of_too_much_text_is_refused_before_it_is_read() -> None:
    """What is packed a hundredfold may be a small file; as a text it is as long as any other."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr("3D/3dmodel.model", b"<model/>")
        archive.writestr("Metadata/picture.png", bytes(6 << 20))
    content = bytearray(held.getvalue())
    entry = content.index(b"PK\x01\x02")
    content[entry + 24 : entry + 28] = (600 << 20).to_bytes(4, "little")  # the size that it will have
    with pytest.raises(DataError, match="text of 600 MB"):
        read_mesh(bytes(content), "a.3mf")
