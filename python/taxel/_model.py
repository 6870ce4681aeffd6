"""Models, as estimators of scikit-learn."""

from __future__ import annotations

import inspect
import os
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taxel import _native
from taxel._call import call, folder, option, table, two_dimensional, warn
from taxel._columns import matrix, names_of, numbered, pattern, place, untouched

try:
    from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
    from sklearn.utils.validation import _check_sample_weight, check_consistent_length, check_is_fitted, validate_data

    HAS_SKLEARN = True
except ImportError:  # scikit-learn is optional
    HAS_SKLEARN = False

    class BaseEstimator:  # type: ignore[no-redef]
        """Parameters by name, as in scikit-learn."""

        def get_params(self, deep: bool = True) -> dict[str, Any]:
            names = inspect.signature(type(self).__init__).parameters
            return {name: getattr(self, name) for name in names if name != "self"}

        def set_params(self, **params: Any) -> BaseEstimator:
            for name, value in params.items():
                if name not in self.get_params():
                    raise ValueError(f"{name!r} is not a parameter of {type(self).__name__}")
                setattr(self, name, value)
            return self

        def __repr__(self) -> str:
            given = ", ".join(f"{name}={value!r}" for name, value in self.get_params().items())
            return f"{type(self).__name__}({given})"

    class RegressorMixin:  # type: ignore[no-redef]
        """A regressor."""

    class MultiOutputMixin:  # type: ignore[no-redef]
        """Several outputs."""


#: Most lines for which five folds choose K, spread and penalty without being asked.
FEW_LINES = 1000
#: Least lines outside a fold for which they choose a spread.
LEAST_FOR_SPREAD = 80
#: Penalties that they try. Those above 1 leave a linear model.
PENALTIES = (1e-7, 1e-5, 1e-3, 1e-2, 1e-1, 10, 100)


class Model(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """A network of Gaussians, trained by `taxel train` and decoded bit for bit as on a device.

    Parameters
    ----------
    centres : int or None
        Largest number of Gaussians K; with fewer distinct lines, K is smaller and a warning is given. None is 64, and fewer
        for few lines; without refinement and up to 1000 lines, cross-validation chooses among half, once and twice that
        number.
    spread : float or None
        Width σ of the Gaussians on scaled inputs, where refinement starts. None is 0.4 behind a projection and 0.8
        elsewhere; without refinement and for 100 to 1000 lines, cross-validation chooses it.
    penalty : float or None
        Ridge penalty on squared weights per line. With None, cross-validation chooses it for up to 1000 lines, and the
        default of `taxel train` is used for more.
    refine : bool or None
        Whether centres and widths are refined after K-means, which is more accurate and takes several times as long.
        None is True, except for up to 1000 lines without a significant gain on held-out lines.
    select : bool
        Whether those of `centres`, `spread`, `penalty` and `refine` that are None are chosen for any number of lines as for
        up to 1000.
    format : {"fixed16", "f32"} or None
        Number format of the weights; None is fixed16, or f32 if the model does not fit fixed16.
    each_row : bool
        Whether each row has its own network, instead of one network behind a projection of all readings. Columns
        must be named after wires (`r1c1_ohm`), and outputs must belong to rows.
    features : int or None
        Number of features of that projection.
    features_kind : str or None
        Kind of features: "plain", "normalised" or "normalised:K" (docs/training.md). With None, it is the kind with the
        smaller error on held-out lines, for positions and for amounts.
    grid : (int, int) or None
        Rows and columns of a mat whose cells are the columns of X, row by row. Without it, names of a DataFrame may give the
        grid (`r1c1`, or numbers that fill a square).
    relative_inputs : bool
        Whether inputs are R/R₀. In `fit`, lines where all outputs are zero give the baseline; `predict` needs `baseline`.
    reading_model : {"fill", "full"} or None
        Statistics of the readings: with "fill", missing readings (NaN) are estimated from the others of their line; with
        "full", `predict` can also return standard deviations and novelty (docs/reading-model.md).
    random_state : int, RandomState or None
        Seed of every random draw, or the generator to draw it from.
    n_jobs : int or None
        Number of threads; -1 or None is one per core. It does not change results.

    Attributes
    ----------
    n_features_in_ : int
    feature_names_in_ : array of str, where X had names
    output_names_ : list of str
    report_ : dict
        Result of `taxel train --json`: errors, verdict, warnings, outliers, lines left out.
    blob_ : taxel._native.Blob
        The model as stored on a device.
   
  """

    def __init__(
        self,
        centres: int | None = None,
        *,
        spread: float | None = None,
        penalty: float | None = None,
        refine: bool | None = None,
        select: bool = False,
        format: str | None = None,
        each_row: bool = False,
        features: int | None = None,
        features_kind: str | None = None,
        grid: tuple[int, int] | None = None,
        relative_inputs: bool = False,
        reading_model: str | None = None,
        random_state: Any = 1,
        n_jobs: int | None = None,
    ):
        self.centres = centres
        self.spread = spread
        self.penalty = penalty
        self.refine = refine
        self.select = select
        self.format = format
        self.each_row = each_row
        self.features = features
        self.features_kind = features_kind
        self.grid = grid
        self.relative_inputs = relative_inputs
        self.reading_model = reading_model
        self.random_state = random_state
        self.n_jobs = n_jobs

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        *,
        groups: ArrayLike | None = None,
    ) -> Model:
        """Trains on readings `X` (lines × features, in Ω or any other unit) and outputs `y` (lines × outputs, or lines).

        `groups` has a number for each line: groups are held out in turn for refinement and for deviations, instead of five
        folds. A line of `sample_weight` 2 counts as two lines, and one of 0 as none; weights with fractions are rounded
        to quarters of their mean. An output may be NaN on some lines, such as a position while nothing touches the sensor.
        Columns of a DataFrame keep their names; an output with the name of a feature gets the suffix `_out`. Lines with a
        value far from all others in its column are left out (`report_["outliers"]`). Missing readings are filled from the
        others of their line.
        """
        if y is None:
            raise ValueError("fit requires y to be passed, but the target y is None")
        self._check_parameters()
        names_x, names_y = names_of(X, "X"), names_of(y, "y")
        X, y = self._checked(X, y)
        if len(X) < 2:
            raise ValueError("n_samples = 1: training needs at least two lines, and many more to be useful")
        lines, folds = two_dimensional(y, "y"), groups
        if folds is not None:
            if len(groups) != len(lines):
                raise ValueError(f"X has {len(lines)} lines and groups {len(groups)}")
            folds = np.unique(np.asarray(groups), return_inverse=True)[1].astype(float)
        if sample_weight is not None:
            counts = line_counts(checked_weights(sample_weight, X))
            # Copies of a line stay in one fold.
            folds = np.arange(len(X)) * 5 // len(X) if folds is None else folds
            X, lines, folds = (np.repeat(it, counts, axis=0) for it in (X, lines, folds))
            if len(X) < 2:
                raise ValueError("sample_weight leaves fewer than two lines")
            folds = np.unique(folds, return_inverse=True)[1].astype(float)
        if self.grid is not None:
            grid = "x".join(str(count) for count in self.grid)
        else:
            grid = None if names_x else "none"  # numbers that nobody gave tell no mat
        names_x = names_x or numbered("x", X.shape[1])
        names_y = names_y or numbered("y", lines.shape[1])
        names_y = [f"{name}_out" if name in names_x else name for name in names_y]
        arguments: list[object] = ["--inputs", pattern(names_x), "--outputs", pattern(names_y)]
        # Lines of the smallest training part, with values of every output.
        held_out = len(lines) / 5 if folds is None else np.bincount(folds.astype(int)).max()
        part = int((~np.isnan(lines)).sum(axis=0).min() - held_out)
        is_asked = self.select or (self.penalty is None and not self.refine and len(lines) <= FEW_LINES)
        is_judged = is_asked and part >= 8 and (folds is None or folds.max() >= 2)
        if groups is not None and not (is_judged or self.refine is not False or self.reading_model == "full"):
            raise ValueError("groups has no effect without refine, select or a full reading_model: leave it out")
        most = 9 * part // 10 if is_judged else len(lines) - 1
        centres = self.centres if self.centres is None else min(self.centres, most)
        arguments += option("--format", self.format)
        arguments += option("--each-row", self.each_row) + option("--features", self.features)
        arguments += option("--features-kind", self.features_kind)
        arguments += option("--reading-model", self.reading_model) + option("--grid", grid)
        if self.relative_inputs:
            arguments += ["--relative-inputs", *option("--rest", [pattern(names_y)])]
        arguments += option("--seed", seed_of(self.random_state))
        if self.reading_model and np.isnan(X).any():
            X = self._filled(X, lines, names_x, names_y)
        columns = dict(zip(names_x, X.T)) | dict(zip(names_y, lines.T))
        if folds is not None and (is_judged or self.refine is not False or self.reading_model == "full"):
            columns["\u2009fold"] = folds  # a name that nobody gives
            arguments += ["--fold-column", "\u2009fold"]
        spread, penalty = option("--spread", self.spread), option("--penalty", self.penalty)

        def trained(*more: object) -> tuple[dict[str, Any], bytes]:
            with folder() as path:
                given, blob = table("data.table", columns), path / "model.bin"
                report = call(["train", given[0], *arguments, *more, "-o", blob], tables=[given], threads=self._threads())
                return report, blob.read_bytes()

        if is_judged:
            penalty = penalty or option("--penalty", PENALTIES)
            # Fewer lines tell no spread.
            usual = [] if self.select or part >= LEAST_FOR_SPREAD else option("--spread", 0.8 if self.each_row else 0.4)
            found = trained("--select", "--no-refine", *option("--centres", centres), *(spread or usual), *penalty)
            if self.refine is not False:
                selection = found[0]["selection"]
                best = selection["scored"][selection["chosen"]]
                start = [*option("--centres", centres), *spread, "--penalty", best["penalty"]]
                refined = trained(*start)
                # It stays at its start where no lines held out certainly gain by it.
                if self.refine or refined[1] != trained("--no-refine", *start)[1]:
                    refined[0]["selection"] = selection
                    found = refined
        else:
            found = trained(*option("--no-refine", self.refine is False), *option("--centres", centres), *spread, *penalty)
        self.report_ = found[0]
        self._take(found[1])
        self._one_output = np.ndim(y) == 1
        self._columns = [place(name, names_x) for name in self.blob_.input_names]
        for warning in self.report_["verdict"]["warnings"]:
            if warning["name"] != "larger-than-slot":  # which `link upload` says, where it matters
                warn(warning["text"])
        if self.centres is not None and not self.select and self.report_["centres"] < self.centres:
            warn(f"{self.report_['centres']} centres instead of {self.centres}: there are too few distinct lines")
        return self

    def _filled(self, X: np.ndarray, lines: np.ndarray, names_x: list[str], names_y: list[str]) -> np.ndarray:
        """Readings with missing ones filled by statistics of the complete lines, as on a device."""
        whole = ~np.isnan(X).any(axis=1)
        if whole.sum() < 20:
            return X
        columns = dict(zip(names_x, X[whole].T)) | dict(zip(names_y, lines[whole].T))
        with folder() as path:
            given, blob = table("data.table", columns), path / "model.bin"
            arguments = ["--inputs", pattern(names_x), "--outputs", pattern(names_y), "--grid", "none", "--centres", 1]
            arguments += ["--no-refine", "--features-kind", "plain", "--reading-model", "fill", "--keep-outliers"]
            call(["train", given[0], *arguments, "-o", blob], tables=[given], threads=self._threads())
            known = _native.Blob(blob.read_bytes())
        places = [place(name, names_x) for name in known.input_names]
        filled = X.copy()
        filled[:, places] = known.filled(np.ascontiguousarray(X[:, places]))
        return filled

    def _threads(self) -> int:
        """Number of threads; 0 is one per core."""
        if self.n_jobs is None or self.n_jobs == -1:
            return 0
        return self.n_jobs if self.n_jobs > 0 else max(1, (os.cpu_count() or 1) + 1 + self.n_jobs)

    def predict(
        self,
        X: ArrayLike,
        *,
        return_std: bool = False,
        return_novelty: bool = False,
        baseline: ArrayLike | None = None,
    ) -> Any:
        """Outputs for readings `X` (lines × features), in their units: lines × outputs, or lines for one output.

        `return_std` also returns their standard deviations, and `return_novelty` the novelty of each line in nats (above
        0, the line is unlike those of training); both need a full `reading_model`. A model with relative inputs needs
        `baseline`: readings of the untouched sensor, one line or several.
        """
        given, rest = self._checked(X), self._baseline(baseline)
        if hasattr(self, "report_") and self._columns != list(range(given.shape[1])):
            given = given[:, self._columns]
        given = np.ascontiguousarray(given)
        values = self.blob_.decode(given, rest, self._threads())
        outputs = values[:, 0] if self._one_output else values
        if not (return_std or return_novelty):
            return outputs
        assessed = self.blob_.assess(given, rest, self._threads())
        if assessed is None:
            raise ValueError("the model estimates no deviations: train it with reading_model='full'")
        std, novelty = assessed
        std = std[:, 0] if self._one_output else std
        return (outputs, *([std] if return_std else []), *([novelty] if return_novelty else []))

    def score(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        *,
        baseline: ArrayLike | None = None,
    ) -> float:
        """Coefficient of determination R², averaged over the outputs. True outputs that are NaN are ignored. Estimates that
        are NaN, because a line cannot be filled or nothing touches the sensor, count as the mean. An output that never
        changes has R² 1 if it is predicted exactly, otherwise 0."""
        y, estimate = two_dimensional(y, "y"), two_dimensional(self.predict(X, baseline=baseline), "y")
        weights = np.ones(len(y)) if sample_weight is None else checked_weights(sample_weight, y)
        weights = weights[:, None] * ~np.isnan(y)
        is_known = weights.sum(axis=0) > 0
        if not is_known.any():
            raise ValueError("y has no value of any weight to score by")
        y, estimate, weights = np.nan_to_num(y)[:, is_known], estimate[:, is_known], weights[:, is_known]
        mean = np.average(y, axis=0, weights=weights)
        left = np.average((y - np.where(np.isnan(estimate), mean, estimate)) ** 2, axis=0, weights=weights)
        whole = np.average((y - mean) ** 2, axis=0, weights=weights)
        is_constant = y.max(axis=0) == y.min(axis=0)
        ratios = np.where(is_constant, left > 0, left / np.where(is_constant | (whole == 0), 1, whole))
        return float(np.mean(1 - ratios))

    def save(self, path: str | Path) -> None:
        """Writes the blob, as `taxel train -o` does: for `taxel link PORT upload`."""
        self._fitted()
        Path(path).write_bytes(self.blob_.to_bytes())

    def to_bytes(self) -> bytes:
        """The blob."""
        self._fitted()
        return self.blob_.to_bytes()

    @classmethod
    def load(cls, path: str | Path) -> Model:
        """Model of a blob that `save` or `taxel train` wrote. Columns of a DataFrame are chosen by the blob's names, in
        any order. Parameters that a blob does not store, such as `refine`, have their defaults."""
        return cls.of_bytes(Path(path).read_bytes())

    @classmethod
    def of_bytes(cls, blob: bytes) -> Model:
        """Model of the bytes of a blob."""
        model = cls()
        model._take(blob)
        model.set_params(
            centres=model.blob_.centres,
            format=model.blob_.formats[0],
            relative_inputs=model.blob_.relative_inputs,
            reading_model=model.blob_.reading_model,
        )
        model.n_features_in_ = len(model.blob_.input_names)
        model._one_output = False
        return model

    def export_c(self, path: str | Path, name: str = "taxel_model") -> None:
        """Writes a C99 library that decodes bit for bit as this model to the folder `path` (docs/c.md)."""
        self._fitted()
        with folder() as work:
            blob = work / "model.bin"
            blob.write_bytes(self.blob_.to_bytes())
            call(["export", blob, "--c", path, "--name", name])

    def _take(self, blob: bytes) -> None:
        self.blob_ = _native.Blob(blob)
        self.output_names_ = list(self.blob_.output_names)

    def _fitted(self) -> None:
        if not hasattr(self, "blob_"):
            if HAS_SKLEARN:
                check_is_fitted(self)
            raise ValueError("the model is not trained yet: call fit first, or Model.load")

    def _checked(self, X: ArrayLike, y: ArrayLike | None = None) -> Any:
        """X, and y if it is given, as arrays of float64, checked by scikit-learn if it is installed."""
        if y is None:
            self._fitted()
        if HAS_SKLEARN and (y is not None or hasattr(self, "report_")):
            missing = "allow-nan" if self.reading_model else True
            checks = {"dtype": np.float64, "order": "C", "ensure_all_finite": missing}
            try:
                if y is None:
                    return validate_data(self, X, reset=False, **checks)
                outputs = {"dtype": np.float64, "ensure_2d": False, "ensure_all_finite": "allow-nan"}
                X, y = validate_data(self, X, y, validate_separately=(checks, outputs))
                check_consistent_length(X, y)
                return X, y
            except ValueError as error:
                if "Input X contains NaN" not in str(error):
                    raise
                raise ValueError("Input X contains NaN: missing readings need Model(reading_model='fill')") from None
        if y is None and not hasattr(self, "report_"):
            return matrix(X, self.blob_.input_names)
        X = two_dimensional(X, "X")
        if y is None:
            if X.shape[1] != self.n_features_in_:
                raise ValueError(
                    f"X has {X.shape[1]} features, but {type(self).__name__} is expecting "
                    f"{self.n_features_in_} features as input"
                )
            return X
        y = np.asarray(y, dtype=np.float64)
        if len(y) != len(X):
            raise ValueError(f"X has {len(X)} lines and y {len(y)}")
        self.n_features_in_ = X.shape[1]
        return X, y

    def _baseline(self, baseline: ArrayLike | None) -> np.ndarray | None:
        if not self.blob_.relative_inputs:
            return None
        whole = getattr(self, "n_features_in_", 0)
        if baseline is not None and names_of(baseline, "baseline") is None and hasattr(self, "report_"):
            # Columns as in `fit`, of which the model may have left some out.
            lines = np.atleast_2d(np.asarray(baseline, dtype=np.float64))
            if lines.ndim == 2 and lines.shape[1] == whole:
                baseline = lines[:, self._columns]
        return untouched(baseline, self.blob_.input_names)

    def _check_parameters(self) -> None:
        """Refuses bad parameters by name; the command checks the others."""
        seeds = self.random_state is None or hasattr(self.random_state, "randint")
        for name, least in (("centres", 1), ("random_state", 0)):
            value = getattr(self, name)
            if value is None or (name == "random_state" and seeds):
                continue
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
                raise ValueError(f"{name}={value!r}: give a whole number, {least} or above")
        if self.n_jobs is not None and (not isinstance(self.n_jobs, (int, np.integer)) or self.n_jobs == 0):
            raise ValueError(f"n_jobs={self.n_jobs!r}: give a number of threads, or -1 for one per core")
        if self.format not in (None, "f32", "fixed16"):
            raise ValueError(f'format={self.format!r}: give "f32" or "fixed16"')
        if self.grid is not None and np.shape(self.grid) != (2,):
            raise ValueError(f"grid={self.grid!r}: give rows and columns, such as (16, 16)")

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = self.reading_model is not None
        return tags

    def __getstate__(self) -> dict[str, Any]:
        state = dict(self.__dict__)
        if "blob_" in state:
            state["blob_"] = self.blob_.to_bytes()
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if "blob_" in state:
            self._take(state["blob_"])

    def _repr_html_(self) -> str:
        if not hasattr(self, "report_"):
            return f"<code>{escape(repr(self))}</code>"
        verdict, decoders = self.report_["verdict"], self.report_["decoders"]
        errors, sentence = decoders[0]["errors"], verdict["sentence"]
        if len(errors) > 6:
            known = [of["r_squared"] for of in errors if of.get("r_squared") is not None]
            sentence = f"{len(errors)} groups of outputs, with R² from {min(known, default=0):.3f} to {max(known, default=0):.3f}."
        return f"<p><code>{escape(repr(self))}</code></p><p>{escape(sentence)}</p>" + bars(decoders)


def seed_of(random_state: Any) -> int:
    """Seed for `random_state`, as in scikit-learn."""
    drawn_from = np.random if random_state is None else random_state
    return int(drawn_from.randint(2**31 - 1)) if hasattr(drawn_from, "randint") else int(random_state)


def checked_weights(weights: ArrayLike, X: np.ndarray) -> np.ndarray:
    if HAS_SKLEARN:
        return _check_sample_weight(weights, X, dtype=np.float64, ensure_non_negative=True)
    array = np.asarray(weights, dtype=np.float64)
    if array.shape != (len(X),) or not (array >= 0).all():
        raise ValueError(f"sample_weight: give {len(X)} numbers, 0 or above, one per line")
    return array


def line_counts(weights: np.ndarray) -> np.ndarray:
    """Number of copies of each line for its weight: the weight itself, if all weights are whole numbers."""
    if (weights == np.round(weights)).all():
        return (weights / max(np.gcd.reduce(weights.astype(int)), 1)).astype(int)
    return np.ceil(4 * weights / weights.mean() - 0.5).astype(int)


def bars(decoders: list[dict[str, Any]]) -> str:
    """Bar chart of the decoders' errors for the last group of outputs."""
    errors = [(of["decoder"], of["errors"][-1]) for of in decoders]
    most = max((error["rmse"] for _, error in errors), default=0.0) or 1.0
    unit = escape(errors[0][1].get("unit") or "") if errors else ""
    height, lines = 22, []
    for place, (name, error) in enumerate(errors):
        y, width = place * height, 220 * error["rmse"] / most
        lines.append(
            f'<text x="0" y="{y + 15}">{escape(name)}</text>'
            f'<rect x="90" y="{y + 4}" width="{width:.1f}" height="14" fill="#3b7dd8" />'
            f'<text x="{95 + width:.1f}" y="{y + 15}">{error["rmse"]:.3g} {unit}</text>'
        )
    group = escape(errors[0][1]["group"]) if errors else ""
    return (
        f'<svg width="420" height="{height * len(errors) + 4}" font-family="sans-serif" font-size="12" '
        f'fill="currentColor" role="img" aria-label="RMSE of {group}">{"".join(lines)}</svg><p>RMSE of {group}</p>'
    )
