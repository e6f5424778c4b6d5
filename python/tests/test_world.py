"""Volumes with a place in the world: affine maps, nibabel and SimpleITK."""

import numpy as np
import pytest
from drawing import ellipses, ellipsoid

import shapespace

AFFINE = np.array(
    [[0.0, 0.0, -2.0, 40.0], [1.5, 0.0, 0.0, -10.0], [0.0, 1.0, 0.0, 5.0], [0, 0, 0, 1]]
)


def volumes():
    return [ellipsoid(11).astype("u1"), ellipsoid(11, axes=(0.25, 0.3, 0.25)).astype("u1")]


def centre(mask, affine):
    """The centre of an object in the world."""
    index = np.array(np.nonzero(mask)).mean(axis=1)
    return (affine @ [*index, 1])[:3]


def reach(mask, affine):
    """How far an object reaches about its centre along the axes of the world."""
    points = np.array(np.nonzero(mask)).T @ affine[:3, :3].T
    return points.std(axis=0)


@pytest.fixture(scope="module")
def placed():
    return shapespace.average(volumes(), affine=AFFINE, grid=17)


def test_the_average_lies_where_the_shapes_do(placed):
    expected = centre(volumes()[0], AFFINE)
    assert np.allclose(centre(placed.mask, placed.affine), expected, atol=0.5)
    bounds = np.sort([reach(volume, AFFINE) for volume in volumes()], axis=0)
    found = reach(placed.mask, placed.affine)
    assert (0.9 * bounds[0] < found).all() and (found < 1.1 * bounds[1]).all()
    sizes = [abs(np.linalg.det(AFFINE[:3, :3])) * volume.sum() for volume in volumes()]
    size = abs(np.linalg.det(placed.affine[:3, :3])) * placed.mask.sum()
    assert 0.85 * min(sizes) < size < 1.1 * max(sizes)


def test_the_order_of_axes_does_not_matter(placed):
    """Reversed axes with reversed columns are the same shapes in the world."""
    turned = AFFINE[:, [2, 1, 0, 3]]
    other = shapespace.average([v.T for v in volumes()], affine=turned, grid=17)
    assert np.allclose(other.affine, placed.affine)
    assert np.allclose(other.average, placed.average, atol=1e-9)


def test_a_singular_map_is_refused():
    with pytest.raises(shapespace.InputError, match="singular|no length"):
        shapespace.average(volumes(), affine=np.zeros((4, 4)))
    with pytest.raises(shapespace.InputError, match="2 values of affine|values of affine"):
        shapespace.average(volumes(), affine=[AFFINE])


def test_spacings_follow_the_axes_of_the_array():
    """A volume of thick slices has the shape that its spacing says."""
    thick = [volume[::3] for volume in volumes()]
    fine = shapespace.average(volumes(), spacing=1.0, grid=17, align="none")
    coarse = shapespace.average(thick, spacing=(3, 1, 1), grid=17, align="none")
    wrong = shapespace.average(thick, spacing=(1, 1, 3), grid=17, align="none")

    def size(result):
        return result.record["input"][0]["volume_input_units"]

    assert abs(size(coarse) / size(fine) - 1) < 0.2
    extent = [np.ptp(np.nonzero(r.mask)[0]) / np.ptp(np.nonzero(r.mask)[2]) for r in (coarse, wrong)]
    assert extent[0] > 2 * extent[1]


def test_nibabel_images_are_their_files(program):
    nibabel = pytest.importorskip("nibabel", reason="nibabel is not installed")
    images = [nibabel.Nifti1Image(volume, AFFINE) for volume in volumes()]
    for k, image in enumerate(images):
        nibabel.save(image, program.folder / f"mask_{k:03}.nii.gz")
    files = sorted(program.folder.glob("*.nii.gz"))
    program.run("average", *files, "--grid", 9, "-o", "out")
    program.same(shapespace.average(images, grid=9), "out")
    program.same(shapespace.average([nibabel.load(file) for file in files], grid=9), "out")
    # The array with its affine map is the same, too.
    program.same(shapespace.average(volumes(), affine=AFFINE, grid=9), "out")


def test_units_of_nibabel_images_are_read(program):
    nibabel = pytest.importorskip("nibabel", reason="nibabel is not installed")
    images = [nibabel.Nifti1Image(volume, AFFINE) for volume in volumes()]
    for k, image in enumerate(images):
        image.header.set_xyzt_units("micron")
        nibabel.save(image, program.folder / f"mask_{k:03}.nii")
    files = sorted(program.folder.glob("*.nii"))
    program.run("average", *files, "--grid", 9, "-o", "out")
    program.same(shapespace.average(images, grid=9), "out")


def test_the_affine_is_that_of_nibabel(placed):
    nibabel = pytest.importorskip("nibabel", reason="nibabel is not installed")
    image = nibabel.Nifti1Image(placed.mask.astype("u1"), placed.affine)
    again = shapespace.average([image, image], grid=17)
    assert np.allclose(centre(again.mask, again.affine), centre(placed.mask, placed.affine), atol=0.3)


def test_simpleitk_images_are_their_files(program):
    itk = pytest.importorskip("SimpleITK", reason="SimpleITK is not installed")
    images = []
    for k, volume in enumerate(volumes()):
        image = itk.GetImageFromArray(volume)
        image.SetSpacing((1.0, 1.5, 2.0))
        image.SetOrigin((3.0, -4.0, 5.0))
        image.SetDirection((0, 1, 0, -1, 0, 0, 0, 0, 1))
        itk.WriteImage(image, str(program.folder / f"mask_{k:03}.mha"))
        images.append(image)
    files = sorted(program.folder.glob("*.mha"))
    program.run("average", *files, "--grid", 9, "-o", "out")
    found = shapespace.average(images, grid=9)
    program.same(found, "out")
    # Points of SimpleITK are counted to the left and to the back.
    index = np.array(np.nonzero(volumes()[0])).mean(axis=1)[::-1]
    point = images[0].TransformContinuousIndexToPhysicalPoint(index.tolist())
    expected = np.array(point) * [-1, -1, 1]
    assert np.allclose(centre(found.mask, found.affine), expected, atol=1.0)


def test_flat_images_and_points_are_carried(average, modes, geodesic):
    masks = ellipses()
    assert masks[0].shape == (33, 33)
    carried = shapespace.warp(average, masks[0].astype(float), shape=0, interpolation="linear")
    assert carried.shape == average.mask.shape
    # A quarter of a sample along the boundary is 6 % of the area.
    assert (carried > 0.5).sum() == pytest.approx(average.mask.sum(), rel=0.08)
    onto = shapespace.warp(average, masks[0], shape=0, to_shape=1)
    assert onto.sum() == pytest.approx(masks[1].sum(), rel=0.08)
    points = [[10.0, 16.0], [20.5, 15.0]]
    for source, shapes in [(average, {"shape": 1}), (geodesic, {"time": 0.4}), (modes, {"scores": [1]})]:
        there = shapespace.warp(source, points, **shapes)
        back = shapespace.warp(source, there, inverse=True, **shapes)
        assert there.shape == (2, 2) and np.allclose(back, points, atol=1e-3)
    with pytest.raises(ValueError, match="2 coordinates"):
        shapespace.warp(average, [[0, 0, 0]], shape=0)
    with pytest.raises(shapespace.InputError, match="--shape"):
        shapespace.warp(geodesic, points, shape=0)


def test_points_and_volumes_are_carried(program, placed):
    expected = centre(volumes()[0], AFFINE)
    there = shapespace.warp(placed, [expected.tolist(), (expected + 1).tolist()], shape=0)
    assert there.shape == (2, 3) and np.allclose(there[0], expected, atol=0.7)
    back = shapespace.warp(placed, there, shape=0, inverse=True)
    assert np.allclose(back[1], expected + 1, atol=1e-3)
    values, affine = shapespace.warp(placed, volumes()[0], affine=AFFINE, shape=0)
    assert set(np.unique(values)) <= {0.0, 1.0}
    assert np.allclose(centre(values > 0, affine), centre(placed.mask, placed.affine), atol=0.5)
    nibabel = pytest.importorskip("nibabel", reason="nibabel is not installed")
    file = program.folder / "image.nii.gz"
    nibabel.save(nibabel.Nifti1Image(volumes()[0], AFFINE), file)
    placed_folder = shapespace.average(volumes(), affine=AFFINE, grid=17).save(
        program.folder / "average"
    )
    program.run("warp", placed_folder, file, "--shape", 0, "-o", "warped")
    written = nibabel.load(program.folder / "warped/image.nii.gz")
    assert np.array_equal(np.asarray(written.dataobj), values)
    assert np.allclose(written.affine, affine, atol=1e-4)
    with pytest.raises(shapespace.InputError, match="--shape 5"):
        shapespace.warp(placed, [[0, 0, 0]], shape=5)
