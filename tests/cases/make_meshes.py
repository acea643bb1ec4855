"""Writes the meshes of `tests/cases/meshes` with their right answers: `python -m tests.cases.make_meshes`.

Each file holds one thing that other programs do. What is in all of them is known from geometry: a box of 40 x 30 x 20 (12 triangles, closed), or an L.
"""

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from tests.cases.make_glb import glb_cases
from tests.cases.make_three_mf import three_mf_cases

FOLDER: Final = Path(__file__).parent / "meshes"
CORNERS: Final = np.array([[x, y, z] for z in (0, 20.0) for y in (0, 30.0) for x in (0, 40.0)])
QUADS: Final = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
TRIANGLES: Final = tuple(each for q in QUADS for each in ((q[0], q[1], q[2]), (q[0], q[2], q[3])))
BOX: Final = {"triangles": 12, "size": [40, 30, 20], "area": 5200, "volume": 24000}
_L: Final = ((0, 40), (0, 0), (40, 0), (40, 10), (10, 10), (10, 40))
_RED: Final = (200, 10, 10)

Case = tuple[str, bytes, dict[str, Any]]


def _text(rows: Sequence[Sequence[float]], before: str = "", between: str = " ", after: str = "\n") -> str:
    return "".join(before + between.join(f"{value:g}" for value in row) + after for row in rows)


def _ply(
    count: int,
    faces: str,
    *,
    form: str = "ascii",
    vertices: int = 8,
    of_vertex: str = "property float x\nproperty float y\nproperty float z\n",
    more: str = "",
) -> str:
    return (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\n{of_vertex}element face {count}\n{faces}{more}end_header\n"
    )


_LIST: Final = "property list uchar int vertex_indices\n"
_RGB: Final = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
_LITTLE: Final = "binary_little_endian"


def ply_cases() -> list[Case]:
    """Return what other programs write as PLY."""
    points, packed = _text(CORNERS.tolist()), CORNERS.astype("<f4").tobytes()
    three = [(3, *each) for each in TRIANGLES]
    four = [(4, *each) for each in QUADS]
    mixed = [*four[:5], *three[10:]]
    red = {"colour": list(_RED)}
    big = CORNERS.astype(">f4").tobytes()
    quads = b"".join(struct.pack("<B4i", *each) for each in four)
    strip = (0, 2, 1, 3, 5, 7, 4, 6, 0, 2, -1, 0, 1, 4, 5, -1, 3, 2, 7, 6)
    shares = np.tile(np.array(_RED) / 255, (8, 1))
    colours = [[*corner, *share] for corner, share in zip(CORNERS.tolist(), shares.tolist(), strict=True)]
    words = [[*corner, *(257 * value for value in _RED)] for corner in CORNERS.tolist()]
    shade = "property float x\nproperty float y\nproperty float z\nproperty {0} red\nproperty {0} green\nproperty {0} blue\n"
    text = _ply(6, _LIST) + points + _text(four)
    return [
        ("face-colours-text.ply", (_ply(12, _LIST + _RGB) + points + _text([(*each, *_RED) for each in three])).encode(), BOX | red),
        ("face-colours-binary.ply", _ply(12, _LIST + _RGB, form=_LITTLE).encode() + packed + b"".join(struct.pack("<B3i3B", *each, *_RED) for each in three), BOX | red),
        ("scalar-before-list.ply", (_ply(12, "property uchar material_index\n" + _LIST) + points + _text([(7, *each) for each in three])).encode(), BOX),
        ("quads-text.ply", text.encode(), BOX),
        ("quads-binary.ply", _ply(6, _LIST, form=_LITTLE).encode() + packed + quads, BOX),
        ("mixed-text.ply", (_ply(7, _LIST) + points + _text(mixed)).encode(), BOX),
        ("mixed-big-endian.ply", _ply(7, _LIST, form="binary_big_endian").encode() + big + b"".join(struct.pack(f">B{each[0]}i", *each) for each in mixed), BOX),
        ("texture-list.ply", _ply(12, _LIST + "property list uchar float texcoord\n", form=_LITTLE).encode() + packed + b"".join(struct.pack("<B3iB6f", *each, 6, 0, 0, 1, 0, 1, 1) for each in three), BOX),
        ("texture-list-mixed.ply", _ply(7, _LIST + "property list uchar float texcoord\nproperty int texnumber\n", form=_LITTLE).encode() + packed + b"".join(struct.pack(f"<B{n[0]}iB{2 * n[0]}fi", *n, 2 * n[0], *[0.5] * (2 * n[0]), 0) for n in mixed), BOX),
        ("short-counts.ply", (_ply(12, "property list ushort uint vertex_index\n") + points + _text(three)).encode(), BOX),
        ("strips.ply", (_ply(1, "property list int int vertex_indices\n").replace("face", "tristrips") + points + _text([(len(strip), *strip)])).encode(), BOX),
        ("shares-as-colours.ply", (_ply(6, _LIST, of_vertex=shade.format("float")) + _text(colours) + _text(four)).encode(), BOX | red),
        ("colours-of-16-bit.ply", (_ply(6, _LIST, of_vertex=shade.format("ushort")) + _text(words) + _text(four)).encode(), BOX | red),
        ("windows-lines-and-mark.ply", b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode(), BOX),
        ("tabs-and-blank-lines.ply", text.replace("\nelement", "\nelement\t").replace("\n0 ", "\n\n 0\t").encode(), BOX),
        ("one-line-of-numbers.ply", (_ply(6, _LIST) + (points + _text(four)).replace("\n", " ")).encode(), BOX),
        ("words-behind-the-text.ply", (text + "0 1 2\nmade by hand\n").encode(), BOX),
        ("bytes-behind-the-last-face.ply", _ply(6, _LIST, form=_LITTLE).encode() + packed + quads + b"\0\n\xff", BOX),
        ("comment-with-end-header.ply", text.replace("element vertex", "comment end_header comes later\nelement vertex").encode(), BOX),
        ("edges-and-camera.ply", (_ply(6, _LIST, more="element edge 2\nproperty int vertex1\nproperty int vertex2\nelement camera 1\nproperty float view_px\n") + points + _text(four) + "0 1\n1 2\n0.5\n").encode(), BOX),
        ("capitals.ply", (_ply(6, _LIST).upper() + points + _text(four)).encode(), BOX),
        ("neighbours-of-points.ply", (_ply(6, _LIST, of_vertex="property list uchar int near\nproperty double x\nproperty double y\nproperty double z\n") + "".join(f"{n % 3} {'1 ' * (n % 3)}{x:g} {y:g} {z:g}\n" for n, (x, y, z) in enumerate(CORNERS)) + _text(four)).encode(), BOX),
        ("points-that-are-no-places.ply", (_ply(6, _LIST, vertices=11) + points + "nan nan nan\ninf 0 0\n1e300 0 0\n" + _text(four)).encode(), BOX),
        ("split-at-seams.ply", (_ply(6, _LIST, vertices=24) + _text([CORNERS[n].tolist() for each in QUADS for n in each]) + _text([(4, *range(4 * k, 4 * k + 4)) for k in range(6)])).encode(), BOX | {"points": 8}),
        ("faces-of-two-corners.ply", (_ply(8, _LIST) + points + _text(four) + "2 0 1\n1 4\n").encode(), BOX),
        ("counts-with-signs.ply", _ply(6, "property list int int vertex_indices\n", form=_LITTLE).encode() + packed + b"".join(struct.pack("<5i", *each) for each in four), BOX),
        ("corners-of-16-bit.ply", _ply(6, "property list uchar ushort vertex_index\n", form=_LITTLE).encode() + packed + b"".join(struct.pack("<B4H", *each) for each in four), BOX),
        ("names-of-sizes-and-doubles.ply", _ply(6, "property list uint8 int32 vertex_indices\n", form=_LITTLE, of_vertex="property float64 x\nproperty float64 y\nproperty float64 z\n").encode() + CORNERS.astype("<f8").tobytes() + quads, BOX),
        ("faces-before-points.ply", ("ply\nformat ascii 1.0\ncomment : by hand\nobj_info num_cols 8\nelement face 6\n" + _LIST + "element vertex 8\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + _text(four) + points).encode(), BOX),
        ("blanks-behind-the-header.ply", (_ply(6, _LIST).replace("\n", " \n") + points + _text(four)).encode(), BOX),
        ("properties-in-another-order.ply", (_ply(6, _LIST, of_vertex="property float nx\nproperty float z\nproperty float x\nproperty uchar alpha\nproperty float y\n") + _text([(0, z, x, 255, y) for x, y, z in CORNERS.tolist()]) + _text(four)).encode(), BOX),
        ("claims-too-many-points.ply", (_ply(6, _LIST, vertices=2_000_000_000) + points + _text(four)).encode(), {"refused": "cut short"}),
        ("claims-too-many-faces.ply", _ply(2_000_000_000, _LIST, form=_LITTLE).encode() + packed + quads, {"refused": "cut short"}),
        ("claims-a-long-face.ply", _ply(1, "property list uint int vertex_indices\n", form=_LITTLE).encode() + packed + struct.pack("<I", 0xFFFFFFF0), {"refused": "cut short"}),
        ("a-corner-that-is-no-place.ply", (_ply(6, _LIST) + points.replace("0 30 0", "0 nan 0", 1) + _text(four)).encode(), {"refused": "no place"}),
    ]  # fmt: skip


def obj_cases() -> list[Case]:
    """Return what other programs write as OBJ."""
    v = _text(CORNERS.tolist(), "v ")
    ones = [[number + 1 for number in each] for each in QUADS]
    f = _text(ones, "f ")
    sides = [(i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6) for i in range(6)]
    faces = [tuple(range(5, -1, -1)), tuple(range(6, 12)), *sides]
    concave = _text([(x, y, z) for z in (0, 10) for x, y in _L], "v ") + _text(
        [[number + 1 for number in each] for each in faces], "f "
    )
    red = {"colour": list(_RED)}
    ring = [(10 * np.cos(a), 10 * np.sin(a), z) for z in (0, 5) for a in np.arange(200) * np.pi / 100]
    round_faces = [
        tuple(range(200, 0, -1)),
        tuple(range(201, 401)),
        *((i + 1, (i + 1) % 200 + 1, (i + 1) % 200 + 201, i + 201) for i in range(200)),
    ]
    disc = float(100 * 100 * np.sin(np.pi / 100))
    relative = [[number - 8 for number in each] for each in QUADS]
    return [
        ("plain.obj", (v + f).encode(), BOX),
        ("tabs.obj", (v + f).replace(" ", "\t").encode(), BOX),
        ("indented.obj", (_text(CORNERS.tolist(), "  v ") + _text(ones, "\t f ")).encode(), BOX),
        ("continued-lines.obj", (v + "".join(f"f {a} {b} \\\n  {c} {d}\n" for a, b, c, d in ones)).encode(), BOX),
        ("paths-with-backslashes.obj", ("# made by C:\\models\\\n" + v + "g C:\\parts\\\n" + f).encode(), BOX),
        ("continued-windows-lines.obj", (v + "".join(f"f {a} \\\r\n {b} \\\r\n {c} {d}\r\n" for a, b, c, d in ones)).encode(), BOX),
        ("comments-that-end-in-a-backslash.obj", (v + f.replace("\n", " # C:\\parts\\\n")).encode(), BOX),
        ("continued-behind-the-key-word.obj", (v + "".join(f"f \\\n{a} {b}\\\n{c} {d}\n" for a, b, c, d in ones)).encode(), BOX),
        ("continued-behind-a-comment.obj", (v + "".join(f"f {a} {b} \\\n# the rest\n {c} {d}\n" for a, b, c, d in ones)).encode(), BOX),
        ("comments-behind.obj", (v.replace("\n", " # corner\n") + f.replace("\n", " # side\n")).encode(), BOX),
        ("one-point-with-a-tab.obj", (v + "v\t500 500 500\n" + _text((CORNERS + np.array([60, 0, 0])).tolist(), "v ") + f + _text([[n + 9 for n in each] for each in ones], "f ")).encode(), {"triangles": 24, "size": [100, 30, 20], "area": 10400, "volume": 48000}),
        ("one-face-with-tabs.obj", (v + _text(ones[:5], "f ") + _text(ones[5:], "f\t", "\t")).encode(), BOX),
        ("capitals.obj", (v + f).upper().encode(), BOX),
        ("mark-of-utf-8.obj", b"\xef\xbb\xbf" + (v + f).encode(), BOX),
        ("utf-16.obj", (v + f).encode("utf-16"), BOX),
        ("old-mac-lines.obj", (v + f).replace("\n", "\r").encode(), BOX),
        ("concave-face.obj", concave.encode(), {"triangles": 20, "size": [40, 40, 10], "area": 3000, "volume": 7000}),
        ("face-of-200-corners.obj", (_text(ring, "v ") + _text(round_faces, "f ")).encode(), {"triangles": 796, "size": [20, 20, 5], "area": 2 * disc + 5 * 200 * 20 * float(np.sin(np.pi / 200)), "volume": 5 * disc}),
        ("faces-of-old-files.obj", (v + f.replace("f ", "fo ")).encode(), BOX),
        ("slashes-without-numbers.obj", (v + "vt 0 0\n" + "".join("f " + " ".join(f"{n}/" for n in each) + "\n" for each in ones[:3]) + "".join("f " + " ".join(f"{n}//" for n in each) + "\n" for each in ones[3:])).encode(), BOX),
        ("powers-of-ten-and-signs.obj", ("".join("v " + " ".join(f"+{value:.6E}" for value in corner) + "\n" for corner in CORNERS.tolist()) + f).encode(), BOX),
        ("faces-before-points.obj", (f + v).encode(), BOX),
        ("groups-named-like-faces.obj", ("o v 1 2 3\n" + v + "g f 1 2 3\nusemtl f 1 2\n" + f).encode(), BOX),
        ("commas-in-numbers.obj", (v.replace("40", "40,0") + f).encode(), {"refused": "line 2 is not read"}),
        ("counted-back.obj", (v + _text(relative, "f ")).encode(), BOX),
        ("counted-back-in-two-parts.obj", (v + _text(relative[:3], "f ") + "v 7 7 7\n" + _text([[n - 1 for n in each] for each in relative[3:]], "f ")).encode(), BOX),
        ("texture-and-normals.obj", ("mtllib box.mtl\no box\n" + v + "vt 0 0\nvt 1 0\nvn 0 0 1\ng sides\nusemtl red\ns off\n" + "".join("f " + " ".join(f"{n}/{k % 2 + 1}/1" for k, n in enumerate(each)) + "\n" for each in ones[:3]) + "".join("f " + " ".join(f"{n}//1" for n in each) + "\n" for each in ones[3:])).encode(), BOX),
        ("lines-and-points.obj", (v + "p 1\nl 1 2 3\nf 1 2\n" + f + "curv2 1 2\n").encode(), BOX),
        ("shares-as-colours.obj", (_text([[*c, *(value / 255 for value in _RED)] for c in CORNERS.tolist()], "v ") + f).encode(), BOX | red),
        ("bytes-as-colours.obj", (_text([[*c, *_RED] for c in CORNERS.tolist()], "v ") + f).encode(), BOX | red),
        ("points-with-weights.obj", (_text([[*c, 1] for c in CORNERS.tolist()], "v ") + f).encode(), BOX),
        ("points-that-are-no-places.obj", ("v nan nan nan\nv inf -inf 0\nv 1e300 0 0\n" + v + _text([[n + 3 for n in each] for each in ones], "f ")).encode(), BOX),
        ("numbers-beyond-64-bit.obj", (v + f + "f 1 2 99999999999999999999999\n").encode(), {"refused": "line 15"}),
        ("number-zero.obj", (v + f + "f 0 1 2\n").encode(), {"refused": "line 15"}),
        ("corner-that-is-no-point.obj", (v + f + "f 1 2 9\n").encode(), {"refused": "no point of it"}),
    ]  # fmt: skip


def stl_cases() -> list[Case]:
    """Return what other programs write as STL."""
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[list(each)].ravel(), 0) for each in TRIANGLES)

    def binary(head: bytes, count: int = 12, body: bytes = records) -> bytes:
        return head.ljust(80) + struct.pack("<I", count) + body

    facets = "".join(
        "facet normal 0 0 0\n  outer loop\n"
        + _text(CORNERS[list(each)].tolist(), "    vertex ")
        + "  endloop\nendfacet\n"
        for each in TRIANGLES
    )
    text = f"solid box\n{facets}endsolid box\n"
    two = text + text.replace("box", "other").replace("vertex 0 ", "vertex 100 ").replace("vertex 40 ", "vertex 140 ")
    return [
        ("binary-that-says-solid.stl", binary(b"solid part made by CAD"), BOX),
        ("binary-with-two-bytes-more.stl", binary(b"solid part made by CAD", body=records + b"\0\0"), BOX),
        ("binary-with-a-count-of-zero.stl", binary(b"streamed", 0), BOX),
        ("binary-with-a-count-of-ffffffff.stl", binary(b"streamed", 0xFFFFFFFF), BOX),
        ("text.stl", text.encode(), BOX),
        ("text-in-capitals.stl", text.upper().encode(), BOX),
        ("text-half-in-capitals.stl", text.replace("vertex", "VERTEX").replace("facet", "Facet").encode(), BOX),
        ("text-behind-a-blank-line.stl", f"\n  {text}".encode(), BOX),
        ("text-with-a-mark.stl", b"\xef\xbb\xbf" + text.encode(), BOX),
        ("text-without-its-last-line.stl", text.removesuffix("endsolid box\n").encode(), BOX),
        ("text-with-tabs-and-windows-lines.stl", text.replace("    ", "\t").replace("\n", "\r\n").encode(), BOX),
        ("text-of-old-macs.stl", text.replace("\n", "\r").encode(), BOX),
        ("text-of-two-solids.stl", two.encode(), {"triangles": 24, "size": [140, 30, 20], "area": 10400, "volume": 48000}),
        ("text-named-facet-and-vertex.stl", text.replace("box", "facet vertex 1 of 2").encode(), BOX),
        ("text-named-by-a-path.stl", text.replace("solid box", "solid C:\\parts\\").encode(), BOX),
        ("text-on-one-line-a-facet.stl", text.replace("\n  ", " ").replace("\n    ", " ").encode(), BOX),
        ("text-with-ends-apart.stl", text.replace("endloop", "end loop").replace("endfacet", "end facet").replace("endsolid", "end solid").encode(), BOX),
        ("text-on-one-line.stl", text.replace("\n", " ").encode(), BOX),
        ("text-of-two-solids-on-one-line.stl", two.replace("\n", " ").encode(), {"triangles": 24, "size": [140, 30, 20], "area": 10400, "volume": 48000}),
        ("text-without-facets.stl", ("solid box\n" + "".join(_text(CORNERS[list(each)].tolist(), "vertex ") for each in TRIANGLES)).encode(), BOX),
        ("text-with-normals-that-are-none.stl", text.replace("normal 0 0 0", "normal nan -nan(ind) 1.#QNAN").encode(), BOX),
        ("text-with-zeros-behind.stl", text.encode() + bytes(600), BOX),
        ("text-cut-in-a-triangle.stl", text.encode()[:-60], {"refused": "no whole STL"}),
        ("text-in-utf-16.stl", text.encode("utf-16"), BOX),
        ("binary-with-zeros-behind.stl", binary(b"padded", body=records + bytes(150)), BOX),
        ("binary-that-names-too-few.stl", binary(b"box", 3), {"refused": "holds 12 triangles, but its header names 3"}),
        ("binary-cut-short.stl", binary(b"box", body=records[:-7]), {"refused": "cut short"}),
        ("binary-that-claims-4-billion.stl", binary(b"box", 0xFFFFFFF0), {"refused": "cut short"}),
    ]  # fmt: skip


def all_cases() -> list[Case]:
    """Return all of them: name of the file, its bytes, and its right answer."""
    return [
        *ply_cases(),
        *obj_cases(),
        *stl_cases(),
        *glb_cases(CORNERS, TRIANGLES, BOX),
        *three_mf_cases(CORNERS, TRIANGLES, BOX),
    ]


def main() -> None:
    """Write them anew."""
    FOLDER.mkdir(exist_ok=True)
    for name, content, _ in all_cases():
        (FOLDER / name).write_bytes(content)
    answers = {name: answer for name, _, answer in all_cases()}
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(answer)}" for name, answer in answers.items())
    (FOLDER / "answers.json").write_text(f"{{\n{lines}\n}}\n")


if __name__ == "__main__":
    main()
