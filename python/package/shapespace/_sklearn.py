"""The modes of variation with the conventions of scikit-learn, which is not needed."""

from __future__ import annotations

import inspect
import sys
from typing import Any, Mapping, Optional

import numpy as np

from ._commands import average, pca, score, synthesize
from ._inputs import Images
from ._progress import Progress
from ._results import Scores


class ShapePCA:
    """Modes of variation as an estimator: ``ShapePCA().fit(masks).transform(new)``.

    A sample is a mask of any kind that :func:`shapespace.average` takes. ``n_components`` is the
    largest number of modes, all by default. ``average_options`` and ``pca_options`` are the options
    of :func:`shapespace.average` and :func:`shapespace.pca`, for example
    ``average_options={"grid": 65, "align": "rigid"}``.

    After ``fit``: ``average_`` and ``pca_`` are the results, ``scores_`` has the scores of the
    samples, ``explained_variance_`` and ``explained_variance_ratio_`` have the variances of the
    modes, ``components_`` the modes as rows."""

    def __init__(
        self,
        n_components: Optional[int] = None,
        *,
        average_options: Optional[Mapping[str, Any]] = None,
        pca_options: Optional[Mapping[str, Any]] = None,
        progress: Optional[Progress] = None,
        threads: Optional[int] = None,
    ) -> None:
        self.n_components = n_components
        self.average_options = average_options
        self.pca_options = pca_options
        self.progress = progress
        self.threads = threads

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The parameters by name."""
        names = list(inspect.signature(type(self).__init__).parameters)[1:]
        return {name: getattr(self, name) for name in names}

    def set_params(self, **params: Any) -> "ShapePCA":
        """Sets parameters."""
        known = self.get_params()
        for name, value in params.items():
            if name not in known:
                raise ValueError(f"there is no parameter {name}: there are {', '.join(known)}")
            setattr(self, name, value)
        return self

    def fit(self, masks: Images, y: Any = None) -> "ShapePCA":
        """Computes the average of the masks and its modes; ``y`` is ignored."""
        run: dict[str, Any] = {"progress": self.progress, "threads": self.threads}
        self.average_ = average(masks, **run, **(self.average_options or {}))
        modes = {"modes": self.n_components, **(self.pca_options or {})}
        self.pca_ = pca(self.average_, **run, **modes)
        self.scores_ = self.pca_.scores
        self.explained_variance_ = self.pca_.eigenvalues
        self.explained_variance_ratio_ = self.pca_.ratios
        self.components_ = np.stack([mode.ravel() for mode in self.pca_.modes])
        self.n_components_ = len(self.components_)
        return self

    def transform(self, masks: Images) -> np.ndarray:
        """The scores of shapes, a row for each, in standard deviations."""
        return self.score_shapes(masks).scores

    def score_shapes(self, masks: Images) -> Scores:
        """The same as a result, with Mahalanobis distances and doubts."""
        self._fitted()
        return score(masks, self.pca_, progress=self.progress, threads=self.threads)

    def fit_transform(self, masks: Images, y: Any = None) -> np.ndarray:
        """The scores of the shapes of the average; ``y`` is ignored."""
        return self.fit(masks).scores_

    def inverse_transform(self, scores: Any) -> np.ndarray:
        """The masks of the shapes that have these scores, one for each row."""
        self._fitted()
        rows = np.atleast_2d(np.asarray(scores, float))
        return np.stack([synthesize(self.pca_, row).mask for row in rows])

    def __sklearn_tags__(self) -> Any:
        """What scikit-learn, which alone asks for it, has to know: that this is a transformer."""
        from sklearn.base import BaseEstimator, TransformerMixin

        class Transformer(TransformerMixin, BaseEstimator):
            pass

        return Transformer().__sklearn_tags__()

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "pca_")

    def _fitted(self) -> None:
        if self.__sklearn_is_fitted__():
            return
        text = "this ShapePCA is not fitted yet: call fit first"
        if "sklearn" in sys.modules:
            from sklearn.exceptions import NotFittedError  # a ValueError, too

            raise NotFittedError(text)
        raise ValueError(text)

    def __repr__(self) -> str:
        given = [f"{k}={v!r}" for k, v in self.get_params().items() if v is not None]
        return f"ShapePCA({', '.join(given)})"
