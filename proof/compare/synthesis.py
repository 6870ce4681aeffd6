"""Synthesis of frames: deformations drawn, readings computed, noise added, as one array each.

numpy's side is timed twice: as the formula is written, over arrays with a last axis of x, y and z; and
with x, y and z apart in batches that stay in the processor's cache, which is the quickest that plain
numpy was found to be.
"""

import numpy as np

from measure import Row, bench, by_criterion, fastest_of, timed

FRAMES = 16_384  # as benchmarks/benches/synthesis.rs
FEWER = 4096  # for numpy: a time by frame does not depend on it
SIZE_MM = (20.0, 18.0, 5.0)
ROWS, UPPER, COLUMNS, LOWER = 8, 6, 18, 3
OHM_PER_MM = 100.0
NOISE = 0.005


def cells(count: int, extent_mm: float) -> np.ndarray:
    """Centres of equal cells."""
    return (np.arange(count) + 0.5) * extent_mm / count


def grid(shape: tuple, x: np.ndarray, y: np.ndarray, z_mm: float) -> np.ndarray:
    """Positions in mm, with a last axis of x, y and z."""
    parts = [np.broadcast_to(part, shape) for part in (x, y, np.float64(z_mm))]
    return np.ascontiguousarray(np.stack(parts, axis=-1))


X_MM, Y_MM, Z_MM = SIZE_MM
# Rows × electrodes, and electrodes × columns.
UPPER_MM = grid((ROWS, UPPER), cells(UPPER, X_MM), cells(ROWS, Y_MM)[:, None], Z_MM)
LOWER_MM = grid((LOWER, COLUMNS), cells(COLUMNS, X_MM), cells(LOWER, Y_MM)[:, None], 0.0)


def draw_paper(generator: np.random.Generator, frames: int) -> np.ndarray:
    """Deformations of the scene `paper` in mm: frames × rows × electrodes × 3."""
    low, high = np.array([-1.0, -1.0, 0.0]), np.array([1.0, 1.0, 1.0])
    return generator.uniform(low, high, (frames, ROWS, UPPER, 3))


def by_the_formula(deformation_mm: np.ndarray) -> np.ndarray:
    """Readings in Ω: frames × rows × columns."""
    moved = (UPPER_MM - deformation_mm)[:, :, :, None, None, :]
    node_ohm = OHM_PER_MM * np.linalg.norm(moved - LOWER_MM, axis=-1)
    return 1 / (1 / node_ohm).sum(axis=(2, 3))


def axes_apart(deformation_mm: np.ndarray) -> np.ndarray:
    """The same with x, y and z in arrays of their own, and in place where that saves a pass."""
    moved = UPPER_MM - deformation_mm
    x, y, z = (moved[..., axis][:, :, :, None, None] for axis in range(3))
    node = (x - LOWER_MM[..., 0]) ** 2 + (y - LOWER_MM[..., 1]) ** 2
    node += (z - LOWER_MM[..., 2]) ** 2
    np.sqrt(node, out=node)
    node *= OHM_PER_MM
    np.reciprocal(node, out=node)
    return 1 / node.sum(axis=(2, 3))


def synthesise(readings, frames: int, batch: int) -> tuple:
    """Deformations and noisy readings of `frames`, computed `batch` at a time."""
    generator = np.random.default_rng(1)
    all_mm = np.empty((frames, ROWS, UPPER, 3))
    all_ohm = np.empty((frames, ROWS, COLUMNS))
    for start in range(0, frames, batch):
        part = slice(start, start + batch)
        all_mm[part] = draw_paper(generator, batch)
        ideal_ohm = readings(all_mm[part])
        all_ohm[part] = ideal_ohm * (1 + NOISE * generator.standard_normal(ideal_ohm.shape))
    return all_mm, all_ohm


def rows() -> list[Row]:
    """Frames of `paper`, against both ways to write numpy."""
    bench("synthesis")
    taxel_s = by_criterion("synthesis/paper").over(FRAMES)
    table = []
    for how, readings, batches in [
        ("as the formula", by_the_formula, [8, 512]),
        ("axes apart", axes_apart, [16, 32, 64, 128]),
    ]:
        taken = {}
        for batch in batches:
            work = lambda: synthesise(readings, FEWER, batch)
            taken[batch] = timed(work, repeats=5).over(FEWER)
        batch, fastest = fastest_of(taken)
        table.append(Row("a frame of paper", f"numpy, {how}, batches of {batch}", fastest, taxel_s))
    return table
