"""Results are those of the program on the same inputs, to the last bit."""

import numpy as np
import pytest
from drawing import disc_image, ellipse, ellipses, ellipsoid

import shapespace


def names(files):
    return [file.stem for file in files]


def test_average_of_booleans(program):
    files = program.save(**{f"mask_{k:03}": mask for k, mask in enumerate(ellipses())})
    program.run("average", *files, "--grid", 33, "-o", "out")
    program.same(shapespace.average(ellipses(), grid=33), "out")


@pytest.mark.parametrize(
    "kind", ["bool", "u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8", ">i2", ">f8"]
)
def test_every_type_of_numbers_is_read_as_in_a_file(program, kind):
    masks = [mask.astype(kind) for mask in ellipses(17)[:2]]
    files = program.save(**{f"mask_{k:03}": mask for k, mask in enumerate(masks)})
    program.run("average", *files, "--grid", 17, "-o", "out")
    program.same(shapespace.average(masks, grid=17), "out")


def test_grey_values_lie_between_samples(program):
    masks = [(255 * mask).astype("u1") for mask in ellipses(40)]
    for mask in masks:
        mask[5, 5] = 100
    files = program.save(**{f"mask_{k:03}": mask for k, mask in enumerate(masks)})
    options = {"grid": 33, "align": "rigid", "size": "equal", "mismatch_weight": 0.5}
    flags = [w for k, v in options.items() for w in ("--" + k.replace("_", "-"), v)]
    program.run("average", *files, *flags, "-o", "out")
    program.same(shapespace.average(masks, **options), "out")


def test_order_and_strides_of_memory_do_not_matter():
    masks = ellipses(17)[:2]
    expected = shapespace.average(masks, grid=17).arrays
    for other in [
        [np.asfortranarray(mask) for mask in masks],
        [np.repeat(mask, 2, axis=1)[:, ::2] for mask in masks],
        np.stack(masks),
    ]:
        found = shapespace.average(other, grid=17).arrays
        assert all(np.array_equal(found[k], expected[k]) for k in expected)


def test_average_of_volumes(program):
    masks = [ellipsoid(9), ellipsoid(9, axes=(0.25, 0.3, 0.25))]
    files = program.save(**{f"mask_{k:03}": mask for k, mask in enumerate(masks)})
    program.run("average", *files, "--grid", 9, "-o", "out")
    program.same(shapespace.average(masks, grid=9), "out")


def test_files_pictures_and_arrays_together(program):
    first, second, third = ellipses()
    program.save(first=first, second=second)
    path = program.folder / "first.npy"
    program.run("average", "first.npy", "second.npy", "--grid", 33, "-o", "out")
    program.same(shapespace.average([path, second], grid=33), "out")


def test_visibility_and_weights(program):
    valid = np.ones((33, 33), bool)
    valid[:, :12] = False
    files = program.save(a=ellipses()[0], b=ellipses()[1])
    program.save(valid=valid)
    options = ["--grid", 33, "--weights", ".25,.75", "--valid", "all", "valid.npy"]
    program.run("average", *files, "-o", "out", *options)
    views = [None, valid]
    found = shapespace.average(ellipses()[:2], grid=33, weights=[0.25, 0.75], valid=views)
    program.same(found, "out")


def test_sweep_and_joint(program):
    files = program.save(a=ellipses(17)[0], b=ellipses(17)[1])
    program.run("average", *files, "--grid", 17, "--sweep", 3, "-o", "sweep")
    sweep = shapespace.average(ellipses(17)[:2], grid=17, sweep=3)
    program.same(sweep, "sweep")
    assert len(sweep.masks) == 3 and np.array_equal(sweep.weights[1], [0.5, 0.5])
    images = [disc_image(17), disc_image(17, 0.25)]
    files = program.save(c=images[0], d=images[1])
    program.run("average", *files, "--grid", 17, "--joint", "-o", "joint")
    joint = shapespace.average(images, grid=17, joint=True)
    program.same(joint, "joint")
    assert joint.image.shape == (17, 17)


def test_modes_scores_and_shapes(program, average, modes):
    files = program.save(**{f"mask_{k:03}": mask for k, mask in enumerate(ellipses())})
    options = ["--grid", 33, "--align", "none", "--length-weight", 1e-5]
    program.run("average", *files, *options, "-o", "average")
    program.same(average, "average")
    program.run("pca", "average", "-o", "modes")
    program.same(modes, "modes")
    new = ellipse(axes=(0.28, 0.22))
    [file] = program.save(new=new)
    program.run("score", file, "--pca", "modes", "-o", "score")
    program.same(shapespace.score([new], modes), "score")
    program.run("synthesize", "modes", "--scores", "1,-.5", "-o", "shape")
    program.same(shapespace.synthesize(modes, [1, -0.5]), "shape")
    program.run("synthesize", "modes", "--scores", 1, "--nonlinear", "-o", "nonlinear")
    program.same(shapespace.synthesize(modes, 1, nonlinear=True), "nonlinear")


def test_geodesic_and_its_calculus(program, geodesic):
    ends = {"start": ellipse(), "end": ellipse(axes=(0.24, 0.24))}
    files = program.save(**ends)
    options = ["--grid", 33, "--steps", 2, "--align", "none"]
    program.run("geodesic", *files, *options, "-o", "path")
    program.same(geodesic, "path")
    program.run("extend", "path", "--steps", 1, "-o", "extended")
    program.same(shapespace.extend(geodesic, steps=1), "extended")
    variation = ellipse(axes=(0.30, 0.22))
    [file] = program.save(variation=variation)
    program.run("transport", "path", file, "--steps", 2, "-o", "transported")
    program.same(shapespace.transport(geodesic, variation, steps=2), "transported")


def test_distances(program):
    files = program.save(**{f"mask_{k:03}": mask for k, mask in enumerate(ellipses(17))})
    options = ["--grid", 17, "--steps", 2]
    program.run("distances", *files, *options, "-o", "out")
    found = shapespace.distances(ellipses(17), grid=17, steps=2)
    program.same(found, "out")
    saved = found.save(program.folder / "saved")
    pairs = sorted(file.name for file in (saved / "pairs").iterdir())
    assert pairs == sorted(file.name for file in (program.folder / "out/pairs").iterdir())


def test_segmentation(program):
    images = [disc_image(), disc_image(radius=0.2)]
    files = program.save(image_000=images[0], image_001=images[1])
    program.run("segment", *files, "-o", "out")
    program.same(shapespace.segment(images), "out")


def test_the_folder_is_that_of_the_program(program):
    """Every file but those with times and names has the same bytes."""
    files = program.save(mask_000=ellipses(17)[0], mask_001=ellipses(17)[1])
    program.run("average", *files, "--grid", 17, "-o", "out")
    saved = shapespace.average(ellipses(17)[:2], grid=17).save(program.folder / "saved")
    out = program.folder / "out"
    assert sorted(p.name for p in out.iterdir()) == sorted(p.name for p in saved.iterdir())
    for file in out.iterdir():
        # The table of the inputs has the names of their files.
        if file.suffix in (".npy", ".png", ".vti", ".csv") and file.name != "subjects.csv":
            assert file.read_bytes() == (saved / file.name).read_bytes(), file.name
    program.run("check", "saved")




def test_lengths_and_metrics(program):
    shapes = ellipses()
    files = program.save(**{f"shape_{k:03}": shape for k, shape in enumerate(shapes)})
    program.run("length", *files, "--grid", 33, "-o", "length")
    found = shapespace.length(shapes, grid=33)
    program.same(found, "length")
    assert found.length > found.geodesic_length > 0
    assert found.dissipation >= found.length**2
    program.run("metric", files[0], files[1], "--grid", 33, "-o", "towards")
    towards = shapespace.metric(shapes[0], shapes[1], grid=33)
    program.same(towards, "towards")
    program.run("metric", files[0], "--mode", 2, "--grid", 33, "-o", "mode")
    mode = shapespace.metric(shapes[0], mode=2, grid=33)
    program.same(mode, "mode")
    assert mode.metric > 0 and mode.error is not None
    assert mode.velocity.shape == (2, 33, 33) and mode.dissipation.shape == (33, 33)


def test_groups_of_modes_and_of_distances(program, modes):
    files = program.save(**{f"mask_{k:03}": mask for k, mask in enumerate(ellipses())})
    options = ["--grid", 33, "--align", "none", "--length-weight", 1e-5]
    program.run("average", *files, *options, "-o", "average")
    program.run("pca", "average", "-o", "modes")
    n = len(modes.names)
    groups = ["a", "b"] + ["a"] * (n - 2)
    ages = [30 + 2.5 * k for k in range(n)]
    lines = [f"{name},{group},{age}" for name, group, age in zip(modes.names, groups, ages)]
    (program.folder / "table.csv").write_text("\n".join(["shape,group,age", *lines]))
    program.run("compare", "modes", "--groups", "table.csv", "-o", "groups")
    found = shapespace.compare(modes, {"group": groups, "age": ages})
    program.same(found, "groups")
    assert found.groups == groups and 0 < found.p_value <= 1 and len(found.means) == 2
    # From a folder, and without covariates.
    from_folder = shapespace.compare(program.folder / "modes", groups)
    assert from_folder.p_value == found.p_value
    with pytest.raises(shapespace.InputError, match="values of group"):
        shapespace.compare(modes, groups[:-1])
    with pytest.raises(TypeError, match="pca"):
        shapespace.compare(found, groups)
