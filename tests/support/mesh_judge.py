"""What other programs say of a mesh file: `build/printers/meshes/bin/python mesh_judge.py FILE...` prints one JSON object a line.

It runs in an environment of its own (pymeshlab is GPL-3) and imports nothing of the project: lengths in the file's own unit.
"""

import json
import sys
from pathlib import Path
from typing import Any


def by_trimesh(path: Path) -> dict[str, Any]:
    """Read it with trimesh, points at one place made one."""
    import numpy as np  # noqa: PLC0415 - each reader may be missing
    import trimesh  # noqa: PLC0415

    scene: Any = trimesh.load(path, force="scene")
    mesh = scene.to_geometry() if hasattr(scene, "to_geometry") else scene.dump(concatenate=True)
    visual = next(iter(scene.geometry.values())).visual
    kind, colours = getattr(visual, "kind", None), None
    if kind == "vertex":
        colours = [int(value) for value in visual.vertex_colors[:, :3].mean(axis=0)]
    elif kind == "face":
        colours = [int(value) for value in visual.face_colors[:, :3].mean(axis=0)]
    elif "color" in (held := getattr(visual, "vertex_attributes", {})):  # of a GLB: linear, by its specification
        linear = held["color"][:, :3] / (65535.0 if held["color"].dtype.kind == "u" else 1.0)
        shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        colours = [int(value) for value in 255 * shown.mean(axis=0)]
    bare = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    bare.merge_vertices(merge_norm=True, merge_tex=True)
    return {
        "faces": len(bare.faces),
        "size": [float(value) for value in bare.extents],
        "closed": bool(bare.is_watertight and bare.is_winding_consistent),
        "volume": float(bare.volume),
        "colour": colours,
    }


def by_pymeshlab(path: Path) -> dict[str, Any]:
    """Read it with VCG, points at one place made one; count what crosses."""
    import pymeshlab  # type: ignore[import-not-found]  # noqa: PLC0415

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(path))
    if meshes.mesh_number() > 1:
        meshes.generate_by_merging_visible_meshes(mergevertices=True)
    meshes.meshing_merge_close_vertices(threshold=pymeshlab.PureValue(1e-6))
    mesh = meshes.current_mesh()
    colours = None
    if mesh.has_vertex_color():
        colours = mesh.vertex_color_matrix()
    elif mesh.has_face_color():
        colours = mesh.face_color_matrix()
    measured = meshes.get_topological_measures()
    closed = measured["is_mesh_two_manifold"] and measured["boundary_edges"] == 0
    found = {
        "faces": mesh.face_number(),
        "size": [mesh.bounding_box().dim_x(), mesh.bounding_box().dim_y(), mesh.bounding_box().dim_z()],
        "closed": bool(closed),
        "volume": float(meshes.get_geometric_measures()["mesh_volume"]) if closed else None,
        "colour": None if colours is None else [int(255 * value) for value in colours[:, :3].mean(axis=0)],
    }
    meshes.compute_selection_by_self_intersections_per_face()
    found["crossing"] = mesh.selected_face_number()
    return found


def by_lib3mf(path: Path) -> dict[str, Any]:
    """Read it with the library of the format's makers, which warns of all that is not as it should be."""
    import lib3mf  # type: ignore[import-not-found]  # noqa: PLC0415

    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.ReadFromFile(str(path))
    meshes = model.GetMeshObjects()
    meshes.MoveNext()
    mesh = meshes.GetCurrentMeshObject()
    corners = [
        (each.ResourceID, number)
        for each in mesh.GetAllTriangleProperties()
        for number in each.PropertyIDs
        if each.ResourceID
    ]
    groups = {group: model.GetColorGroupByID(group) for group in {group for group, _ in corners}}
    colours = [
        (colour.Red, colour.Green, colour.Blue)
        for colour in (groups[group].GetColor(number) for group, number in corners)
    ]
    return {
        "faces": mesh.GetTriangleCount(),
        "closed": bool(mesh.IsManifoldAndOriented()),
        "warnings": reader.GetWarningCount(),
        "is_mm": int(model.GetUnit()) == 1,
        "colour": [int(sum(each) / len(colours)) for each in zip(*colours, strict=True)] if colours else None,
    }


def by_manifold(path: Path) -> dict[str, Any]:
    """Ask manifold3d whether it is a closed two-manifold."""
    import manifold3d  # noqa: PLC0415
    import numpy as np  # noqa: PLC0415
    import trimesh  # type: ignore[import-untyped,import-not-found,unused-ignore]  # noqa: PLC0415

    mesh: Any = trimesh.load(path, force="mesh")
    made = manifold3d.Manifold(manifold3d.Mesh(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)))
    return {"status": made.status().name, "bodies": len(made.decompose()), "volume": made.volume()}


READERS = {"trimesh": by_trimesh, "pymeshlab": by_pymeshlab}


def main(paths: list[str]) -> None:
    """Judge each file by all who read it."""
    for path in map(Path, paths):
        said: dict[str, Any] = {"file": path.name}
        kind = path.suffix.lower()
        for name, reader in READERS.items():
            if (name, kind) in {("trimesh", ".3ds"), ("pymeshlab", ".glb")}:
                continue
            try:
                said[name] = reader(path)
            except Exception as error:  # noqa: BLE001 - whatever it is, it is the verdict
                said[name] = {"error": f"{type(error).__name__}: {error}"}
        if kind == ".3mf":
            said["lib3mf"] = by_lib3mf(path)
        if kind == ".stl":
            said["manifold"] = by_manifold(path)
        print(json.dumps(said), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
