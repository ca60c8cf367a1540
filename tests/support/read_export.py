#!/usr/bin/env python3
"""Reads an export back with a program that somebody else wrote, and compares it with the states.

    read_export.py PROGRAM STATES PATH        PROGRAM: vtk, usd, blender
    blender -b --factory-startup --python read_export.py -- blender STATES PATH

Prints the largest difference [m]. Exit code 0: agrees; 1: differs; 77: the program is not there.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts"))
try:
    import numpy as np
    from read_states import States
except ImportError as missing:
    print(f"missing: {missing}")
    sys.exit(77)

worst = 0.0


def near(name, found, expected, tolerance=2e-7):
    """Floats of metres: relative to the largest number."""
    global worst
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    if found.shape != expected.shape:
        sys.exit(f"{name}: shape {found.shape}, expected {expected.shape}")
    difference = float(np.abs(found - expected).max()) if expected.size else 0.0
    worst = max(worst, difference)
    if not difference <= tolerance * max(1.0, float(np.abs(expected).max())):
        sys.exit(f"{name}: differs by {difference:.3g}")


def need(condition, text):
    if not condition:
        sys.exit(text)


def surfaces(states):
    return [f.layout.surface(f["x"]) for f in states.frames]


def watch(reader, failed):
    """VTK prints its errors and goes on; this keeps them."""
    reader.AddObserver("ErrorEvent", lambda *_: failed.append(reader.GetClassName()))


def check_poly(data, states, i):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    frame = states.frames[i]
    layout = frame.layout
    near("points", vtk_to_numpy(data.GetPoints().GetData()), layout.surface(frame["x"]))
    need(data.GetNumberOfPolys() == len(layout.triangles), "number of triangles")
    cells = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    need((cells == layout.triangles).all(), "triangles")
    arrays = data.GetPointData()
    near("velocity", vtk_to_numpy(arrays.GetArray("velocity")), layout.surface(frame["v"]))
    near("material", vtk_to_numpy(arrays.GetArray("material")), layout.vertex_material)
    near("displacement", vtk_to_numpy(arrays.GetArray("displacement")),
         layout.surface(frame["x"]) - layout.surface(layout.rest), 1e-6)
    near("normals", np.linalg.norm(vtk_to_numpy(arrays.GetArray("Normals")), axis=1),
         np.ones(layout.vertex_count), 1e-6)
    for name in ("strain", "curvature"):
        need(arrays.GetArray(name).GetNumberOfComponents() == 3, name)
    cloth = vtk_to_numpy(arrays.GetArray("cloth"))
    need((cloth == np.searchsorted(layout.vertex_begin[1:], np.arange(layout.vertex_count),
                                   side="right")).all(), "cloth")


def check_vtk(states, path):
    try:
        from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
        from vtkmodules.vtkIOPLY import vtkPLYReader
        from vtkmodules.vtkIOGeometry import vtkOBJReader
        from vtkmodules.util.numpy_support import vtk_to_numpy
    except ImportError as missing:
        print(f"missing: {missing}")
        sys.exit(77)
    failed = []
    if path.endswith(".pvd"):
        import xml.etree.ElementTree as tree
        sets = tree.parse(path).getroot().find("Collection").findall("DataSet")
        near("times", [float(s.get("timestep")) for s in sets], [f.time for f in states.frames])
        for i, one in enumerate(sets):
            reader = vtkXMLPolyDataReader()
            watch(reader, failed)
            reader.SetFileName(os.path.join(os.path.dirname(path), one.get("file")))
            reader.Update()
            check_poly(reader.GetOutput(), states, i)
    elif os.path.exists(os.path.join(path, "0000.ply")):
        for frame in states.frames:
            reader = vtkPLYReader()
            watch(reader, failed)
            reader.SetFileName(os.path.join(path, f"{frame.number:04d}.ply"))
            reader.Update()
            points = vtk_to_numpy(reader.GetOutput().GetPoints().GetData())
            near("points", points, frame.layout.surface(frame["x"]))
            need(reader.GetOutput().GetNumberOfPolys() == len(frame.layout.triangles), "triangles")
    else:
        for c, cloth in enumerate(states.header.cloths):
            layout = states.layouts[0]
            rows = slice(layout.vertex_begin[c], layout.vertex_begin[c + 1])
            reader = vtkOBJReader()
            watch(reader, failed)
            reader.SetFileName(os.path.join(path, cloth["name"] + ".obj"))
            reader.Update()
            data = reader.GetOutput()
            faces = int(layout.triangle_begin[c + 1] - layout.triangle_begin[c])
            need(data.GetNumberOfPolys() == faces, "triangles")
            rest = layout.surface(layout.rest)[rows]
            # this reader doubles the points at seams, behind the others or among them
            points = vtk_to_numpy(data.GetPoints().GetData())
            for p in points:
                near("a point", np.abs(rest - p).max(axis=1).min(), 0.0)
            uv = vtk_to_numpy(data.GetPointData().GetTCoords())
            need(uv.min() >= 0 and uv.max() <= 1, "texture coordinates")
    need(not failed, f"errors of {failed}")


def check_usd(states, path):
    try:
        from pxr import Usd, UsdGeom
    except ImportError as missing:
        print(f"missing: {missing} (pip install usd-core)")
        sys.exit(77)
    stage = Usd.Stage.Open(path)
    need(UsdGeom.GetStageUpAxis(stage) == "Z", "up axis")
    near("unit", UsdGeom.GetStageMetersPerUnit(stage), 1.0)
    meshes = [UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]
    need(len(meshes) == len(states.header.cloths), "number of meshes")
    for c, mesh in enumerate(meshes):
        need(UsdGeom.Mesh.ValidateTopology(
            mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(),
            len(mesh.GetPointsAttr().Get(states.frames[0].number)))[0], "topology")
        for frame in states.frames:
            layout = frame.layout
            rows = slice(layout.vertex_begin[c], layout.vertex_begin[c + 1])
            points = np.array(mesh.GetPointsAttr().Get(frame.number))
            near("points", points, layout.surface(frame["x"])[rows])
            normals = np.array(mesh.GetNormalsAttr().Get(frame.number))
            near("normals", np.linalg.norm(normals, axis=1), np.ones(len(points)), 1e-5)
            near("extent", np.array(mesh.GetExtentAttr().Get(frame.number)),
                 [points.min(axis=0), points.max(axis=0)])
        need(mesh.GetNormalsInterpolation() == "vertex", "interpolation of the normals")
        st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        need(st.GetInterpolation() == "faceVarying", "interpolation of st")
        uv = np.array(st.ComputeFlattened())
        need(len(uv) == 3 * len(mesh.GetFaceVertexCountsAttr().Get()), "st")
        need(uv.min() >= 0 and uv.max() <= 1, "texture coordinates")


def blender_positions(bpy, thing, frame):
    bpy.context.scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = thing.evaluated_get(graph).to_mesh()
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    return points.reshape(-1, 3)


def check_blender_cache(bpy, states, path, ending):
    """OBJ with the modifier Mesh Cache, in the object's own axes."""
    rate = states.header.film["rate"]
    bpy.context.scene.render.fps = int(round(rate))
    layout = states.layouts[0]
    for c, cloth in enumerate(states.header.cloths):
        rows = slice(layout.vertex_begin[c], layout.vertex_begin[c + 1])
        bpy.ops.wm.obj_import(filepath=os.path.join(path, cloth["name"] + ".obj"))
        thing = bpy.context.selected_objects[0]
        modifier = thing.modifiers.new("cache", "MESH_CACHE")
        modifier.cache_format = ending
        modifier.filepath = os.path.join(path, cloth["name"] + "." + ending.lower())
        # by time too; of a PC2 Blender divides the time by the rate twice, so its users stay with frames
        for mode in ("FRAME", "TIME") if ending == "MDD" else ("FRAME",):
            modifier.time_mode = mode
            modifier.frame_start = 0
            for i in (0, len(states.frames) // 2, len(states.frames) - 1):
                points = blender_positions(bpy, thing, i)
                near(f"{mode} {i}", points, surfaces(states)[i][rows], 2e-6)


def check_blender_gltf(bpy, states, path):
    """The animation of the morph targets; Blender is z up again. Corners at seams are doubled."""
    bpy.context.scene.render.fps = int(round(states.header.film["rate"]))
    for name in ("bool", "int", "float", "object"):  # this importer is older than its numpy
        setattr(np, name, __builtins__[name] if isinstance(__builtins__, dict)
                else getattr(__builtins__, name))
    bpy.ops.import_scene.gltf(filepath=path)
    layout = states.layouts[0]
    for c, cloth in enumerate(states.header.cloths):
        rows = slice(layout.vertex_begin[c], layout.vertex_begin[c + 1])
        thing = bpy.data.objects[cloth["name"]]
        for i in (0, len(states.frames) // 2, len(states.frames) - 1):
            points = blender_positions(bpy, thing, i)
            near(f"frame {i}", points[:rows.stop - rows.start], surfaces(states)[i][rows], 1e-5)


def check_blender(states, path):
    try:
        import bpy
    except ImportError:
        print("missing: this must run inside Blender")
        sys.exit(77)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.endswith(".glb"):
        check_blender_gltf(bpy, states, path)
    else:
        cache = "MDD" if any(n.endswith(".mdd") for n in os.listdir(path)) else "PC2"
        check_blender_cache(bpy, states, path, cache)


def main():
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    program, states, path = words
    {"vtk": check_vtk, "usd": check_usd, "blender": check_blender}[program](States(states), path)
    print(f"{program}: {os.path.basename(path)}: largest difference {worst:.3g}")


if __name__ == "__main__":
    main()
