"""Errors are exceptions with the report of the program; nothing ends the interpreter."""

import pickle

import numpy as np
import pytest
from drawing import ellipse, ellipses

import shapespace


def report(text):
    """The parts of a report of the program, without its marks."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return [line.lstrip("×╰─▶ ") for line in lines]


@pytest.mark.parametrize(
    "options",
    [
        {"grid": 100},
        {"mismatch_weight": -1},
        {"weights": [0.5, 0.7, 0.1]},
        {"weights": [0.5, 0.5]},
        {"frame": "physical"},
        {"max_iterations": 0},
        {"like": "none_of_them"},
    ],
)
def test_the_text_is_that_of_the_program(program, options):
    files = program.save(**{f"mask_{k:03}": mask for k, mask in enumerate(ellipses())})
    flags = []
    for key, value in options.items():
        value = ",".join(map(str, value)) if isinstance(value, list) else value
        flags += [f"--{key.replace('_', '-')}={value}"]
    printed = program.run("average", *files, *flags, "-o", "out", fails=True)
    with pytest.raises(shapespace.InputError) as caught:
        shapespace.average(ellipses(), **options)
    expected = report(printed.replace(str(program.folder) + "/", "").replace(".npy", ""))
    assert str(caught.value).splitlines() == expected


def test_threads_and_memory_are_checked():
    with pytest.raises(shapespace.InputError, match="--threads 5000 is not allowed"):
        shapespace.average(ellipses(), threads=5000)
    with pytest.raises(shapespace.InputError, match="--memory lots is not allowed"):
        shapespace.average(ellipses(), memory="lots")
    with pytest.raises(shapespace.InputError, match="of memory are not enough"):
        shapespace.average(ellipses(), memory="1MB")


def test_arrays_that_are_too_large_are_refused_before_they_are_copied():
    huge = np.broadcast_to(np.uint8(1), (100000, 100000))
    for calls in [shapespace.average, shapespace.segment]:
        with pytest.raises(shapespace.InputError, match="100000 x 100000 values, more than the limit"):
            calls([huge, huge])


def test_a_spacing_has_one_number_or_one_for_each_axis():
    with pytest.raises(shapespace.InputError, match="a spacing of 3 numbers .* array of 2 axes"):
        shapespace.average(ellipses(), spacing=[1, 1, 1])


def test_errors_are_of_kinds_that_python_knows():
    with pytest.raises(ValueError) as caught:
        shapespace.average(ellipses(), grid=100)
    error = caught.value
    assert isinstance(error, shapespace.ShapespaceError)
    assert error.message == "--grid 100 is not allowed"
    assert "101" in error.help
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), type(again)) == (str(error), type(error))


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("gird", "grid"), ("aling", "align"), ("mismatch_wieght", "mismatch_weight")],
)
def test_the_nearest_option_is_named(wrong, right):
    with pytest.raises(shapespace.InputError, match=f"no key `{wrong}`(.|\n)*did you mean `{right}`"):
        shapespace.average(ellipses(), **{wrong: 1})


def test_values_of_a_wrong_type_are_named():
    with pytest.raises(shapespace.InputError, match="`grid` cannot be"):
        shapespace.average(ellipses(), grid="fine")
    with pytest.raises(shapespace.InputError, match="finite numbers"):
        shapespace.average(ellipses(), mismatch_weight=float("nan"))


@pytest.mark.parametrize(
    "mask",
    [
        np.zeros((9, 9), bool),
        np.ones((9, 9), bool),
        np.full((9, 9), np.nan),
        np.zeros((0, 9)),
        np.zeros(9),
        np.zeros((3, 3, 3, 3)),
    ],
)
def test_arrays_that_are_no_masks_are_named(mask):
    with pytest.raises(shapespace.InputError, match="'mask_001'"):
        shapespace.average([ellipse(9), mask], grid=9)


def test_arrays_of_other_types_are_refused():
    for wrong in [ellipse(9).astype(complex), np.array([["a"]]), np.array([[object()]])]:
        with pytest.raises(TypeError, match="is no image"):
            shapespace.average([ellipse(9), wrong])


def test_inputs_that_do_not_fit_together():
    with pytest.raises(shapespace.InputError):
        shapespace.average([ellipse(9)])
    with pytest.raises(shapespace.InputError):
        shapespace.average([])
    with pytest.raises(TypeError):
        shapespace.average("mask.npy")
    with pytest.raises(shapespace.InputError, match="2 names for 3"):
        shapespace.average(ellipses(), names=["a", "b"])
    with pytest.raises(shapespace.InputError, match="must differ"):
        shapespace.average(ellipses(), names=["a", "b", "a"])
    with pytest.raises(shapespace.InputError, match="affine map of shape"):
        shapespace.average(ellipses(), affine=np.eye(2))
    with pytest.raises(shapespace.InputError, match="states its own spacing"):
        shapespace.average(["a.npy", "b.npy"], spacing=2)
    with pytest.raises(TypeError):
        shapespace.pca(ellipse())


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(shapespace.InputError, match="nowhere.png"):
        shapespace.average(["nowhere.png", ellipse()])
    with pytest.raises(shapespace.InputError, match="not a result of `shapespace average`"):
        shapespace.pca(tmp_path)


def test_a_result_is_not_written_over_another(average, tmp_path):
    average.save(tmp_path / "out")
    with pytest.raises(shapespace.InputError, match="exists already"):
        average.save(tmp_path / "out")


def test_more_scores_than_modes(modes):
    with pytest.raises(shapespace.InputError, match="--scores with 9 numbers"):
        shapespace.synthesize(modes, [0] * 9)
