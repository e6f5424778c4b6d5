"""Reads what the program writes for volumes and drawings with VTK, nibabel and shapely; prints JSON.

Arguments: the folder of an average of volumes, that of a segmented volume, and that of an average in the plane.
"""
import json
import sys

import nibabel
import numpy
import shapely
import vtk
from vtk.util.numpy_support import vtk_to_numpy

average, segmented, flat = sys.argv[1:]


def centre(values, places):
    """Centroid of a mask."""
    weights = values.astype(float).ravel()
    return (weights @ places / weights.sum()).tolist()


def samples(image):
    """Values, and places in the world, of a NIfTI file."""
    image = nibabel.load(image)
    index = numpy.indices(image.shape[:3]).reshape(3, -1)
    places = (image.affine[:3, :3] @ index + image.affine[:3, 3:]).T
    return numpy.asarray(image.dataobj, dtype=float), places, image.affine


def nodes(name):
    """The image and the places of its nodes, as VTK has them."""
    reader = vtk.vtkXMLImageDataReader()
    reader.SetFileName(name)
    reader.Update()
    image = reader.GetOutput()
    places = numpy.array([image.GetPoint(k) for k in range(image.GetNumberOfPoints())])
    return image, places


image, places = nodes(f"{average}/average.vti")
field = vtk_to_numpy(image.GetPointData().GetArray("average"))
array = numpy.load(f"{average}/average.npy")
distance, lattice, _ = samples(f"{average}/average_distance.nii.gz")
reader = vtk.vtkXMLPolyDataReader()
reader.SetFileName(f"{average}/input_000.vtp")
reader.Update()
surface = reader.GetOutput()
carried = vtk_to_numpy(surface.GetPoints().GetData())
carried = carried + vtk_to_numpy(surface.GetPointData().GetArray("displacement"))
mean = vtk.vtkXMLPolyDataReader()
mean.SetFileName(f"{average}/average.vtp")
mean.Update()
locator = vtk.vtkImplicitPolyDataDistance()
locator.SetInput(mean.GetOutput())
determinant, _, _ = samples(f"{average}/jacobian_000.nii.gz")
mask, inside, affine = samples(f"{segmented}/mask_a.nii.gz")
with open(f"{flat}/average_outline.geojson") as file:
    drawing = json.load(file)
features = drawing["features"] if "features" in drawing else [drawing]
polygons = [shapely.geometry.shape(feature["geometry"]) for feature in features]
print(
    json.dumps(
        {
            "array": float(numpy.abs(array.ravel() - field).max()),
            "vti": centre(vtk_to_numpy(image.GetPointData().GetArray("mask")), places),
            "nifti": centre(distance > 0, lattice),
            "carried": float(max(abs(locator.EvaluateFunction(p)) for p in carried[::7])),
            "inner_change": float(determinant[distance > 0.3 * distance.max()].mean()),
            "mask_affine": affine.ravel().tolist(),
            "mask_samples": int(mask.sum()),
            "mask_centre": centre(mask, inside),
            "valid": all(polygon.is_valid for polygon in polygons),
            "area": sum(polygon.area for polygon in polygons),
        }
    )
)
