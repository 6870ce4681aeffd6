"""Time of `predict` for 100,000 lines on one core: taxel's Model beside scikit-learn's pipelines with as many Gaussians.

`pip install taxel scikit-learn`, then `python proof/compare/predict.py`. Times are the least of seven, taken in turn.
"""

import os

os.environ |= {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS")}

import time

import numpy as np
import taxel
from sklearn.cluster import KMeans
from sklearn.kernel_approximation import Nystroem
from sklearn.linear_model import Ridge
from sklearn.metrics.pairwise import rbf_kernel
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, MinMaxScaler

LINES, INPUTS, TURNS = 100_000, 12, 7


def main():
    random = np.random.default_rng(1)
    x = random.uniform(40, 60, (LINES, INPUTS))
    y = np.column_stack([np.sin(x[:, i] / 4) + x[:, i + 1] / 20 for i in range(5)])
    print("K      model                          ms   times taxel's   RMSE")
    for centres in (16, 64, 256):
        known = slice(0, 4000)
        of_scaled = KMeans(centres, n_init=1, random_state=1).fit(MinMaxScaler().fit_transform(x[known])).cluster_centers_
        gaussians = FunctionTransformer(rbf_kernel, kw_args={"Y": of_scaled, "gamma": 0.8})
        models = {
            "taxel, f32": taxel.Model(centres, refine=False, affine_tail=False),
            "K-means, rbf_kernel, Ridge": make_pipeline(MinMaxScaler(), gaussians, Ridge(1e-6)),
            "Nystroem, Ridge": make_pipeline(
                MinMaxScaler(), Nystroem(gamma=0.8, n_components=centres, random_state=1), Ridge(1e-6)
            ),
        }
        for model in models.values():
            model.fit(x[known], y[known])
        least = dict.fromkeys(models, np.inf)
        errors = {}
        for _ in range(TURNS):
            for name, model in models.items():
                start = time.perf_counter()
                estimate = model.predict(x)
                least[name] = min(least[name], time.perf_counter() - start)
                errors[name] = np.sqrt(np.mean((estimate - y) ** 2))
        for name, seconds in least.items():
            times = seconds / least["taxel, f32"]
            print(f"{centres:<6} {name:28} {1e3 * seconds:6.1f} {times:15.1f} {errors[name]:6.3f}")


if __name__ == "__main__":
    main()
