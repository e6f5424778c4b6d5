"""Writes one mask in every format of pictures and arrays that other programs write, in the folder it runs in.

Prints the size, and the values of the mask with x fastest and the first row first, as JSON.
"""
import json

import numpy
from PIL import Image

width, height = 30, 22
y, x = numpy.mgrid[:height, :width]
# No symmetry: a disk, and a bar at one side.
mask = ((x - 11) / 8) ** 2 + ((y - 9) / 6) ** 2 < 1
mask |= (x > 11) & (x < 26) & (y > 8) & (y < 14)
grey = (mask * 200).astype("uint8")

picture = Image.fromarray(grey)
bits = picture.convert("1", dither=Image.Dither.NONE)
wide = Image.fromarray((mask * 50000).astype("uint16"))
colours = picture.convert("RGB")
palette = Image.fromarray(mask.astype("uint8")).convert("P")
palette.putpalette([0, 0, 0, 250, 60, 10] + [0] * 750)
for mode, image in {"grey": picture, "bits": bits, "wide": wide, "rgb": colours, "palette": palette}.items():
    image.save(f"{mode}.png")
for mode, image in {"grey": picture, "bits": bits, "rgb": colours}.items():
    image.save(f"{mode}.bmp")
picture.save("grey.pgm")
wide.save("wide.pgm")
bits.save("bits.pbm")
colours.save("rgb.ppm")
picture.save("grey.jpg", quality=100, subsampling=0)
for packing in ("raw", "packbits", "tiff_lzw", "tiff_adobe_deflate"):
    picture.save(f"grey_{packing}.tif", compression=packing)
wide.save("wide.tiff", compression="raw")
Image.fromarray(mask.astype("float32")).save("single.tiff")

# A stack of the mask, of an empty page and of the mask again.
pages = [picture, Image.fromarray(0 * grey), picture]
pages[0].save("stack.tif", save_all=True, append_images=pages[1:])

# Arrays have rows, as pictures.
for kind in ("bool", "uint8", "int16", ">i4", "uint64", "<f4", ">f8"):
    numpy.save(f"array_{kind.strip('<>')}.npy", mask.astype(kind))
numpy.save("array_fortran.npy", numpy.asfortranarray(mask.astype("float64")))

print(json.dumps({"size": [width, height], "mask": mask.ravel().tolist()}))
