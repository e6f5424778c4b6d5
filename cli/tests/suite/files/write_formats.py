"""Writes one mask in every format that other programs write, and prints its affine map as JSON.

Argument: the folder. The lattice is oblique and left-handed, with unequal spacings.
"""
import json
import pathlib
import sys

import nibabel
import numpy
import SimpleITK as sitk

folder = pathlib.Path(sys.argv[1])
shape = (20, 18, 16)
c, s = numpy.cos(0.5), numpy.sin(0.5)
turn = numpy.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
turn = turn @ numpy.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
affine = numpy.eye(4)
affine[:3, :3] = turn @ numpy.diag([-1.5, 1.0, 2.0])
affine[:3, 3] = [12.0, -30.0, 44.0]
i, j, k = numpy.meshgrid(*[numpy.arange(n) for n in shape], indexing="ij")
mask = (((i - 9) / 7) ** 2 + ((j - 8) / 5) ** 2 + ((k - 7) / 4) ** 2 + 0.004 * i * j < 1).astype("uint8")

for name, kind in [("one.nii", nibabel.Nifti1Image), ("two.nii", nibabel.Nifti2Image)]:
    for type_ in ("uint8", "int16", "float32"):
        image = kind(mask.astype(type_), affine)
        nibabel.save(image, folder / f"{type_}_{name}")
        nibabel.save(image, folder / f"{type_}_{name}.gz")
big = nibabel.Nifti1Header(endianness=">")
nibabel.save(nibabel.Nifti1Image(mask, affine, big), folder / "big.nii")
nibabel.save(nibabel.Nifti1Pair(mask, affine), folder / "pair.img")
nibabel.save(nibabel.Nifti2Pair(mask, affine), folder / "pair_two.img")
quaternion = nibabel.Nifti1Image(mask, affine)
quaternion.set_sform(None, code=0)
quaternion.set_qform(affine, code=1)
nibabel.save(quaternion, folder / "quaternion.nii")

image = sitk.ReadImage(str(folder / "uint8_one.nii"))
for name in ("raw.nrrd", "detached.nhdr", "raw.mha", "detached.mhd"):
    sitk.WriteImage(image, str(folder / name))
    sitk.WriteImage(image, str(folder / f"packed_{name}"), True)
wide = sitk.Cast(image, sitk.sitkFloat64)
sitk.WriteImage(wide, str(folder / "wide.nrrd"), True)
sitk.WriteImage(wide, str(folder / "wide.mha"), True)
print(json.dumps({"affine": affine[:3].tolist(), "samples": int(mask.sum())}))
