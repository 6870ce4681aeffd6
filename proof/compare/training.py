"""Training one network: scikit-learn's KMeans and Ridge against Taxel's K-means and least squares.

Both have the same 100,000 scaled samples of 18 readings and 18 outputs, 256 centres, 30 of Lloyd's iterations, the same
width, affine inputs and penalty. Ridge solves normal equations, Taxel a QR decomposition. scikit-learn uses as many
threads as there are cores, as Taxel does.
"""

import numpy as np
from sklearn.cluster import KMeans
from sklearn.linear_model import Ridge

from measure import Row, bench, by_criterion, target_folder, timed

CENTRES, ITERATIONS, SPREAD = 256, 30, 0.8  # as benchmarks/benches/training.rs
PENALTY = 1e-6  # 1/INITIAL_COVARIANCE
BATCH = 256


def left_by_the_bench(name: str) -> np.ndarray:
    """What the bench wrote, in lines of 18 columns."""
    return np.fromfile(target_folder() / "tmp" / f"training-{name}.f64", "<f8").reshape(-1, 18)


def regressors(inputs: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Gaussian activations, in batches that stay in the cache, then the inputs: samples × (centres + inputs)."""
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


def rows() -> list[Row]:
    """All steps of training together."""
    bench("training")
    inputs, outputs = left_by_the_bench("inputs"), left_by_the_bench("outputs")

    def train() -> Ridge:
        search = KMeans(CENTRES, n_init=1, max_iter=ITERATIONS, tol=0, algorithm="lloyd", random_state=1)
        centres = search.fit(inputs).cluster_centers_
        return Ridge(alpha=PENALTY, copy_X=False).fit(regressors(inputs, centres), outputs)

    work = f"training, N = {len(inputs)}, K = {CENTRES}"
    return [Row(work, "KMeans (lloyd), Ridge", timed(train, repeats=5), by_criterion("training/whole"))]
