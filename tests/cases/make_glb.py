"""GLB as other programs write it; see `make_meshes`."""

import base64
import json
import struct
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_KINDS: Final = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_SHAPES: Final = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


class GlbFile:
    """A GLB that grows: accessors are added, then meshes and nodes are named."""

    def __init__(self) -> None:
        self.buffer = b""
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def view(self, content: bytes, **more: Any) -> int:
        """Append bytes; return the number of their view."""
        self.buffer += bytes(-len(self.buffer) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(content), **more})
        self.buffer += content
        return len(self.views) - 1

    def add(self, values: NDArray[Any], kind: str, **more: Any) -> int:
        """Append numbers; return the number of their accessor."""
        columns = 1 if values.ndim == 1 else values.shape[1]
        row = {"componentType": _KINDS[kind], "count": len(values), "type": _SHAPES[columns], **more}
        if "bufferView" not in row and "sparse" not in row:
            row["bufferView"] = self.view(values.astype(f"<{kind}").tobytes())
        self.accessors.append(row)
        return len(self.accessors) - 1

    def bytes(self, primitives: Sequence[dict[str, Any]], nodes: Sequence[dict[str, Any]], roots: Sequence[int] = (0,), **more: Any) -> bytes:  # fmt: skip
        """Return the file, with each primitive as a mesh of its own."""
        told = {
            "asset": {"version": "2.0", "generator": "by hand"},
            "scene": 0,
            "scenes": [{"nodes": list(roots)}],
            "nodes": list(nodes),
            "meshes": [{"primitives": [each]} for each in primitives],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.buffer)}],
            **more,
        }
        text = json.dumps(told).encode()
        text += b" " * (-len(text) % 4)
        body = self.buffer + bytes(-len(self.buffer) % 4)
        chunks = (
            struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(body), 0x004E4942) + body
            if body
            else struct.pack("<II", len(text), 0x4E4F534A) + text
        )
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def glb_cases(corners: NDArray[Any], triangles: Sequence[Sequence[int]], box: dict[str, Any]) -> list[tuple[str, bytes, dict[str, Any]]]:  # fmt: skip
    """Return what other programs write as GLB: in metres, y up.

    Args:
        corners: of a box, mm, z up.
        triangles: of it.
        box: its answer.
    """
    points = (corners @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])) / 1000
    numbers = np.array(triangles)
    answer = box | {"size": [40, 20, 30]}
    red, linear = {"colour": [200, 10, 10]}, [0.577580, 0.003035, 0.003035]
    scaled = [{"mesh": 0, "scale": [0.001] * 3}]
    cases: dict[str, tuple[bytes, dict[str, Any]]] = {}

    def plain(places: NDArray[Any] = points, kind: str = "f4", index: str = "u2", **more: Any) -> tuple[GlbFile, dict[str, Any]]:  # fmt: skip
        file = GlbFile()
        return file, {
            "attributes": {"POSITION": file.add(places, kind, **more)},
            "indices": file.add(numbers.ravel(), index),
        }

    for index in ("u1", "u2", "u4"):
        file, primitive = plain(index=index)
        cases[f"indices-{index}"] = file.bytes([primitive], [{"mesh": 0}]), answer
    file, primitive = plain(points[numbers.ravel()])
    del primitive["indices"]
    cases["without-indices"] = file.bytes([primitive], [{"mesh": 0}]), answer | {"points": 8}
    file = GlbFile()
    tops = {number: numbers[2 * number : 2 * number + 2] for number in range(6)}
    strips = [[int(first[0]), int(first[1]), int(second[2]), int(first[2])] for first, second in tops.values()]
    at = file.add(points, "f4")
    parts = [{"attributes": {"POSITION": at}, "indices": file.add(np.array(each), "u2"), "mode": 5} for each in strips]
    cases["strips"] = file.bytes(parts, [{"mesh": k} for k in range(6)], range(6)), answer
    file = GlbFile()
    at = file.add(points, "f4")
    fans = [[int(first[0]), int(first[1]), int(first[2]), int(second[2])] for first, second in tops.values()]
    parts = [{"attributes": {"POSITION": at}, "indices": file.add(np.array(each), "u2"), "mode": 6} for each in fans]
    cases["fans"] = file.bytes(parts, [{"mesh": k} for k in range(6)], range(6)), answer
    file = GlbFile()
    mixed = np.zeros((8, 8), "<f4")
    mixed[:, 2:5] = points
    view = file.view(mixed.tobytes(), byteStride=32)
    primitive = {"attributes": {"POSITION": file.add(points, "f4", bufferView=view, byteOffset=8)}, "indices": file.add(numbers.ravel(), "u2")}  # fmt: skip
    cases["interleaved"] = file.bytes([primitive], [{"mesh": 0}]), answer
    file, primitive = plain(1000 * points)
    half = np.sqrt(0.5)
    nodes: list[dict[str, Any]] = [
        {"children": [1], "rotation": [half, 0, 0, half]},
        {"children": [2], "translation": [5, 6, 7]},
        {"mesh": 0, "matrix": [0.001, 0, 0, 0, 0, 0.001, 0, 0, 0, 0, 0.001, 0, 1, 0, 0, 1]},
    ]
    cases["turned-by-its-nodes"] = file.bytes([primitive], nodes), answer | {"size": [40, 30, 20]}
    file, primitive = plain()
    cases["mirrored-by-its-node"] = file.bytes([primitive], [{"mesh": 0, "scale": [-1, 1, 1]}]), answer
    file, primitive = plain()
    nodes = [{"mesh": 0}, {"mesh": 0, "translation": [0.1, 0, 0]}]
    cases["one-mesh-twice"] = (
        file.bytes([primitive], nodes, (0, 1)),
        {"triangles": 24, "size": [140, 20, 30], "area": 10400, "volume": 48000},
    )
    cases["nodes-without-a-scene"] = (
        file.bytes([primitive], [{}, {"children": [2]}, *nodes], scenes=[]),
        {"triangles": 24, "size": [140, 20, 30], "area": 10400, "volume": 48000},
    )
    for kind, white in (("f4", 1), ("u1", 255), ("u2", 65535)):
        file, primitive = plain()
        shades = np.rint(np.tile(linear, (8, 1)) * white) if white > 1 else np.tile(linear, (8, 1))
        primitive["attributes"]["COLOR_0"] = file.add(shades, kind, **({"normalized": True} if white > 1 else {}))
        cases[f"colours-{kind}"] = (
            file.bytes([primitive], [{"mesh": 0}]),
            answer | ({"colour": [200, 13, 13]} if kind == "u1" else red),  # the darkest step of 8 linear bits is 13
        )
    file, primitive = plain(1000 * points, "i2")
    cases["places-of-16-bit"] = (
        file.bytes([primitive], scaled, extensionsRequired=["KHR_mesh_quantization"]),
        answer,
    )
    file, primitive = plain(np.rint(points / 0.04 * 32767), "i2", normalized=True)
    cases["places-of-16-bit-as-shares"] = (
        file.bytes([primitive], [{"mesh": 0, "scale": [0.04] * 3}], extensionsRequired=["KHR_mesh_quantization"]),
        answer | {"rel": 1e-4},
    )
    file = GlbFile()
    flat = points * [1, 0, 1]
    lifted = np.flatnonzero(points[:, 1])
    sparse = {
        "count": len(lifted),
        "indices": {"bufferView": file.view(lifted.astype("<u2").tobytes()), "componentType": _KINDS["u2"]},
        "values": {"bufferView": file.view(points[lifted].astype("<f4").tobytes())},
    }
    at = file.view(flat.astype("<f4").tobytes())
    primitive = {"attributes": {"POSITION": file.add(points, "f4", bufferView=at, sparse=sparse)}, "indices": file.add(numbers.ravel(), "u2")}  # fmt: skip
    cases["sparse-places"] = file.bytes([primitive], [{"mesh": 0}]), answer
    file, primitive = plain()
    primitive["attributes"]["TEXCOORD_0"] = file.add(np.zeros((8, 3)), "f4")
    file.accessors[-1]["type"] = "VEC2"
    picture = file.view(b"\x89PNG\r\n\x1a\n no picture")
    primitive["material"] = 0
    cases["with-a-picture"] = (
        file.bytes(
            [primitive], [{"mesh": 0}], materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            textures=[{"source": 0}], images=[{"bufferView": picture, "mimeType": "image/png"}],
        ),
        answer,
    )  # fmt: skip
    file, primitive = plain()
    cases["lines-beside"] = (
        file.bytes([primitive, {**primitive, "mode": 1}], [{"mesh": 0}, {"mesh": 1}, {"camera": 0}], (0, 1, 2), cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]),
        answer,
    )  # fmt: skip
    file, primitive = plain()
    packed = f"data:application/octet-stream;base64,{base64.b64encode(file.buffer).decode()}"
    whole, file.buffer = len(file.buffer), b""
    buffers = [{"byteLength": whole, "uri": packed}]
    cases["numbers-within-the-json"] = file.bytes([primitive], [{"mesh": 0}], buffers=buffers), answer
    buffers = [{"byteLength": whole, "uri": "box.bin"}]
    cases["numbers-in-another-file"] = file.bytes([primitive], [{"mesh": 0}], buffers=buffers), {"refused": "another file"}  # fmt: skip
    file, primitive = plain()
    content = file.bytes([primitive], [{"mesh": 0}])
    cases["bytes-behind"] = content + b"\0\0\n", answer
    cases["cut-short"] = content[:-20], {"refused": "cut short"}
    file, primitive = plain()
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    for each in file.accessors:
        del each["bufferView"]
    cases["draco"] = file.bytes([primitive], [{"mesh": 0}], extensionsRequired=["KHR_draco_mesh_compression"]), {"refused": "KHR_draco_mesh_compression"}  # fmt: skip
    file, primitive = plain()
    content = file.bytes([primitive], [{"mesh": 0}], extensionsRequired=["EXT_mesh_gpu_instancing"])
    cases["instances-of-an-extension"] = content, {"refused": "EXT_mesh_gpu_instancing"}
    file, primitive = plain()
    rest = {**primitive, "indices": file.add(numbers[6:].ravel(), "u2")}
    first = {**primitive, "indices": file.add(numbers[:6].ravel(), "u2")}
    cases["parts-that-share-points"] = (
        file.bytes([first, rest], [{"mesh": 0}, {"mesh": 1}], (0, 1)),
        answer | {"points": 8},
    )
    file, primitive = plain()
    file.accessors[0]["count"] = 2_000_000_000
    del file.accessors[0]["bufferView"]
    cases["claims-2-billion-points"] = file.bytes([primitive], [{"mesh": 0}]), {"refused": "cut short"}
    file, primitive = plain()
    cases["nodes-in-a-circle"] = file.bytes([primitive], [{"children": [1]}, {"mesh": 0, "children": [0]}]), {"refused": "circle"}  # fmt: skip
    file, primitive = plain()
    nodes = [*({"children": [k + 1, k + 1]} for k in range(40)), {"mesh": 0}]
    cases["nodes-that-double"] = file.bytes([primitive], nodes), {"refused": "circle"}
    cases |= _odd_cases(plain, answer)
    return [(f"{name}.glb", content, answer) for name, (content, answer) in cases.items()]


def _odd_cases(
    plain: Callable[[], tuple[GlbFile, dict[str, Any]]], answer: dict[str, Any]
) -> dict[str, tuple[bytes, dict[str, Any]]]:
    """Return what few programs write, or what the specification allows and nobody expects."""
    cases: dict[str, tuple[bytes, dict[str, Any]]] = {}
    file, primitive = plain()
    cases["primitive-without-places"] = file.bytes([primitive, {"attributes": {}}], [{"mesh": 0}, {"mesh": 1}], (0, 1)), answer  # fmt: skip
    file, primitive = plain()
    buffers = [{"byteLength": len(file.buffer)}, {"byteLength": 9, "uri": "picture.bin"}]
    cases["another-file-that-no-mesh-needs"] = file.bytes([primitive], [{"mesh": 0}], buffers=buffers), answer
    file, primitive = plain()
    file.views[0]["buffer"] = 1
    buffers = [{"byteLength": len(file.buffer)}, {"byteLength": 96}]
    cases["second-buffer-without-an-address"] = file.bytes([primitive], [{"mesh": 0}], buffers=buffers), {"refused": "another file"}  # fmt: skip
    file, primitive = plain()
    node = {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {}}}}
    cases["instances-that-are-not-required"] = file.bytes([primitive], [node], extensionsUsed=["EXT_mesh_gpu_instancing"]), {"refused": "EXT_mesh_gpu_instancing"}  # fmt: skip
    file, primitive = plain()
    primitive["attributes"]["COLOR_0"] = file.add(np.tile([147, 1, 1], (8, 1)), "u1")
    cases["colours-that-say-not-that-they-are-shares"] = file.bytes([primitive], [{"mesh": 0}]), answer | {"colour": [200, 13, 13]}  # fmt: skip
    file, primitive = plain()
    whole = file.bytes([primitive], [{"mesh": 0}], extras="\N{DEGREE SIGN}")
    length = struct.unpack_from("<I", whole, 12)[0]
    text = b"\xef\xbb\xbf" + whole[20 : 20 + length].rstrip() + b"\0"
    text += bytes(-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + whole[20 + length :]
    cases["filled-with-zeros-behind-a-mark"] = struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks, answer
    return cases
