//! Work on all threads, by index. rayon's iterators would be compiled anew for every closure; here they are once.

use std::sync::OnceLock;

use rayon::prelude::*;

/// Calls `work` with each number below `count`, in any order.
fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

/// Calls `work` with the index of each piece of `values`, of so many values each, and with the piece, in any order.
pub(crate) fn fill(values: &mut [f64], size: usize, work: &(dyn Fn(usize, &mut [f64]) + Sync)) {
    let pieces = values.par_chunks_mut(size).enumerate();
    pieces.for_each(|(index, piece)| work(index, piece));
}

/// Results of `of` for each number below `count`, in that order.
pub(crate) fn map<T: Send + Sync>(count: usize, of: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let results: Vec<OnceLock<T>> = (0..count).map(|_| OnceLock::new()).collect();
    each(count, &|index| _ = results[index].set(of(index)));
    results.into_iter().filter_map(OnceLock::into_inner).collect()
}

/// Piece number `index` of `values`, of so many values each; the last one may have fewer.
pub(crate) fn piece<T>(values: &[T], size: usize, index: usize) -> &[T] {
    &values[index * size..values.len().min((index + 1) * size)]
}

/// Results of `of` for each piece of `values`, of so many values each.
pub(crate) fn pieces<T: Send + Sync>(
    values: &[f64],
    size: usize,
    of: &(dyn Fn(&[f64]) -> T + Sync),
) -> Vec<T> {
    map(values.len().div_ceil(size), &|index| of(piece(values, size, index)))
}
