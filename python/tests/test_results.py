"""What results are, how they print, draw and save themselves."""

import json
import warnings

import numpy as np
import pytest
from drawing import disc_image, ellipse, ellipses, ellipsoid

import shapespace


def test_an_average_has_its_arrays_and_its_verdict(average):
    assert average.mask.dtype == bool and average.mask.shape == (33, 33)
    assert len(average.deformations) == len(average.weights) == len(average.phase_fields) == 3
    assert average.deformations[0].shape == (2, 33, 33)
    assert average.dice.shape == (3,) and (average.dice > 0.9).all()
    assert average.certified and average.status == "converged"
    assert average.names == ["mask_000", "mask_001", "mask_002"] or len(average.names) == 3
    assert average.options["grid"] == 33 and average.affine is None
    assert average.record["verdict"] == average.verdict
    # The mean of the areas, up to a few samples.
    areas = [mask.sum() for mask in ellipses()]
    assert min(areas) < average.mask.sum() < max(areas)


def test_doubts_have_a_remedy():
    far = [ellipse(axes=(0.4, 0.05)), ellipse(axes=(0.05, 0.4))]
    result = shapespace.average(far, grid=17, align="none", max_iterations=1)
    assert result.verdict == "doubtful" and "doubtful" in repr(result)
    assert all(doubt.remedy for doubt in result.doubts)
    assert result.doubts[0].remedy in str(result)


def test_names(average):
    named = shapespace.average(dict(zip("abc", ellipses(17))), grid=17)
    assert named.names == ["a", "b", "c"]
    same = shapespace.average(ellipses(17), names=["a", "b", "c"], grid=17)
    assert same.average.tobytes() == named.average.tobytes()


def test_results_print_well(average, modes, geodesic):
    assert repr(average).startswith("<Average of 3 shapes on 33 x 33 nodes: converged")
    assert "Average of 3 shapes" in str(average) and "verdict" in str(average)
    assert "3 shapes" in repr(modes) and "modes" in repr(modes)
    assert repr(geodesic).startswith("<Geodesic of 2 shapes")
    assert average._repr_html_().startswith("<pre>")
    with pytest.raises(TypeError, match="save"):
        import pickle

        pickle.dumps(average)


def test_results_draw_themselves(average, modes, geodesic):
    matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    matplotlib.use("Agg")
    for result in [average, modes, geodesic, shapespace.synthesize(modes, 1)]:
        assert result.plot() is not None
    # Modes have the numbers that tables and pictures of the program give them.
    assert modes.plot().get_xlabel().startswith("mode 0")
    segmentation = shapespace.segment([disc_image()])
    distances = shapespace.distances(ellipses(17), grid=17, steps=1)
    scores = shapespace.score(ellipses()[:2], modes)
    for result in [segmentation, distances, scores]:
        assert result.plot() is not None
    assert "<img" in average._repr_html_()


def test_a_saved_result_is_read_by_other_commands(average, tmp_path):
    again = shapespace.average(ellipses(), grid=33, align="none", length_weight=1e-5)
    folder = again.save(tmp_path / "average")
    record = json.loads((folder / "result.json").read_text())
    assert record["energy"] == again.record["energy"]
    of_folder = shapespace.pca(folder)
    of_result = shapespace.pca(again)
    assert of_folder.arrays["gram"].tobytes() == of_result.arrays["gram"].tobytes()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        modes = of_result.save(tmp_path / "modes")
    del again, of_result
    assert shapespace.synthesize(modes, 1).mask.any()


def test_modes_of_a_result_in_memory_warn_when_they_are_saved(tmp_path):
    modes = shapespace.pca(shapespace.average(ellipses(17), grid=17))
    with pytest.warns(UserWarning, match="temporary folder"):
        modes.save(tmp_path / "modes")


def test_starting_from_a_result(average):
    again = shapespace.average(
        ellipses(), grid=33, align="none", length_weight=1e-5, start=average
    )
    assert again.record["iterations"] < average.record["iterations"]


def test_scores_of_the_average_are_zero(modes):
    assert np.allclose(shapespace.synthesize(modes, 0).displacement, 0)
    found = shapespace.score([ellipses()[0]], modes)
    assert np.allclose(found.scores[0], modes.scores[0], atol=0.2)
    assert found.mahalanobis.shape == found.p_values.shape == (1,)


def test_distances_are_a_matrix():
    found = shapespace.distances(ellipses(17), grid=17, steps=1, classes=["a", "b", "b"])
    matrix = np.asarray(found)
    assert matrix.shape == (3, 3) and np.array_equal(matrix, matrix.T)
    assert (np.diag(matrix) == 0).all() and found.condensed().shape == (3,)
    assert [entry["class"] for entry in found.record["input"]] == ["a", "b", "b"]
    scipy = pytest.importorskip("scipy.cluster.hierarchy", reason="SciPy is not installed")
    assert scipy.linkage(found.condensed()).shape == (2, 4)


def test_new_shapes_are_compared_with_stored_ones():
    new, *stored = ellipses(17)
    found = shapespace.distances([new], against=stored, classes=["a", "b"], grid=17, steps=1)
    every = shapespace.distances([new, *stored], grid=17, steps=1)
    assert found.matrix.shape == (1, 2)
    assert np.array_equal(found.matrix, every.matrix[:1, 1:])
    [nearest] = found.neighbours
    assert [column for column, _ in nearest] == list(np.argsort(found.matrix[0]))
    assert [distance for _, distance in nearest] == sorted(found.matrix[0])
    assert found.votes == ["ab"[nearest[0][0]]]
    with pytest.raises(ValueError, match="condensed"):
        found.condensed()


def test_all_options_of_the_program_are_named():
    assert {"grid", "align", "mismatch_weight", "law"} <= set(shapespace.options("average"))
    assert "inputs" not in shapespace.options("average")
    assert "lambda" in shapespace.options("average")
    one = shapespace.average(ellipses(17), grid=17, lambda_=2.0)
    assert one.options["lambda"] == 2.0
    words = shapespace.geodesic(*ellipses(17)[:2], grid=17, steps=1, form="level-sets")
    assert words.options["form"] == "level_sets"


def test_verification():
    found = shapespace.verify("laws-rest", quick=True)
    assert found and "statements" in repr(found)
    with pytest.raises(shapespace.InputError, match="NAME"):
        shapespace.verify("no-such-statement")


def test_a_configuration_repeats_a_result(tmp_path):
    files = []
    for k, mask in enumerate(ellipses(17)):
        files.append(tmp_path / f"shape_{k}.npy")
        np.save(files[-1], mask)
    first = shapespace.average(files, grid=17, mu=2.0)
    config = first.save(tmp_path / "first") / "config.toml"
    again = shapespace.average(config=config)
    assert again.average.tobytes() == first.average.tobytes()
    assert again.options["mu"] == 2.0 and again.names == first.names
    # Arguments override the file.
    other = shapespace.average(files, config=config, mu=3.0)
    assert other.options["mu"] == 3.0 and other.options["grid"] == 17
    config.write_text("grid = 17\nwrong = 1\n")
    with pytest.raises(shapespace.InputError, match="wrong"):
        shapespace.average(files, config=config)
    with pytest.raises(shapespace.InputError):
        shapespace.average(grid=17)
