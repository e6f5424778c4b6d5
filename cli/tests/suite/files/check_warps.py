"""Applies displacement fields with SimpleITK, and with ANTs where it is, and prints overlaps as JSON.

Arguments: the average's mask, its signed distance, its affine map as JSON (16 numbers by rows), and
for each input a comma-separated list of its file, its warp, its inverse warp, and its warped mask by
the program under test.
"""
import json
import sys

import nibabel
import numpy
import SimpleITK as sitk

try:
    import ants
except ImportError:
    ants = None


def transform(path):
    field = sitk.ReadImage(path, sitk.sitkVectorFloat64)
    assert field.GetNumberOfComponentsPerPixel() == 3, "not a field of vectors"
    return sitk.DisplacementFieldTransform(field)


def resampled(moving, fixed, path):
    return sitk.Resample(moving, fixed, transform(path), sitk.sitkLinear, 0.0, sitk.sitkFloat64)


def by_ants(moving, fixed, path):
    moving, fixed = (ants.image_read(name) for name in (moving, fixed))
    warped = ants.apply_transforms(fixed, moving, transformlist=[path], interpolator="linear")
    # The arrays of ANTs begin with x, those of SimpleITK with z.
    return sitk.GetImageFromArray(warped.numpy().T)


def dice(a, b):
    a, b = (sitk.GetArrayFromImage(image) > 0.5 for image in (a, b))
    return 2.0 * numpy.logical_and(a, b).sum() / (a.sum() + b.sum())


average = sitk.ReadImage(sys.argv[1], sitk.sitkFloat64)
distance = sitk.GetArrayFromImage(sitk.ReadImage(sys.argv[2], sitk.sitkFloat64))
stated = numpy.array(json.loads(sys.argv[3])).reshape(4, 4)
found = {
    # Both readers place the samples in the same way.
    "affine": float(numpy.abs(nibabel.load(sys.argv[1]).affine - stated).max()),
    "sides": bool(((distance > 0) == (sitk.GetArrayFromImage(average) > 0.5)).all()),
    "volume": float(sitk.GetArrayFromImage(average).sum() * numpy.prod(average.GetSpacing())),
    "onto": [],
    "back": [],
    "ours": [],
    "ants": [],
}
for names in sys.argv[4:]:
    subject, warp, inverse, warped = names.split(",")
    file = subject
    subject = sitk.ReadImage(subject, sitk.sitkFloat64)
    onto = resampled(subject, average, warp)
    found["onto"].append(dice(onto, average))
    found["back"].append(dice(resampled(average, subject, inverse), subject))
    if warped:
        found["ours"].append(dice(onto, sitk.ReadImage(warped, sitk.sitkFloat64)))
        if ants:
            found["ants"].append(dice(by_ants(file, sys.argv[1], warp), sitk.ReadImage(warped, sitk.sitkFloat64)))
print(json.dumps(found))
