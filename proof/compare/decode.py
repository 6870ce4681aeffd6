"""Decoding a table on one core: numpy's batches against Taxel's, whose estimates are the device's bit for bit.

numpy's side expands distances into a matrix product, exponentiates in place and multiplies by the weights, in
batches that stay in the processor's cache; in f64, which is numpy's own choice, and in f32, which is Taxel's.
Scaling, clamp, affine tail and bias are in both. Its numbers are random: times do not depend on them.
"""

import numpy as np
from threadpoolctl import threadpool_limits  # scikit-learn brings it

from measure import Row, bench, by_criterion, fastest_of, timed

LINES, CHANNELS, SPREAD = 8192, 18, 0.8  # as benchmarks/benches/decode.rs
LOWEST_OHM, SPAN_OHM = 40.0, 20.0
CLAMP = (-0.125, 1.125)
CENTRES, FORMATS = [64, 256], ["f32", "fixed16"]
BATCHES = [125, 250, 500, 1000, 2000]


class Network:
    """The network in numpy, with all numbers of one type."""

    def __init__(self, centres: int, kind: type) -> None:
        random = np.random.default_rng(1)
        places, decay = random.uniform(0, 1, (centres, CHANNELS)), 0.5 / SPREAD**2
        self.twice = np.ascontiguousarray(2 * decay * places.T, kind)
        self.own = (decay * (places**2).sum(axis=1)).astype(kind)
        self.decay, self.kind = kind(decay), kind
        self.weights = random.uniform(-1, 1, (centres, CHANNELS)).astype(kind)
        self.affine = random.uniform(-1, 1, (CHANNELS, CHANNELS)).astype(kind)
        self.bias = random.uniform(-1, 1, CHANNELS).astype(kind)

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
    """Each format, against numpy in both types."""
    bench("decode")
    high = LOWEST_OHM + SPAN_OHM
    readings = np.random.default_rng(2).uniform(LOWEST_OHM, high, (LINES, CHANNELS))
    table = []
    for centres in CENTRES:
        for kind in [np.float64, np.float32]:
            network, own = Network(centres, kind), readings.astype(kind)
            taken = {
                batch: timed(lambda: network.infer(own, batch), repeats=51).over(LINES)
                for batch in BATCHES
            }
            batch, fastest = fastest_of(taken)
            for form in FORMATS:
                seconds = by_criterion(f"decode/{form}/{centres}").over(LINES)
                reference = f"numpy, {np.dtype(kind).name}, batches of {batch}"
                table.append(Row(f"a line, {form}, {centres} centres", reference, fastest, seconds))
    return table
