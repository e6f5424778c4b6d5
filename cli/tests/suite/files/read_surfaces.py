"""Reads the surfaces of an average with trimesh, VTK and meshio; prints volumes, bounds, and whether
they are closed."""

import json
import sys

import meshio
import trimesh
import vtk

folder = sys.argv[1]
found = {}
for extension in ["stl", "ply"]:
    mesh = trimesh.load(f"{folder}/average.{extension}")
    found[f"trimesh {extension}"] = [mesh.volume, bool(mesh.is_watertight), mesh.bounds.tolist()]
mesh = meshio.read(f"{folder}/average.ply")
mesh = trimesh.Trimesh(mesh.points, mesh.cells_dict["triangle"])
found["meshio ply"] = [mesh.volume, bool(mesh.is_watertight), mesh.bounds.tolist()]
readers = {"stl": vtk.vtkSTLReader(), "ply": vtk.vtkPLYReader(), "vtp": vtk.vtkXMLPolyDataReader()}
for extension, reader in readers.items():
    reader.SetFileName(f"{folder}/average.{extension}")
    reader.Update()
    surface = reader.GetOutput()
    mass = vtk.vtkMassProperties()
    mass.SetInputData(surface)
    edges = vtk.vtkFeatureEdges()
    edges.SetInputData(surface)
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.NonManifoldEdgesOn()
    edges.BoundaryEdgesOn()
    edges.Update()
    b = surface.GetBounds()
    closed = edges.GetOutput().GetNumberOfCells() == 0
    found[f"vtk {extension}"] = [mass.GetVolume(), closed, [[b[0], b[2], b[4]], [b[1], b[3], b[5]]]]
space = surface.GetFieldData().GetAbstractArray("SPACE").GetValue(0)
print(json.dumps({"space": space, "found": found}))
