//! Products of matrices whose lines are samples side by side: the only costly steps of a gradient.
//!
//! Own code: a library that fuses operations where the machine can would make trained models depend on the
//! machine. All sums are taken in an order that depends on the shapes alone.

use std::borrow::Cow;

use taxel_data::widest;

/// Samples that lie side by side; every line is so long.
pub(super) const SIDE: usize = 256;
/// Numbers that a register holds.
const REGISTER: usize = 8;
/// Lines that are added to at once: their sums stay in registers.
const STRIP: usize = 4;
/// Lines of the second matrix whose products are taken at once.
const BLOCK: usize = 16;
/// Lines that are combined before the next ones are added to the same sums: they stay in the first cache.
const RUN: usize = 16;

/// Samples side by side of one regressor, one input or one output.
pub(super) type Line = [f64; SIDE];

/// Adds the products Σ_samples a_i·b_j of all lines to `sums` (`a.len() × b.len()`, row-major).
pub(super) fn add_products(a: &[Line], b: &[Line], sums: &mut [f64]) {
    add_blocks((&by_samples(a), a.len()), b, |_| a.len(), sums);
}

/// The products Σ_samples a_i·a_j with j ≥ i (`a.len() × a.len()`, row-major) without the samples for which one of `masks`
/// is NaN, for each mask; and those of [`add_products`]. What stands in squares below the diagonal has no meaning.
pub(super) fn normal_equations(
    a: &[Line],
    b: &[Line],
    masks: &[&Line],
) -> (Vec<Vec<f64>>, Vec<f64>) {
    let factors = by_samples(a);
    let squares = |mask: &&Line| {
        let mut factors = Cow::Borrowed(&factors);
        for (s, _) in mask.iter().enumerate().filter(|(_, mask)| mask.is_nan()) {
            factors.to_mut()[s * a.len()..][..a.len()].fill(0.0);
        }
        let mut squares = vec![0.0; a.len() * a.len()];
        add_blocks((&factors, a.len()), a, |end| end, &mut squares);
        squares
    };
    let mut products = vec![0.0; a.len() * b.len()];
    add_blocks((&factors, a.len()), b, |_| a.len(), &mut products);
    (masks.iter().map(squares).collect(), products)
}

/// Adds the products of so many lines a_i, whose samples are `factors`, and lines b_j, block by block of j. Of a block that
/// ends before j = e those with i < `needed(e)` are needed.
fn add_blocks(
    (factors, height): (&[f64], usize),
    b: &[Line],
    needed: impl Fn(usize) -> usize,
    sums: &mut [f64],
) {
    for (number, lines) in b.chunks(BLOCK).enumerate() {
        let first = number * BLOCK;
        let rows = needed(first + lines.len()).min(height);
        if lines.len() > REGISTER {
            add_block::<BLOCK>((factors, height), lines, &mut sums[first..], (b.len(), rows));
        } else {
            add_block::<REGISTER>((factors, height), lines, &mut sums[first..], (b.len(), rows));
        }
    }
}

/// Adds the products of the first `rows` lines a_i, whose samples are `factors`, and at most `L` lines b_j to `sums`,
/// whose rows are `width` apart.
fn add_block<const L: usize>(
    (factors, height): (&[f64], usize),
    b: &[Line],
    sums: &mut [f64],
    (width, rows): (usize, usize),
) {
    let mut block: Vec<[f64; L]> = vec![[0.0; L]; SIDE];
    for (j, line) in b.iter().enumerate() {
        block.iter_mut().zip(line).for_each(|(sample, value)| sample[j] = *value);
    }
    let mut products = vec![[0.0; L]; rows];
    combine_all(factors, height, &block, &mut products);
    for (sums, products) in sums.chunks_mut(width).zip(&products) {
        sums.iter_mut().zip(&products[..b.len()]).for_each(|(sum, product)| *sum += product);
    }
}

/// The numbers of `lines` sample after sample.
fn by_samples(lines: &[Line]) -> Vec<f64> {
    let mut rows = vec![0.0; SIDE * lines.len()];
    for (group, some) in lines.chunks(STRIP).enumerate() {
        for (s, row) in rows.chunks_exact_mut(lines.len()).enumerate() {
            let places = &mut row[group * STRIP..];
            places.iter_mut().zip(some).for_each(|(place, line)| *place = line[s]);
        }
    }
    rows
}

/// Adds Σ_k factor(k, m)·a_k to every line m of `sums`.
///
/// `factors` holds them as `a.len() × sums.len()`, row-major.
pub(super) fn add_combinations(factors: &[f64], a: &[Line], sums: &mut [Line]) {
    combine_all(factors, sums.len(), a, sums);
}

/// Adds Σ_k factor(k, m)·a_k to every line m of `sums`, for `factors` in rows of `width`.
fn combine_all<const L: usize>(
    factors: &[f64],
    width: usize,
    a: &[[f64; L]],
    sums: &mut [[f64; L]],
) {
    widest!({
        for (a, factors) in a.chunks(RUN).zip(factors.chunks(RUN * width)) {
            let mut first = 0;
            let (strips, rest) = sums.as_chunks_mut::<STRIP>();
            for lines in strips {
                combine((factors, width, first), a, lines);
                first += STRIP;
            }
            for line in rest {
                combine((factors, width, first), a, std::array::from_mut(line));
                first += 1;
            }
        }
    });
}

/// Adds the combinations of a few lines `a` to `N` lines, the first of which is number `first`.
#[inline(always)]
fn combine<const N: usize, const L: usize>(
    (factors, width, first): (&[f64], usize, usize),
    a: &[[f64; L]],
    lines: &mut [[f64; L]; N],
) {
    for start in (0..L).step_by(REGISTER) {
        let mut sums: [[f64; REGISTER]; N] =
            std::array::from_fn(|i| std::array::from_fn(|l| lines[i][start + l]));
        for (a, factors) in a.iter().zip(factors.chunks_exact(width)) {
            let a: [f64; REGISTER] = std::array::from_fn(|l| a[start + l]);
            let factors = &factors[first..first + N];
            for i in 0..N {
                sums[i] = std::array::from_fn(|l| sums[i][l] + factors[i] * a[l]);
            }
        }
        for (line, sums) in lines.iter_mut().zip(sums) {
            line[start..start + REGISTER].copy_from_slice(&sums);
        }
    }
}

/// The transpose of `matrix` (`rows × columns`, row-major).
pub(super) fn transposed(matrix: &[f64], columns: usize) -> Vec<f64> {
    let rows = matrix.len() / columns;
    (0..columns).flat_map(|j| (0..rows).map(move |i| matrix[i * columns + j])).collect()
}
