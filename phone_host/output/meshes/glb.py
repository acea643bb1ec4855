"""GLB, the binary form of glTF: what browsers, phones and Blender open. Its unit is the metre and y is up, by its specification. Pure.

Read are the triangles of all meshes where the scene's nodes put them. Pictures, skins, animations and cameras have no part in the shape.
Compressed meshes (Draco, meshopt) are refused by name.
Source: Khronos, glTF 2.0 Specification, sections 3.4 (axes, unit), 3.5 (nodes), 3.6 (accessors), 3.7.2 (meshes) and 4 (GLB).
"""

import base64
import json
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from common.byte_order_mark import without_mark
from common.errors import DataError
from phone_host.output.axes import Axes
from phone_host.output.meshes.assembly import Part, assemble, require_count
from phone_host.output.meshes.solid import NO_COLOURS, Solid, require_corners, used_points

_FLOAT, _UNSIGNED, _BYTE = 5126, 5125, 5121
_POINTS_TARGET, _CORNERS_TARGET = 34962, 34963
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_MAGIC: Final = 0x46546C67
GENERATOR: Final = "tandemscan"


def glb_bytes(solid: Solid, axes: Axes | None) -> bytes:
    """Return a GLB file, in metres.

    Args:
        solid: the mesh; y up.
        axes: that it had before it was turned, for `read_glb` to turn it back; None: nobody knows.
    """
    points = np.ascontiguousarray(solid.points_m, "<f4")
    parts = [points.tobytes()]
    attributes, accessors = {"POSITION": 0}, [_accessor(0, _FLOAT, len(points), "VEC3")]
    accessors[0] |= {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    if solid.has_colours:
        # COLOR_0 is linear by specification, pictures are sRGB.
        share = solid.colours / 255
        linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        shades = np.full((len(points), 4), 65535, "<u2")
        shades[:, :3] = np.rint(65535 * linear)
        parts.append(shades.tobytes())
        attributes["COLOR_0"] = 1
        accessors.append(_accessor(1, 5123, len(points), "VEC4") | {"normalized": True})
    corners = len(parts)
    parts.append(solid.triangles.astype("<u4").tobytes())
    accessors.append(_accessor(corners, _UNSIGNED, solid.triangles.size, "SCALAR"))
    views, at = [], 0
    for number, part in enumerate(parts):
        target = _CORNERS_TARGET if number == corners else _POINTS_TARGET
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part), "target": target})
        at += len(part)
    told = {
        "asset": {"version": "2.0", "generator": GENERATOR} | ({"extras": {"axes": axes.text}} if axes else {}),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": corners, "mode": 4, "material": 0}]}],
        "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": at}],
    }
    text = json.dumps(told, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", at, _BINARY) + b"".join(parts)
    return struct.pack("<III", _MAGIC, 2, 12 + len(chunks)) + chunks


def _accessor(view: int, kind: int, count: int, shape: str) -> dict[str, Any]:
    return {"bufferView": view, "componentType": kind, "count": count, "type": shape}


_KINDS: Final = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COLUMNS: Final = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_UNREAD_EXTENSIONS: Final = (
    "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression", "EXT_mesh_gpu_instancing",
)  # fmt: skip
_MAX_DEPTH: Final = 64
_MAX_NODES: Final = 100_000
_FREE_LISTS, _BYTES_PER_LIST = 100_000, 16
"""Lists and maps that the JSON may have, and how many bytes the file must have for each further one: each takes 64 bytes of memory."""

_WRONG: Final = (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError)
"""What reading a tree of JSON raises where something else stands than must."""

Tree = dict[str, Any]
Used = NDArray[np.integer[Any]] | slice


def read_glb(content: bytes, name: str, unit_m: float) -> tuple[Solid, Axes | None]:
    """Read a GLB file. One of ours is turned back to the axes it was made from.

    Args:
        content: of the file; it may come from anybody.
        name: of the file, for errors.
        unit_m: its unit, m; the specification wants the metre.

    Returns:
        The mesh, and its axes; None: it is one of ours, and they were not known then either.

    Raises:
        DataError: it is no GLB file, is cut short or compressed, or holds no sound triangle.
    """
    try:
        file = _file(content, name)
        parts, axes = list(_parts(file)), _axes(file.tree["asset"])
    except _WRONG as error:
        raise DataError(f"{name} is cut short, or no GLB file of a mesh", "copy the file again, or export it anew") from error  # fmt: skip
    solid = assemble(name, parts, unit_m)
    if axes is None:
        return solid, None
    return Solid(solid.points_m @ axes.to_y_up, solid.triangles, solid.colours), axes


def _axes(asset: Tree) -> Axes | None:
    """Return the axes that the points shall have when they are turned back."""
    if asset.get("generator") != GENERATOR:
        return Axes.GLTF
    extras = asset.get("extras", {})
    return next((axes for axes in Axes if axes.text == extras.get("axes")), None)


@dataclass(slots=True, eq=False)
class _File:
    """A file that was taken apart.

    Attributes:
        name: of the file, for errors.
        tree: its JSON.
        buffers: its bytes; None: they are in another file.
        held_bytes: of all buffers.
        sparse_rows: that were read so far.
    """

    name: str
    tree: Tree
    buffers: list[memoryview | None]
    held_bytes: int
    sparse_rows: int = 0

    def view(self, number: int) -> tuple[memoryview, int]:
        """Return the bytes of a view, and how far apart its rows are; 0: close together."""
        view = self.tree["bufferViews"][number]
        begin, length, buffer = view.get("byteOffset", 0), view["byteLength"], self.buffers[view["buffer"]]
        if buffer is None:
            raise DataError(f"{self.name} has its numbers in another file", "export it as one file")
        if min(begin, length) < 0 or begin + length > len(buffer):
            raise IndexError("beyond the end")
        return buffer[begin : begin + length], view.get("byteStride", 0)

    def shape(self, number: int) -> tuple[int, int]:
        """Return how many rows and columns an accessor has, as it says itself."""
        accessor = self.tree["accessors"][number]
        count = accessor["count"]
        if type(count) is not int or count < 0:
            raise ValueError("a count that is none")
        return count, _COLUMNS[accessor["type"]]

    def numbers(self, number: int, used: Used = slice(None)) -> NDArray[Any]:
        """Return (N, columns) numbers of an accessor; integers that stand for shares are float32.

        Args:
            number: of the accessor.
            used: the rows that are wanted, in rising order; the others take no time.
        """
        accessor, (count, columns) = self.tree["accessors"][number], self.shape(number)
        kind = np.dtype(_KINDS[accessor["componentType"]])
        if "bufferView" in accessor:
            rows = self._rows(accessor["bufferView"], accessor.get("byteOffset", 0), (count, columns), kind)
        elif "sparse" in accessor:
            if count > self.held_bytes:
                raise IndexError("more than any mesh leaves at zero")
            rows = np.broadcast_to(np.zeros((), kind), (count, columns))
        else:
            raise IndexError("numbers that are nowhere")
        values = rows[used]
        if "sparse" in accessor:
            values = self._apply_sparse(values, accessor["sparse"], count, used)
        if accessor.get("normalized") and kind.kind in "iu":
            values = np.maximum(values.astype(np.float32) / np.iinfo(kind).max, -1)
        return values

    def _rows(self, view: int, begin: int, shape: tuple[int, int], kind: np.dtype[Any]) -> NDArray[Any]:
        content, step = self.view(view)
        row = shape[1] * kind.itemsize
        step = step or row
        if min(begin, shape[0], step) < 0 or (shape[0] and begin + (shape[0] - 1) * step + row > len(content)):
            raise IndexError("beyond the end")
        return np.ndarray(shape, kind, content, begin, (step, kind.itemsize))

    def _apply_sparse(self, values: NDArray[Any], sparse: Tree, whole: int, used: Used) -> NDArray[Any]:
        """Return the used rows of an accessor of `whole` rows, some of which stand elsewhere."""
        count, where, what = sparse["count"], sparse["indices"], sparse["values"]
        self.sparse_rows += count
        require_count(self.name, self.sparse_rows)  # each primitive reads them anew
        kind = np.dtype(_KINDS[where["componentType"]])
        changed = self._rows(where["bufferView"], where.get("byteOffset", 0), (count, 1), kind)[:, 0]
        rows = self._rows(what["bufferView"], what.get("byteOffset", 0), (count, values.shape[1]), values.dtype)
        if count and not 0 <= changed.min() <= changed.max() < whole:
            raise IndexError("beyond the end")
        if isinstance(used, slice):
            values = values.copy()
            values[changed] = rows
        elif len(used):
            places = np.minimum(np.searchsorted(used, changed), len(used) - 1)
            is_used = used[places] == changed
            values[places[is_used]] = rows[is_used]
        return values


def _file(content: bytes, name: str) -> _File:
    """Take a file apart. Its tree's numbers are not believed yet."""
    if len(content) < 20 or struct.unpack_from("<I", content)[0] != _MAGIC:
        raise DataError(f"{name} is no GLB file", "give a mesh file")
    if (version := struct.unpack_from("<I", content, 4)[0]) != 2:
        raise DataError(f"{name} is a GLB of version {version}, which is not read", "export it as glTF 2.0")
    whole, at, found = memoryview(content), 12, dict[int, memoryview]()
    while at + 8 <= len(whole) and not (_JSON in found and _BINARY in found):
        length, kind = struct.unpack_from("<II", whole, at)
        if at + 8 + length > len(whole):
            raise IndexError("beyond the end")
        found.setdefault(kind, whole[at + 8 : at + 8 + length])
        at += 8 + length
    try:
        text = without_mark(bytes(found[_JSON])).rstrip(b"\0")  # with which some fill the chunk
        if text.count(b"[") + text.count(b"{") > _FREE_LISTS + len(content) // _BYTES_PER_LIST:
            raise ValueError("too many lists")
        tree = json.loads(text)
    except RecursionError:
        raise ValueError("too deep") from None
    _require_plain(name, tree.get("extensionsRequired", ()))
    buffers = list(_buffers(tree, found.get(_BINARY, memoryview(b""))))
    return _File(name, tree, buffers, sum(len(buffer) for buffer in buffers if buffer is not None))


def _buffers(tree: Tree, binary: memoryview) -> Iterator[memoryview | None]:
    """Yield the buffers: the binary chunk, which only the first one can be, or bytes within the JSON, as Open3D writes them; None: another file."""
    for number, buffer in enumerate(tree.get("buffers", ())):
        uri = buffer.get("uri", "")
        if uri.startswith("data:"):
            yield memoryview(base64.b64decode(uri.partition(",")[2]))
        else:
            yield None if uri or number else binary


def _require_plain(name: str, extensions: Iterable[str]) -> None:
    """Check that no extension changes the shape in a way that is not read."""
    for extension in extensions:
        if extension in _UNREAD_EXTENSIONS:
            raise DataError(f"{name} needs {extension}, which is not read", "export it without compression or instancing")  # fmt: skip


def _parts(file: _File) -> Iterator[Part]:
    """Yield the meshes as often as nodes place them."""
    meshes, count = list[list[Part]](), 0
    for mesh in file.tree.get("meshes", ()):
        meshes.append([])
        for part in _mesh(file, mesh):
            count += len(part.triangles)
            require_count(file.name, count)
            meshes[-1].append(part)
    nodes = file.tree.get("nodes", ())
    scenes = file.tree.get("scenes", ())
    if len(nodes) > _MAX_NODES:
        raise DataError(f"{file.name} has more than {_MAX_NODES} nodes", "join its meshes")
    children = {child for node in nodes for child in node.get("children", ())}
    whole = [number for number in range(len(nodes)) if number not in children]
    roots = scenes[file.tree.get("scene", 0)].get("nodes", ()) if scenes else whole
    waiting, visits = [(root, np.eye(4), 0) for root in roots], 0
    while waiting:
        number, transform, depth = waiting.pop()
        visits += 1
        if depth > _MAX_DEPTH or visits > len(nodes):  # a node has one parent
            raise DataError(f"{file.name} has nodes in a circle", "export it anew")
        node = nodes[number]
        _require_plain(file.name, node.get("extensions", ()))
        transform = transform @ _matrix(node)
        waiting += [(child, transform, depth + 1) for child in node.get("children", ())]
        if "mesh" in node:
            for part in meshes[node["mesh"]]:
                yield Part(part.points, part.triangles, part.colours, transform)


def _matrix(node: Tree) -> NDArray[np.float64]:
    """Return (4, 4): from a node's coordinates to its parent's."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = (float(value) for value in node.get("rotation", (0, 0, 0, 1)))
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _mesh(file: _File, mesh: Tree) -> Iterator[Part]:
    """Yield the triangles of a mesh, each part with the points that it uses alone; lines and points are none."""
    for primitive in mesh["primitives"]:
        _require_plain(file.name, primitive.get("extensions", ()))
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            continue
        attributes = primitive["attributes"]
        if "POSITION" not in attributes:  # the specification allows that, and nothing is to be seen of it
            continue
        count, columns = file.shape(attributes["POSITION"])
        if columns != 3:
            raise ValueError("places of another shape")
        triangles = _triangles(_corners(file, primitive), mode)
        require_corners(file.name, triangles, count)
        used, numbered = used_points(triangles, count)
        points, colours = file.numbers(attributes["POSITION"], used), NO_COLOURS
        if "COLOR_0" in attributes:
            if file.shape(attributes["COLOR_0"])[0] != count:
                raise ValueError("colours of other points")
            colours = _colours(file.numbers(attributes["COLOR_0"], used))
        yield Part(points, numbered, colours, np.eye(4))


def _corners(file: _File, primitive: Tree) -> NDArray[Any]:
    """Return numbers of points; without indices they are all, in their order."""
    if "indices" in primitive:
        return file.numbers(primitive["indices"])[:, 0]
    return np.arange(len(file.numbers(primitive["attributes"]["POSITION"])), dtype=np.int32)


def _triangles(corners: NDArray[Any], mode: int) -> NDArray[Any]:
    if mode == _TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    first = corners[:-2] if mode == _STRIP else np.full(max(len(corners) - 2, 0), corners[0])
    triangles = np.stack([first, corners[1:-1], corners[2:]], axis=1)
    if mode == _STRIP:
        triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles


def _colours(shades: NDArray[Any]) -> NDArray[np.uint8]:
    """Return (N, 3): sRGB, as in pictures; those of a file are linear. Integers are shares, also where the file forgets to say so."""
    white = np.iinfo(shades.dtype).max if shades.dtype.kind in "iu" else 1
    linear = np.clip(np.nan_to_num(shades[:, :3].astype(np.float64)) / white, 0, 1)
    shares = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * shares), np.uint8)
