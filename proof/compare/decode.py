"""Decoding a table on one core: numpy's batches against Taxel's blocks of lines, bit for bit the device's.

numpy's side expands distances into a matrix product, exponentiates in place and multiplies by the weights, in
batches that stay in the processor's cache; in f64, which is numpy's own choice, and in f32, which is Taxel's.
Scaling, clamp, affine tail and bias are in both.
"""

import numpy as np
from threadpoolctl import threadpool_limits  # scikit-learn brings it

from measure import Row, bench, by_criterion, fastest_of, target_folder, timed

CHANNELS, SPREAD = 18, 0.8  # as benchmarks/benches/decode.rs
LOWEST_OHM, SPAN_OHM = 40.0, 20.0
CLAMP = (-0.125, 1.125)
CENTRES = [64, 256]
# What each form's outputs may differ by from the formula's: fixed16 rounds random weights to 16 bits.
MOST_ERROR = {"f32": 1e-3, "f32-direct": 1e-3, "fixed16": 0.1}
BATCHES = [125, 250, 500, 1000, 2000]


def left_by_the_bench(name: str, columns: int) -> np.ndarray:
    """What the bench wrote, in lines of `columns`."""
    path = target_folder() / "tmp" / f"decode-{name}.f64"
    return np.fromfile(path, "<f8").reshape(-1, columns)


class Network:
    """The network in numpy, with all numbers of one type."""

    def __init__(self, centres: int, kind: type) -> None:
        c = left_by_the_bench(f"centres-{centres}", CHANNELS)
        decay = 0.5 / SPREAD**2
        self.twice = np.ascontiguousarray(2 * decay * c.T, kind)
        self.own = (decay * (c**2).sum(axis=1)).astype(kind)
        self.decay, self.kind = kind(decay), kind
        self.weights = left_by_the_bench(f"weights-{centres}", CHANNELS).astype(kind)
        self.affine = left_by_the_bench(f"affine-{centres}", CHANNELS).astype(kind)
        self.bias = left_by_the_bench(f"bias-{centres}", CHANNELS)[0].astype(kind)

    def infer(self, readings: np.ndarray, batch: int) -> np.ndarray:
        """Outputs of all lines, `batch` at a time."""
        outputs = np.empty((len(readings), CHANNELS), self.kind)
        for start in range(0, len(readings), batch):
            x = (readings[start : start + batch] - self.kind(LOWEST_OHM)) * self.kind(1 / SPAN_OHM)
            np.clip(x, *CLAMP, out=x)
            exponent = x @ self.twice
            exponent -= self.own
            exponent -= self.decay * np.einsum("ij,ij->i", x, x)[:, None]
            np.exp(exponent, out=exponent)
            y = outputs[start : start + batch]
            np.matmul(exponent, self.weights, out=y)
            y += x @ self.affine
            y += self.bias
        return outputs


@threadpool_limits.wrap(limits=1)
def rows() -> list[Row]:
    """All forms of networks, against numpy in both types."""
    bench("decode")
    readings = left_by_the_bench("readings", CHANNELS)
    table = []
    for centres in CENTRES:
        expected = Network(centres, np.float64).infer(readings, 1000)
        taxel = {
            form: by_criterion(f"decode/{form}/{centres}").over(len(readings)) for form in MOST_ERROR
        }
        for form in taxel:
            error = np.abs(left_by_the_bench(f"{form}-{centres}", CHANNELS) - expected).max()
            assert error < MOST_ERROR[form], f"{form} with {centres} centres differs by {error}"
        for kind in [np.float64, np.float32]:
            network, own = Network(centres, kind), readings.astype(kind)
            taken = {
                batch: timed(lambda: network.infer(own, batch), repeats=51).over(len(readings))
                for batch in BATCHES
            }
            batch, fastest = fastest_of(taken)
            for form, seconds in taxel.items():
                reference = f"numpy, {np.dtype(kind).name}, batches of {batch}"
                table.append(Row(f"a line, {form}, {centres} centres", reference, fastest, seconds))
    return table
