"""3MF: a zip with the mesh as XML, in mm, with the colours of its points. Pure.

Source: 3MF Core Specification 1.3; the colours are a colour group of the Materials and Properties Extension 1.2.1.
"""

import io
import zipfile
from typing import Final

import numpy as np

from phone_host.output.axes import Axes
from phone_host.output.meshes.solid import Solid

_CORE: Final = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_MATERIAL: Final = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
_TYPES: Final = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
_RELATIONS: Final = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "</Relationships>"
)
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
"""The same mesh gives the same bytes."""


def three_mf_bytes(solid: Solid, axes: Axes | None) -> bytes:
    """Return a 3MF file in mm.

    Args:
        solid: the mesh.
        axes: in which its points are, for `read_three_mf`; None: nobody knows.
    """
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", _model(solid, "" if axes is None else axes_element(axes))),
        ):
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text)
    return held.getvalue()


def axes_element(axes: Axes) -> str:
    """Return the element that says the axes."""
    return f'<metadata name="Description">{axes.text}</metadata>'


def _model(solid: Solid, axes: str) -> str:
    group, paint = "", None
    if solid.has_colours:
        distinct, paint = np.unique(solid.colours, axis=0, return_inverse=True)
        paint = paint.ravel()[solid.triangles]
        colours = "".join(f'<m:color color="#{r:02X}{g:02X}{b:02X}FF"/>' for r, g, b in distinct.tolist())
        group = f'<m:colorgroup id="2">{colours}</m:colorgroup>'
    vertices = "".join(f'<vertex x="{x:.5f}" y="{y:.5f}" z="{z:.5f}"/>' for x, y, z in solid.points_mm.tolist())
    if paint is None:
        faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in solid.triangles.tolist())
    else:
        rows = np.column_stack([solid.triangles, paint]).tolist()
        faces = "".join(
            f'<triangle v1="{a}" v2="{b}" v3="{c}" pid="2" p1="{p}" p2="{q}" p3="{r}"/>' for a, b, c, p, q, r in rows
        )
    paints = ' pid="2" pindex="0"' if group else ""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE}" xmlns:m="{_MATERIAL}">'
        f'<metadata name="Application">tandemscan</metadata>{axes}<resources>{group}<object id="1" type="model"{paints}>'
        f"<mesh><vertices>{vertices}</vertices><triangles>{faces}</triangles></mesh></object></resources>"
        '<build><item objectid="1"/></build></model>\n'
    )
