"""Errors of scikit-learn on eFlesh's recordings, on the split of docs/real.md: the last fifth is held out.

    python compare/eflesh.py normal-a.csv normal-b.csv shear.csv spatial.csv

The files are those that `host-sim join` writes there. Prints the RMSE of each output, in g or mm.
"""

import argparse
from pathlib import Path

import numpy as np
from sklearn.cluster import KMeans
from sklearn.linear_model import LinearRegression, Ridge
from sklearn.metrics import pairwise_distances
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, MinMaxScaler, StandardScaler

CENTRES = 200
SPREAD = 0.5
SEED = 1


def split(path: Path) -> tuple[np.ndarray, ...]:
    """Inputs and outputs to train on, then those held out; lines without a value are left out."""
    table = np.genfromtxt(path, delimiter=",", names=True, deletechars="", dtype=float)
    names = list(table.dtype.names)
    values = np.array(table.tolist())
    first = names.index("b.c1")
    outputs = [names.index(name) for name in (["b.c5"] if "b.c5" in names else ["b.c2", "b.c3"])]
    cut = int(len(values) * 0.8 + 0.5)
    parts = []
    for part in (values[:cut], values[cut:]):
        part = part[~np.isnan(part[:, [*range(1, first), *outputs]]).any(axis=1)]
        parts += [part[:, 1:first], part[:, outputs]]
    return tuple(parts)


def rbf(inputs: np.ndarray):
    """Gaussians around K-means' centres and linear terms, with ridge regression: what `--no-refine` trains."""
    scaler = MinMaxScaler().fit(inputs)
    kmeans = KMeans(CENTRES, n_init=1, random_state=SEED).fit(scaler.transform(inputs))
    centres = kmeans.cluster_centers_

    def regressors(readings: np.ndarray) -> np.ndarray:
        scaled = scaler.transform(readings)
        squares = pairwise_distances(scaled, centres, metric="sqeuclidean")
        return np.hstack([np.exp(-squares / (2 * SPREAD**2)), scaled])

    return make_pipeline(FunctionTransformer(regressors), Ridge(alpha=1e-6))


def mlp(outputs: np.ndarray):
    """Two hidden layers of 128, as in eFlesh's paper, on standardised inputs."""
    network = MLPRegressor(
        hidden_layer_sizes=(128, 128), max_iter=2000, n_iter_no_change=50, random_state=SEED
    )
    return make_pipeline(StandardScaler(), network), StandardScaler().fit(outputs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    for path in parser.parse_args().files:
        inputs, outputs, test_inputs, truth = split(path)
        network, scale = mlp(outputs)
        scaled = scale.transform(outputs)
        network.fit(inputs, scaled if scaled.shape[1] > 1 else scaled.ravel())
        estimates = {
            "mean": np.broadcast_to(truth.mean(axis=0), truth.shape),
            "linear": LinearRegression().fit(inputs, outputs).predict(test_inputs),
            f"K-means, K = {CENTRES}": rbf(inputs).fit(inputs, outputs).predict(test_inputs),
            "MLP, 128 × 128": scale.inverse_transform(
                network.predict(test_inputs).reshape(len(truth), -1)
            ),
        }
        print(f"{path.name}: {len(inputs)} lines to train on, {len(truth)} held out")
        for name, estimate in estimates.items():
            rmse = np.sqrt(np.mean((estimate.reshape(truth.shape) - truth) ** 2, axis=0))
            print(f"  {name:16} " + "  ".join(f"{value:9.3f}" for value in rmse))


if __name__ == "__main__":
    main()
