"""Writes one surface in every format as trimesh, VTK and meshio do; prints its volume, and the signed
distances (positive inside) of points to it as VTK computes them."""

import json

import meshio
import numpy
import trimesh
import vtk
from vtk.util.numpy_support import vtk_to_numpy

# Two balls that are joined, without symmetries, closed and smooth.
sphere = trimesh.creation.icosphere(subdivisions=4, radius=9.0)
points = numpy.asarray(sphere.vertices)
points = points * (1 + 0.25 * numpy.sin(0.3 * points[:, :1]) + 0.1 * numpy.cos(0.4 * points[:, 1:2]))
points = numpy.float32(points + [20.0, -35.0, 41.0]).astype(float)
mesh = trimesh.Trimesh(points, sphere.faces, process=False)
mesh.export("t_binary.stl")
mesh.export("t_text.stl", file_type="stl_ascii")
mesh.export("t_binary.ply")
mesh.export("t_text.ply", encoding="ascii")
mesh.export("t.obj")
cells = [("triangle", mesh.faces)]
meshio.write_points_cells("m_binary.ply", points, cells, binary=True)
meshio.write_points_cells("m_text.ply", points, cells, binary=False)
meshio.write_points_cells("m.obj", points, cells)

reader = vtk.vtkSTLReader()
reader.SetFileName("t_binary.stl")
reader.Update()
surface = reader.GetOutput()
for kind, name in [(vtk.VTK_BINARY, "binary"), (vtk.VTK_ASCII, "text")]:
    for version in [42, 51]:
        writer = vtk.vtkPolyDataWriter()
        writer.SetFileType(kind)
        writer.SetFileVersion(version)
        writer.SetFileName(f"v_{name}_{version}.vtk")
        writer.SetInputData(surface)
        writer.Write()
    writer = vtk.vtkPLYWriter()
    writer.SetFileType(kind)
    writer.SetFileName(f"v_{name}.ply")
    writer.SetInputData(surface)
    writer.Write()
normals = vtk.vtkPolyDataNormals()
normals.SetInputData(surface)
strips = vtk.vtkStripper()
strips.SetInputConnection(normals.GetOutputPort())
strips.Update()
for data, shape in [(normals.GetOutput(), "polygons"), (strips.GetOutput(), "strips")]:
    for mode in ["Ascii", "Binary", "Appended"]:
        for compressor in ["None", "ZLib"]:
            for encode in [True, False]:
                writer = vtk.vtkXMLPolyDataWriter()
                getattr(writer, f"SetDataModeTo{mode}")()
                getattr(writer, f"SetCompressorTypeTo{compressor}")()
                writer.SetEncodeAppendedData(encode)
                writer.SetHeaderTypeToUInt32() if encode else writer.SetHeaderTypeToUInt64()
                writer.SetFileName(f"v_{shape}_{mode}_{compressor}_{encode}.vtp")
                writer.SetInputData(data)
                writer.Write()

distance = vtk.vtkImplicitPolyDataDistance()
distance.SetInput(surface)
random = numpy.random.default_rng(0)
places = random.uniform(mesh.bounds[0] - 5, mesh.bounds[1] + 5, (200, 3))
values = [-distance.EvaluateFunction(place) for place in places]
corners = vtk_to_numpy(surface.GetPoints().GetData())
print(json.dumps({
    "volume": mesh.volume,
    "places": places.tolist(),
    "distances": values,
    "corner": corners[0].tolist(),
}))
