"""3MF as other programs write it; see `make_meshes`."""

import io
import zipfile
from collections.abc import Mapping, Sequence
from typing import Any, Final

from numpy.typing import NDArray

_CORE: Final = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_MORE: Final = (
    'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" '
    'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
)
_RELATIONS: Final = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/{0}" Id="r0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


_PRUSA, _BAMBU = "Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"


def _zipped(parts: Mapping[str, str | bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", method) as archive:
        for name, text in parts.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = method
            archive.writestr(entry, text)
    return held.getvalue()


def _model(resources: str, items: str, unit: str = ' unit="millimeter"', head: str = '<?xml version="1.0"?>') -> str:
    return (
        f'{head}<model{unit} xmlns="{_CORE}" {_MORE}><resources>{resources}</resources><build>{items}</build></model>'
    )


def package(resources: str, items: str = "", method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Return a 3MF file with these resources and build items, mm."""
    name = "3D/3dmodel.model"
    return _zipped({"_rels/.rels": _RELATIONS.format(name), name: _model(resources, items)}, method)


def three_mf_cases(corners: NDArray[Any], triangles: Sequence[Sequence[int]], box: dict[str, Any]) -> list[tuple[str, bytes, dict[str, Any]]]:  # fmt: skip
    """Return what other programs write as 3MF.

    Args:
        corners: of a box, mm.
        triangles: of it.
        box: its answer.
    """

    def mesh(scale: float = 1, more: Sequence[str] = ("",) * 12) -> str:
        places = "".join(f'<vertex x="{x * scale:g}" y="{y * scale:g}" z="{z * scale:g}"/>' for x, y, z in corners)
        faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"{end}/>' for (a, b, c), end in zip(triangles, more, strict=True))  # fmt: skip
        return f"<mesh><vertices>{places}</vertices><triangles>{faces}</triangles></mesh>"

    def thing(number: int, held: str, more: str = "") -> str:
        return f'<object id="{number}" type="model"{more}>{held}</object>'

    def whole(model: str, name: str = "3D/3dmodel.model") -> bytes:
        return _zipped({"_rels/.rels": _RELATIONS.format(name), name: model})

    item = '<item objectid="1"/>'
    red, twice = {"colour": [200, 10, 10]}, {"triangles": 24, "size": [140, 30, 20], "area": 10400, "volume": 48000}
    shades = '<m:colorgroup id="9"><m:color color="#FFFFFFFF"/><m:color color="#C80A0AFF"/></m:colorgroup>'
    bases = '<basematerials id="9"><base name="white" displaycolor="#FFFFFF"/><base name="red" displaycolor="#C80A0A"/></basematerials>'
    move = 'transform="1 0 0 0 1 0 0 0 1 100 0 0"'
    components = thing(2, f'<components><component objectid="1"/><component objectid="1" {move}/></components>')
    apart = thing(1, '<components><component objectid="7" p:path="/3D/Objects/box.model"/></components>')
    doubled = "".join(
        thing(k, f'<components><component objectid="{k - 1}"/><component objectid="{k - 1}"/></components>')
        for k in range(2, 42)
    )
    twice_in_one = mesh().replace("</vertices>", "".join(f'<vertex x="{3 * x:g}" y="{y:g}" z="{z:g}"/>' for x, y, z in corners) + "</vertices>")  # fmt: skip
    others = "".join(f'<triangle v1="{a + 8}" v2="{b + 8}" v3="{c + 8}"/>' for a, b, c in triangles)
    twice_in_one = twice_in_one.replace("</triangles>", others + "</triangles>")
    in_parts = thing(2, '<components><component objectid="1"/><component objectid="5"/></components>')

    def project(config: str, resources: str, roles: str) -> bytes:
        item = '<item objectid="2"/>' if 'id="2"' in resources else '<item objectid="1"/>'
        return _zipped({"3D/3dmodel.model": _model(resources, item), config: f"<config>{roles}</config>"})

    model = _model(thing(1, mesh()), item)
    cases: dict[str, tuple[bytes, dict[str, Any]]] = {
        "plain": (whole(model), box),
        "stored-without-relations": (_zipped({"3D/Other.model": model}, zipfile.ZIP_STORED), box),
        "in-metres": (whole(_model(thing(1, mesh(0.001)), item, ' unit="meter"')), box),
        "in-inches": (whole(_model(thing(1, mesh(1 / 25.4)), item, ' unit="inch"')), box | {"rel": 1e-4}),
        "without-unit": (whole(_model(thing(1, mesh()), item, "")), box),
        "components": (whole(_model(thing(1, mesh()) + components, '<item objectid="2"/>')), twice),
        "two-items": (whole(_model(thing(1, mesh()), f'{item}<item objectid="1" {move}/>')), twice),
        "mirrored": (whole(_model(thing(1, mesh()), '<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>')), box),
        "part-in-a-file-of-its-own": (
            _zipped({"_rels/.rels": _RELATIONS.format("3D/3dmodel.model"), "3D/3dmodel.model": _model(apart, item), "3D/Objects/box.model": _model(thing(7, mesh()), "")}),
            box,
        ),
        "colours-of-corners": (whole(_model(shades + thing(1, mesh(more=[' pid="9" p1="1" p2="1" p3="1"'] * 12)), item)), box | red),
        "colour-of-the-object": (whole(_model(shades + thing(1, mesh(), ' pid="9" pindex="1"'), item)), box | red),
        "colours-of-materials": (whole(_model(bases + thing(1, mesh(more=[' pid="9" p1="1"'] * 12)), item)), box | red),
        "object-beside-the-build": (whole(_model(thing(1, mesh()) + thing(3, mesh(5)), item)), box),
        "prefixed-names": (whole(model.replace("<", "<c:").replace("<c:/", "</c:").replace("<c:?", "<?").replace("xmlns=", "xmlns:c=")), box),
        "circle": (whole(_model(thing(1, '<components><component objectid="1"/></components>'), item)), {"refused": "circle"}),
        "objects-that-double": (whole(_model(thing(1, mesh()) + doubled, '<item objectid="41"/>')), {"refused": "circle"}),
        "entities": (whole(_model(thing(1, mesh()), item, head='<?xml version="1.0"?><!DOCTYPE model [<!ENTITY a "b">]>')), {"refused": "document type"}),
        "cut-short": (whole(model)[:-200], {"refused": "no 3MF"}),
        "bomb": (whole(_model(thing(1, mesh()), item) + " " * (1 << 25)), {"refused": "times its size"}),
        "empty-object": (whole(_model(thing(1, mesh()) + thing(2, "<mesh><vertices/><triangles/></mesh>"), item + '<item objectid="2"/>')), box),
        "of-type-surface": (whole(_model(thing(1, mesh()).replace('type="model"', 'type="surface"'), item)), box),
        "of-type-support": (whole(_model(thing(1, mesh()) + thing(5, mesh()).replace('type="model"', 'type="support"'), f'{item}<item objectid="5" {move}/>')), box),
        "item-that-is-not-printed": (whole(_model(thing(1, mesh()), f'{item}<item objectid="1" {move} printable="0"/>')), box),
        "path-in-another-case": (
            _zipped({"_rels/.rels": _RELATIONS.format("3D/3DModel.model"), "3D/3dmodel.model": _model(apart.replace("Objects/box", "objects/Box"), item), "3D/Objects/box.model": _model(thing(7, mesh()), "")}),
            box,
        ),
        "modifier-of-prusaslicer": (project(_PRUSA, thing(1, twice_in_one), '<object id="1"><volume firstid="0" lastid="11"><metadata type="volume" key="volume_type" value="ModelPart"/></volume><volume firstid="12" lastid="23"><metadata type="volume" key="modifier" value="1"/><metadata type="volume" key="volume_type" value="ParameterModifier"/></volume></object>'), box),
        "support-blocker-of-bambu-studio": (project(_BAMBU, thing(1, mesh()) + thing(5, mesh(3)) + in_parts, '<object id="2"><part id="1" subtype="normal_part"/><part id="5" subtype="support_blocker"/></object>'), box),
        "negative-part": (project(_BAMBU, thing(1, mesh()) + thing(5, mesh(3)) + in_parts, '<object id="2"><part id="1" subtype="normal_part"/><part id="5" subtype="negative_part"/></object>'), {"refused": "cut away"}),
        "beams": (whole(_model(thing(1, mesh().replace("</mesh>", '<b:beamlattice xmlns:b="b" radius="1"><b:beams><b:beam v1="0" v2="1"/></b:beams></b:beamlattice></mesh>')), item)), {"refused": "beamlattice"}),
        "in-utf-16": (_zipped({"3D/3dmodel.model": model.replace('"1.0"', '"1.0" encoding="UTF-16"').encode("utf-16")}), box),
    }  # fmt: skip
    return [(f"{name}.3mf", content, answer) for name, (content, answer) in cases.items()]
