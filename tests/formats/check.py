#!/usr/bin/env python3
"""check.py FOLDER: opens what firn_formats has written to FOLDER with OpenUSD, which Houdini, Blender and Omniverse use,
with VTK, which ParaView uses, and with plyfile and trimesh, and compares it with expected.json. Ends with 77 if a library
is missing."""

import json
import pathlib
import sys

try:
    import numpy as np
    import plyfile
    import trimesh
    import vtk
    from pxr import Sdf, Usd, UsdGeom, UsdUtils
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError as missing:
    print(f"Skipped: {missing}. pip install usd-core vtk plyfile trimesh numpy")
    sys.exit(77)

folder = pathlib.Path(sys.argv[1])
expected = json.loads((folder / "expected.json").read_text())
failures = 0
checks = 0


def check(holds, what):
    global failures, checks
    checks += 1
    if not holds:
        failures += 1
        print(f"Not so: {what}")


def array(state, name, columns):
    return np.array(state[name], dtype=np.float32).reshape(-1, columns)


def same(got, wanted, what):
    got = np.asarray(got)
    check(got.shape == wanted.shape and np.array_equal(got, wanted), f"{what} is what was written")


def read_series(name):
    listed = json.loads((folder / name).read_text())
    return [(entry["name"], entry["time"]) for entry in listed["files"]]


# OpenUSD: the checker of the library, and all values at all times.
def complaints(path):
    if hasattr(UsdUtils, "ComplianceChecker"):  # until USD 25
        checker = UsdUtils.ComplianceChecker()
        checker.CheckCompliance(str(path))
        return checker.GetErrors() + checker.GetFailedChecks() + checker.GetWarnings()
    from pxr import UsdValidation

    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    check(len(validators) > 10, "USD has its validators")
    stage = Usd.Stage.Open(str(path))
    return [f"{error.GetName()}: {error.GetMessage()}"
            for error in UsdValidation.ValidationContext(validators).Validate(stage)]


def check_stage(path):
    found = complaints(path)
    check(not found, f"{path.name} complies: {found}")


def check_points(prim, time, state, what):
    points = UsdGeom.Points(prim)
    check(bool(points), f"{what} is UsdGeomPoints")
    same(points.GetPointsAttr().Get(time), array(state, "position", 3), f"{what}: points")
    same(points.GetVelocitiesAttr().Get(time), array(state, "velocity", 3), f"{what}: velocities")
    same(points.GetIdsAttr().Get(time), np.array(state["id"], dtype=np.int64), f"{what}: ids")
    widths = points.GetWidthsAttr().Get(time)
    check(np.allclose(widths, 0.02, rtol=1e-6), f"{what}: widths are the spacing")
    check(points.GetWidthsInterpolation() == "vertex", f"{what}: a width for each point")


def check_mesh(prim, time, state, what):
    mesh = UsdGeom.Mesh(prim)
    check(bool(mesh), f"{what} is UsdGeomMesh")
    same(mesh.GetPointsAttr().Get(time), array(state, "position", 3), f"{what}: points")
    facets = np.array(state["facets"], dtype=np.int32)
    same(mesh.GetFaceVertexIndicesAttr().Get(time), facets, f"{what}: corners")
    counts = mesh.GetFaceVertexCountsAttr().Get(time)
    same(counts, np.full(len(facets) // 3, 3, dtype=np.int32), f"{what}: triangles")
    valid, why = UsdGeom.Mesh.ValidateTopology(
        mesh.GetFaceVertexIndicesAttr().Get(time), counts, len(mesh.GetPointsAttr().Get(time)))
    check(valid, f"{what}: topology is valid ({why})")


def check_extent(prim, time, what):
    geometry = UsdGeom.Boundable(prim)
    same(geometry.GetExtentAttr().Get(time), np.array(UsdGeom.Boundable.ComputeExtentFromPlugins(geometry, time)),
         f"{what}: extent")


def check_run():
    check_stage(folder / "run.usda")
    stage = Usd.Stage.Open(str(folder / "run.usda"))
    check(UsdGeom.GetStageMetersPerUnit(stage) == 1, "lengths are in metres")
    check(UsdGeom.GetStageUpAxis(stage) == "Y", "y is up")
    check(stage.GetTimeCodesPerSecond() == 24, "24 time codes are a second")
    check(stage.GetDefaultPrim().GetPath() == "/run", "the default prim is /run")
    check((stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, 12), "the stage begins and ends")
    drops, cloth = stage.GetPrimAtPath("/run/drops"), stage.GetPrimAtPath("/run/cloth")
    for prim in (drops, cloth):
        points = prim.GetAttribute("points")
        check(points.GetTimeSamples() == [0, 3, 6, 9, 12], f"{prim.GetName()} has a sample for each time")
        check(points.ValueMightBeTimeVarying(), f"{prim.GetName()} is animated")
    for k in range(5):
        check_points(drops, 3 * k, expected["drops"][k], f"drops at the time code {3 * k}")
        check_mesh(cloth, 3 * k, expected["cloth"][k], f"cloth at the time code {3 * k}")
        check_extent(drops, 3 * k, f"drops at the time code {3 * k}")
        check_extent(cloth, 3 * k, f"cloth at the time code {3 * k}")
        if k < 4:  # between two samples: drops, of which there are more and more, are held, and cloth is interpolated
            check_points(drops, 3 * k + 1.5, expected["drops"][k], f"drops at the time code {3 * k + 1.5}")
            mean = (array(expected["cloth"][k], "position", 3) + array(expected["cloth"][k + 1], "position", 3)) / 2
            check(np.allclose(UsdGeom.Mesh(cloth).GetPointsAttr().Get(3 * k + 1.5), mean, atol=1e-7),
                  f"cloth at the time code {3 * k + 1.5} is between its neighbours")
        path = folder / f"run_{k:04d}.usda"
        check_stage(path)
        alone = Usd.Stage.Open(str(path))
        check_points(alone.GetPrimAtPath("/run/drops"), 3 * k, expected["drops"][k], f"drops in {path.name}")
        check_mesh(alone.GetPrimAtPath("/run/cloth"), 3 * k, expected["cloth"][k], f"cloth in {path.name}")
        check(Sdf.Layer.FindOrOpen(str(path)).ExportToString() != "", f"{path.name} is a layer")
    box = UsdGeom.BBoxCache(6, ["default"]).ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    every = np.concatenate([array(expected[name][2], "position", 3) for name in ("drops", "cloth")])
    check(np.allclose(box.GetMin(), np.minimum(every.min(0), array(expected["drops"][2], "position", 3).min(0) - 0.01),
                      atol=1e-6), "the bounding box of the stage is that of its points")
    # OpenUSD makes one binary file of it, whose values are its own.
    stage.Export(str(folder / "run.usdc"))
    binary = Usd.Stage.Open(str(folder / "run.usdc"))
    check(binary.GetDefaultPrim().GetMetadata("clips") is None, "the binary file needs no other")
    for k in range(5):
        check_points(binary.GetPrimAtPath("/run/drops"), 3 * k, expected["drops"][k], f"drops in run.usdc at {3 * k}")
        check_mesh(binary.GetPrimAtPath("/run/cloth"), 3 * k, expected["cloth"][k], f"cloth in run.usdc at {3 * k}")
    # Another stage may refer to it.
    other = Usd.Stage.CreateInMemory()
    other.DefinePrim("/shot").GetReferences().AddReference(str(folder / "run.usda"))
    same(other.GetPrimAtPath("/shot/drops").GetAttribute("points").Get(9), array(expected["drops"][3], "position", 3),
         "a reference to the stage")


def check_primvars():
    check_stage(folder / "fields.usda")
    stage = Usd.Stage.Open(str(folder / "fields.usda"))
    primvars = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/fields/drops"))
    gradient = array(expected["drops"][2], "deformation_gradient", 9)
    for c in range(9):
        primvar = primvars.GetPrimvar(f"deformation_gradient_{c}")
        check(primvar.GetInterpolation() == "vertex" and primvar.GetElementSize() == 1, f"F_{c} has a value for each point")
        same(primvar.Get(6), gradient[:, c], f"F_{c}")
    same(primvars.GetPrimvar("volume").Get(6), array(expected["drops"][2], "volume", 1)[:, 0], "the volume")


# PLY and OBJ with trimesh and VTK.
def read_vtk(reader, path):
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    points = data.GetPoints()
    return (vtk_to_numpy(points.GetData()) if points else np.zeros((0, 3), np.float32)), data


def check_ply():
    listed = read_series("drops.ply.series")
    check([time for _, time in listed] == [0.125 * k for k in range(5)], "the list of PLY has its times")
    for (name, _), state in zip(listed[1:], expected["drops"][1:]):  # libraries refuse a file without points
        path = folder / name
        positions = array(state, "position", 3)
        same(trimesh.load(path).vertices, positions.astype(float), f"{name} with trimesh")
        vertex = plyfile.PlyData.read(path)["vertex"].data
        same(np.stack([vertex[axis] for axis in ("vx", "vy", "vz")], 1), array(state, "velocity", 3), f"{name}: vx vy vz")
        same(vertex["id"], np.array(state["id"], dtype=np.uint32), f"{name}: ids")
        same(vertex["volume"], array(state, "volume", 1)[:, 0], f"{name}: volume")
        same(read_vtk(vtk.vtkPLYReader(), path)[0], positions, f"{name} with VTK")
    for k, (name, _) in enumerate(read_series("all.ply.series")):
        mesh = trimesh.load(folder / name, process=False)
        drops, cloth = array(expected["drops"][k], "position", 3), array(expected["cloth"][k], "position", 3)
        same(mesh.vertices, np.concatenate([drops, cloth]).astype(float), f"{name}: drops and cloth")
        facets = np.array(expected["cloth"][k]["facets"]).reshape(-1, 3) + len(drops)
        same(mesh.faces, facets, f"{name}: triangles")
        points, data = read_vtk(vtk.vtkPLYReader(), folder / name)
        same(points, np.concatenate([drops, cloth]), f"{name} with VTK")
        check(data.GetNumberOfPolys() == len(facets), f"{name} with VTK: triangles")


def check_obj():
    for k, (name, time) in enumerate(read_series("cloth.obj.series")):
        state = expected["cloth"][k]
        check(time == state["time"], f"{name} has its time")
        positions, facets = array(state, "position", 3), np.array(state["facets"]).reshape(-1, 3)
        mesh = trimesh.load(folder / name, process=False, maintain_order=True)
        same(mesh.vertices.astype(np.float32), positions, f"{name} with trimesh")
        same(mesh.faces, facets, f"{name} with trimesh: triangles")
        points, data = read_vtk(vtk.vtkOBJReader(), folder / name)
        same(points.astype(np.float32), positions, f"{name} with VTK")
        check(data.GetNumberOfPolys() == len(facets), f"{name} with VTK: triangles")


# Gaussian splats, as viewers compute them from the file.
def check_splats():
    for (name, _), state in zip(read_series("splats.ply.series"), expected["drops"][1:]):
        same(read_vtk(vtk.vtkPLYReader(), folder / name)[0], array(state, "position", 3), f"{name} with VTK")
        vertex = plyfile.PlyData.read(folder / name)["vertex"].data
        names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                 "rot_0", "rot_1", "rot_2", "rot_3"]
        check(list(vertex.dtype.names) == names, f"{name} has the properties of a splat in their order")

        def columns(*names):
            return np.stack([vertex[name] for name in names], 1).astype(float)

        w, x, y, z = columns("rot_0", "rot_1", "rot_2", "rot_3").T
        check(np.allclose(w * w + x * x + y * y + z * z, 1, atol=3e-7) and (w >= 0).all(), f"{name}: unit quaternions")
        rotation = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                             [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                             [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)
        scale = np.exp(columns("scale_0", "scale_1", "scale_2"))
        covariance = np.einsum("nij,nj,nkj->nik", rotation, scale**2, rotation)
        gradient = array(state, "deformation_gradient", 9).astype(float).reshape(-1, 3, 3)
        wanted = expected["radius"] ** 2 * gradient @ gradient.transpose(0, 2, 1)
        error = np.linalg.norm(covariance - wanted, axis=(1, 2)) / np.linalg.norm(wanted, axis=(1, 2))
        print(f"{name}: {len(error)} covariances, largest relative error {error.max():.2g}")
        check(error.max() < 2e-6, f"{name}: covariances are F Sigma0 F^T")
        colour = 0.5 + 0.28209479177387814 * columns("f_dc_0", "f_dc_1", "f_dc_2")
        check(np.allclose(colour, [1, 0.25, 0], atol=1e-6), f"{name}: colours")
        check(np.allclose(1 / (1 + np.exp(-columns("opacity"))), 0.9, atol=1e-6), f"{name}: opacity")


check_run()
check_primvars()
check_ply()
check_obj()
check_splats()
print(f"{checks - failures} passed, {failures} failed")
sys.exit(1 if failures else 0)
