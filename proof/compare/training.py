"""Training one network: scikit-learn's KMeans and Ridge against Taxel's K-means and least squares.

Both have the same 100,000 scaled samples of 18 readings and 18 outputs, 256 centres, 30 of Lloyd's
iterations, the same width, affine inputs and penalty. "One start" gives scikit-learn the centres that
Taxel's k-means++ picked; otherwise each side picks its own. Taxel's weights include its activations;
Ridge stands once beside them with numpy's, computed in batches that stay in the cache, and once alone.
Ridge solves normal equations, Taxel a QR decomposition. scikit-learn uses as many threads as there are
cores, as Taxel does. Errors are of 20,000 samples that were not trained on.
"""

import sys

import numpy as np
from sklearn.cluster import KMeans, kmeans_plusplus
from sklearn.linear_model import Ridge

from measure import Row, Seconds, bench, by_criterion, target_folder, timed

CENTRES, ITERATIONS, SPREAD = 256, 30, 0.8  # as benchmarks/benches/training.rs
PENALTY = 1e-6  # 1/INITIAL_COVARIANCE
BATCH = 256


def left_by_the_bench(name: str, columns: int) -> np.ndarray:
    """What the bench wrote, in lines of `columns`."""
    path = target_folder() / "tmp" / f"training-{name}.f64"
    return np.fromfile(path, "<f8").reshape(-1, columns)


def regressors(inputs: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Gaussian activations, then the inputs: samples × (centres + inputs)."""
    decay = 1 / (2 * SPREAD**2)
    values = np.empty((len(inputs), len(centres) + inputs.shape[1]))
    twice, own = 2 * decay * centres.T, decay * (centres**2).sum(axis=1)
    for start in range(0, len(inputs), BATCH):
        x = inputs[start : start + BATCH]
        exponent = x @ twice
        exponent -= own
        exponent -= decay * (x**2).sum(axis=1)[:, None]
        np.exp(exponent, out=values[start : start + BATCH, : len(centres)])
    values[:, len(centres) :] = inputs
    return values


def k_means(inputs: np.ndarray, start: object, algorithm: str = "lloyd", seed: int = 1) -> KMeans:
    """All iterations from one start: an array, or "k-means++"."""
    model = KMeans(
        CENTRES, init=start, n_init=1, max_iter=ITERATIONS, tol=0, algorithm=algorithm, random_state=seed
    )
    return model.fit(inputs)


def rows() -> list[Row]:
    """The steps, and all of them together."""
    bench("training")
    inputs, outputs = left_by_the_bench("inputs", 18), left_by_the_bench("outputs", 18)
    test_inputs = left_by_the_bench("test-inputs", 18)
    test_outputs = left_by_the_bench("test-outputs", 18)
    start, centres = left_by_the_bench("start", 18), left_by_the_bench("centres", 18)
    inertia, iterations, rmse_mm = left_by_the_bench("results", 3)[0]
    assert iterations == ITERATIONS, f"{iterations} iterations"

    def weights(centres: np.ndarray) -> Ridge:
        return Ridge(alpha=PENALTY, copy_X=False).fit(regressors(inputs, centres), outputs)

    def ridge_rmse_mm(found: KMeans) -> float:
        centres = found.cluster_centers_
        errors = weights(centres).predict(regressors(test_inputs, centres)) - test_outputs
        return np.sqrt((errors**2).mean())

    shared = {algorithm: k_means(inputs, start, algorithm) for algorithm in ["lloyd", "elkan"]}
    found = [k_means(inputs, "k-means++", seed=seed) for seed in range(1, 6)]
    inertias, rmses_mm = [own.inertia_ for own in found], [ridge_rmse_mm(own) for own in found]
    # To stderr, as all that is not the table.
    print(
        f"Taxel: inertia {inertia:.1f}, RMSE {rmse_mm:.6f} mm; scikit-learn from the same start:"
        f" {shared['lloyd'].inertia_:.1f}, {ridge_rmse_mm(shared['lloyd']):.6f} mm; from {len(found)} of its own:"
        f" {min(inertias):.1f} to {max(inertias):.1f}, {min(rmses_mm):.6f} to {max(rmses_mm):.6f} mm",
        file=sys.stderr,
    )
    known = regressors(inputs, centres)

    def elkan_s() -> Seconds:
        return timed(lambda: k_means(inputs, start, "elkan"), repeats=3)

    def lloyd_s() -> Seconds:
        return timed(lambda: k_means(inputs, start), repeats=5)

    picking_s = timed(lambda: kmeans_plusplus(inputs, CENTRES, random_state=1), repeats=5)
    both_s = timed(lambda: weights(centres), repeats=5)
    ridge_s = timed(lambda: Ridge(alpha=PENALTY).fit(known, outputs), repeats=5)
    steps = ["start", "iterations", "weights", "whole"]
    taxel = {name: by_criterion(f"training/{name}") for name in steps}
    iterating = f"30 iterations, one start: inertia {inertia:.1f}"
    return [
        Row("k-means++ start", "kmeans_plusplus (greedy)", picking_s, taxel["start"]),
        Row(iterating, f"KMeans, lloyd: {shared['lloyd'].inertia_:.1f}", lloyd_s(), taxel["iterations"]),
        Row(iterating, f"KMeans, elkan: {shared['elkan'].inertia_:.1f}", elkan_s(), taxel["iterations"]),
        Row("activations and weights", "numpy, Ridge", both_s, taxel["weights"]),
        Row("activations and weights", "Ridge alone", ridge_s, taxel["weights"]),
        Row(
            f"training: inertia {inertia:.1f}, RMSE {rmse_mm:.6f} mm",
            f"all of these: {inertias[0]:.1f}, {rmses_mm[0]:.6f} mm",
            timed(lambda: weights(k_means(inputs, "k-means++").cluster_centers_), repeats=5),
            taxel["whole"],
        ),
    ]
