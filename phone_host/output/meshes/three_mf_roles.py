"""What in a slicer's project is not the model: modifiers and marks for supports, which lie in a 3MF as meshes like any other. Pure.

Source: PrusaSlicer, src/libslic3r/Format/3mf.cpp (Metadata/Slic3r_PE_model.config: ranges of triangles within an object); Bambu Studio and OrcaSlicer, bbs_3mf.cpp
(Metadata/model_settings.config: parts of an object).
"""

import zipfile
from dataclasses import dataclass, field
from typing import Final
from xml.parsers import expat

from common.errors import DataError

_PRUSA, _BAMBU = "metadata/slic3r_pe_model.config", "metadata/model_settings.config"
_MODEL: Final = frozenset({"modelpart", "normal_part"})
_NEGATIVE: Final = frozenset({"negativevolume", "negative_part"})


@dataclass(slots=True)
class Roles:
    """What has no part in the shape.

    Attributes:
        ranges: by number of an object: first and last triangle of each volume that is not the model.
        parts: numbers of an object and of a component of it that is not the model.
    """

    ranges: dict[str, list[tuple[int, int]]] = field(default_factory=dict)
    parts: set[tuple[str, str]] = field(default_factory=set)


def read_roles(archive: zipfile.ZipFile, name: str) -> Roles:
    """Read what the slicer says of the meshes; nothing where the file is of no slicer.

    Raises:
        DataError: a part is to be cut away, which is not done here.
        ExpatError: what a slicer says is no XML.
    """
    roles = _Reader(name)
    for each in archive.namelist():
        if each.lower() in (_PRUSA, _BAMBU):
            roles.read(archive.read(each))
    return roles.found


class _Reader:
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
