"""The conventions of scikit-learn."""

import numpy as np
import pytest
from drawing import ellipse, ellipses

import shapespace

OPTIONS = {"grid": 33, "align": "none", "length_weight": 1e-5}


@pytest.fixture(scope="module")
def fitted():
    return shapespace.ShapePCA(2, average_options=OPTIONS).fit(ellipses())


def test_fit_transform_and_back(fitted, modes):
    assert np.array_equal(fitted.scores_, modes.scores)
    assert fitted.components_.shape == (2, 2 * 33 * 33)
    assert abs(fitted.explained_variance_ratio_.sum() - 1) < 1e-6
    scores = fitted.transform([ellipse(axes=(0.28, 0.22))])
    assert scores.shape == (1, 2)
    masks = fitted.inverse_transform([[0, 0], [1, 0]])
    assert masks.shape == (2, 33, 33) and masks.dtype == bool


def test_parameters_are_kept_as_they_are(fitted):
    assert fitted.get_params()["average_options"] is OPTIONS
    assert fitted.set_params(n_components=1).n_components == 1
    fitted.set_params(n_components=2)
    with pytest.raises(ValueError, match="no parameter"):
        fitted.set_params(wrong=1)
    with pytest.raises(ValueError, match="not fitted"):
        shapespace.ShapePCA().transform(ellipses())


def test_it_can_be_cloned_and_stand_in_a_pipeline():
    base = pytest.importorskip("sklearn.base", reason="scikit-learn is not installed")
    pipeline = pytest.importorskip("sklearn.pipeline", reason="scikit-learn is not installed")
    neighbours = pytest.importorskip("sklearn.neighbors", reason="scikit-learn is not installed")
    validation = pytest.importorskip("sklearn.utils.validation")
    exceptions = pytest.importorskip("sklearn.exceptions")
    with pytest.raises(exceptions.NotFittedError):
        validation.check_is_fitted(shapespace.ShapePCA())
    with pytest.raises(exceptions.NotFittedError):
        shapespace.ShapePCA().transform(ellipses())
    copy = base.clone(shapespace.ShapePCA(1, average_options=OPTIONS))
    assert copy.n_components == 1
    classifier = neighbours.KNeighborsClassifier(1)
    steps = pipeline.make_pipeline(copy, classifier).fit(ellipses(), [0, 1, 1])
    assert list(steps.predict(ellipses())) == [0, 1, 1]


def test_distances_are_taken_by_scikit_learn():
    cluster = pytest.importorskip("sklearn.cluster", reason="scikit-learn is not installed")
    matrix = shapespace.distances(ellipses(17), grid=17, steps=1).matrix
    found = cluster.AgglomerativeClustering(2, metric="precomputed", linkage="average").fit(matrix)
    assert len(set(found.labels_)) == 2
