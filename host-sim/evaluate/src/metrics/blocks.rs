//! Blocks of frames: their parts in errors, which tell how sure these are.

use std::collections::BTreeMap;

use taxel_data::{Table, columns};
use taxel_limit::reference;

use super::{ALL, Errors, Measure, by_group};

/// Parts that successive frames have in the RMSE of a group, by its name: what the squares of a block's errors sum to beyond as
/// many mean squares, over twice the RMSE and the mean number of values in a block. The standard error of their mean is that
/// of the RMSE, and the one of their differences that of a difference between decoders of the same frames. A group without
/// errors has none.
pub type Blocks = BTreeMap<String, Vec<f64>>;

/// Number of blocks of frames.
const BLOCKS: usize = 50;

/// Errors as [`by_group`] has them, with the parts of blocks of frames in them. [`ALL`] has those of its groups, by their
/// shares.
pub fn with_blocks(truth: &Table, estimate: &[f64], measure: &Measure) -> (Vec<Errors>, Blocks) {
    let errors = by_group(truth, estimate, measure);
    let estimate = truth.with_places(estimate.to_vec());
    let (frames, columns) = (truth.len(), truth.names.len());
    let length = frames.div_ceil(BLOCKS).max(1);
    let mut blocks = Blocks::new();
    for (errors, (group, members)) in errors.iter().zip(columns::groups(&truth.names)) {
        let mean_square = errors.rmse.powi(2);
        let squares = truth.values.chunks(length * columns).zip(estimate.chunks(length * columns));
        let squares = squares.map(|(truth, estimate)| {
            let lines = truth.chunks_exact(columns).zip(estimate.chunks_exact(columns));
            let errors = lines.flat_map(|(truth, estimate)| {
                members.iter().map(|column| (estimate[*column] - truth[*column]).powi(2))
            });
            let beyond = errors.filter(|it| !it.is_nan()).map(|square| square - mean_square);
            beyond.sum::<f64>()
        });
        let squares: Vec<f64> = squares.collect();
        let mean = errors.count as f64 / squares.len().max(1) as f64;
        let part = |square: f64| square / mean / (2.0 * errors.rmse);
        if errors.rmse > 0.0 {
            blocks.insert(group.into(), squares.into_iter().map(part).collect());
        }
    }
    let shares = errors.iter().filter_map(|errors| {
        let deviation = errors.rmse / (1.0 - errors.r_squared?).sqrt();
        Some((blocks.get(&errors.group)?, deviation))
    });
    let shares: Vec<(&Vec<f64>, f64)> = shares.collect();
    if let (true, [(first, _), ..]) = (errors.len() > 1, shares.as_slice()) {
        let of_block = |block: usize| {
            shares.iter().map(|(of, deviation)| of[block] / deviation).sum::<f64>()
                / shares.len() as f64
        };
        let all = (0..first.len()).map(of_block).collect();
        blocks.insert(ALL.into(), all);
    }
    (errors, blocks)
}

/// Standard error of the mean of `parts`, which are those of blocks; 0 where there are not two.
pub fn standard_error(parts: impl Iterator<Item = f64>) -> f64 {
    let parts: Vec<f64> = parts.collect();
    if parts.len() > 1 { reference::standard_error(&parts) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_data::{Purpose, Random, Stream};

    #[test]
    fn parts_of_blocks_tell_the_standard_error_of_normal_errors() {
        let mut random = Random::new(3, Stream::Test, Purpose::Noise, 0, 0);
        let values: Vec<f64> = (0..2020).map(|at| f64::from(at % 7 * at)).collect();
        let estimate = values.iter().map(|value| value + 0.5 * random.normal());
        let estimate: Vec<f64> = estimate.collect();
        let truth =
            Table { names: ["a_mm", "b_n"].map(String::from).into(), values: values.into() };
        let measure =
            Measure { full_scale: vec![1.0; 2], thickness_mm: None, limit: None, noise: None };
        let (_, blocks) = with_blocks(&truth, &estimate, &measure);
        let [a, b] = ["a_mm", "b_n"].map(|group| &blocks[group]);
        assert!(a.len() == 49 && a.iter().sum::<f64>().abs() < 1e-9, "{a:?}");
        // σ/√2n of n values.
        let error = standard_error(a.iter().copied());
        assert!((error * 2020_f64.sqrt() / 0.5 - 1.0).abs() < 0.3, "{error}");
        let deviations = truth.deviations();
        let all = 0.5 * (a[7] / deviations[0] + b[7] / deviations[1]);
        assert!((blocks[ALL][7] / all - 1.0).abs() < 1e-6, "{all}");
    }

    #[test]
    fn a_standard_error_is_that_of_what_was_measured() {
        // Errors of 1 and 3 mm by turns: squares of 1 and 9 mm², whose means over 20 frames are all 5 mm².
        let columns = ["a_mm", "b_mm", "c_mm"];
        let truth = |kept: &dyn Fn(usize) -> bool| {
            let line = |i| [if kept(i) { 0.0 } else { f64::NAN }, f64::NAN, (i % 7) as f64];
            let names = columns.map(String::from).to_vec();
            Table { names, values: (0..1010).flat_map(line).collect::<Vec<_>>().into() }
        };
        let estimate: Vec<f64> = (0..1010)
            .flat_map(|i| [if i % 2 == 0 { 1.0 } else { 3.0 }, 0.0, f64::from(i % 7)])
            .collect();
        let measure =
            Measure { full_scale: vec![1.0; 3], thickness_mm: None, limit: None, noise: None };
        for kept in [|_| true, |i| i >= 420] {
            let (errors, blocks) = with_blocks(&truth(&kept), &estimate, &measure);
            assert!((errors[0].rmse - 5.0_f64.sqrt()).abs() < 1e-12);
            let error = standard_error(blocks["a_mm"].iter().copied());
            // An odd number of frames in a block is what it differs by.
            assert!(error < 0.01, "{error}");
            // Without a value, or an error, there is none.
            assert_eq!(blocks.keys().collect::<Vec<_>>(), ["a_mm"]);
        }
    }
}
