"""Reads 3MF: the meshes of all objects where the build puts them, in the unit that the file names. Pure.

Source: 3MF Core Specification 1.3; colours by the Materials and Properties Extension 1.2.1, parts in files of their own (as Bambu Studio and OrcaSlicer
write them) by the Production Extension 1.1. What in a slicer's project is not the model (modifiers and marks for supports lie in it as meshes
like any other): PrusaSlicer, src/libslic3r/Format/3mf.cpp (Slic3r_PE_model.config: ranges of triangles within an object); Bambu Studio and
OrcaSlicer, bbs_3mf.cpp (model_settings.config: parts of an object).
"""

import io
import re
import zipfile
import zlib
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.output.axes import Axes
from phone_host.output.meshes.assembly import Part, assemble, require_count
from phone_host.output.meshes.solid import NO_COLOURS, Solid, colours_of_points, require_corners
from phone_host.output.meshes.text import require_short
from phone_host.output.meshes.three_mf import axes_element

_UNITS_M: Final = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}
_TARGET: Final = re.compile(r'Target\s*=\s*"/?([^"]+\.model)"', re.IGNORECASE)
_TEXTS: Final = (".model", ".rels", ".config")
_UNREAD: Final = ("beamlattice", "booleanshape", "displacementmesh", "levelset")
"""Elements of extensions whose shape is not that of triangles."""

_RELATIONS: Final = "_rels/.rels"
_MAX_INFLATED: Final = 100
"""Times the file's size that its parts may have: a mesh's text has 5 to 20."""

_FREE_BYTES: Final = 1 << 20
_CHUNK: Final = 1 << 16
_HEAD: Final = 1024
_MAX_DEPTH: Final = 16
_MAX_OPEN: Final = 1000
"""Elements within elements; a mesh's have seven."""

_MAX_VISITS: Final = 10_000
_MAX_ENTRIES: Final = 100_000
"""Objects, components, items and groups of colours: each takes far more memory than text."""

_SUPPORTS: Final = ("support", "solidsupport")
"""Types of objects that are printed below the model and taken off (Core Specification, 4.1)."""

_ENTRIES: Final = ("object", "component", "item", "colorgroup", "basematerials")
_NO_COLOUR: Final = -1

Key = tuple[str, str]
"""The file of a package that an object or a group of colours is in, and its number there."""


@dataclass(slots=True)
class Roles:
    """What has no part in the shape.

    Attributes:
        ranges: by number of an object: first and last triangle of each volume that is not the model.
        parts: numbers of an object and of a component of it that is not the model.
    """

    ranges: dict[str, list[tuple[int, int]]] = field(default_factory=dict)
    parts: set[tuple[str, str]] = field(default_factory=set)


@dataclass(slots=True)
class _Object:
    """A mesh, or objects put together."""

    points: "array[float]" = field(default_factory=lambda: array("d"))
    triangles: "array[int]" = field(default_factory=lambda: array("i"))
    paints: "array[int]" = field(default_factory=lambda: array("i"))
    components: list[tuple[Key, NDArray[np.float64]]] = field(default_factory=list)
    is_support: bool = False


@dataclass(slots=True)
class _Package:
    """What the files of a package hold."""

    objects: dict[Key, _Object] = field(default_factory=dict)
    items: list[tuple[Key, NDArray[np.float64]]] = field(default_factory=list)
    groups: dict[Key, list[int]] = field(default_factory=dict)
    colours: list[tuple[int, ...]] = field(default_factory=list)
    unit_m: float = 1e-3
    entries: int = 0
    roles: Roles = field(default_factory=Roles)


def read_three_mf(content: bytes, name: str, unit_m: float | None) -> tuple[Solid, Axes | None]:
    """Read a 3MF file.

    Args:
        content: of the file; it may come from anybody.
        name: of the file, for errors.
        unit_m: its unit, m; None: the one it names.

    Raises:
        DataError: it is no 3MF file, is cut short, or holds no sound triangle.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _require_bounded(archive, name, len(content))
            package, root = _Package(roles=read_roles(archive, name)), _root(archive)
            with archive.open(root) as file:
                head = file.read(_HEAD).decode("utf-8", "replace")
            names = sorted((each for each in archive.namelist() if each.lower().endswith(".model")), key=root.__ne__)
            for each in names:
                _Reader(package, each, name, is_root=each == root).read(archive)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, OSError, expat.ExpatError, ValueError, LookupError, OverflowError) as error:  # fmt: skip
        raise DataError(f"{name} is no 3MF file, or cut short", "copy the file again, or export it anew") from error
    parts = list(_build_parts(package, name))
    axes = next((axes for axes in Axes if axes_element(axes) in head), None)
    return assemble(name, parts, package.unit_m if unit_m is None else unit_m), axes


def _require_bounded(archive: zipfile.ZipFile, name: str, held: int) -> None:
    """Check how long the texts inside are before one of them is read."""
    inflated = sum(each.file_size for each in archive.infolist() if each.filename.lower().endswith(_TEXTS))
    if inflated > _FREE_BYTES + _MAX_INFLATED * held:
        raise DataError(f"{name} would grow to {inflated // held} times its size", "no mesh does: export it anew")
    require_short(inflated, name)


def _root(archive: zipfile.ZipFile) -> str:
    """Return the name of the file with the build: as the package says, else the first model."""
    models = [each for each in archive.namelist() if each.lower().endswith(".model")]
    said = _TARGET.search(archive.read(_RELATIONS).decode("utf-8", "replace")) if _RELATIONS in archive.namelist() else None  # fmt: skip
    named = said[1].lower() if said else ""
    return next((each for each in models if each.lower() == named), models[0])


class _Reader:
    """Takes the elements of one file as they come, so that no tree of them is built.

    Args:
        package: takes what they hold.
        part: name of the file in the package.
        name: of the package, for errors.
        is_root: whether its build counts.
    """

    def __init__(self, package: _Package, part: str, name: str, *, is_root: bool) -> None:
        self._package, self._file, self._name, self._is_root = package, part, name, is_root
        self._part = part.lower()
        self._object, self._group = _Object(), list[int]()
        self._paint: tuple[str | None, str | None] = (None, None)
        self._open = 0

    def read(self, archive: zipfile.ZipFile) -> None:
        """Read the file."""
        parser = expat.ParserCreate()
        parser.StartElementHandler = self._start_element
        parser.EndElementHandler = self._end_element
        parser.StartDoctypeDeclHandler = self._refuse
        parser.buffer_text = True
        with archive.open(self._file) as file:
            while chunk := file.read(_CHUNK):
                parser.Parse(chunk)
            parser.Parse(b"", True)  # noqa: FBT003 - expat's own argument

    def _refuse(self, *_: object) -> None:
        raise DataError(f"{self._name} has a document type, which no 3MF file has", "export it anew")

    def _end_element(self, _: str) -> None:
        self._open -= 1

    def _count(self, element: str) -> None:
        """Bound what takes more memory than its text."""
        self._open += 1
        if self._open > _MAX_OPEN:
            raise ValueError("elements within elements")
        if element in _UNREAD:
            raise DataError(
                f"{self._name} has a {element}, which is not read", "let the program that made it export triangles"
            )
        if element in _ENTRIES:
            self._package.entries += 1
            if self._package.entries > _MAX_ENTRIES:
                raise DataError(f"{self._name} has more than {_MAX_ENTRIES} objects and groups", "export fewer")

    def _start_element(self, tag: str, attributes: dict[str, str]) -> None:
        element = tag.rpartition(":")[2]
        self._count(element)
        match element:
            case "vertex":
                self._object.points.extend((float(attributes["x"]), float(attributes["y"]), float(attributes["z"])))
            case "triangle":
                self._object.triangles.extend((int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])))
                if self._package.groups:
                    self._object.paints.extend(self._paints(attributes))
            case "object":
                self._object = _Object(is_support=attributes.get("type") in _SUPPORTS)
                self._paint = attributes.get("pid"), attributes.get("pindex")
                self._package.objects[self._part, attributes["id"]] = self._object
            case "component":
                self._object.components.append((self._key(attributes), _matrix(attributes)))
            case "item" if self._is_root and attributes.get("printable") != "0":
                self._package.items.append((self._key(attributes), _matrix(attributes)))
            case "model" if self._is_root:
                self._package.unit_m = _UNITS_M[attributes.get("unit", "millimeter")]
            case "colorgroup" | "basematerials":
                self._group = self._package.groups.setdefault((self._part, attributes["id"]), [])
            case "color" | "base":
                self._group.append(len(self._package.colours))
                self._package.colours.append(_colour(attributes.get("color") or attributes.get("displaycolor", "")))

    def _key(self, attributes: dict[str, str]) -> Key:
        """Return which object a component or an item places."""
        path = next((value for key, value in attributes.items() if key.rpartition(":")[2] == "path"), self._part)
        return path.lstrip("/").lower(), attributes["objectid"]

    def _paints(self, attributes: dict[str, str]) -> tuple[int, int, int]:
        """Return the numbers of the colours of a triangle's corners."""
        of_object, index = self._paint
        group = self._package.groups.get((self._part, attributes.get("pid") or of_object or ""))
        if not group:
            return (_NO_COLOUR,) * 3
        first = int(attributes.get("p1") or index or 0)
        a, b, c = (int(attributes.get(key) or first) for key in ("p1", "p2", "p3"))
        return group[a], group[b], group[c]


def _matrix(attributes: dict[str, str]) -> NDArray[np.float64]:
    """Return (4, 4) of twelve numbers, row by row, for places that are rows."""
    matrix = np.eye(4)
    if words := attributes.get("transform", "").split():
        matrix[:3] = np.array([float(word) for word in words]).reshape(4, 3).T
    return matrix


def _colour(text: str) -> tuple[int, ...]:
    """Return red, green and blue of #RRGGBB or #RRGGBBAA."""
    red, green, blue = bytes.fromhex(text.lstrip("#"))[:3]
    return red, green, blue


def _build_parts(package: _Package, name: str) -> Iterator[Part]:
    """Yield the meshes as often as the build places them; of a build without items, all."""
    unmoved = np.eye(4)
    items = package.items or [(key, unmoved) for key in package.objects]
    palette = np.array([*package.colours, (255, 255, 255)], np.uint8)  # the last is for corners without one
    waiting, parts, visits, triangles = [(*item, 0) for item in items], dict[Key, Part](), 0, 0
    while waiting:
        key, transform, depth = waiting.pop()
        visits += 1
        if depth > _MAX_DEPTH or visits > _MAX_VISITS:
            raise DataError(f"{name} has objects in a circle, or places them more than {_MAX_VISITS} times", "export it anew")  # fmt: skip
        if key not in package.objects:
            raise DataError(f"{name} places an object that it does not hold", "export it anew")
        thing = package.objects[key]
        if thing.is_support:
            continue
        waiting += [
            (inner, transform @ way, depth + 1)
            for inner, way in thing.components
            if (key[1], inner[1]) not in package.roles.parts
        ]
        if thing.triangles:
            part = parts.get(key) or _part(palette, thing, package.roles.ranges.get(key[1], []), name)
            parts[key] = part
            triangles += len(part.triangles)
            require_count(name, triangles)
            yield Part(part.points, part.triangles, part.colours, transform)


def _part(palette: NDArray[np.uint8], thing: _Object, others: list[tuple[int, int]], name: str) -> Part:
    """Return a mesh, without those ranges of its triangles that are not the model."""
    points = np.frombuffer(thing.points, np.float64).reshape(-1, 3) if thing.points else np.zeros((0, 3))
    triangles = np.frombuffer(thing.triangles, np.int32).reshape(-1, 3)
    paints: NDArray[Any] = np.frombuffer(thing.paints, np.int32)
    if others:
        is_model = np.ones(len(triangles), np.bool_)
        for first, last in others:
            is_model[max(first, 0) : max(last + 1, 0)] = False
        triangles, paints = triangles[is_model], paints.reshape(-1, 3)[is_model[: len(paints) // 3]].ravel()
    require_corners(name, triangles, len(points))
    if not (paints >= 0).any():
        return Part(points, triangles, NO_COLOURS, np.eye(4))
    return Part(points, triangles, colours_of_points(triangles.ravel(), palette[paints], len(points)), np.eye(4))


_PRUSA, _BAMBU = "metadata/slic3r_pe_model.config", "metadata/model_settings.config"
_MODEL: Final = frozenset({"modelpart", "normal_part"})
_NEGATIVE: Final = frozenset({"negativevolume", "negative_part"})


def read_roles(archive: zipfile.ZipFile, name: str) -> Roles:
    """Read what the slicer says of the meshes; nothing where the file is of no slicer.

    Raises:
        DataError: a part is to be cut away, which is not done here.
        ExpatError: what a slicer says is no XML.
    """
    roles = _RolesReader(name)
    for each in archive.namelist():
        if each.lower() in (_PRUSA, _BAMBU):
            roles.read(archive.read(each))
    return roles.found


class _RolesReader:
    def __init__(self, name: str) -> None:
        self._name, self.found = name, Roles()
        self._object, self._volume = "", (0, -1)

    def read(self, content: bytes) -> None:
        """Read one of the two files."""
        parser = expat.ParserCreate()
        parser.StartElementHandler = self._start_element
        parser.StartDoctypeDeclHandler = self._refuse
        parser.Parse(content, True)  # noqa: FBT003 - expat's own argument

    def _refuse(self, *_: object) -> None:
        raise ValueError("a document type")

    def _start_element(self, tag: str, attributes: dict[str, str]) -> None:
        match tag:
            case "object":
                self._object = attributes.get("id", "")
            case "part" if self._is_other(attributes.get("subtype", "normal_part")):
                self.found.parts.add((self._object, attributes.get("id", "")))
            case "volume":
                self._volume = int(attributes["firstid"]), int(attributes["lastid"])
            case "metadata" if self._is_role(attributes):
                self.found.ranges.setdefault(self._object, []).append(self._volume)

    def _is_role(self, attributes: dict[str, str]) -> bool:
        """Return whether a line says that its volume is not the model."""
        value = attributes.get("value", "")
        match attributes.get("key"):
            case "volume_type":
                return self._is_other(value)
            case "modifier":
                return value == "1"
        return False

    def _is_other(self, role: str) -> bool:
        if role.lower() in _NEGATIVE:
            raise DataError(
                f"{self._name} has a part that is to be cut away, which is not done here",
                "let the slicer export the model as STL",
            )
        return role.lower() not in _MODEL
